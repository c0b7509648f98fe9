#include "api/resource_view.h"

#include "api/job_view.h"
#include "api/json.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>

/* A motion's collection depends on its mesh. */
static const char *const collections[RESOURCE_KINDS] = {
	[RESOURCE_MESH] = "/v1/meshes",
	[RESOURCE_FIELD] = "/v1/fields",
	[RESOURCE_LAYOUT] = "/v1/layouts",
	[RESOURCE_RECORDING] = "/v1/rig/recordings",
};

/* `parent`: the mesh of a motion; else ignored. */
static void print_path(enum resource_kind kind, const char *parent, const char *id, char *path, size_t size)
{
	if (kind == RESOURCE_MOTION)
		snprintf(path, size, "/v1/meshes/%s/motions/%s", parent, id);
	else
		snprintf(path, size, "%s/%s", collections[kind], id);
}

enum tw_status resource_first_need(struct api_call *call, const char *id, enum resource_kind kind,
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

const char *array_type_name(enum tw_type type)
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
		json_object_set_new(json, "type", json_string(array_type_name(blob->type)));
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
	enum tw_status status = resource_first_need(call, id, kind, need, error);
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
	if (resource->options)
		json_object_set_new(made, resource->kind == RESOURCE_LAYOUT ? "request" : "options",
				    json_embed(resource->options));
	json_object_set_new(made, "summary", json_embed(resource->summary));
	json_object_set_new(made, "problem", job_show_problem(&resource->job));
	json_object_set_new(made, "job", job_show(&resource->job));
	print_path(resource->kind, json_string_value(json_object_get(made, "mesh")), resource->id, path, sizeof path);
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
