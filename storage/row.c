/* Rows as structs, and the steps in the life of a job that more than one file takes.
 *
 * The plus in `+state` keeps SQLite from walking all queued jobs by their state where the few rows are known by
 * resource: with ten thousand jobs queued that is what every step would cost. */
#include "storage/row.h"

#include <stdlib.h>
#include <string.h>

void row_read_job(struct sql *q, struct job *job)
{
	memset(job, 0, sizeof *job);
	sql_copy_text(q, job->id, sizeof job->id);
	sql_copy_text(q, job->resource_id, sizeof job->resource_id);
	job->kind = (enum job_kind)sql_int(q);
	job->state = (enum job_state)sql_int(q);
	job->cancel_requested = sql_int(q);
	job->waiting_for = (uint32_t)sql_int(q);
	job->attempts = (uint32_t)sql_int(q);
	job->attempts_max = (uint32_t)sql_int(q);
	job->priority = (int32_t)sql_int(q);
	job->progress = sql_real(q);
	sql_copy_text(q, job->stage, sizeof job->stage);
	job->partial = sql_own_text(q);
	sql_copy_text(q, job->worker, sizeof job->worker);
	job->created_ms = sql_int(q);
	job->started_ms = sql_int(q);
	job->finished_ms = sql_int(q);
	job->lease_until_ms = sql_int(q);
	job->change = sql_int(q);
	job->failure.status = (enum tw_status)sql_int(q);
	sql_copy_text(q, job->failure.type, sizeof job->failure.type);
	sql_copy_text(q, job->failure.where, sizeof job->failure.where);
	sql_copy_text(q, job->failure.text, sizeof job->failure.text);
}

void row_read_resource(struct sql *q, struct resource *resource)
{
	memset(resource, 0, sizeof *resource);
	sql_copy_text(q, resource->id, sizeof resource->id);
	resource->kind = (enum resource_kind)sql_int(q);
	resource->name = sql_own_text(q);
	resource->options = sql_own_text(q);
	resource->summary = sql_own_text(q);
	resource->created_ms = sql_int(q);
	row_read_job(q, &resource->job);
}

uint32_t row_page_limit(uint32_t limit)
{
	return limit < 1 ? 1 : limit > 1000 ? 1000 : limit;
}

enum tw_status row_read_page(struct sql *q, uint32_t limit, size_t size, void (*read)(struct sql *q, void *row),
			     struct row_page *page, struct tw_error *error)
{
	*page = (struct row_page){.rows = calloc(limit, size)};
	if (!page->rows)
		q->code = SQLITE_NOMEM;
	while (sql_step(q)) {
		page->more = page->count == limit;
		if (page->more)
			break;
		page->last = sql_int(q);
		read(q, (char *)page->rows + size * page->count++);
	}
	return sql_end(q, error);
}

enum tw_status row_find_resource(struct store *store, const char *id, int64_t *number, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number FROM resource WHERE id = ?");
	sql_bind_text(&q, id);
	bool found = sql_step(&q);
	*number = found ? sql_int(&q) : 0;
	enum tw_status status = sql_end(&q, error);
	if (status == TW_OK && !found)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-resource", NULL, "there is no %.64s", id);
	return status;
}

static enum tw_status set_ended(struct store *store, int64_t job, enum job_state state, const struct tw_error *failure,
				struct tw_error *error)
{
	bool failed = state == JOB_FAILED && failure;
	struct sql q = sql_query(
		store,
		"UPDATE job SET state = ?1, finished_ms = ?2, lease_until_ms = 0,"
		" progress = iif(?1 = 2, 1.0, progress), partial = iif(?1 = 2, NULL, partial), failure_status = ?3,"
		" failure_type = ?4, failure_where = ?5, failure_text = ?6 WHERE number = ?7");
	sql_bind_int(&q, state);
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, failed ? failure->status : TW_OK);
	sql_bind_text(&q, failed && failure->type ? failure->type : "");
	sql_bind_text(&q, failed ? failure->where : "");
	sql_bind_text(&q, failed ? failure->text : "");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

/* Counts again what queued jobs wait for; which jobs, follows. */
#define COUNT_NEEDS                                                                                                    \
	"UPDATE job SET waiting_for = (SELECT count(*) FROM need n JOIN job m ON m.resource = n.needed"                \
	" WHERE n.resource = job.resource AND m.state <> 2) WHERE +state = 0 AND resource IN "

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
		" UPDATE job SET state = 3, finished_ms = ?2, failure_status = ?3, failure_type = 'dependency-failed',"
		" failure_where = '', failure_text = (SELECT iif(state = 4, id || ', which this is made from, was "
		"cancelled',"
		"  id || ', which this is made from, failed: ' || text) FROM cause)"
		" WHERE +state = 0 AND resource IN (SELECT resource FROM down)");
	sql_bind_int(&q, job);
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, TW_ERROR_CONFLICT);
	return sql_run(&q, NULL, error);
}

enum tw_status row_end_job(struct store *store, int64_t job, enum job_state state, const struct tw_error *failure,
			   struct tw_error *error)
{
	enum tw_status status = set_ended(store, job, state, failure, error);
	if (status != TW_OK)
		return status;
	return state == JOB_SUCCEEDED ? release_dependents(store, job, error) : fail_dependents(store, job, error);
}

enum tw_status row_count_needs(struct store *store, int64_t resource, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "WITH RECURSIVE up(resource) AS (VALUES (?)"
				 " UNION SELECT n.needed FROM need n JOIN up ON n.resource = up.resource) " COUNT_NEEDS
				 "(SELECT resource FROM up)");
	sql_bind_int(&q, resource);
	return sql_run(&q, NULL, error);
}

static enum tw_status forget_samples(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(store, "DELETE FROM recording_chunk WHERE resource ="
					" (SELECT resource FROM job WHERE number = ?)");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

static enum tw_status queue_again(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(
		store, "WITH RECURSIVE up(resource) AS (SELECT resource FROM job WHERE number = ?"
		       " UNION SELECT n.needed FROM need n JOIN up ON n.resource = up.resource"
		       "  JOIN job m ON m.resource = n.needed WHERE m.state IN (3, 4))"
		       " UPDATE job SET state = 0, attempts = 0, not_before_ms = 0, cancel_requested = 0, progress = 0,"
		       " stage = '', partial = NULL, failure_status = 0, failure_type = '', failure_where = '',"
		       " failure_text = '', started_ms = 0, finished_ms = 0, worker = ''"
		       " WHERE +state IN (3, 4) AND resource IN (SELECT resource FROM up)");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

enum tw_status row_redrive(struct store *store, int64_t job, struct tw_error *error)
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
	return status == TW_OK ? row_count_needs(store, resource, error) : status;
}

enum tw_status row_renew_lease(struct store *store, const struct job_ticket *ticket, double progress, const char *stage,
			       const char *partial, bool *cancel, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE job SET lease_until_ms = ?, progress = ?, stage = coalesce(?, stage),"
					" partial = coalesce(?, partial) WHERE number = ? AND fence = ? AND state = 1"
					" RETURNING cancel_requested");
	sql_bind_int(&q, store_now_ms(store) + ticket->lease_ms);
	sql_bind_real(&q, progress);
	sql_bind_text(&q, stage);
	sql_bind_text(&q, partial);
	sql_bind_int(&q, ticket->number);
	sql_bind_int(&q, ticket->fence);
	bool own = sql_step(&q);
	*cancel = own && sql_int(&q);
	while (own && sql_step(&q))
		;
	enum tw_status status = sql_end(&q, error);
	return status == TW_OK && !own ? row_fail_lost(ticket, error) : status;
}
