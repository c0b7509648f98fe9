/* The plus in `+state` keeps SQLite from walking all queued jobs by their state where the few rows are known by
 * resource: with ten thousand jobs queued that is what every step would cost. */
#include "storage/job_state.h"

#include "storage/id.h"
#include "storage/sql.h"

#include <inttypes.h>

/* A job that takes all the memory of a machine kills service and worker at once, and must end some day too. */
enum { INTERRUPTIONS_FREE = 10 };

static enum tw_status fail_lost(const struct job_ticket *ticket, struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_CONFLICT, "lease-lost", NULL,
		       "the lease on %s ran out or the job was removed; its result is not wanted any more",
		       ticket->job_id);
}

/* --- what waits for what ---------------------------------------------------------------------------------------- */

/* Counts again what queued jobs wait for; which jobs, follows. */
#define COUNT_NEEDS                                                                                                    \
	"UPDATE job SET waiting_for = (SELECT count(*) FROM need n JOIN job m ON m.resource = n.needed"                \
	" WHERE n.resource = job.resource AND m.state <> " SQL_SUCCEEDED ") WHERE +state = " SQL_QUEUED                \
	" AND resource IN "

/* Of `resource`, and of everything it is made from. */
static enum tw_status count_needs(struct store *store, int64_t resource, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "WITH RECURSIVE up(resource) AS (VALUES (?)"
				 " UNION SELECT n.needed FROM need n JOIN up ON n.resource = up.resource) " COUNT_NEEDS
				 "(SELECT resource FROM up)");
	sql_bind_int(&q, resource);
	return sql_run(&q, NULL, error);
}

static enum tw_status release_dependents(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q =
		sql_query(store, COUNT_NEEDS
			  "(SELECT n.resource FROM need n JOIN job d ON d.resource = n.needed WHERE d.number = ?)");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

/* All that is made from it, directly or not, is still queued: nobody could claim it. */
static enum tw_status fail_dependents(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(
		store,
		"WITH RECURSIVE cause(resource, id, state, text) AS"
		" (SELECT r.number, r.id, j.state, j.failure_text FROM job j JOIN resource r ON r.number = j.resource"
		"  WHERE j.number = ?1),"
		" down(resource) AS (SELECT n.resource FROM need n, cause c WHERE n.needed = c.resource"
		"  UNION SELECT n.resource FROM need n JOIN down d ON n.needed = d.resource)"
		" UPDATE job SET state = " SQL_FAILED ", finished_ms = ?2, failure_status = ?3,"
		" failure_type = 'dependency-failed', failure_where = '', failure_text = (SELECT id ||"
		"  CASE state WHEN " SQL_CANCELLED " THEN ', which this is made from, was cancelled'"
		"  WHEN " SQL_INCOMPLETE " THEN ', which this is made from, is incomplete'"
		"  ELSE ', which this is made from, failed: ' || text END FROM cause)"
		" WHERE +state = " SQL_QUEUED " AND resource IN (SELECT resource FROM down)");
	sql_bind_int(&q, job);
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, TW_ERROR_CONFLICT);
	return sql_run(&q, NULL, error);
}

/* --- into the queue --------------------------------------------------------------------------------------------- */

enum tw_status job_state_add(struct store *store, struct owner owner, int64_t resource, enum job_kind kind,
			     int32_t priority, uint32_t attempts_max, struct tw_error *error)
{
	char id[STORE_ID_SIZE];
	id_random(id, "job");
	struct sql q = sql_query(store, "INSERT INTO job(tenant, client, id, resource, kind, state, priority,"
					" attempts_max, room_bytes, created_ms)"
					" VALUES (?, ?, ?, ?, ?, " SQL_QUEUED ", ?, ?, ?, ?)");
	sql_bind_int(&q, owner.tenant);
	sql_bind_int(&q, owner.client);
	sql_bind_text(&q, id);
	if (resource)
		sql_bind_int(&q, resource);
	else
		sql_bind_text(&q, NULL);
	sql_bind_int(&q, kind);
	sql_bind_int(&q, priority);
	sql_bind_int(&q, attempts_max);
	sql_bind_int(&q, (int64_t)job_kind_row(kind)->room_bytes);
	sql_bind_int(&q, store_now_ms(store));
	enum tw_status status = sql_run(&q, NULL, error);
	return status == TW_OK && resource ? count_needs(store, resource, error) : status;
}

enum tw_status job_state_expect_room(struct store *store, int64_t resource, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "UPDATE job SET room_bytes = room_bytes"
				 " + (SELECT coalesce(sum(size), 0) FROM blob WHERE resource = ?1)"
				 " + (SELECT coalesce(sum(b.size), 0) FROM need n JOIN blob b ON b.resource = n.needed"
				 "    WHERE n.resource = ?1 AND n.position = 0 AND b.role = ?2)"
				 " WHERE resource = ?1");
	sql_bind_int(&q, resource);
	sql_bind_int(&q, BLOB_ARRAY);
	return sql_run(&q, NULL, error);
}

enum tw_status job_state_put_back(struct store *store, int64_t job, enum job_blame blame, int64_t pause_ms,
				  uint64_t room_bytes, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE job SET state = " SQL_QUEUED ", attempts = attempts - ?1,"
					" interruptions = interruptions + ?2, not_before_ms = ?3,"
					" room_bytes = CASE WHEN ?4 > room_bytes THEN ?4 ELSE room_bytes END,"
					" lease_until_ms = 0, progress = 0, stage = '' WHERE number = ?5");
	sql_bind_int(&q, blame != JOB_BLAMED);
	sql_bind_int(&q, blame == JOB_INTERRUPTED);
	sql_bind_int(&q, pause_ms ? store_lease_now_ms(store) + pause_ms : 0);
	sql_bind_int(&q, room_bytes < INT64_MAX ? (int64_t)room_bytes : INT64_MAX);
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

enum tw_status job_state_end_pauses(struct store *store, int64_t now_ms, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE job SET not_before_ms = 0 WHERE state = " SQL_QUEUED
					" AND not_before_ms > 0 AND not_before_ms <= ?");
	sql_bind_int(&q, now_ms);
	return sql_run(&q, NULL, error);
}

static enum tw_status forget_samples(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(store, "DELETE FROM recording_chunk WHERE resource ="
					" (SELECT resource FROM job WHERE number = ?)");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

/* A job without a resource is its own row only. */
static enum tw_status queue_again(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(
		store,
		"WITH RECURSIVE up(resource) AS (SELECT resource FROM job WHERE number = ?1"
		" UNION SELECT n.needed FROM need n JOIN up ON n.resource = up.resource"
		"  JOIN job m ON m.resource = n.needed WHERE m.state IN " SQL_REDRIVABLE ")"
		" UPDATE job SET state = " SQL_QUEUED ", attempts = 0, interruptions = 0, not_before_ms = 0,"
		" cancel_requested = 0,"
		" progress = 0, stage = '', partial = NULL, failure_status = 0, failure_type = '',"
		" failure_where = '', failure_text = '', started_ms = 0, finished_ms = 0, worker = ''"
		" WHERE +state IN " SQL_REDRIVABLE " AND (number = ?1 OR resource IN (SELECT resource FROM up))");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

enum tw_status job_state_redrive(struct store *store, int64_t job, struct tw_error *error)
{
	int64_t resource = 0;
	enum tw_status status = forget_samples(store, job, error);
	if (status == TW_OK)
		status = queue_again(store, job, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, "SELECT resource FROM job WHERE number = ?");
	sql_bind_int(&q, job);
	if (sql_step(&q))
		resource = sql_int(&q);
	status = sql_end(&q, error);
	return status == TW_OK && resource ? count_needs(store, resource, error) : status;
}

/* --- running ---------------------------------------------------------------------------------------------------- */

enum tw_status job_state_take(struct store *store, int64_t job, const char *worker, struct job_ticket *ticket,
			      struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE job SET state = " SQL_RUNNING
					", attempts = attempts + 1, fence = fence + 1, worker = ?,"
					" lease_until_ms = ?, started_ms = ?, progress = 0, stage = '' WHERE number = ?"
					" RETURNING number, fence, kind, attempts, id,"
					" (SELECT id FROM resource WHERE number = job.resource)");
	sql_bind_text(&q, worker);
	sql_bind_int(&q, store_lease_now_ms(store) + ticket->lease_ms);
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, job);
	if (sql_step(&q)) {
		ticket->number = sql_int(&q);
		ticket->fence = sql_int(&q);
		ticket->kind = (enum job_kind)sql_int(&q);
		ticket->attempt = (uint32_t)sql_int(&q);
		sql_copy_text(&q, ticket->job_id, sizeof ticket->job_id);
		sql_copy_text(&q, ticket->resource_id, sizeof ticket->resource_id);
	}
	return sql_run(&q, NULL, error);
}

void job_state_read_run(struct sql *q, struct job_run *run)
{
	run->number = sql_int(q);
	run->attempts = sql_int(q);
	run->attempts_max = sql_int(q);
	run->interruptions = sql_int(q);
	run->lease_until_ms = sql_int(q);
	run->cancel_requested = sql_int(q);
}

enum tw_status job_state_check(struct store *store, const struct job_ticket *ticket, struct job_run *run,
			       struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT " JOB_RUN_COLUMNS
					" FROM job WHERE number = ? AND fence = ? AND state = " SQL_RUNNING);
	sql_bind_int(&q, ticket->number);
	sql_bind_int(&q, ticket->fence);
	bool own = sql_step(&q);
	if (own)
		job_state_read_run(&q, run);
	enum tw_status status = sql_end(&q, error);
	return status == TW_OK && !own ? fail_lost(ticket, error) : status;
}

enum tw_status job_state_renew(struct store *store, const struct job_ticket *ticket, double progress, const char *stage,
			       const char *partial, bool *cancel, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE job SET lease_until_ms = ?, progress = ?, stage = coalesce(?, stage),"
					" partial = coalesce(?, partial) WHERE number = ? AND fence = ?"
					" AND state = " SQL_RUNNING " RETURNING cancel_requested");
	sql_bind_int(&q, store_lease_now_ms(store) + ticket->lease_ms);
	sql_bind_real(&q, progress);
	sql_bind_text(&q, stage);
	sql_bind_text(&q, partial);
	sql_bind_int(&q, ticket->number);
	sql_bind_int(&q, ticket->fence);
	bool own = sql_step(&q);
	*cancel = own && sql_int(&q);
	enum tw_status status = sql_run(&q, NULL, error);
	return status == TW_OK && !own ? fail_lost(ticket, error) : status;
}

enum tw_status job_state_ask_to_stop(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE job SET cancel_requested = 1 WHERE number = ?");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

enum tw_status job_state_crash(struct store *store, const struct job_run *run, struct tw_error *error)
{
	struct tw_error failure = {0};
	if (run->cancel_requested)
		return job_state_end(store, run->number, JOB_CANCELLED, NULL, error);
	if (run->attempts < run->attempts_max)
		return job_state_put_back(store, run->number, JOB_BLAMED, 0, 0, error);
	(void)tw_fail(&failure, TW_ERROR_INTERNAL, "attempts-exhausted", NULL,
		      "every one of the %" PRId64 " workers that tried it died or hung; redrive it to try again",
		      run->attempts);
	return job_state_end(store, run->number, JOB_FAILED, &failure, error);
}

enum tw_status job_state_interrupt(struct store *store, const struct job_run *run, struct tw_error *error)
{
	if (run->cancel_requested || run->interruptions >= INTERRUPTIONS_FREE)
		return job_state_crash(store, run, error);
	return job_state_put_back(store, run->number, JOB_INTERRUPTED, 0, 0, error);
}

/* --- the end ---------------------------------------------------------------------------------------------------- */

static enum tw_status set_ended(struct store *store, int64_t job, enum job_state state, const struct tw_error *failure,
				struct tw_error *error)
{
	bool failed = state == JOB_FAILED && failure;
	bool has_result = state == JOB_SUCCEEDED || state == JOB_INCOMPLETE;
	struct sql q = sql_query(store, "UPDATE job SET state = ?1, finished_ms = ?2, lease_until_ms = 0,"
					" progress = CASE WHEN ?3 = 1 THEN 1.0 ELSE progress END,"
					" partial = CASE WHEN ?3 = 1 THEN NULL ELSE partial END, failure_status = ?4,"
					" failure_type = ?5, failure_where = ?6, failure_text = ?7 WHERE number = ?8");
	sql_bind_int(&q, state);
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, has_result);
	sql_bind_int(&q, failed ? failure->status : TW_OK);
	sql_bind_text(&q, failed && failure->type ? failure->type : "");
	sql_bind_text(&q, failed ? failure->where : "");
	sql_bind_text(&q, failed ? failure->text : "");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

/* A recording has a course only while nobody has ended it. */
static enum tw_status forget_course(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(store, "DELETE FROM recording_course WHERE resource ="
					" (SELECT resource FROM job WHERE number = ?)");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

enum tw_status job_state_end(struct store *store, int64_t job, enum job_state state, const struct tw_error *failure,
			     struct tw_error *error)
{
	assert(job_state_is_final(state));
	enum tw_status status = set_ended(store, job, state, failure, error);
	if (status == TW_OK)
		status = forget_course(store, job, error);
	if (status != TW_OK)
		return status;
	return state == JOB_SUCCEEDED ? release_dependents(store, job, error) : fail_dependents(store, job, error);
}
