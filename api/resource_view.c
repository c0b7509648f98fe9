#include "api/resource_view.h"

#include "api/drawing_list.h"
#include "api/job_view.h"
#include "api/json.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>

enum tw_status resource_first_need(struct api_call *call, const char *id, enum resource_kind kind,
				   char need[STORE_ID_SIZE], struct tw_error *error)
{
	char(*ids)[STORE_ID_SIZE] = NULL;
	size_t count = 0;
	enum tw_status status = resource_needs(call->store, id, kind, &ids, &count, error);
	need[0] = 0;
	if (status == TW_OK && count)
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
	char href[512], hash[2 * CONTENT_HASH_SIZE + 1];
	sodium_bin2hex(hash, sizeof hash, blob->hash.bytes, sizeof blob->hash.bytes);
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
	const struct resource_kind_row *kind = resource_kind_row(resource->kind);
	enum tw_status status = TW_OK;
	for (unsigned i = 0; i < kind->need_count && status == TW_OK; i++) {
		const struct kind_need *need = &kind->needs[i];
		status = need->many ? add_needs(call, json, need->member, resource->id, need->kind, error)
				    : add_need(call, json, need->member, resource->id, need->kind, error);
	}
	return status;
}

static enum tw_status add_outdated(struct api_call *call, json_t *json, const struct resource *resource,
				   struct tw_error *error)
{
	bool outdated = false;
	enum tw_status status = resource_is_outdated(call->store, resource, &outdated, error);
	json_object_set_new(json, "outdated", json_boolean(outdated));
	return status;
}

/* What is made when somebody asks for it. */
static enum tw_status add_drawings(struct api_call *call, json_t *list, const struct resource *layout, const char *path,
				   struct tw_error *error)
{
	bool possible = false;
	enum tw_status status = drawing_is_possible(call, layout, &possible, error);
	if (status == TW_OK && possible)
		drawing_add_to_list(list, path);
	return status;
}

static enum tw_status add_contents(struct api_call *call, json_t *json, const struct resource *resource,
				   const char *path, struct tw_error *error)
{
	static const char *const members[] = {
		[BLOB_UPLOAD] = "uploads", [BLOB_ARRAY] = "arrays", [BLOB_ARTIFACT] = "artifacts"};
	unsigned contains = resource_kind_row(resource->kind)->contains;
	enum tw_status status = TW_OK;
	for (enum blob_role role = BLOB_UPLOAD; role <= BLOB_ARTIFACT && status == TW_OK; role++)
		if (contains >> role & 1)
			status = add_blobs(call, json, members[role], resource->id, role, path, error);
	if (status == TW_OK && resource->kind == RESOURCE_LAYOUT)
		status = add_drawings(call, json_object_get(json, members[BLOB_ARTIFACT]), resource, path, error);
	return status;
}

static void print_href(const struct resource *resource, const json_t *shown, char href[KIND_HREF_SIZE])
{
	const char *parent = NULL;
	if (resource_kind_is_nested(resource->kind))
		parent = json_string_value(json_object_get(shown, resource_kind_row(resource->kind)->needs[0].member));
	resource_kind_print_href(resource->kind, parent ? parent : "", resource->id, href);
}

enum tw_status resource_show(struct api_call *call, const struct resource *resource, bool with_contents, json_t **json,
			     struct tw_error *error)
{
	char path[KIND_HREF_SIZE];
	json_t *made = json_object();
	json_object_set_new(made, "id", json_string(resource->id));
	json_object_set_new(made, "name", json_string(resource->name));
	json_object_set_new(made, "state", json_string(job_state_name(resource->job.state)));
	json_object_set_new(made, "created_at", json_time(resource->created_ms));
	enum tw_status status = add_origin(call, made, resource, error);
	if (resource->options)
		json_object_set_new(made, resource_kind_row(resource->kind)->options_member,
				    json_embed(resource->options));
	json_object_set_new(made, "version", json_integer(resource->version));
	if (status == TW_OK)
		status = add_outdated(call, made, resource, error);
	json_object_set_new(made, "summary", json_embed(resource->summary));
	json_object_set_new(made, "problem", job_show_problem(&resource->job));
	json_object_set_new(made, "job", job_show(&resource->job));
	print_href(resource, made, path);
	json_object_set_new(made, "href", json_string(path));
	if (status == TW_OK && with_contents)
		status = add_contents(call, made, resource, path, error);
	if (status != TW_OK) {
		json_decref(made);
		made = NULL;
	}
	*json = made;
	return status;
}
