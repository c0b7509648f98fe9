#include "api/page.h"

#include "api/veil.h"

#include <string.h>

#define PAGE_LIMIT_DEFAULT 50
#define PAGE_LIMIT_MAX 1000

static enum tw_status parse_cursor(const struct api_call *call, int64_t *cursor, struct tw_error *error)
{
	const char *text = query_get(&call->query, "cursor");
	*cursor = 0;
	if (!text || veil_parse(call->caller.veil, text, cursor))
		return TW_OK;
	return tw_fail(error, TW_ERROR_INPUT, "invalid-parameter", "cursor",
		       "this is no cursor of this list; follow the link \"next\" of a page");
}

enum tw_status page_parameters(const struct api_call *call, uint32_t *limit, int64_t *cursor, struct tw_error *error)
{
	int64_t number = 0;
	enum tw_status status =
		query_integer(&call->query, "limit", PAGE_LIMIT_DEFAULT, 1, PAGE_LIMIT_MAX, &number, error);
	*limit = (uint32_t)number;
	if (status == TW_OK)
		status = parse_cursor(call, cursor, error);
	return status;
}

enum tw_status page_respond(struct api_call *call, json_t *items, int64_t next, struct tw_error *error)
{
	char text[VEIL_TEXT_SIZE];
	veil_print(call->caller.veil, next, text);
	return page_respond_text(call, items, next ? text : NULL, error);
}

enum tw_status page_respond_text(struct api_call *call, json_t *items, const char *next, struct tw_error *error)
{
	json_t *page = json_object();
	json_object_set_new(page, "items", items);
	if (!next) {
		json_object_set_new(page, "next", json_null());
		return response_json(&call->response, 200, page, error);
	}
	/* The same query with another cursor. */
	char link[3 * QUERY_TEXT_MAX + 64], value[3 * QUERY_TEXT_MAX + 1];
	size_t used = (size_t)snprintf(link, sizeof link, "%s?cursor=%s", call->query.path, next);
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
