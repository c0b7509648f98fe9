/* How a job changes state: every statement that writes a state, a lease or what a job waits for stands in job_state.c.
 * job.h draws the states. Internal to this folder; each function here works inside the caller's transaction. */
#ifndef STORAGE_JOB_STATE_H
#define STORAGE_JOB_STATE_H

#include "storage/attempt.h"
#include "storage/job.h"
#include "storage/job_sql.h"
#include "storage/owner.h"

/* A running job, as far as ending it has to know it. */
struct job_run {
	int64_t number;
	int64_t attempts, attempts_max;
	int64_t interruptions;
	int64_t lease_until_ms;
	bool cancel_requested;
};

/* A new job of the resource that has this number, or of none where it is 0; queued, and waiting for what the resource
 * is made from. *job is its number. What it supersedes is cancelled. */
enum tw_status job_state_add(struct store *store, struct owner owner, int64_t resource, enum job_kind kind,
			     const struct job_request *request, int64_t *job, struct tw_error *error) TW_NODISCARD;

/* For a request that needs no job, because what it asks for is there: cancels the client's unfinished jobs of the word.
 * NULL or "": none. */
enum tw_status job_state_supersede(struct store *store, struct owner owner, const char *word,
				   struct tw_error *error) TW_NODISCARD;

/* What a second request for the same adds to an unfinished job: it is as urgent as the more urgent of the two, begins
 * and is cancelled when the last of them would have it, and is superseded or let go of with neither. A queued job
 * moves into the lane of the more urgent request, and stays in its group unless that names another. One that was asked
 * to stop and has not yet is wanted again, on the terms of the second request; not where every request but a repeated
 * one has a job of its own. */
enum tw_status job_state_join(struct store *store, struct owner owner, int64_t job, const struct job_request *request,
			      struct tw_error *error) TW_NODISCARD;

/* What the resource is made from and is yet to be made: it is as urgent as the request for the resource, and is neither
 * cancelled at a time, nor superseded, nor let go of any more. */
enum tw_status job_state_hasten_needs(struct store *store, struct owner owner, int64_t resource,
				      const struct job_request *request, struct tw_error *error) TW_NODISCARD;

/* failed or cancelled → queued, as job_state_redrive does it, but on the terms of a new request. */
enum tw_status job_state_retry(struct store *store, struct owner owner, int64_t job, const struct job_request *request,
			       struct tw_error *error) TW_NODISCARD;

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

/* Why and how a running job goes back into the queue. Only an attempt that failed or crashed counts. */
struct job_return {
	enum attempt_ending ending;
	const struct tw_error *failure; /* may be NULL */
	int64_t pause_ms;               /* it may be claimed so long from now */
	uint64_t room_bytes;            /* and where there is room for so much; 0: as before */
};

/* running → queued. */
enum tw_status job_state_put_back(struct store *store, int64_t job, const struct job_return *how,
				  struct tw_error *error) TW_NODISCARD;

/* running → queued, or failed with "attempts-exhausted", or cancelled: its worker died of it, or hung. */
enum tw_status job_state_crash(struct store *store, const struct job_run *run, struct tw_error *error) TW_NODISCARD;

/* running → queued, or cancelled: its worker went with the service or the machine, which is not the job's fault. Where
 * that has happened ten times, it may be after all, and counts as a crash. */
enum tw_status job_state_interrupt(struct store *store, const struct job_run *run, struct tw_error *error) TW_NODISCARD;

/* Reads a job_run from the columns JOB_RUN_COLUMNS of a query. */
#define JOB_RUN_COLUMNS "number, attempts, attempts_max, interruptions, lease_until_ms, cancel_requested"
struct sql;
void job_state_read_run(struct sql *q, struct job_run *run);

/* queued → queued: those whose pause is over, or whose time has come, may be claimed; a bounded number of them, and
 * *more is set where there may be others. */
enum tw_status job_state_end_pauses(struct store *store, bool *more, struct tw_error *error) TW_NODISCARD;
enum tw_status job_state_end_delays(struct store *store, bool *more, struct tw_error *error) TW_NODISCARD;

/* queued or running → a final state. Succeeded: what waited for it may go on; else what waited for it fails. `failure`
 * counts for failed only, and may be NULL. */
enum tw_status job_state_end(struct store *store, int64_t job, enum job_state state, const struct tw_error *failure,
			     struct tw_error *error) TW_NODISCARD;

/* A queued job is cancelled; a running one is asked to stop: however it ends from now on, it ends as cancelled, unless
 * somebody wants it again before that (job_state_join). *state
 * is what it is before the call, and after it. */
enum tw_status job_state_cancel(struct store *store, int64_t job, enum job_cancel cause, enum job_state *state,
				struct tw_error *error) TW_NODISCARD;

/* failed or cancelled → queued, with fresh attempts, together with those failed or cancelled jobs whose resources it
 * needs. */
enum tw_status job_state_redrive(struct store *store, int64_t job, struct tw_error *error) TW_NODISCARD;

#endif
