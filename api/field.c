/* Fields: {"mesh": id, "motions": [id, …], "name": …, "options": {…}} in; arrays out. */
#include "api/content.h"
#include "api/handlers.h"
#include "api/json.h"
#include "api/resource.h"
#include "solver/field/options.h"
#include "solver/option_json.h"

#include <stdlib.h>
#include <string.h>

struct field_request {
	json_t *body;       /* owned; the texts below are borrowed from it */
	const char *name;   /* may be NULL */
	char *options;      /* owned, canonical JSON */
	const char **needs; /* owned list: the mesh, then the motions */
	size_t need_count;
};

static void field_request_clear(struct field_request *request)
{
	json_decref(request->body);
	free(request->options);
	free(request->needs);
}

static enum tw_status check_members(const json_t *body, struct tw_error *error)
{
	static const char *const known[] = {"mesh", "motions", "name", "options", NULL};
	return json_check_members(body, "", known, error);
}

static enum tw_status parse_needs(struct field_request *request, struct tw_error *error)
{
	const char *mesh = NULL;
	enum tw_status status = json_get_text(request->body, "mesh", true, &mesh, error);
	if (status != TW_OK)
		return status;
	const json_t *motions = json_object_get(request->body, "motions");
	size_t count = json_array_size(motions);
	if (!json_is_array(motions))
		return tw_fail(error, TW_ERROR_INPUT, "json-type", "/motions",
			       "motions must be a list of motion ids of the mesh");
	if (count > TW_LIMIT_MOTIONS)
		return tw_fail(error, TW_ERROR_LIMIT, "too-many-motions", "/motions", "at most %u motions",
			       TW_LIMIT_MOTIONS);
	request->needs = calloc(count + 1, sizeof *request->needs);
	if (!request->needs)
		return tw_fail_memory(error);
	request->needs[request->need_count++] = mesh;
	for (size_t i = 0; i < count; i++) {
		char pointer[64];
		const char *id = json_string_value(json_array_get(motions, i));
		snprintf(pointer, sizeof pointer, "/motions/%zu", i);
		if (!id)
			return tw_fail(error, TW_ERROR_INPUT, "json-type", pointer, "a motion id must be a string");
		for (size_t k = 1; k < request->need_count; k++)
			if (!strcmp(request->needs[k], id))
				return tw_fail(error, TW_ERROR_INPUT, "motion-twice", pointer,
					       "this motion is in the list twice; name it once");
		request->needs[request->need_count++] = id;
	}
	return TW_OK;
}

static enum tw_status parse_options(struct field_request *request, struct tw_error *error)
{
	struct field_options values;
	const json_t *given = json_object_get(request->body, "options");
	field_options_defaults(&values, FIELD_PRESET_NONE);
	if (given && !json_is_object(given))
		return tw_fail(error, TW_ERROR_INPUT, "json-type", "/options", "options must be an object");
	enum tw_status status = given ? field_options_from_json(&values, given, "/options", error) : TW_OK;
	if (status != TW_OK)
		return status;
	json_t *json = option_to_json(&field_option_table, &values);
	request->options = json ? json_dumps(json, JSON_COMPACT) : NULL;
	json_decref(json);
	return request->options ? TW_OK : tw_fail_memory(error);
}

static enum tw_status parse(struct field_request *request, const char *bytes, size_t size, struct tw_error *error)
{
	enum tw_status status = option_json_parse(&request->body, bytes, size, error);
	if (status == TW_OK)
		status = check_members(request->body, error);
	if (status == TW_OK)
		status = json_get_name(request->body, &request->name, error);
	if (status == TW_OK)
		status = parse_needs(request, error);
	return status != TW_OK ? status : parse_options(request, error);
}

/* The mesh exists, and every motion is one of that mesh. */
static enum tw_status check_needs(struct api_call *call, const struct field_request *request, struct tw_error *error)
{
	struct resource resource = {0};
	enum tw_status status = resource_get(call->store, call->caller.owner.tenant, RESOURCE_MESH, request->needs[0],
					     &resource, error);
	if (status == TW_ERROR_NOT_FOUND)
		status = tw_fail(error, TW_ERROR_INPUT, "no-such-mesh", "/mesh",
				 "there is no such mesh; upload it first");
	resource_clear(&resource);
	for (size_t i = 1; status == TW_OK && i < request->need_count; i++) {
		char(*meshes)[STORE_ID_SIZE] = NULL, pointer[64];
		size_t count = 0;
		snprintf(pointer, sizeof pointer, "/motions/%zu", i - 1);
		status = resource_get(call->store, call->caller.owner.tenant, RESOURCE_MOTION, request->needs[i],
				      &resource, error);
		if (status == TW_OK)
			status = resource_needs(call->store, request->needs[i], RESOURCE_MESH, &meshes, &count, error);
		if (status == TW_ERROR_NOT_FOUND ||
		    (status == TW_OK && (!count || strcmp(meshes[0], request->needs[0]) != 0)))
			status = tw_fail(error, TW_ERROR_INPUT, "no-such-motion", pointer,
					 "the mesh has no such motion; upload it to /v1/meshes/{mesh}/motions");
		free(meshes);
		resource_clear(&resource);
	}
	return status;
}

enum tw_status post_field(struct api_call *call, struct tw_error *error)
{
	struct field_request request = {0};
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = parse(&request, call->body, call->body_size, error);
	if (status == TW_OK)
		status = check_needs(call, &request, error);
	struct resource_draft draft = {
		.owner = call->caller.owner,
		.kind = RESOURCE_FIELD,
		.name = request.name,
		.options = request.options,
		.needs = request.needs,
		.need_count = request.need_count,
	};
	if (status == TW_OK)
		status = resource_respond_create(call, &draft, error);
	field_request_clear(&request);
	return status;
}

enum tw_status list_fields(struct api_call *call, struct tw_error *error)
{
	return resource_respond_list(call, RESOURCE_FIELD, NULL, "mesh", error);
}

enum tw_status get_field(struct api_call *call, struct tw_error *error)
{
	return resource_respond(call, RESOURCE_FIELD, error);
}

enum tw_status get_field_array(struct api_call *call, struct tw_error *error)
{
	return content_respond(call, RESOURCE_FIELD, BLOB_ARRAY, NULL, error);
}

enum tw_status delete_field(struct api_call *call, struct tw_error *error)
{
	return resource_respond_delete(call, RESOURCE_FIELD, error);
}
