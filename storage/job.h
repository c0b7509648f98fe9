/* Jobs: what is known of one, and what a worker holds while it works on one. What can be done with them stands in
 * jobs.h (clients) and queue.h (workers).
 *
 * Every resource is made by exactly one job, and its state is that job's state; a job may also stand alone and make no
 * resource.
 *
 *                     claim                  finish
 *   create ──► queued ──────► running ──────────────► succeeded | incomplete
 *                │  ▲            │ │ fail, or the last lease ran out
 *                │  └────────────┘ └────────────────► failed ──┐
 *                │    lease ran out, released, retry           │ redrive: back to queued
 *                └──────────────────────────────────► cancelled┘
 *                     cancel (a running job is asked, and obeys at its next heartbeat or at its end, whichever is
 *                     first: once somebody has asked, it does not succeed any more)
 *
 * A job whose resource needs others (a layout its field, a field its motions) is queued but nobody can claim it until
 * all of them have succeeded. When one of them ends otherwise, it fails too, with "dependency-failed". */
#ifndef STORAGE_JOB_H
#define STORAGE_JOB_H

#include "storage/job_request.h"
#include "storage/kind.h"

/* The numbers stand in the store. */
enum job_state {
	JOB_QUEUED,
	JOB_RUNNING,
	JOB_SUCCEEDED,
	JOB_FAILED,
	JOB_CANCELLED,
	JOB_INCOMPLETE, /* ended with a result that lacks something: a recording with too many gaps */
	JOB_STATES
};

const char *job_state_name(enum job_state state); /* "queued" */
bool job_state_by_name(const char *name, enum job_state *state);

static inline bool job_state_is_final(enum job_state state)
{
	return state >= JOB_SUCCEEDED;
}

/* Whether there is a result to be had. */
static inline bool job_state_has_result(enum job_state state)
{
	return state == JOB_SUCCEEDED || state == JOB_INCOMPLETE;
}

/* Why a job failed: a tw_error that was kept. */
struct job_failure {
	enum tw_status status;
	char type[64]; /* "" where the job has not failed */
	char where[128];
	char text[384];
};

/* Why a job was asked to stop. The numbers stand in the store. */
enum job_cancel {
	JOB_CANCEL_NONE,
	JOB_CANCEL_ASKED,      /* by a client */
	JOB_CANCEL_DEADLINE,   /* its time was up */
	JOB_CANCEL_SUPERSEDED, /* by a later job */
	JOB_CANCEL_UNWANTED,   /* nobody waits for it any more */
	JOB_CANCELS
};

const char *job_cancel_name(enum job_cancel cause); /* "asked" */

struct job {
	char id[STORE_ID_SIZE];
	char resource_id[STORE_ID_SIZE]; /* "" where it makes no resource */
	char subject_id[STORE_ID_SIZE];  /* of a task: what it works on, else "" */
	char argument[BLOB_NAME_SIZE];   /* and which file of that it makes */
	enum job_kind kind;
	enum job_state state;
	bool cancel_requested;
	enum job_cancel cancel_cause;
	enum job_class class;
	char group[JOB_WORD_SIZE]; /* "" where it has none */
	uint32_t transient;   /* requests that it is made for; see job_cancel_unwanted. 0: whoever wants it stays */
	uint32_t waiting_for; /* resources that it needs and that have not succeeded yet */
	uint32_t attempts;    /* claims so far */
	uint32_t attempts_max;
	int32_t priority;
	double progress; /* 0…1 */
	char stage[64];  /* what it is doing, "" or a word: "solving" */
	char *partial;   /* owned, JSON; NULL where the job has no partial result */
	char worker[64]; /* who has or had it */
	int64_t created_ms, started_ms, finished_ms, lease_until_ms; /* 0 where it has not happened */
	int64_t not_before_ms, cancel_at_ms;                         /* 0 where nobody said so */
	int64_t change; /* grows with every change of any job in the store; see job_changes */
	struct job_failure failure;
};

void job_clear(struct job *job);

struct job_page {
	struct job *jobs; /* owned */
	size_t count;
	int64_t next; /* cursor of the following page, 0 after the last */
};

void job_page_clear(struct job_page *page);

/* What a worker holds while it works on a job. */
struct job_ticket {
	int64_t number;
	int64_t fence;
	int64_t lease_ms;
	enum job_kind kind;
	uint32_t attempt; /* 1 for the first */
	char job_id[STORE_ID_SIZE];
	char resource_id[STORE_ID_SIZE]; /* "" where it makes no resource */
	char subject_id[STORE_ID_SIZE];  /* of a task: what it works on, else "" */
	char argument[BLOB_NAME_SIZE];   /* and which file of that it makes */
	char session[JOB_WORD_SIZE];     /* as the request said, "" for none */
	int64_t affinity;
};

#endif
