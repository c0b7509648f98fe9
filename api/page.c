#include "api/page.h"

#include <string.h>

#define PAGE_LIMIT_DEFAULT 50
#define PAGE_LIMIT_MAX 1000

enum tw_status page_parameters(const struct api_call *call, uint32_t *limit, int64_t *cursor, struct tw_error *error)
{
	int64_t number = 0;
	enum tw_status status =
		query_integer(&call->query, "limit", PAGE_LIMIT_DEFAULT, 1, PAGE_LIMIT_MAX, &number, error);
	*limit = (uint32_t)number;
	if (status == TW_OK)
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
