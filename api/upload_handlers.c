/* Uploads that can be continued: begun, sent in pieces as the connection allows, completed, and then named in the query
 * of POST /v1/meshes and …/motions. What a broken connection leaves is whole chunks (storage/blob.h); the client asks
 * how far it came and goes on from there. */
#include "api/handlers.h"
#include "api/json.h"
#include "solver/names.h"

#include <string.h>

static enum tw_status respond_upload(struct api_call *call, const char *id, unsigned status, struct tw_error *error)
{
	struct blob blob;
	bool sealed = false;
	enum tw_status found = upload_find(call->store, call->caller.owner.tenant, id, &blob, &sealed, error);
	if (found)
		return found;
	char path[64];
	json_t *json = json_object();
	snprintf(path, sizeof path, "/v1/uploads/%s", id);
	json_object_set_new(json, "id", json_string(id));
	json_object_set_new(json, "part", json_string(blob.name));
	json_object_set_new(json, "file_name", json_string(blob.file_name));
	json_object_set_new(json, "received_bytes", json_integer((json_int_t)blob.size));
	json_object_set_new(json, "complete", json_boolean(sealed));
	json_object_set_new(json, "href", json_string(path));
	if (status == 201)
		response_header(&call->response, "Location", "%s", path);
	response_header(&call->response, "Upload-Offset", "%llu", (unsigned long long)blob.size);
	return response_json(&call->response, status, json, error);
}

/* What an upload can become: the parts of a mesh, and a motion. */
static enum tw_status check_part(const char *part, struct tw_error *error)
{
	const char *names[] = {mesh_parts[0], mesh_parts[1], motion_parts[0]};
	const struct names parts = {names, sizeof names / sizeof *names};
	for (size_t i = 0; part && i < parts.count; i++)
		if (!strcmp(parts.list[i], part))
			return TW_OK;
	return names_refuse(&parts, "part", part ? part : "", "unknown-part", "part", error);
}

enum tw_status post_upload(struct api_call *call, struct tw_error *error)
{
	static const char *const known[] = {"part", "name", NULL};
	const char *part = query_get(&call->query, "part"), *name = NULL;
	struct upload *upload = NULL;
	char id[STORE_ID_SIZE] = "";
	enum tw_status status = query_only(&call->query, known, error);
	if (status != TW_OK)
		return status;
	status = check_part(part, error);
	if (status == TW_OK)
		status = query_name(&call->query, &name, error);
	if (status != TW_OK)
		return status;
	status = upload_begin(&upload, call->store, call->caller.owner, part, name, "application/octet-stream",
			      call->settings->upload_limit_bytes, error);
	if (status == TW_OK)
		snprintf(id, sizeof id, "%s", upload_id(upload));
	upload_free(upload);
	return status != TW_OK ? status : respond_upload(call, id, 201, error);
}

enum tw_status get_upload(struct api_call *call, struct tw_error *error)
{
	enum tw_status status = query_only(&call->query, NULL, error);
	return status != TW_OK ? status : respond_upload(call, call->match.parameters[0], 200, error);
}

/* The body is in the store already. */
enum tw_status patch_upload(struct api_call *call, struct tw_error *error)
{
	enum tw_status status = query_only(&call->query, NULL, error);
	return status != TW_OK ? status : respond_upload(call, call->match.parameters[0], 200, error);
}

enum tw_status delete_upload(struct api_call *call, struct tw_error *error)
{
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = upload_discard(call->store, call->caller.owner.tenant, call->match.parameters[0], error);
	if (status == TW_OK)
		response_empty(&call->response, 204);
	return status;
}
