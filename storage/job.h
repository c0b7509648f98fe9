/* The queue. Every resource is made by exactly one job, and its state is that job's state; a job may also stand alone
 * and make no resource.
 *
 *                     claim                  finish
 *   create ──► queued ──────► running ──────────────► succeeded
 *                │  ▲            │ │ fail, or the last lease ran out
 *                │  └────────────┘ └────────────────► failed ──┐
 *                │    lease ran out, released, retry           │ redrive: back to queued
 *                └──────────────────────────────────► cancelled┘
 *                     cancel (a running job is asked, and obeys at its next heartbeat)
 *
 * A job whose resource needs others (a layout its field, a field its motions) is queued but nobody can claim it until
 * all of them have succeeded. When one of them fails or is cancelled, it fails too, with "dependency-failed".
 *
 * Exactly once: a claim gives a lease and a fence, a number that grows with every claim of the job. Whatever a worker
 * writes about a job names its fence; once the lease has run out and somebody else has claimed, the old fence is
 * refused with TW_ERROR_CONFLICT "lease-lost", so a result is written by one worker only, in the transaction that ends
 * the job. A worker that dies leaves nothing but a lease that runs out. */
#ifndef STORAGE_JOB_H
#define STORAGE_JOB_H

#include "storage/kind.h"

enum job_state { JOB_QUEUED, JOB_RUNNING, JOB_SUCCEEDED, JOB_FAILED, JOB_CANCELLED, JOB_STATES };

const char *job_state_name(enum job_state state); /* "queued" */
bool job_state_by_name(const char *name, enum job_state *state);

static inline bool job_state_is_final(enum job_state state)
{
	return state >= JOB_SUCCEEDED;
}

/* Why a job failed: a tw_error that was kept. */
struct job_failure {
	enum tw_status status;
	char type[64]; /* "" where the job has not failed */
	char where[128];
	char text[384];
};

struct job {
	char id[STORE_ID_SIZE];
	char resource_id[STORE_ID_SIZE]; /* "" where it makes no resource */
	enum job_kind kind;
	enum job_state state;
	bool cancel_requested;
	uint32_t waiting_for; /* resources that it needs and that have not succeeded yet */
	uint32_t attempts;    /* claims so far */
	uint32_t attempts_max;
	int32_t priority;
	double progress; /* 0…1 */
	char stage[64];  /* what it is doing, "" or a word: "solving" */
	char *partial;   /* owned, JSON; NULL where the job has no partial result */
	char worker[64]; /* who has or had it */
	int64_t created_ms, started_ms, finished_ms, lease_until_ms; /* 0 where it has not happened */
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

/* --- for clients ------------------------------------------------------------------------------------------------ */

/* TW_ERROR_NOT_FOUND "no-such-job". */
enum tw_status job_get(struct store *store, const char *id, struct job *job, struct tw_error *error) TW_NODISCARD;

/* Newest first. Pages do not shift when jobs are added while a client turns them. */
struct job_query {
	unsigned kinds;  /* JOB_KIND_BIT…; 0 for all */
	unsigned states; /* 1u << state…; 0 for all */
	int64_t cursor;  /* 0, or `next` of the page before */
	uint32_t limit;  /* 1…1000 */
};
enum tw_status job_list(struct store *store, const struct job_query *query, struct job_page *page,
			struct tw_error *error) TW_NODISCARD;

/* Jobs that changed after `since`, oldest change first, each once with its latest state; `page->next` is the `since` of
 * the next call. Serves event streams (the change number is the event's id) and held requests. `since` -1 gives no jobs
 * and the newest change number. */
enum tw_status job_changes(struct store *store, int64_t since, uint32_t limit, struct job_page *page,
			   struct tw_error *error) TW_NODISCARD;

/* A queued job is cancelled at once; a running one is asked. `*state` is the state after the call. TW_ERROR_CONFLICT
 * "job-finished" where it had ended. */
enum tw_status job_cancel(struct store *store, const char *id, enum job_state *state,
			  struct tw_error *error) TW_NODISCARD;

/* Puts a failed or cancelled job back into the queue with fresh attempts, together with those failed or cancelled jobs
 * whose resources it needs. TW_ERROR_CONFLICT "job-not-failed". */
enum tw_status job_redrive(struct store *store, const char *id, struct tw_error *error) TW_NODISCARD;

/* Jobs by state, for metrics and readiness; `oldest_ms`: age of the oldest that could be claimed now, 0 if none. */
struct job_counts {
	uint64_t by_state[JOB_STATES];
	int64_t oldest_ms;
};
enum tw_status job_count(struct store *store, struct job_counts *counts, struct tw_error *error) TW_NODISCARD;

/* --- for workers ------------------------------------------------------------------------------------------------ */

/* What a worker holds while it works on a job. */
struct job_ticket {
	int64_t number;
	int64_t fence;
	int64_t lease_ms;
	enum job_kind kind;
	uint32_t attempt; /* 1 for the first */
	char job_id[STORE_ID_SIZE];
	char resource_id[STORE_ID_SIZE]; /* "" where it makes no resource */
};

/* Takes the most urgent job (highest priority, then oldest) of the kinds, for `lease_ms`. Leases that have run out are
 * put back first. `*found` false when there is none. An idle call takes no write lock. */
enum tw_status job_claim(struct store *store, unsigned kinds, const char *worker, int64_t lease_ms,
			 struct job_ticket *ticket, bool *found, struct tw_error *error) TW_NODISCARD;

/* Renews the lease and tells progress. `stage` and `partial` (JSON) may be NULL: unchanged. `*cancel` is set when
 * somebody asked the job to stop. TW_ERROR_CONFLICT "lease-lost". */
enum tw_status job_heartbeat(struct store *store, const struct job_ticket *ticket, double progress, const char *stage,
			     const char *partial, bool *cancel, struct tw_error *error) TW_NODISCARD;

struct job_artifact {
	const char *name;
	const char *media_type;
	const void *bytes;
	size_t size;
};

/* All borrowed. */
struct job_result {
	const char *summary; /* JSON: what clients see on the resource; may be NULL */
	const struct tw_array *arrays;
	size_t array_count;
	const struct job_artifact *artifacts;
	size_t artifact_count;
	const char
		*upload; /* id of a sealed upload that the resource takes over: what is too large for memory; or NULL */
	const char *dropped_part; /* of its uploads, what is not needed any more; or NULL */
};

/* Writes the result and ends the job, in one durable transaction; wakes what waited for it. TW_ERROR_CONFLICT
 * "lease-lost", and then nothing is written. */
enum tw_status job_finish(struct store *store, const struct job_ticket *ticket, const struct job_result *result,
			  struct tw_error *error) TW_NODISCARD;

/* Ends the job as failed because of `failure`. With `retry` it goes back to the queue, after a pause that doubles with
 * each attempt, unless its attempts are used. TW_ERROR_CANCELLED as the failure's status ends it as cancelled. */
enum tw_status job_fail(struct store *store, const struct job_ticket *ticket, const struct tw_error *failure,
			bool retry, struct tw_error *error) TW_NODISCARD;

/* Gives an unfinished job back, and the attempt with it: the worker is asked to leave. */
enum tw_status job_release(struct store *store, const struct job_ticket *ticket, struct tw_error *error) TW_NODISCARD;

/* Ends the leases of a worker that is known to be dead, so that nobody waits for them to run out. For the supervisor.
 */
enum tw_status job_abandon(struct store *store, const char *worker, struct tw_error *error) TW_NODISCARD;

#endif
