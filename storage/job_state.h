/* How a job changes state: every statement that writes a state, a lease or what a job waits for stands in job_state.c.
 * job.h draws the states. Internal to this folder; each function here works inside the caller's transaction. */
#ifndef STORAGE_JOB_STATE_H
#define STORAGE_JOB_STATE_H

#include "storage/job.h"
#include "storage/tenant.h"

#include <assert.h>

/* The states in statements: literals rather than parameters, because partial indices are used for literals only. */
#define SQL_QUEUED "0/*queued*/"
#define SQL_RUNNING "1/*running*/"
#define SQL_SUCCEEDED "2/*succeeded*/"
#define SQL_FAILED "3/*failed*/"
#define SQL_CANCELLED "4/*cancelled*/"
#define SQL_INCOMPLETE "5/*incomplete*/"
static_assert(JOB_QUEUED == 0 && JOB_RUNNING == 1 && JOB_SUCCEEDED == 2 && JOB_FAILED == 3 && JOB_CANCELLED == 4 &&
		      JOB_INCOMPLETE == 5 && JOB_STATES == 6,
	      "the literals above");

/* As job_state_has_result says. */
#define SQL_WITH_RESULT "(" SQL_SUCCEEDED ", " SQL_INCOMPLETE ")"
/* Ended without the result that others wait for. */
#define SQL_UNSUCCESSFUL "(" SQL_FAILED ", " SQL_CANCELLED ", " SQL_INCOMPLETE ")"
/* Ended so that it may be tried again. */
#define SQL_REDRIVABLE "(" SQL_FAILED ", " SQL_CANCELLED ")"

/* A running job, as far as ending it has to know it. */
struct job_run {
	int64_t number;
	int64_t attempts, attempts_max;
	int64_t interruptions;
	int64_t lease_until_ms;
	bool cancel_requested;
};

/* Why a running job goes back into the queue: whether the attempt counts. */
enum job_blame {
	JOB_BLAMED,      /* it counts */
	JOB_SPARED,      /* it does not */
	JOB_INTERRUPTED, /* it does not either, but is remembered */
};

/* A new job of the resource that has this number, or of none where it is 0; queued, and waiting for what the resource
 * is made from. */
enum tw_status job_state_add(struct store *store, struct owner owner, int64_t resource, enum job_kind kind,
			     int32_t priority, uint32_t attempts_max, struct tw_error *error) TW_NODISCARD;

/* What the result of the resource's job will take: as usual for its kind, and as much again as its uploads and the
 * arrays of the first that it is made from, because it has an array for each of theirs or keeps them in another form.
 */
enum tw_status job_state_expect_room(struct store *store, int64_t resource, struct tw_error *error) TW_NODISCARD;

/* queued → running: an attempt, with a lease of ticket->lease_ms and a new fence. Fills the rest of the
 * ticket. */
enum tw_status job_state_take(struct store *store, int64_t job, const char *worker, struct job_ticket *ticket,
			      struct tw_error *error) TW_NODISCARD;

/* Whether the ticket still holds its job: it is running with the ticket's fence. TW_ERROR_CONFLICT "lease-lost". */
enum tw_status job_state_check(struct store *store, const struct job_ticket *ticket, struct job_run *run,
			       struct tw_error *error) TW_NODISCARD;

/* running → running: a longer lease. `stage` and `partial` may be NULL: unchanged. TW_ERROR_CONFLICT "lease-lost". */
enum tw_status job_state_renew(struct store *store, const struct job_ticket *ticket, double progress, const char *stage,
			       const char *partial, bool *cancel, struct tw_error *error) TW_NODISCARD;

/* running → queued, to be claimed `pause_ms` from now, and where there is room for `room_bytes` (0: as before). */
enum tw_status job_state_put_back(struct store *store, int64_t job, enum job_blame blame, int64_t pause_ms,
				  uint64_t room_bytes, struct tw_error *error) TW_NODISCARD;

/* running → queued, or failed with "attempts-exhausted", or cancelled: its worker died of it, or hung. */
enum tw_status job_state_crash(struct store *store, const struct job_run *run, struct tw_error *error) TW_NODISCARD;

/* running → queued, or cancelled: its worker went with the service or the machine, which is not the job's fault. Where
 * that has happened ten times, it may be after all, and counts as a crash. */
enum tw_status job_state_interrupt(struct store *store, const struct job_run *run, struct tw_error *error) TW_NODISCARD;

/* Reads a job_run from the columns JOB_RUN_COLUMNS of a query. */
#define JOB_RUN_COLUMNS "number, attempts, attempts_max, interruptions, lease_until_ms, cancel_requested"
struct sql;
void job_state_read_run(struct sql *q, struct job_run *run);

/* queued → queued: those whose pause is over may be claimed. */
enum tw_status job_state_end_pauses(struct store *store, int64_t now_ms, struct tw_error *error) TW_NODISCARD;

/* queued or running → a final state. Succeeded: what waited for it may go on; else what waited for it fails. `failure`
 * counts for failed only, and may be NULL. */
enum tw_status job_state_end(struct store *store, int64_t job, enum job_state state, const struct tw_error *failure,
			     struct tw_error *error) TW_NODISCARD;

/* A running job is asked to stop: however it ends from now on, it ends as cancelled. */
enum tw_status job_state_ask_to_stop(struct store *store, int64_t job, struct tw_error *error) TW_NODISCARD;

/* failed or cancelled → queued, with fresh attempts, together with those failed or cancelled jobs whose resources it
 * needs. */
enum tw_status job_state_redrive(struct store *store, int64_t job, struct tw_error *error) TW_NODISCARD;

#endif
