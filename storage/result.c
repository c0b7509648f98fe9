#include "storage/result.h"

#include "storage/chunk.h"
#include "storage/sql.h"

#include <assert.h>
#include <stdlib.h>

/* The write lock is held for some milliseconds a megabyte: a result of 60 MiB kept others from writing for 0.4 s. */
enum { STAGE_BYTES = 1 << 20 };

/* Too large a number is found where the array is written. */
uint64_t result_size(const struct job_result *result)
{
	uint64_t size = 0;
	for (size_t i = 0; i < result->array_count; i++)
		size += result->arrays[i].rows * result->arrays[i].columns * tw_type_size(result->arrays[i].type);
	for (size_t i = 0; i < result->artifact_count; i++)
		size += result->artifacts[i].size;
	return size;
}

static enum tw_status array_blob(const struct tw_array *array, struct blob *blob, struct tw_error *error)
{
	uint64_t row_bytes = (uint64_t)array->columns * tw_type_size(array->type);
	*blob = (struct blob){.role = BLOB_ARRAY, .type = array->type, .columns = array->columns, .rows = array->rows};
	if (row_bytes && array->rows > INT64_MAX / row_bytes)
		return tw_fail(error, TW_ERROR_LIMIT, "array-too-large", NULL, "the array %.100s is too large",
			       array->name);
	blob->size = array->rows * row_bytes;
	snprintf(blob->name, sizeof blob->name, "%s", array->name);
	snprintf(blob->media_type, sizeof blob->media_type, "application/octet-stream");
	return TW_OK;
}

static void artifact_blob(const struct job_artifact *artifact, struct blob *blob)
{
	*blob = (struct blob){.role = BLOB_ARTIFACT, .size = artifact->size};
	snprintf(blob->name, sizeof blob->name, "%s", artifact->name);
	snprintf(blob->media_type, sizeof blob->media_type, "%s", artifact->media_type);
}

static size_t blob_count(const struct job_result *result)
{
	return result->array_count + result->artifact_count;
}

/* The i-th of its arrays and artifacts. */
static enum tw_status take_blob(const struct job_result *result, size_t i, struct blob *blob, const void **bytes,
				struct tw_error *error)
{
	if (i < result->array_count) {
		*bytes = result->arrays[i].data;
		return array_blob(&result->arrays[i], blob, error);
	}
	const struct job_artifact *artifact = &result->artifacts[i - result->array_count];
	*bytes = artifact->bytes;
	artifact_blob(artifact, blob);
	return TW_OK;
}

enum tw_status result_stage(struct store *store, const struct job_result *result, struct result_draft *draft,
			    struct tw_error *error)
{
	*draft = (struct result_draft){.result = result};
	if (result_size(result) <= STAGE_BYTES)
		return TW_OK;
	draft->staged = calloc(blob_count(result), sizeof *draft->staged);
	if (!draft->staged)
		return tw_fail_memory(error);
	enum tw_status status = TW_OK;
	for (size_t i = 0; status == TW_OK && i < blob_count(result); i++) {
		struct blob blob;
		const void *bytes = NULL;
		status = take_blob(result, i, &blob, &bytes, error);
		if (status == TW_OK)
			status = chunk_stage_blob(store, &blob, bytes, error);
		if (status == TW_OK)
			draft->staged[draft->staged_count++] = blob.number;
	}
	return status;
}

static enum tw_status let_go(struct store *store, const struct result_draft *draft)
{
	enum tw_status status = transaction_begin(store, false, NULL);
	if (status != TW_OK)
		return status;
	for (size_t i = 0; status == TW_OK && i < draft->staged_count; i++) {
		struct sql q = sql_query(store, CHUNK_LET_GO " WHERE number = ? AND resource IS NULL");
		sql_bind_int(&q, draft->staged[i]);
		status = sql_run(&q, NULL, NULL);
	}
	return transaction_end(store, status, NULL);
}

/* What cannot be let go of is swept some day. */
void result_discard(struct store *store, struct result_draft *draft)
{
	enum tw_status ignored = draft->staged_count ? let_go(store, draft) : TW_OK;
	(void)ignored;
	free(draft->staged);
	draft->staged = NULL;
}

static enum tw_status write_blob(struct store *store, int64_t resource, const struct result_draft *draft, size_t i,
				 struct tw_error *error)
{
	struct blob blob;
	const void *bytes = NULL;
	if (draft->staged)
		return chunk_adopt(store, resource, draft->staged[i], error);
	enum tw_status status = take_blob(draft->result, i, &blob, &bytes, error);
	return status == TW_OK ? chunk_write_blob(store, resource, &blob, bytes, error) : status;
}

static enum tw_status write_summary(struct store *store, int64_t resource, uint32_t version, const char *summary,
				    struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE resource SET summary = ?, version = ? WHERE number = ?");
	sql_bind_text(&q, summary);
	sql_bind_int(&q, version);
	sql_bind_int(&q, resource);
	return sql_run(&q, NULL, error);
}

static enum tw_status take_upload(struct store *store, int64_t resource, const char *upload, struct tw_error *error)
{
	int64_t taken = 0;
	struct sql q = sql_query(store, "UPDATE blob SET resource = ?1, " CHUNK_OWNED_BY_RESOURCE
					" WHERE upload = ?2 AND resource IS NULL"
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

static enum tw_status mark_file(struct store *store, int64_t resource, const char *name, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE blob SET of_task = 1 WHERE resource = ? AND role = ? AND name = ?");
	sql_bind_int(&q, resource);
	sql_bind_int(&q, BLOB_ARTIFACT);
	sql_bind_text(&q, name);
	return sql_run(&q, NULL, error);
}

enum tw_status result_write_file(struct store *store, int64_t resource, const struct result_draft *draft,
				 struct tw_error *error)
{
	assert(draft->result->artifact_count == 1 && draft->result->array_count == 0);
	enum tw_status status = write_blob(store, resource, draft, 0, error);
	return status == TW_OK ? mark_file(store, resource, draft->result->artifacts[0].name, error) : status;
}

enum tw_status result_write(struct store *store, int64_t resource, uint32_t version, const struct result_draft *draft,
			    struct tw_error *error)
{
	const struct job_result *result = draft->result;
	enum tw_status status = write_summary(store, resource, version, result->summary, error);
	for (size_t i = 0; status == TW_OK && i < blob_count(result); i++)
		status = write_blob(store, resource, draft, i, error);
	if (status == TW_OK && result->dropped_part)
		status = drop_upload(store, resource, result->dropped_part, error);
	if (status == TW_OK && result->upload)
		status = take_upload(store, resource, result->upload, error);
	return status;
}
