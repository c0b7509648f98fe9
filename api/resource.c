#include "api/resource.h"

#include "api/header.h"
#include "api/job_view.h"
#include "api/json.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>

#define PAGE_LIMIT_DEFAULT 50
#define PAGE_LIMIT_MAX 1000

static const char *const collections[RESOURCE_KINDS] = {
	[RESOURCE_MESH] = "/v1/meshes",    [RESOURCE_MOTION] = "/v1/meshes/%s/motions", [RESOURCE_FIELD] = "/v1/fields",
	[RESOURCE_LAYOUT] = "/v1/layouts", [RESOURCE_RECORDING] = "/v1/rig/recordings",
};

void resource_path(enum resource_kind kind, const char *parent, const char *id, char *path, size_t size)
{
	if (kind == RESOURCE_MOTION)
		snprintf(path, size, "/v1/meshes/%s/motions/%s", parent, id);
	else
		snprintf(path, size, "%s/%s", collections[kind], id);
}

/* The one resource of a kind that another was made from, "" where there is none: the mesh of a motion, the field of a
 * layout. */
static enum tw_status first_need(struct api_call *call, const char *id, enum resource_kind kind,
				 char need[STORE_ID_SIZE], struct tw_error *error)
{
	char(*ids)[STORE_ID_SIZE] = NULL;
	size_t count = 0;
	enum tw_status status = resource_needs(call->store, id, kind, &ids, &count, error);
	need[0] = 0;
	if (!status && count)
		memcpy(need, ids[0], STORE_ID_SIZE);
	free(ids);
	return status;
}

/* --- showing ---------------------------------------------------------------------------------------------------------
 */

static const char *type_name(enum tw_type type)
{
	static const char *const names[] = {
		[TW_F32] = "f32", [TW_F64] = "f64", [TW_U8] = "u8", [TW_U32] = "u32", [TW_U64] = "u64"};
	return names[type];
}

static json_t *show_blob(const struct blob *blob, const char *path)
{
	char href[512], hash[2 * BLOB_HASH_SIZE + 1];
	sodium_bin2hex(hash, sizeof hash, blob->hash, sizeof blob->hash);
	json_t *json = json_object();
	json_object_set_new(json, "name", json_string(blob->name));
	if (blob->role == BLOB_UPLOAD)
		json_object_set_new(json, "file_name", json_string(blob->file_name));
	if (blob->role == BLOB_ARRAY) {
		json_object_set_new(json, "type", json_string(type_name(blob->type)));
		json_object_set_new(json, "rows", json_integer((json_int_t)blob->rows));
		json_object_set_new(json, "columns", json_integer(blob->columns));
	} else {
		json_object_set_new(json, "media_type", json_string(blob->media_type));
	}
	json_object_set_new(json, "size_bytes", json_integer((json_int_t)blob->size));
	json_object_set_new(json, "blake2b", json_string(hash));
	if (blob->role != BLOB_UPLOAD) {
		snprintf(href, sizeof href, "%s/%s%s", path, blob->role == BLOB_ARRAY ? "arrays/" : "", blob->name);
		json_object_set_new(json, "href", json_string(href));
	}
	return json;
}

static enum tw_status add_blobs(struct api_call *call, json_t *json, const char *member, const char *id,
				enum blob_role role, const char *path, struct tw_error *error)
{
	struct blob *blobs = NULL;
	size_t count = 0;
	enum tw_status status = blob_list(call->store, id, role, &blobs, &count, error);
	json_t *list = json_array();
	for (size_t i = 0; i < count; i++)
		json_array_append_new(list, show_blob(&blobs[i], path));
	json_object_set_new(json, member, list);
	free(blobs);
	return status;
}

static enum tw_status add_need(struct api_call *call, json_t *json, const char *member, const char *id,
			       enum resource_kind kind, struct tw_error *error)
{
	char need[STORE_ID_SIZE];
	enum tw_status status = first_need(call, id, kind, need, error);
	json_object_set_new(json, member, json_string(need));
	return status;
}

static enum tw_status add_needs(struct api_call *call, json_t *json, const char *member, const char *id,
				enum resource_kind kind, struct tw_error *error)
{
	char(*ids)[STORE_ID_SIZE] = NULL;
	size_t count = 0;
	enum tw_status status = resource_needs(call->store, id, kind, &ids, &count, error);
	json_t *list = json_array();
	for (size_t i = 0; i < count; i++)
		json_array_append_new(list, json_string(ids[i]));
	json_object_set_new(json, member, list);
	free(ids);
	return status;
}

/* What a resource was made from. */
static enum tw_status add_origin(struct api_call *call, json_t *json, const struct resource *resource,
				 struct tw_error *error)
{
	enum tw_status status = TW_OK;
	switch (resource->kind) {
	case RESOURCE_MOTION:
		return add_need(call, json, "mesh", resource->id, RESOURCE_MESH, error);
	case RESOURCE_FIELD:
		status = add_need(call, json, "mesh", resource->id, RESOURCE_MESH, error);
		return status ? status : add_needs(call, json, "motions", resource->id, RESOURCE_MOTION, error);
	case RESOURCE_LAYOUT:
		return add_need(call, json, "field", resource->id, RESOURCE_FIELD, error);
	default:
		return TW_OK;
	}
}

static enum tw_status add_contents(struct api_call *call, json_t *json, const struct resource *resource,
				   const char *path, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	if (resource->kind == RESOURCE_MESH || resource->kind == RESOURCE_MOTION)
		status = add_blobs(call, json, "uploads", resource->id, BLOB_UPLOAD, path, error);
	if (!status && resource->kind != RESOURCE_LAYOUT && resource->kind != RESOURCE_RECORDING)
		status = add_blobs(call, json, "arrays", resource->id, BLOB_ARRAY, path, error);
	if (!status && resource->kind == RESOURCE_LAYOUT)
		status = add_blobs(call, json, "artifacts", resource->id, BLOB_ARTIFACT, path, error);
	return status;
}

enum tw_status resource_show(struct api_call *call, const struct resource *resource, bool with_contents, json_t **json,
			     struct tw_error *error)
{
	char path[256];
	json_t *made = json_object();
	json_object_set_new(made, "id", json_string(resource->id));
	json_object_set_new(made, "name", json_string(resource->name));
	json_object_set_new(made, "state", json_string(job_state_name(resource->job.state)));
	json_object_set_new(made, "created_at", json_time(resource->created_ms));
	enum tw_status status = add_origin(call, made, resource, error);
	json_object_set_new(made, resource->kind == RESOURCE_LAYOUT ? "request" : "options",
			    json_embed(resource->options));
	json_object_set_new(made, "summary", json_embed(resource->summary));
	json_object_set_new(made, "problem", job_show_problem(&resource->job));
	json_object_set_new(made, "job", job_show(&resource->job));
	resource_path(resource->kind, json_string_value(json_object_get(made, "mesh")), resource->id, path,
		      sizeof path);
	json_object_set_new(made, "href", json_string(path));
	if (!status && with_contents)
		status = add_contents(call, made, resource, path, error);
	if (status) {
		json_decref(made);
		made = NULL;
	}
	*json = made;
	return status;
}

/* --- one -------------------------------------------------------------------------------------------------------------
 */

/* The resource that the path names; of a motion also checks that it is one of the path's mesh. */
static enum tw_status find_resource(struct api_call *call, enum resource_kind kind, struct resource *resource,
				    struct tw_error *error)
{
	bool is_motion = kind == RESOURCE_MOTION;
	const char *id = call->match.parameters[is_motion];
	enum tw_status status = resource_get(call->store, kind, id, resource, error);
	if (status || !is_motion)
		return status;
	char mesh[STORE_ID_SIZE];
	status = first_need(call, id, RESOURCE_MESH, mesh, error);
	if (!status && strcmp(mesh, call->match.parameters[0]) != 0)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-resource", NULL,
				 "the mesh %.40s has no motion %.40s", call->match.parameters[0], id);
	if (status)
		resource_clear(resource);
	return status;
}

static enum tw_status respond_resource(struct api_call *call, unsigned http_status, const struct resource *resource,
				       struct tw_error *error)
{
	json_t *json = NULL;
	enum tw_status status = resource_show(call, resource, true, &json, error);
	return status ? status : response_json(&call->response, http_status, json, error);
}

enum tw_status resource_respond(struct api_call *call, enum resource_kind kind, struct tw_error *error)
{
	struct resource resource = {0};
	enum tw_status status = query_only(&call->query, NULL, error);
	if (!status)
		status = find_resource(call, kind, &resource, error);
	if (!status)
		status = respond_resource(call, 200, &resource, error);
	resource_clear(&resource);
	return status;
}

enum tw_status resource_respond_delete(struct api_call *call, enum resource_kind kind, struct tw_error *error)
{
	static const char *const known[] = {"dependents", NULL};
	struct resource resource = {0};
	const char *dependents = query_get(&call->query, "dependents");
	enum tw_status status = query_only(&call->query, known, error);
	if (!status && dependents && strcmp(dependents, "true") != 0 && strcmp(dependents, "false") != 0)
		status = tw_fail(error, TW_ERROR_INPUT, "invalid-parameter", "dependents",
				 "dependents is true or false");
	if (!status)
		status = find_resource(call, kind, &resource, error);
	if (!status)
		status = resource_delete(call->store, kind, resource.id, dependents && !strcmp(dependents, "true"),
					 error);
	if (!status)
		response_empty(&call->response, 204);
	resource_clear(&resource);
	return status;
}

/* --- lists -----------------------------------------------------------------------------------------------------------
 */

enum tw_status page_parameters(const struct api_call *call, uint32_t *limit, int64_t *cursor, struct tw_error *error)
{
	int64_t number = 0;
	enum tw_status status =
		query_integer(&call->query, "limit", PAGE_LIMIT_DEFAULT, 1, PAGE_LIMIT_MAX, &number, error);
	*limit = (uint32_t)number;
	if (!status)
		status = query_integer(&call->query, "cursor", 0, 0, INT64_MAX, cursor, error);
	return status;
}

enum tw_status page_respond(struct api_call *call, json_t *items, int64_t next, struct tw_error *error)
{
	json_t *page = json_object();
	json_object_set_new(page, "items", items);
	if (!next) {
		json_object_set_new(page, "next", json_null());
		return response_json(&call->response, 200, page, error);
	}
	/* The same query with another cursor. */
	char link[3 * QUERY_TEXT_MAX + 64], value[3 * QUERY_TEXT_MAX + 1];
	size_t used = (size_t)snprintf(link, sizeof link, "%s?cursor=%lld", call->query.path, (long long)next);
	for (size_t i = 0; i < call->query.pair_count && used < sizeof link; i++) {
		if (!strcmp(call->query.pairs[i].name, "cursor"))
			continue;
		query_encode(call->query.pairs[i].value, value, sizeof value);
		used += (size_t)snprintf(link + used, sizeof link - used, "&%s=%s", call->query.pairs[i].name, value);
	}
	json_object_set_new(page, "next", json_string(link));
	response_header(&call->response, "Link", "<%s>; rel=\"next\"", link);
	return response_json(&call->response, 200, page, error);
}

static enum tw_status show_page(struct api_call *call, const struct resource_page *page, json_t *items,
				struct tw_error *error)
{
	for (size_t i = 0; i < page->count; i++) {
		json_t *item = NULL;
		enum tw_status status = resource_show(call, &page->resources[i], false, &item, error);
		if (status)
			return status;
		json_array_append_new(items, item);
	}
	return TW_OK;
}

enum tw_status resource_respond_list(struct api_call *call, enum resource_kind kind, const char *needs,
				     const char *filter, struct tw_error *error)
{
	const char *const known[] = {"state", "limit", "cursor", filter, NULL};
	struct resource_query query = {.kind = kind, .needs = needs};
	if (filter)
		query.needs = query_get(&call->query, filter);
	struct resource_page page = {0};
	enum tw_status status = query_only(&call->query, known, error);
	if (!status)
		status = page_parameters(call, &query.limit, &query.cursor, error);
	if (!status)
		status = job_states_parse(query_get(&call->query, "state"), &query.states, error);
	if (!status)
		status = resource_list(call->store, &query, &page, error);
	json_t *items = json_array();
	if (!status)
		status = show_page(call, &page, items, error);
	int64_t next = page.next;
	resource_page_clear(&page);
	if (!status)
		return page_respond(call, items, next, error);
	json_decref(items);
	return status;
}

/* --- stored bytes ----------------------------------------------------------------------------------------------------
 */

/* A blob that is read from the store while it is sent. */
struct blob_stream {
	struct api_stream stream;
	struct store *store; /* borrowed: of the thread that sends */
	int64_t number;
};

static enum tw_status read_blob(struct api_stream *stream, uint64_t offset, void *bytes, size_t size, size_t *got)
{
	const struct blob_stream *blob = (const struct blob_stream *)stream;
	return blob_read(blob->store, blob->number, offset, bytes, size, got, NULL);
}

static void close_blob(struct api_stream *stream)
{
	free(stream);
}

static enum tw_status stream_blob(struct api_call *call, const struct blob *blob, const char *media_type,
				  struct tw_error *error)
{
	struct blob_stream *stream = malloc(sizeof *stream);
	if (!stream)
		return tw_fail_memory(error);
	*stream = (struct blob_stream){
		{.size = blob->size, .read = read_blob, .close = close_blob}, call->store, blob->number};
	response_stream(&call->response, media_type, &stream->stream);
	return TW_OK;
}

/* Results never change once they are there, so a client may keep them; it asks again only whether it still may. */
static enum tw_status respond_blob(struct api_call *call, const struct blob *blob, struct tw_error *error)
{
	const char *media_type = blob->role == BLOB_ARRAY ? "application/octet-stream" : blob->media_type;
	char etag[33];
	enum tw_status status = call_check_accept(call, media_type, error);
	if (status)
		return status;
	sodium_bin2hex(etag, sizeof etag, blob->hash, 16);
	if (call_is_unchanged(call, etag))
		return TW_OK;
	if (blob->role == BLOB_ARRAY) {
		response_header(&call->response, "X-Array-Type", "%s", type_name(blob->type));
		response_header(&call->response, "X-Array-Shape", "%llu, %u", (unsigned long long)blob->rows,
				blob->columns);
	}
	return stream_blob(call, blob, media_type, error);
}

enum tw_status resource_respond_blob(struct api_call *call, enum resource_kind kind, enum blob_role role,
				     struct tw_error *error)
{
	struct resource resource = {0};
	struct blob blob;
	const char *name = call->match.parameters[kind == RESOURCE_MOTION ? 2 : 1];
	enum tw_status status = query_only(&call->query, NULL, error);
	if (!status)
		status = find_resource(call, kind, &resource, error);
	if (!status && resource.job.state != JOB_SUCCEEDED)
		status = tw_fail(error, TW_ERROR_CONFLICT, "not-computed", NULL,
				 "this is %s; its results are not there", job_state_name(resource.job.state));
	if (!status)
		status = blob_find(call->store, resource.id, role, name, &blob, error);
	if (!status)
		status = respond_blob(call, &blob, error);
	resource_clear(&resource);
	return status;
}

/* --- creation --------------------------------------------------------------------------------------------------------
 */

static enum tw_status respond_created(struct api_call *call, const struct resource *resource, struct tw_error *error)
{
	json_t *json = NULL;
	bool is_final = job_state_is_final(resource->job.state);
	enum tw_status status = resource_show(call, resource, is_final, &json, error);
	if (status)
		return status;
	response_header(&call->response, "Location", "%s", json_string_value(json_object_get(json, "href")));
	if (!is_final)
		response_header(&call->response, "Retry-After", "1");
	return response_json(&call->response, is_final ? 200 : 202, json, error);
}

/* Prefer: wait. The connection is held for the job, at most as long as the service allows. */
static void hold(struct api_call *call, const struct resource *resource)
{
	uint32_t wait_s = header_prefer_wait_s(call_header(call, "Prefer"));
	if (wait_s > call->settings->wait_limit_s)
		wait_s = call->settings->wait_limit_s;
	if (!wait_s)
		return;
	response_header(&call->response, "Preference-Applied", "wait=%u", wait_s);
	if (job_state_is_final(resource->job.state))
		return;
	call->wait.kind = resource->kind;
	call->wait.until_ms = call_now_ms() + 1000 * (int64_t)wait_s;
	memcpy(call->wait.resource_id, resource->id, STORE_ID_SIZE);
	memcpy(call->wait.job_id, resource->job.id, STORE_ID_SIZE);
}

enum tw_status resource_respond_create(struct api_call *call, const struct resource_draft *draft,
				       struct tw_error *error)
{
	struct resource resource = {0};
	enum resource_outcome outcome = RESOURCE_CREATED;
	enum tw_status status = resource_create(call->store, draft, &resource, &outcome, error);
	if (status)
		return status;
	body_upload_release(&call->upload);
	if (outcome != RESOURCE_EXISTED)
		call_job_added(call);
	hold(call, &resource);
	if (!call->wait.job_id[0])
		status = respond_created(call, &resource, error);
	resource_clear(&resource);
	return status;
}

enum tw_status resource_respond_awaited(struct api_call *call, struct tw_error *error)
{
	struct resource resource = {0};
	enum tw_status status = resource_get(call->store, call->wait.kind, call->wait.resource_id, &resource, error);
	if (!status)
		status = respond_created(call, &resource, error);
	resource_clear(&resource);
	return status;
}
