/* How a job is to be queued: what a client may say about it that has no part in what it computes, and so none in
 * content addresses and idempotency keys either.
 *
 * Jobs that are ready are claimed in this order:
 *
 *   class      interactive before normal before batch; but of 16 claims in a row one goes to a class that was passed
 *              over, so that none waits for ever (PICK_PASSES_MAX)
 *   client     within a class, clients (an owner, storage/tenant.h) take turns, those with a greater weight more often
 *   priority   of a client, higher first, then older first; but a worker may prefer, among the first few of one lane
 *              and priority, a job for which it has something in memory (PICK_WINDOW)
 *
 * What its group has no room for, or the store, is passed over. */
#ifndef STORAGE_JOB_REQUEST_H
#define STORAGE_JOB_REQUEST_H

#include <stdbool.h>
#include <stdint.h>

/* The numbers stand in the store; the smaller is claimed first. */
enum job_class {
	JOB_CLASS_UNSAID, /* in a request: normal */
	JOB_INTERACTIVE,
	JOB_NORMAL,
	JOB_BATCH,
	JOB_CLASSES_END
};
#define JOB_CLASS_BIT(class) (1u << (class))
#define JOB_CLASSES_ALL (JOB_CLASS_BIT(JOB_INTERACTIVE) | JOB_CLASS_BIT(JOB_NORMAL) | JOB_CLASS_BIT(JOB_BATCH))

const char *job_class_name(enum job_class class); /* "interactive" */
bool job_class_by_name(const char *name, enum job_class *class);

enum { JOB_WEIGHT_MAX = 1000, JOB_WORD_SIZE = 128 };

/* All borrowed; all zero is the usual. */
struct job_request {
	uint32_t weight; /* turns of the owner's client for one of others, 1…JOB_WEIGHT_MAX; 0: as before, or 1 */
	enum job_class class;
	int32_t priority;      /* higher is claimed earlier */
	uint32_t attempts_max; /* 0 for the default of 3 */
	/* The tenant's jobs of this group run `max_running` at a time, whoever submitted them: the latest request that
	 * says so decides. NULL or "": no group; 0: as before, or 1. */
	const char *group;
	uint32_t max_running;
	int64_t not_before_ms;   /* by the machine's clock (store_now_ms); 0: at once */
	int64_t cancel_after_ms; /* from now: the job is cancelled then, queued or running; 0: never */
	/* Cancels the job that came with the same word from the same client before. NULL or "": none. */
	const char *supersedes;
	/* What the worker may have in memory already: a number that is equal for jobs that profit from each other
	 * (job_affinity), 0: nothing. */
	int64_t affinity;
	const char *session; /* handed to the worker; NULL or "": none */
	bool transient;      /* it may be cancelled when nobody waits for it any more: job_cancel_unwanted */
};

static inline enum job_class job_request_class(const struct job_request *request)
{
	return request->class ? request->class : JOB_NORMAL;
}

/* Of the jobs of a session (any word; NULL or "": none) on a resource. The upper half is equal for all on the same
 * resource, which is worth something too. */
int64_t job_affinity(const char *resource_id, const char *session);

#endif
