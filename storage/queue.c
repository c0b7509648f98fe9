/* The workers' side of the queue: claim, heartbeat, and the ways to end.
 *
 * A claim looks first without a lock, so that idle workers that ask often cost nothing, and then once more under the
 * write lock, where it takes the job: two workers cannot both see it queued there. */
#include "storage/chunk.h"
#include "storage/row.h"

#include <inttypes.h>
#include <string.h>

enum { RETRY_PAUSE_MS = 1000 };

static enum tw_status anything_to_do(struct store *store, unsigned kinds, int64_t now_ms, bool *found,
				     struct tw_error *error)
{
	struct sql q = sql_query(
		store, "SELECT EXISTS (SELECT 1 FROM job INDEXED BY job_claimable WHERE state = 0 AND waiting_for = 0"
		       " AND not_before_ms <= ?1 AND ?2 >> kind & 1)"
		       " OR EXISTS (SELECT 1 FROM job INDEXED BY job_leased WHERE state = 1 AND lease_until_ms < ?1)");
	sql_bind_int(&q, now_ms);
	sql_bind_int(&q, kinds);
	*found = sql_step(&q) && sql_int(&q);
	return sql_end(&q, error);
}

/* Back into the queue: `attempts_back` 1 when the attempt does not count. */
static enum tw_status put_back(struct store *store, int64_t job, int attempts_back, int64_t not_before_ms,
			       struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE job SET state = 0, attempts = attempts - ?, not_before_ms = ?,"
					" lease_until_ms = 0, progress = 0, stage = '' WHERE number = ?");
	sql_bind_int(&q, attempts_back);
	sql_bind_int(&q, not_before_ms);
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

/* A running job, as far as putting it back has to know it. */
struct running {
	int64_t number;
	int64_t attempts;
	int64_t attempts_max;
	bool cancel_requested;
};

static void read_running(struct sql *q, struct running *job)
{
	job->number = sql_int(q);
	job->attempts = sql_int(q);
	job->attempts_max = sql_int(q);
	job->cancel_requested = sql_int(q);
}

static enum tw_status expire_one(struct store *store, const struct running *job, struct tw_error *error)
{
	struct tw_error failure = {0};
	if (job->cancel_requested)
		return row_end_job(store, job->number, JOB_CANCELLED, NULL, error);
	if (job->attempts < job->attempts_max)
		return put_back(store, job->number, 0, 0, error);
	(void)tw_fail(&failure, TW_ERROR_INTERNAL, "attempts-exhausted", NULL,
		      "every one of the %" PRId64 " workers that tried it died or hung; redrive it to try again",
		      job->attempts);
	return row_end_job(store, job->number, JOB_FAILED, &failure, error);
}

static enum tw_status next_expired(struct store *store, int64_t now_ms, struct running *job, bool *found,
				   struct tw_error *error)
{
	struct sql q =
		sql_query(store, "SELECT number, attempts, attempts_max, cancel_requested"
				 " FROM job INDEXED BY job_leased WHERE state = 1 AND lease_until_ms < ? LIMIT 1");
	sql_bind_int(&q, now_ms);
	*found = sql_step(&q);
	if (*found)
		read_running(&q, job);
	return sql_end(&q, error);
}

static enum tw_status expire_leases(struct store *store, int64_t now_ms, struct tw_error *error)
{
	for (;;) {
		struct running job;
		bool found = false;
		enum tw_status status = next_expired(store, now_ms, &job, &found, error);
		if (status == TW_OK && found)
			status = expire_one(store, &job, error);
		if (status != TW_OK || !found)
			return status;
	}
}

static enum tw_status take_first(struct store *store, unsigned kinds, const char *worker, int64_t now_ms,
				 struct job_ticket *ticket, bool *found, struct tw_error *error)
{
	struct sql q = sql_query(
		store,
		"UPDATE job SET state = 1, attempts = attempts + 1, fence = fence + 1, worker = ?1,"
		" lease_until_ms = ?2, started_ms = ?3, progress = 0, stage = ''"
		" WHERE number = (SELECT number FROM job INDEXED BY job_claimable"
		"  WHERE state = 0 AND waiting_for = 0 AND not_before_ms <= ?3"
		"  AND ?4 >> kind & 1 ORDER BY priority DESC, number LIMIT 1)"
		" RETURNING number, fence, kind, attempts, id, (SELECT id FROM resource WHERE number = job.resource)");
	sql_bind_text(&q, worker);
	sql_bind_int(&q, now_ms + ticket->lease_ms);
	sql_bind_int(&q, now_ms);
	sql_bind_int(&q, kinds);
	*found = sql_step(&q);
	if (*found) {
		ticket->number = sql_int(&q);
		ticket->fence = sql_int(&q);
		ticket->kind = (enum job_kind)sql_int(&q);
		ticket->attempt = (uint32_t)sql_int(&q);
		sql_copy_text(&q, ticket->job_id, sizeof ticket->job_id);
		sql_copy_text(&q, ticket->resource_id, sizeof ticket->resource_id);
		while (sql_step(&q))
			;
	}
	return sql_end(&q, error);
}

enum tw_status job_claim(struct store *store, unsigned kinds, const char *worker, int64_t lease_ms,
			 struct job_ticket *ticket, bool *found, struct tw_error *error)
{
	int64_t now_ms = store_now_ms(store);
	memset(ticket, 0, sizeof *ticket);
	ticket->lease_ms = lease_ms;
	enum tw_status status = anything_to_do(store, kinds, now_ms, found, error);
	if (status != TW_OK || !*found)
		return status;
	*found = false;
	status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = expire_leases(store, now_ms, error);
	if (status == TW_OK)
		status = take_first(store, kinds, worker, now_ms, ticket, found, error);
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
	status = row_renew_lease(store, ticket, progress, stage, partial, cancel, error);
	return transaction_end(store, status, error);
}

static enum tw_status write_array(struct store *store, int64_t resource, const struct tw_array *array,
				  struct tw_error *error)
{
	uint64_t row_bytes = (uint64_t)array->columns * tw_type_size(array->type);
	struct blob blob = {.role = BLOB_ARRAY, .type = array->type, .columns = array->columns, .rows = array->rows};
	if (row_bytes && array->rows > INT64_MAX / row_bytes)
		return tw_fail(error, TW_ERROR_LIMIT, "array-too-large", NULL, "the array %.100s is too large",
			       array->name);
	blob.size = array->rows * row_bytes;
	snprintf(blob.name, sizeof blob.name, "%s", array->name);
	snprintf(blob.media_type, sizeof blob.media_type, "application/octet-stream");
	return chunk_write_blob(store, resource, &blob, array->data, error);
}

static enum tw_status write_artifact(struct store *store, int64_t resource, const struct job_artifact *artifact,
				     struct tw_error *error)
{
	struct blob blob = {.role = BLOB_ARTIFACT, .size = artifact->size};
	snprintf(blob.name, sizeof blob.name, "%s", artifact->name);
	snprintf(blob.media_type, sizeof blob.media_type, "%s", artifact->media_type);
	return chunk_write_blob(store, resource, &blob, artifact->bytes, error);
}

static enum tw_status write_summary(struct store *store, int64_t resource, const char *summary, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE resource SET summary = ? WHERE number = ?");
	sql_bind_text(&q, summary);
	sql_bind_int(&q, resource);
	return sql_run(&q, NULL, error);
}

static enum tw_status take_upload(struct store *store, int64_t resource, const char *upload, struct tw_error *error)
{
	int64_t taken = 0;
	struct sql q = sql_query(store, "UPDATE blob SET resource = ? WHERE upload = ? AND resource IS NULL"
					" AND hash IS NOT NULL");
	sql_bind_int(&q, resource);
	sql_bind_text(&q, upload);
	enum tw_status status = sql_run(&q, &taken, error);
	if (status == TW_OK && taken != 1)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-upload", NULL, "there is no complete upload %.64s",
				 upload);
	return status;
}

static enum tw_status drop_upload(struct store *store, int64_t resource, const char *part, struct tw_error *error)
{
	struct sql q = sql_query(store, CHUNK_LET_GO " WHERE resource = ? AND role = ? AND name = ?");
	sql_bind_int(&q, resource);
	sql_bind_int(&q, BLOB_UPLOAD);
	sql_bind_text(&q, part);
	return sql_run(&q, NULL, error);
}

static enum tw_status write_result(struct store *store, int64_t resource, const struct job_result *result,
				   struct tw_error *error)
{
	enum tw_status status = write_summary(store, resource, result->summary, error);
	for (size_t i = 0; status == TW_OK && i < result->array_count; i++)
		status = write_array(store, resource, &result->arrays[i], error);
	for (size_t i = 0; status == TW_OK && i < result->artifact_count; i++)
		status = write_artifact(store, resource, &result->artifacts[i], error);
	if (status == TW_OK && result->dropped_part)
		status = drop_upload(store, resource, result->dropped_part, error);
	if (status == TW_OK && result->upload)
		status = take_upload(store, resource, result->upload, error);
	return status;
}

/* The fence is checked before anything is written, inside the same transaction. */
static enum tw_status check_fence(struct store *store, const struct job_ticket *ticket, struct running *job,
				  struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number, attempts, attempts_max, cancel_requested FROM job"
					" WHERE number = ? AND fence = ? AND state = 1");
	sql_bind_int(&q, ticket->number);
	sql_bind_int(&q, ticket->fence);
	bool own = sql_step(&q);
	if (own)
		read_running(&q, job);
	enum tw_status status = sql_end(&q, error);
	return status == TW_OK && !own ? row_fail_lost(ticket, error) : status;
}

static enum tw_status finish(struct store *store, const struct job_ticket *ticket, const struct job_result *result,
			     struct tw_error *error)
{
	struct running job;
	int64_t resource = 0;
	enum tw_status status = check_fence(store, ticket, &job, error);
	if (status == TW_OK)
		status = row_find_resource(store, ticket->resource_id, &resource, error);
	if (status == TW_OK)
		status = write_result(store, resource, result, error);
	return status == TW_OK ? row_end_job(store, ticket->number, JOB_SUCCEEDED, NULL, error) : status;
}

/* Too large a number is found where the array is written. */
static uint64_t size_of_result(const struct job_result *result)
{
	uint64_t size = 0;
	for (size_t i = 0; i < result->array_count; i++)
		size += result->arrays[i].rows * result->arrays[i].columns * tw_type_size(result->arrays[i].type);
	for (size_t i = 0; i < result->artifact_count; i++)
		size += result->artifacts[i].size;
	return size;
}

enum tw_status job_finish(struct store *store, const struct job_ticket *ticket, const struct job_result *result,
			  struct tw_error *error)
{
	enum tw_status status = sql_check_room(store, size_of_result(result), error);
	if (status == TW_OK)
		status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = finish(store, ticket, result, error);
	return transaction_end(store, status, error);
}

static enum tw_status fail_one(struct store *store, const struct job_ticket *ticket, const struct tw_error *failure,
			       bool retry, struct tw_error *error)
{
	struct running job;
	enum tw_status status = check_fence(store, ticket, &job, error);
	if (status != TW_OK)
		return status;
	if (job.cancel_requested || failure->status == TW_ERROR_CANCELLED)
		return row_end_job(store, job.number, JOB_CANCELLED, NULL, error);
	if (!retry || job.attempts >= job.attempts_max)
		return row_end_job(store, job.number, JOB_FAILED, failure, error);
	int doublings = job.attempts < 10 ? (int)job.attempts - 1 : 9;
	return put_back(store, job.number, 0, store_now_ms(store) + ((int64_t)RETRY_PAUSE_MS << doublings), error);
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

static enum tw_status release(struct store *store, const struct job_ticket *ticket, struct tw_error *error)
{
	struct running job;
	enum tw_status status = check_fence(store, ticket, &job, error);
	if (status != TW_OK)
		return status;
	return job.cancel_requested ? row_end_job(store, job.number, JOB_CANCELLED, NULL, error)
				    : put_back(store, job.number, 1, 0, error);
}

enum tw_status job_release(struct store *store, const struct job_ticket *ticket, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = release(store, ticket, error);
	return transaction_end(store, status, error);
}

enum tw_status job_abandon(struct store *store, const char *worker, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, "UPDATE job SET lease_until_ms = 0 WHERE state = 1 AND worker = ?");
	sql_bind_text(&q, worker);
	status = sql_run(&q, NULL, error);
	return transaction_end(store, status, error);
}
