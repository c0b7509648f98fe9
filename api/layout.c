/* Layouts: the request that solver/layout/request.h describes in, with the field that it is for; artifacts out. */
#include "api/content.h"
#include "api/drawing.h"
#include "api/handlers.h"
#include "api/resource.h"
#include "solver/layout/request.h"
#include "solver/option_json.h"

#include <stdlib.h>
#include <string.h>

#define IDEMPOTENCY_KEY_MAX 255

static enum tw_status check_field_exists(struct api_call *call, const char *id, struct tw_error *error)
{
	struct resource field = {0};
	if (!id)
		return tw_fail(error, TW_ERROR_INPUT, "json-missing-field", "/field",
			       "field is missing; give the id of a field");
	enum tw_status status = resource_get(call->store, call->caller.owner.tenant, RESOURCE_FIELD, id, &field, error);
	resource_clear(&field);
	if (status == TW_ERROR_NOT_FOUND)
		return tw_fail(error, TW_ERROR_INPUT, "no-such-field", "/field",
			       "there is no such field; make it with POST /v1/fields");
	return status;
}

static enum tw_status find_idempotency_key(const struct api_call *call, const char **key, struct tw_error *error)
{
	*key = call_header(call, "Idempotency-Key");
	if (!*key || (**key && strlen(*key) <= IDEMPOTENCY_KEY_MAX))
		return TW_OK;
	return tw_fail(error, TW_ERROR_INPUT, "malformed-header", "Idempotency-Key", "the key has 1 to %d characters",
		       IDEMPOTENCY_KEY_MAX);
}

/* Without white space and with its members in one order, so that the same request always has the same bytes. */
static enum tw_status print_canonical(json_t *body, char **text, struct tw_error *error)
{
	*text = json_dumps(body, JSON_COMPACT | JSON_SORT_KEYS);
	json_decref(body);
	return *text ? TW_OK : tw_fail_memory(error);
}

/* The request as the worker will read it and as it can be computed again a year later; and as it was written, because
 * that is what releases have in common. */
static enum tw_status read_request(const struct api_call *call, char **options, char **asked, struct tw_error *error)
{
	json_t *body = NULL;
	enum tw_status status = option_json_parse(&body, call->body, call->body_size, error);
	if (status == TW_OK)
		status = print_canonical(body, options, error);
	if (status == TW_OK)
		status = option_json_parse_as_written(&body, call->body, call->body_size, error);
	return status == TW_OK ? print_canonical(body, asked, error) : status;
}

static enum tw_status create_layout(struct api_call *call, const char *field, struct tw_error *error)
{
	char *options = NULL, *asked = NULL;
	const char *needs[] = {field};
	struct resource_draft draft = {
		.owner = call->caller.owner, .kind = RESOURCE_LAYOUT, .needs = needs, .need_count = 1};
	enum tw_status status = find_idempotency_key(call, &draft.idempotency_key, error);
	if (status == TW_OK)
		status = read_request(call, &options, &asked, error);
	draft.options = options;
	draft.asked = asked;
	if (status == TW_OK)
		status = resource_respond_create(call, &draft, error);
	free(options);
	free(asked);
	return status;
}

enum tw_status post_layout(struct api_call *call, struct tw_error *error)
{
	struct layout_request request = {0};
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = layout_request_parse(&request, call->body ? call->body : "", call->body_size, error);
	if (status != TW_OK)
		return status;
	status = check_field_exists(call, request.field, error);
	if (status == TW_OK)
		status = create_layout(call, request.field, error);
	layout_request_clear(&request);
	return status;
}

enum tw_status list_layouts(struct api_call *call, struct tw_error *error)
{
	return resource_respond_list(call, RESOURCE_LAYOUT, NULL, "field", error);
}

enum tw_status get_layout(struct api_call *call, struct tw_error *error)
{
	return resource_respond(call, RESOURCE_LAYOUT, error);
}

enum tw_status get_layout_artifact(struct api_call *call, struct tw_error *error)
{
	return content_respond(call, RESOURCE_LAYOUT, BLOB_ARTIFACT, drawing_respond, error);
}

enum tw_status delete_layout(struct api_call *call, struct tw_error *error)
{
	return resource_respond_delete(call, RESOURCE_LAYOUT, error);
}
