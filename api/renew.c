/* A layout that an older release computed, or that lies on a field of one, asked for again: the same request, on the
 * field that this release computes from the same mesh, motions and options. Both stay side by side. */
#include "api/handlers.h"
#include "api/resource.h"
#include "api/resource_view.h"
#include "solver/field/options.h"
#include "solver/layout/request.h"
#include "solver/option_json.h"

#include <stdlib.h>
#include <string.h>

/* Options as a request of today would have them: with those that have come since. */
static enum tw_status options_of_today(const char *stored, char **options, struct tw_error *error)
{
	struct field_options values;
	json_t *given = NULL;
	enum tw_status status = option_json_parse(&given, stored, strlen(stored), error);
	if (status == TW_OK)
		status = field_options_from_json(&values, given, "", error);
	json_decref(given);
	if (status != TW_OK)
		return status;
	json_t *json = option_to_json(&field_option_table, &values);
	*options = json ? json_dumps(json, JSON_COMPACT) : NULL;
	json_decref(json);
	return *options ? TW_OK : tw_fail_memory(error);
}

/* What a field was made from, as post_field has it: the mesh, then the motions. */
struct origin {
	char (*mesh)[STORE_ID_SIZE];    /* owned */
	char (*motions)[STORE_ID_SIZE]; /* owned */
	const char **needs;             /* owned list */
	size_t need_count;
};

static void origin_clear(struct origin *origin)
{
	free(origin->needs);
	free(origin->mesh);
	free(origin->motions);
}

static enum tw_status origin_read(struct api_call *call, const char *field, struct origin *origin,
				  struct tw_error *error)
{
	size_t mesh_count = 0, motion_count = 0;
	enum tw_status status = resource_needs(call->store, field, RESOURCE_MESH, &origin->mesh, &mesh_count, error);
	if (status == TW_OK)
		status = resource_needs(call->store, field, RESOURCE_MOTION, &origin->motions, &motion_count, error);
	if (status != TW_OK)
		return status;
	origin->needs = calloc(mesh_count + motion_count + 1, sizeof *origin->needs);
	if (!origin->needs)
		return tw_fail_memory(error);
	for (size_t i = 0; i < mesh_count; i++)
		origin->needs[origin->need_count++] = origin->mesh[i];
	for (size_t i = 0; i < motion_count; i++)
		origin->needs[origin->need_count++] = origin->motions[i];
	return TW_OK;
}

static enum tw_status create_field(struct api_call *call, const struct resource *old, const char *options,
				   char id[STORE_ID_SIZE], struct tw_error *error)
{
	struct origin origin = {0};
	struct resource field = {0};
	enum tw_status status = origin_read(call, old->id, &origin, error);
	const struct resource_draft draft = {
		.owner = call->caller.owner,
		.kind = RESOURCE_FIELD,
		.name = old->name,
		.options = options,
		.needs = origin.needs,
		.need_count = origin.need_count,
	};
	if (status == TW_OK)
		status = resource_submit(call, &draft, &field, error);
	if (status == TW_OK)
		memcpy(id, field.id, STORE_ID_SIZE);
	resource_clear(&field);
	origin_clear(&origin);
	return status;
}

/* `id`: of the field, and then of the one that this release computes; they are one where it is not outdated. */
static enum tw_status renew_field(struct api_call *call, char id[STORE_ID_SIZE], struct tw_error *error)
{
	struct resource field = {0};
	char *options = NULL;
	bool outdated = false;
	enum tw_status status = resource_get(call->store, call->caller.owner.tenant, RESOURCE_FIELD, id, &field, error);
	if (status == TW_OK)
		status = resource_is_outdated(call->store, &field, &outdated, error);
	if (status == TW_OK && outdated)
		status = options_of_today(field.options, &options, error);
	if (status == TW_OK && outdated)
		status = create_field(call, &field, options, id, error);
	resource_clear(&field);
	free(options);
	return status;
}

/* From this layout version on the numbers of a request are the uploaded file's; before, those of the mesh that welding
 * and refinement made of it, which nobody can tell from the request. */
enum { NUMBERS_OF_THE_FILE = 2 };

static enum tw_status check_numbers(struct api_call *call, const struct resource *old, const char *field,
				    const struct layout_request *request, struct tw_error *error)
{
	char mesh[STORE_ID_SIZE];
	struct blob blob;
	if (old->version >= NUMBERS_OF_THE_FILE || !layout_request_has_numbers(request))
		return TW_OK;
	enum tw_status status = resource_first_need(call, field, RESOURCE_MESH, mesh, error);
	if (status == TW_OK)
		status = blob_find(call->store, mesh, BLOB_ARRAY, "source_vertex", &blob, error);
	if (status == TW_OK)
		return tw_fail(
			error, TW_ERROR_CONFLICT, "numbers-have-changed", NULL,
			"this layout counts the vertices or faces of a welded or refined mesh; since then numbers "
			"are those of the uploaded file, and its terminals would move: ask for it anew with "
			"POST /v1/layouts");
	return status == TW_ERROR_NOT_FOUND ? TW_OK : status;
}

/* The old request with the new field in it, if this release still understands it as it was meant. */
static enum tw_status renew_request(struct api_call *call, const struct resource *old, const char *field,
				    char **request, struct tw_error *error)
{
	struct layout_request parsed = {0};
	json_t *json = NULL;
	enum tw_status status = option_json_parse(&json, old->options, strlen(old->options), error);
	if (status != TW_OK)
		return status;
	int failed = json_object_set_new(json, "field", json_string(field));
	*request = failed ? NULL : json_dumps(json, JSON_COMPACT | JSON_SORT_KEYS);
	json_decref(json);
	if (!*request)
		return tw_fail_memory(error);
	status = layout_request_parse(&parsed, *request, strlen(*request), error);
	if (status == TW_OK)
		status = check_numbers(call, old, field, &parsed, error);
	layout_request_clear(&parsed);
	return status;
}

/* Asked for twice, it is one. No client's key begins with a control character. */
static void print_key(const char *layout, char key[128])
{
	snprintf(key, 128, "\x1frenew %s %u %u", layout, (unsigned)resource_kind_row(RESOURCE_FIELD)->version,
		 (unsigned)resource_kind_row(RESOURCE_LAYOUT)->version);
}

static enum tw_status renew(struct api_call *call, const struct resource *old, struct tw_error *error)
{
	char field[STORE_ID_SIZE], key[128];
	char *request = NULL;
	enum tw_status status = resource_first_need(call, old->id, RESOURCE_FIELD, field, error);
	if (status == TW_OK)
		status = renew_field(call, field, error);
	if (status == TW_OK)
		status = renew_request(call, old, field, &request, error);
	if (status == TW_OK) {
		print_key(old->id, key);
		const struct resource_draft draft = {
			.owner = call->caller.owner,
			.kind = RESOURCE_LAYOUT,
			.name = old->name,
			.options = request,
			.needs = (const char *const[]){field},
			.need_count = 1,
			.idempotency_key = key,
		};
		status = resource_respond_create(call, &draft, error);
	}
	free(request);
	return status;
}

enum tw_status renew_layout(struct api_call *call, struct tw_error *error)
{
	struct resource old = {0};
	bool outdated = false;
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = resource_find(call, RESOURCE_LAYOUT, &old, error);
	if (status == TW_OK)
		status = resource_is_outdated(call->store, &old, &outdated, error);
	if (status == TW_OK)
		status = outdated ? renew(call, &old, error) : resource_respond_wanted(call, &old, error);
	resource_clear(&old);
	return status;
}
