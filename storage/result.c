#include "storage/result.h"

#include "storage/chunk.h"
#include "storage/sql.h"

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

enum tw_status result_write(struct store *store, int64_t resource, uint32_t version, const struct job_result *result,
			    struct tw_error *error)
{
	enum tw_status status = write_summary(store, resource, version, result->summary, error);
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
