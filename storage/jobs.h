/* Jobs as clients see them: reading, listing, counting, cancelling, redriving. */
#ifndef STORAGE_JOBS_H
#define STORAGE_JOBS_H

#include "storage/job.h"
#include "storage/tenant.h"

/* TW_ERROR_NOT_FOUND "no-such-job"; also when it is another tenant's. */
enum tw_status job_get(struct store *store, int64_t tenant, const char *id, struct job *job,
		       struct tw_error *error) TW_NODISCARD;

/* Newest first. Pages do not shift when jobs are added while a client turns them. */
struct job_query {
	int64_t tenant;            /* not TENANT_ANY */
	unsigned kinds;            /* JOB_KIND_BIT…; 0 for all */
	unsigned states;           /* 1u << state…; 0 for all */
	unsigned classes;          /* JOB_CLASS_BIT…; 0 for all */
	const char *failure_type;  /* only those that failed with it, "store-full"; NULL for all */
	const char *group;         /* NULL for all */
	int64_t created_before_ms; /* 0 for all */
	int64_t cursor;            /* 0, or `next` of the page before */
	uint32_t limit;            /* 1…1000 */
};
enum tw_status job_list(struct store *store, const struct job_query *query, struct job_page *page,
			struct tw_error *error) TW_NODISCARD;

/* Running jobs of all tenants, at most a thousand, those first whose leases run out first. */
enum tw_status job_list_running(struct store *store, struct job_page *page, struct tw_error *error) TW_NODISCARD;

/* Jobs that changed after `since`, oldest change first, each once with its latest state; `page->next` is the `since` of
 * the next call. Serves event streams (the change number is the event's id) and held requests. `since` -1 gives no jobs
 * and the newest change number. */
enum tw_status job_changes(struct store *store, int64_t since, uint32_t limit, struct job_page *page,
			   struct tw_error *error) TW_NODISCARD;

/* A queued job is cancelled at once; a running one is asked. `*state` is the state after the call. TW_ERROR_CONFLICT
 * "job-finished" where it had ended. */
enum tw_status job_cancel(struct store *store, int64_t tenant, const char *id, enum job_state *state,
			  struct tw_error *error) TW_NODISCARD;

/* Cancels a job for want of anybody who wants it: those of its requests that are gone are all that there were
 * (`requests`, as struct job has it), and nothing that is yet to be made needs its resource. *cancelled says whether.
 */
enum tw_status job_cancel_unwanted(struct store *store, const char *id, int64_t requests, bool *cancelled,
				   struct tw_error *error) TW_NODISCARD;

/* Puts a failed or cancelled job back into the queue with fresh attempts, together with those failed or cancelled jobs
 * whose resources it needs. TW_ERROR_CONFLICT "job-not-failed". */
enum tw_status job_redrive(struct store *store, int64_t tenant, const char *id, struct tw_error *error) TW_NODISCARD;

/* Jobs by state, for metrics and readiness; `oldest_ms`: age of the oldest that could be claimed now, 0 if none. */
struct job_counts {
	uint64_t by_state[JOB_STATES];
	int64_t oldest_ms;
	int64_t oldest_of_class_ms[JOB_CLASSES_END]; /* by enum job_class */
};
enum tw_status job_count(struct store *store, struct job_counts *counts, struct tw_error *error) TW_NODISCARD;

#endif
