/* A claim looks first without a lock, so that idle workers that ask often cost nothing, and then once more under the
 * write lock, where it takes the job: two workers cannot both see it queued there. Every look is a few steps in an
 * index, however long the queue. */
#include "storage/queue.h"

#include "storage/job_state.h"
#include "storage/row.h"

#include <string.h>

enum {
	RETRY_PAUSE_MS = 1000,   /* after a failed attempt; doubled by every one before */
	PUT_OFF_PAUSE_MS = 1000, /* after the store failed */
};

/* What a claim may find: the most urgent job. */
struct candidate {
	int64_t number;
	int64_t priority;
	bool found;
};

/* --- what is due ------------------------------------------------------------------------------------------------ */

static enum tw_status anything_due(struct store *store, int64_t now_ms, bool *due, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "SELECT EXISTS (SELECT 1 FROM job INDEXED BY job_leased WHERE state = " SQL_RUNNING
				 " AND lease_until_ms < ?1) OR EXISTS (SELECT 1 FROM job INDEXED BY job_put_off"
				 " WHERE state = " SQL_QUEUED " AND not_before_ms > 0 AND not_before_ms <= ?1)");
	sql_bind_int(&q, now_ms);
	*due = sql_step(&q) && sql_int(&q);
	return sql_end(&q, error);
}

static enum tw_status next_expired(struct store *store, int64_t now_ms, struct job_run *run, bool *found,
				   struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT " JOB_RUN_COLUMNS " FROM job INDEXED BY job_leased"
					" WHERE state = " SQL_RUNNING " AND lease_until_ms < ? LIMIT 1");
	sql_bind_int(&q, now_ms);
	*found = sql_step(&q);
	if (*found)
		job_state_read_run(&q, run);
	return sql_end(&q, error);
}

/* Whose fault it is that a lease ran out: nobody's where the machine was started anew, or where the worker could not
 * renew it because the disk was full. */
static enum tw_status expire(struct store *store, const struct job_run *run, struct tw_error *error)
{
	if (store_is_of_older_boot(store, run->lease_until_ms))
		return job_state_interrupt(store, run, error);
	if (sql_had_trouble(store) && !run->cancel_requested)
		return job_state_put_back(store, run->number, JOB_SPARED, 0, 0, error);
	return job_state_crash(store, run, error);
}

static enum tw_status expire_leases(struct store *store, int64_t now_ms, struct tw_error *error)
{
	for (;;) {
		struct job_run run;
		bool found = false;
		enum tw_status status = next_expired(store, now_ms, &run, &found, error);
		if (status == TW_OK && found)
			status = expire(store, &run, error);
		if (status != TW_OK || !found)
			return status;
	}
}

/* --- claiming --------------------------------------------------------------------------------------------------- */

/* The most urgent of one kind that there is room for. A thousand that need more than there is are looked over. */
static enum tw_status find_of_kind(struct store *store, enum job_kind kind, uint64_t room, struct candidate *best,
				   struct tw_error *error)
{
	struct sql q = sql_query(
		store, "SELECT number, priority FROM (SELECT number, priority, room_bytes FROM job"
		       " INDEXED BY job_claimable WHERE kind = ? AND state = " SQL_QUEUED
		       " AND waiting_for = 0 AND not_before_ms = 0 ORDER BY priority DESC, number LIMIT 1000) f"
		       " WHERE room_bytes <= ? LIMIT 1");
	sql_bind_int(&q, kind);
	sql_bind_int(&q, room < INT64_MAX ? (int64_t)room : INT64_MAX);
	if (sql_step(&q)) {
		int64_t number = sql_int(&q);
		int64_t priority = sql_int(&q);
		if (!best->found || priority > best->priority || (priority == best->priority && number < best->number))
			*best = (struct candidate){number, priority, true};
	}
	return sql_end(&q, error);
}

static enum tw_status find_first(struct store *store, unsigned kinds, struct candidate *best, struct tw_error *error)
{
	uint64_t room = 0;
	*best = (struct candidate){0};
	enum tw_status status = sql_room(store, &room, error);
	for (enum job_kind kind = 0; status == TW_OK && kind < JOB_KINDS; kind++)
		if (kinds & JOB_KIND_BIT(kind))
			status = find_of_kind(store, kind, room, best, error);
	return status;
}

static enum tw_status look(struct store *store, unsigned kinds, int64_t now_ms, bool *found, struct tw_error *error)
{
	struct candidate best;
	enum tw_status status = anything_due(store, now_ms, found, error);
	if (status != TW_OK || *found)
		return status;
	status = find_first(store, kinds, &best, error);
	*found = best.found;
	return status;
}

static enum tw_status end_what_is_due(struct store *store, int64_t now_ms, struct tw_error *error)
{
	enum tw_status status = expire_leases(store, now_ms, error);
	return status == TW_OK ? job_state_end_pauses(store, now_ms, error) : status;
}

enum tw_status job_expire(struct store *store, struct tw_error *error)
{
	bool due = false;
	int64_t now_ms = store_lease_now_ms(store);
	enum tw_status status = anything_due(store, now_ms, &due, error);
	if (status != TW_OK || !due)
		return status;
	status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = end_what_is_due(store, now_ms, error);
	return transaction_end(store, status, error);
}

static enum tw_status take_first(struct store *store, unsigned kinds, const char *worker, struct job_ticket *ticket,
				 bool *found, struct tw_error *error)
{
	struct candidate best;
	enum tw_status status = find_first(store, kinds, &best, error);
	*found = best.found;
	return status == TW_OK && best.found ? job_state_take(store, best.number, worker, ticket, error) : status;
}

enum tw_status job_claim(struct store *store, unsigned kinds, const char *worker, int64_t lease_ms,
			 struct job_ticket *ticket, bool *found, struct tw_error *error)
{
	int64_t now_ms = store_lease_now_ms(store);
	memset(ticket, 0, sizeof *ticket);
	ticket->lease_ms = lease_ms;
	enum tw_status status = look(store, kinds, now_ms, found, error);
	if (status != TW_OK || !*found)
		return status;
	*found = false;
	status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = end_what_is_due(store, now_ms, error);
	if (status == TW_OK)
		status = take_first(store, kinds, worker, ticket, found, error);
	status = transaction_end(store, status, error);
	*found = *found && status == TW_OK;
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
	int64_t now_ms = store_lease_now_ms(store);
	*found = false;
	memset(ticket, 0, sizeof *ticket);
	ticket->lease_ms = lease_ms;
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = expire_leases(store, now_ms, error);
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
	if (status == TW_OK && ticket->resource_id[0])
		status = row_find_resource(store, TENANT_ANY, ticket->resource_id, &resource, error);
	if (status == TW_OK && resource)
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

static enum tw_status fail_one(struct store *store, const struct job_ticket *ticket, const struct tw_error *failure,
			       bool retry, struct tw_error *error)
{
	struct job_run run;
	enum tw_status status = job_state_check(store, ticket, &run, error);
	if (status != TW_OK)
		return status;
	if (run.cancel_requested || failure->status == TW_ERROR_CANCELLED)
		return job_state_end(store, run.number, JOB_CANCELLED, NULL, error);
	if (!retry || run.attempts >= run.attempts_max)
		return job_state_end(store, run.number, JOB_FAILED, failure, error);
	int doublings = run.attempts < 10 ? (int)run.attempts - 1 : 9;
	return job_state_put_back(store, run.number, JOB_BLAMED, (int64_t)RETRY_PAUSE_MS << doublings, 0, error);
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

static enum tw_status give_back(struct store *store, const struct job_ticket *ticket, int64_t pause_ms,
				uint64_t room_bytes, struct tw_error *error)
{
	struct job_run run;
	enum tw_status status = job_state_check(store, ticket, &run, error);
	if (status != TW_OK)
		return status;
	return run.cancel_requested ? job_state_end(store, run.number, JOB_CANCELLED, NULL, error)
				    : job_state_put_back(store, run.number, JOB_SPARED, pause_ms, room_bytes, error);
}

enum tw_status job_release(struct store *store, const struct job_ticket *ticket, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = give_back(store, ticket, 0, 0, error);
	return transaction_end(store, status, error);
}

enum tw_status job_put_off(struct store *store, const struct job_ticket *ticket, uint64_t room_bytes,
			   struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = give_back(store, ticket, PUT_OFF_PAUSE_MS, room_bytes, error);
	return transaction_end(store, status, error);
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

static void read_job(struct sql *q, void *job)
{
	row_read_job(q, job);
}

enum tw_status job_list_running(struct store *store, struct job_page *page, struct tw_error *error)
{
	struct row_page read;
	struct sql q = sql_query(store, "SELECT j.number, " ROW_JOB_COLUMNS " FROM job j INDEXED BY job_leased"
					" LEFT JOIN resource r ON r.number = j.resource WHERE j.state = " SQL_RUNNING
					" ORDER BY j.lease_until_ms LIMIT 1000");
	enum tw_status status = row_read_page(&q, 1000, sizeof *page->jobs, read_job, &read, error);
	*page = (struct job_page){read.rows, read.count, 0};
	if (status != TW_OK)
		job_page_clear(page);
	return status;
}
