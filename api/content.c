/* Stored arrays and artifacts, streamed from the store while they are sent. */
#include "api/content.h"

#include "api/resource.h"
#include "api/resource_view.h"
#include "solver/names.h"
#include "storage/task.h"

#include <sodium.h>
#include <stdlib.h>

/* A blob that is read from the store while it is sent. */
struct blob_stream {
	struct api_stream stream;
	struct store *store;           /* borrowed: of the thread that sends */
	const struct api_hooks *hooks; /* borrowed */
	int64_t number;
};

static enum tw_status read_blob(struct api_stream *stream, uint64_t offset, void *bytes, size_t size, size_t *got)
{
	const struct blob_stream *blob = (const struct blob_stream *)stream;
	struct tw_error error = {0};
	enum tw_status status = blob_read(blob->store, blob->number, offset, bytes, size, got, &error);
	if (status == TW_ERROR_IO && blob->hooks->failed)
		blob->hooks->failed(blob->hooks->context, NULL, &error);
	return status;
}

static void close_blob(struct api_stream *stream)
{
	free(stream);
}

/* What is small is read before the answer begins, so that bytes that are damaged become an error and not half an
 * answer; of what is large, the beginning. Damage further on breaks the answer off. */
enum { WHOLE_BYTES = 1 << 20 };

static enum tw_status respond_whole(struct api_call *call, const struct blob *blob, const char *media_type,
				    struct tw_error *error)
{
	size_t got = 0;
	char *bytes = malloc(blob->size ? (size_t)blob->size : 1);
	if (!bytes)
		return tw_fail_memory(error);
	enum tw_status status = blob_read(call->store, blob->number, 0, bytes, (size_t)blob->size, &got, error);
	if (status == TW_OK)
		return response_bytes(&call->response, 200, media_type, bytes, got, error);
	free(bytes);
	return status;
}

static enum tw_status stream_blob(struct api_call *call, const struct blob *blob, const char *media_type,
				  struct tw_error *error)
{
	char first;
	size_t got = 0;
	if (blob->size <= WHOLE_BYTES)
		return respond_whole(call, blob, media_type, error);
	enum tw_status status = blob_read(call->store, blob->number, 0, &first, 1, &got, error);
	if (status != TW_OK)
		return status;
	struct blob_stream *stream = malloc(sizeof *stream);
	if (!stream)
		return tw_fail_memory(error);
	*stream = (struct blob_stream){{.size = blob->size, .read = read_blob, .close = close_blob},
				       call->store,
				       &call->settings->hooks,
				       blob->number};
	response_stream(&call->response, media_type, &stream->stream);
	return TW_OK;
}

/* Results never change once they are there, so a client may keep them; it asks again only whether it still may. */
static enum tw_status respond_blob(struct api_call *call, const struct blob *blob, struct tw_error *error)
{
	const char *media_type = blob->role == BLOB_ARRAY ? "application/octet-stream" : blob->media_type;
	char etag[33];
	enum tw_status status = call_check_accept(call, media_type, error);
	if (status != TW_OK)
		return status;
	sodium_bin2hex(etag, sizeof etag, blob->hash.bytes, 16);
	if (call_is_unchanged(call, etag))
		return TW_OK;
	if (blob->role == BLOB_ARRAY) {
		response_header(&call->response, "X-Array-Type", "%s", array_type_name(blob->type));
		response_header(&call->response, "X-Array-Shape", "%llu, %u", (unsigned long long)blob->rows,
				blob->columns);
	}
	return stream_blob(call, blob, media_type, error);
}

/* What nobody reads may be dropped where room is short. That somebody does is noted once in a while; that this time it
 * cannot be is no reason not to answer. */
static bool note_read(struct api_call *call, const struct blob *blob)
{
	struct tw_error error = {0};
	if (!task_is_read_seldom(call->store, blob))
		return true;
	if (!call_may_write(call))
		return false;
	if (task_note_read(call->store, blob, &error) != TW_OK)
		call_failed(call, NULL, &error);
	return true;
}

/* What there is in its place. */
static enum tw_status refuse_name(struct api_call *call, const char *resource_id, enum blob_role role, const char *name,
				  struct tw_error *error)
{
	struct blob *blobs = NULL;
	size_t count = 0;
	enum tw_status status = blob_list(call->store, resource_id, role, &blobs, &count, error);
	if (status != TW_OK)
		return status;
	const char **list = calloc(count + 1, sizeof *list);
	for (size_t i = 0; list && i < count; i++)
		list[i] = blobs[i].name;
	if (list) {
		(void)names_refuse(&(struct names){list, count}, role == BLOB_ARRAY ? "array" : "file", name,
				   "no-such-blob", NULL, error);
		status = error->status = TW_ERROR_NOT_FOUND;
	} else {
		status = tw_fail_memory(error);
	}
	free(list);
	free(blobs);
	return status;
}

static enum tw_status respond_missing(struct api_call *call, const struct resource *resource, enum blob_role role,
				      const char *name, content_missing *missing, struct tw_error *error)
{
	bool known = false;
	enum tw_status status = missing ? missing(call, resource, name, &known, error) : TW_OK;
	return status != TW_OK || known ? status : refuse_name(call, resource->id, role, name, error);
}

static enum tw_status respond_named(struct api_call *call, const struct resource *resource, enum blob_role role,
				    const char *name, content_missing *missing, struct tw_error *error)
{
	struct blob blob;
	enum tw_status status = blob_find(call->store, resource->id, role, name, &blob, error);
	if (status == TW_ERROR_NOT_FOUND)
		return respond_missing(call, resource, role, name, missing, error);
	if (status != TW_OK || !note_read(call, &blob))
		return status;
	return respond_blob(call, &blob, error);
}

enum tw_status content_respond(struct api_call *call, enum resource_kind kind, enum blob_role role,
			       content_missing *missing, struct tw_error *error)
{
	struct resource resource = {0};
	const char *name = call->match.parameters[resource_kind_is_nested(kind) ? 2 : 1];
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = resource_find(call, kind, &resource, error);
	if (status == TW_OK && !job_state_has_result(resource.job.state))
		status = tw_fail(error, TW_ERROR_CONFLICT, "not-computed", NULL,
				 "this is %s; its results are not there", job_state_name(resource.job.state));
	if (status == TW_OK)
		status = respond_named(call, &resource, role, name, missing, error);
	resource_clear(&resource);
	return status;
}
