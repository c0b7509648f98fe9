/* Meshes and their motions: uploads in, resources out. */
#include "api/content.h"
#include "api/handlers.h"
#include "api/resource.h"
#include "solver/garment/options.h"
#include "solver/motion/options.h"
#include "solver/names.h"

#include <stdlib.h>
#include <string.h>

const char *const mesh_parts[] = {"worn", "pattern", NULL};
const char *const motion_parts[] = {"motion", NULL};

static bool is_part(const struct api_call *call, const char *name)
{
	const char *const *part = call->match.route->parts;
	while (*part && strcmp(*part, name) != 0)
		part++;
	return *part;
}

static enum tw_status refuse_parameter(const struct api_call *call, const struct option_table *table, const char *name,
				       struct tw_error *error)
{
	const char *names[OPTION_NAMES_MAX] = {"name"};
	size_t count = 1;
	for (const char *const *part = call->match.route->parts; *part; part++)
		names[count++] = *part;
	option_add_names(table, names, &count);
	return names_refuse(&(struct names){names, count}, "query parameter", name, "unknown-parameter", name, error);
}

/* Every query parameter but `name` and the parts is an option of the table; `values` is the struct that it describes.
 */
static enum tw_status parse_options(const struct api_call *call, const struct option_table *table, void *values,
				    char **options, struct tw_error *error)
{
	option_defaults(table, values);
	for (size_t i = 0; i < call->query.pair_count; i++) {
		const struct query_pair *pair = &call->query.pairs[i];
		if (!strcmp(pair->name, "name") || is_part(call, pair->name))
			continue;
		if (!option_is_known(table, pair->name))
			return refuse_parameter(call, table, pair->name, error);
		enum tw_status status = option_from_text(table, values, pair->name, pair->value, error);
		if (status != TW_OK)
			return status;
	}
	json_t *json = option_to_json(table, values);
	*options = json ? json_dumps(json, JSON_COMPACT) : NULL;
	json_decref(json);
	return *options ? TW_OK : tw_fail_memory(error);
}

/* What a person calls it: the query's name, else that of the first file. */
static const char *display_name(const struct api_call *call)
{
	const char *name = query_get(&call->query, "name");
	return name && *name ? name : call->upload.file_names[0];
}

static void draft_uploads(const struct api_call *call, struct resource_draft *draft,
			  const char *uploads[BODY_UPLOADS_MAX])
{
	for (size_t i = 0; i < call->upload.count; i++)
		uploads[i] = call->upload.ids[i];
	draft->name = display_name(call);
	draft->uploads = uploads;
	draft->upload_count = call->upload.count;
}

enum tw_status post_mesh(struct api_call *call, struct tw_error *error)
{
	char *options = NULL;
	const char *uploads[BODY_UPLOADS_MAX];
	struct import_options values;
	enum tw_status status = parse_options(call, &import_option_table, &values, &options, error);
	struct resource_draft draft = {.owner = call->caller.owner, .kind = RESOURCE_MESH, .options = options};
	draft_uploads(call, &draft, uploads);
	if (status == TW_OK)
		status = resource_respond_create(call, &draft, error);
	free(options);
	return status;
}

enum tw_status list_meshes(struct api_call *call, struct tw_error *error)
{
	return resource_respond_list(call, RESOURCE_MESH, NULL, NULL, error);
}

enum tw_status get_mesh(struct api_call *call, struct tw_error *error)
{
	return resource_respond(call, RESOURCE_MESH, error);
}

enum tw_status get_mesh_array(struct api_call *call, struct tw_error *error)
{
	return content_respond(call, RESOURCE_MESH, BLOB_ARRAY, NULL, error);
}

enum tw_status delete_mesh(struct api_call *call, struct tw_error *error)
{
	return resource_respond_delete(call, RESOURCE_MESH, error);
}

static enum tw_status check_mesh_exists(struct api_call *call, struct tw_error *error)
{
	struct resource mesh = {0};
	enum tw_status status = resource_get(call->store, call->caller.owner.tenant, RESOURCE_MESH,
					     call->match.parameters[0], &mesh, error);
	resource_clear(&mesh);
	return status;
}

enum tw_status post_motion(struct api_call *call, struct tw_error *error)
{
	char *options = NULL;
	const char *uploads[BODY_UPLOADS_MAX];
	const char *needs[] = {call->match.parameters[0]};
	struct motion_options values;
	enum tw_status status = parse_options(call, &motion_option_table, &values, &options, error);
	struct resource_draft draft = {.owner = call->caller.owner,
				       .kind = RESOURCE_MOTION,
				       .options = options,
				       .needs = needs,
				       .need_count = 1};
	draft_uploads(call, &draft, uploads);
	if (status == TW_OK)
		status = check_mesh_exists(call, error);
	if (status == TW_OK)
		status = resource_respond_create(call, &draft, error);
	free(options);
	return status;
}

enum tw_status list_motions(struct api_call *call, struct tw_error *error)
{
	enum tw_status status = check_mesh_exists(call, error);
	return status != TW_OK ? status
			       : resource_respond_list(call, RESOURCE_MOTION, call->match.parameters[0], NULL, error);
}

enum tw_status get_motion(struct api_call *call, struct tw_error *error)
{
	return resource_respond(call, RESOURCE_MOTION, error);
}

enum tw_status get_motion_array(struct api_call *call, struct tw_error *error)
{
	return content_respond(call, RESOURCE_MOTION, BLOB_ARRAY, NULL, error);
}

enum tw_status delete_motion(struct api_call *call, struct tw_error *error)
{
	return resource_respond_delete(call, RESOURCE_MOTION, error);
}
