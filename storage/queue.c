/* A claim looks first without a lock, so that idle workers that ask often cost nothing, and then once more under the
 * write lock, where it takes the job: two workers cannot both see it queued there. Every look is a few steps in an
 * index, however long the queue. */
#include "storage/queue.h"

#include "storage/due.h"
#include "storage/job_state.h"
#include "storage/pick.h"
#include "storage/row.h"

enum {
	RETRY_PAUSE_MS = 1000,   /* after a failed attempt, at least; doubled by every one before */
	PUT_OFF_PAUSE_MS = 1000, /* after the store failed */
};

/* A step at a time, so that others can write in between however many are due. */
static enum tw_status end_what_is_due(struct store *store, bool *more, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = due_end(store, more, error);
	return transaction_end(store, status, error);
}

enum tw_status job_expire(struct store *store, struct tw_error *error)
{
	bool more = false;
	enum tw_status status = due_any(store, &more, error);
	while (status == TW_OK && more)
		status = end_what_is_due(store, &more, error);
	return status;
}

enum tw_status job_next_due(struct store *store, int64_t *wait_ms, struct tw_error *error)
{
	return due_next(store, wait_ms, error);
}

/* --- claiming --------------------------------------------------------------------------------------------------- */

/* Whether there may be something to do, without the lock: mostly an idle worker asks, and there is not. */
static enum tw_status look(struct store *store, const struct claim_query *query, bool *found, struct tw_error *error)
{
	uint64_t room = 0;
	struct pick pick = {0};
	enum tw_status status = due_any(store, found, error);
	if (status == TW_OK && !*found)
		status = sql_room(store, &room, error);
	if (status == TW_OK && !*found)
		status = pick_look(store, query, room, &pick, error);
	*found = *found || pick.job || pick.stale;
	return status;
}

static enum tw_status look_once(struct store *store, const struct claim_query *query, bool *found,
				struct tw_error *error)
{
	enum tw_status status = snapshot_begin(store, error);
	if (status != TW_OK)
		return status;
	status = look(store, query, found, error);
	return transaction_end(store, status, error);
}

static enum tw_status find_and_take(struct store *store, const struct claim_query *query, struct pick *pick,
				    struct job_ticket *ticket, struct tw_error *error)
{
	bool due = false, more = false;
	uint64_t room = 0;
	enum tw_status status = due_any(store, &due, error);
	if (status == TW_OK && due)
		status = due_end(store, &more, error);
	if (status == TW_OK)
		status = sql_room(store, &room, error);
	if (status == TW_OK)
		status = pick_find(store, query, room, pick, error);
	if (status != TW_OK || !pick->job)
		return status;
	status = job_state_take(store, pick->job, query->worker, ticket, error);
	return status == TW_OK ? pick_taken(store, query, pick, error) : status;
}

static enum tw_status try_to_take(struct store *store, const struct claim_query *query, struct pick *pick,
				  struct job_ticket *ticket, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = find_and_take(store, query, pick, ticket, error);
	return transaction_end(store, status, error);
}

/* Who found something the last time will this time, and does not look first: every look after somebody has written
 * has to read its pages anew (claims a second: 7,700 with, 10,000 without). */
enum tw_status job_claim(struct store *store, const struct claim_query *query, struct job_ticket *ticket, bool *found,
			 struct tw_error *error)
{
	struct pick pick = {0};
	bool promising = store->found_work;
	enum tw_status status = promising ? TW_OK : look_once(store, query, &promising, error);
	*found = false;
	*ticket = (struct job_ticket){.lease_ms = query->lease_ms};
	if (status != TW_OK || !promising)
		return status;
	do
		status = try_to_take(store, query, &pick, ticket, error);
	while (status == TW_OK && !pick.job && pick.stale);
	*found = status == TW_OK && pick.job;
	store->found_work = *found;
	return status;
}

static enum tw_status take_of_resource(struct store *store, const char *resource_id, const char *worker,
				       struct job_ticket *ticket, bool *found, struct tw_error *error)
{
	int64_t job = 0;
	struct sql q = sql_query(store, "SELECT j.number FROM resource r JOIN job j ON j.resource = r.number"
					" WHERE r.id = ? AND j.state = " SQL_QUEUED " AND j.waiting_for = 0");
	sql_bind_text(&q, resource_id);
	*found = sql_step(&q);
	if (*found)
		job = sql_int(&q);
	enum tw_status status = sql_end(&q, error);
	return status == TW_OK && *found ? job_state_take(store, job, worker, ticket, error) : status;
}

enum tw_status job_claim_resource(struct store *store, const char *resource_id, const char *worker, int64_t lease_ms,
				  struct job_ticket *ticket, bool *found, struct tw_error *error)
{
	*found = false;
	*ticket = (struct job_ticket){.lease_ms = lease_ms};
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = due_expire_leases(store, error);
	if (status == TW_OK)
		status = take_of_resource(store, resource_id, worker, ticket, found, error);
	status = transaction_end(store, status, error);
	*found = *found && status == TW_OK;
	return status;
}

enum tw_status job_heartbeat(struct store *store, const struct job_ticket *ticket, double progress, const char *stage,
			     const char *partial, bool *cancel, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = job_state_renew(store, ticket, progress, stage, partial, cancel, error);
	return transaction_end(store, status, error);
}

enum tw_status job_is_cancelled(struct store *store, const struct job_ticket *ticket, bool *cancel,
				struct tw_error *error)
{
	struct job_run run = {0};
	enum tw_status status = job_state_check(store, ticket, &run, error);
	*cancel = status == TW_OK && run.cancel_requested;
	return status;
}

static uint32_t version_of(const struct job_ticket *ticket)
{
	return resource_kind_row(job_kind_row(ticket->kind)->resource)->version;
}

/* The fence is checked before anything of the resource is written, inside the same transaction. */
static enum tw_status finish(struct store *store, const struct job_ticket *ticket, const struct result_draft *draft,
			     struct tw_error *error)
{
	struct job_run run;
	int64_t resource = 0;
	enum tw_status status = job_state_check(store, ticket, &run, error);
	if (status == TW_OK && run.cancel_requested)
		return job_state_end(store, run.number, JOB_CANCELLED, NULL, error);
	bool is_task = ticket->subject_id[0];
	const char *id = is_task ? ticket->subject_id : ticket->resource_id;
	if (status == TW_OK && *id)
		status = row_find_resource(store, TENANT_ANY, id, &resource, error);
	if (status == TW_OK && is_task)
		status = result_write_file(store, resource, draft, error);
	else if (status == TW_OK && resource)
		status = result_write(store, resource, version_of(ticket), draft, error);
	if (status != TW_OK)
		return status;
	return job_state_end(store, run.number, draft->result->incomplete ? JOB_INCOMPLETE : JOB_SUCCEEDED, NULL,
			     error);
}

static enum tw_status finish_draft(struct store *store, const struct job_ticket *ticket,
				   const struct result_draft *draft, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = finish(store, ticket, draft, error);
	return transaction_end(store, status, error);
}

enum tw_status job_finish(struct store *store, const struct job_ticket *ticket, const struct job_result *result,
			  struct tw_error *error)
{
	struct job_run run;
	struct result_draft draft = {0};
	enum tw_status status = sql_check_room(store, result_size(result), error);
	if (status == TW_OK)
		status = job_state_check(store, ticket, &run, error);
	if (status == TW_OK)
		status = result_stage(store, result, &draft, error);
	if (status == TW_OK)
		status = finish_draft(store, ticket, &draft, error);
	result_discard(store, &draft);
	return status;
}

/* What failed together is not tried again together: up to half as long again, by a hash of job and attempt, so that the
 * same job waits the same time wherever it runs. */
static int64_t retry_pause_ms(int64_t job, int64_t attempt)
{
	int64_t pause_ms = (int64_t)RETRY_PAUSE_MS << (attempt < 10 ? attempt - 1 : 9);
	uint64_t mixed = ((uint64_t)job + (uint64_t)attempt * 0x9e3779b97f4a7c15) * 0xbf58476d1ce4e5b9;
	return pause_ms + (int64_t)((mixed >> 32) % (uint64_t)(pause_ms / 2));
}

static enum tw_status fail_one(struct store *store, const struct job_ticket *ticket, const struct tw_error *failure,
			       bool retry, struct tw_error *error)
{
	struct job_run run;
	enum tw_status status = job_state_check(store, ticket, &run, error);
	if (status != TW_OK)
		return status;
	if (run.cancel_requested)
		return job_state_end(store, run.number, JOB_CANCELLED, NULL, error);
	if (failure->status == TW_ERROR_CANCELLED)
		return job_state_put_back(store, run.number, &(struct job_return){.ending = ATTEMPT_RELEASED}, error);
	if (!retry || run.attempts >= run.attempts_max)
		return job_state_end(store, run.number, JOB_FAILED, failure, error);
	const struct job_return how = {
		.ending = ATTEMPT_FAILED, .failure = failure, .pause_ms = retry_pause_ms(run.number, run.attempts)};
	return job_state_put_back(store, run.number, &how, error);
}

enum tw_status job_fail(struct store *store, const struct job_ticket *ticket, const struct tw_error *failure,
			bool retry, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = fail_one(store, ticket, failure, retry, error);
	return transaction_end(store, status, error);
}

static enum tw_status give_back(struct store *store, const struct job_ticket *ticket, const struct job_return *how,
				struct tw_error *error)
{
	struct job_run run;
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = job_state_check(store, ticket, &run, error);
	if (status == TW_OK)
		status = run.cancel_requested ? job_state_end(store, run.number, JOB_CANCELLED, NULL, error)
					      : job_state_put_back(store, run.number, how, error);
	return transaction_end(store, status, error);
}

enum tw_status job_release(struct store *store, const struct job_ticket *ticket, struct tw_error *error)
{
	return give_back(store, ticket, &(struct job_return){.ending = ATTEMPT_RELEASED}, error);
}

enum tw_status job_put_off(struct store *store, const struct job_ticket *ticket, uint64_t room_bytes,
			   struct tw_error *error)
{
	const struct job_return how = {
		.ending = ATTEMPT_PUT_OFF, .pause_ms = PUT_OFF_PAUSE_MS, .room_bytes = room_bytes};
	return give_back(store, ticket, &how, error);
}

static enum tw_status next_of_worker(struct store *store, const char *worker, struct job_run *run, bool *found,
				     struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT " JOB_RUN_COLUMNS " FROM job INDEXED BY job_leased"
					" WHERE state = " SQL_RUNNING " AND worker = ? LIMIT 1");
	sql_bind_text(&q, worker);
	*found = sql_step(&q);
	if (*found)
		job_state_read_run(&q, run);
	return sql_end(&q, error);
}

static enum tw_status abandon(struct store *store, const char *worker, bool crashed, struct tw_error *error)
{
	for (;;) {
		struct job_run run;
		bool found = false;
		enum tw_status status = next_of_worker(store, worker, &run, &found, error);
		if (status == TW_OK && found)
			status =
				crashed ? job_state_crash(store, &run, error) : job_state_interrupt(store, &run, error);
		if (status != TW_OK || !found)
			return status;
	}
}

enum tw_status job_abandon(struct store *store, const char *worker, bool crashed, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = abandon(store, worker, crashed, error);
	return transaction_end(store, status, error);
}
