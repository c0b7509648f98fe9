#include "api/resource.h"

#include "api/job_view.h"
#include "api/page.h"
#include "api/resource_view.h"

#include <string.h>

enum tw_status resource_find(struct api_call *call, enum resource_kind kind, struct resource *resource,
			     struct tw_error *error)
{
	bool nested = resource_kind_is_nested(kind);
	const char *id = call->match.parameters[nested];
	enum tw_status status = resource_get(call->store, call->caller.owner.tenant, kind, id, resource, error);
	if (status != TW_OK || !nested)
		return status;
	char parent[STORE_ID_SIZE];
	enum resource_kind parent_kind = resource_kind_row(kind)->needs[0].kind;
	status = resource_first_need(call, id, parent_kind, parent, error);
	if (status == TW_OK && strcmp(parent, call->match.parameters[0]) != 0)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-resource", NULL, "the %s %.40s has no %s %.40s",
				 resource_kind_name(parent_kind), call->match.parameters[0], resource_kind_name(kind),
				 id);
	if (status != TW_OK)
		resource_clear(resource);
	return status;
}

static enum tw_status respond_resource(struct api_call *call, unsigned http_status, const struct resource *resource,
				       struct tw_error *error)
{
	json_t *json = NULL;
	enum tw_status status = resource_show(call, resource, true, &json, error);
	return status != TW_OK ? status : response_json(&call->response, http_status, json, error);
}

enum tw_status resource_respond(struct api_call *call, enum resource_kind kind, struct tw_error *error)
{
	struct resource resource = {0};
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = resource_find(call, kind, &resource, error);
	if (status == TW_OK)
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
	if (status == TW_OK && dependents && strcmp(dependents, "true") != 0 && strcmp(dependents, "false") != 0)
		status = tw_fail(error, TW_ERROR_INPUT, "invalid-parameter", "dependents",
				 "dependents is true or false");
	if (status == TW_OK)
		status = resource_find(call, kind, &resource, error);
	if (status == TW_OK)
		status = resource_delete(call->store, call->caller.owner.tenant, kind, resource.id,
					 dependents && !strcmp(dependents, "true"), error);
	if (status == TW_OK) {
		call_job_asked(call);
		response_empty(&call->response, 204);
	}
	resource_clear(&resource);
	return status;
}

static enum tw_status show_page(struct api_call *call, const struct resource_page *page, json_t *items,
				struct tw_error *error)
{
	for (size_t i = 0; i < page->count; i++) {
		json_t *item = NULL;
		enum tw_status status = resource_show(call, &page->resources[i], false, &item, error);
		if (status != TW_OK)
			return status;
		json_array_append_new(items, item);
	}
	return TW_OK;
}

enum tw_status resource_respond_list(struct api_call *call, enum resource_kind kind, const char *needs,
				     const char *filter, struct tw_error *error)
{
	const char *const known[] = {"state", "limit", "cursor", filter, NULL};
	struct resource_query query = {.tenant = call->caller.owner.tenant, .kind = kind, .needs = needs};
	if (filter)
		query.needs = query_get(&call->query, filter);
	struct resource_page page = {0};
	enum tw_status status = query_only(&call->query, known, error);
	if (status == TW_OK)
		status = page_parameters(call, &query.limit, &query.cursor, error);
	if (status == TW_OK)
		status = job_states_parse(query_get(&call->query, "state"), &query.states, error);
	if (status == TW_OK)
		status = resource_list(call->store, &query, &page, error);
	json_t *items = json_array();
	if (status == TW_OK)
		status = show_page(call, &page, items, error);
	int64_t next = page.next;
	resource_page_clear(&page);
	if (status == TW_OK)
		return page_respond(call, items, next, error);
	json_decref(items);
	return status;
}

/* 200 says that the job has ended, whatever its end: a resource that failed is there, with its problem, and a request
 * for the same again answers alike, with or without waiting. */
static enum tw_status respond_created(struct api_call *call, const struct resource *resource, struct tw_error *error)
{
	json_t *json = NULL;
	bool is_final = job_state_is_final(resource->job.state);
	enum tw_status status = resource_show(call, resource, is_final, &json, error);
	if (status != TW_OK)
		return status;
	response_header(&call->response, "Location", "%s", json_string_value(json_object_get(json, "href")));
	if (!is_final)
		response_header(&call->response, "Retry-After", "1");
	return response_json(&call->response, is_final ? 200 : 202, json, error);
}

/* Answers for a resource whose creator has waited: with what it is now. */
static enum tw_status respond_awaited(struct api_call *call, struct tw_error *error)
{
	struct resource resource = {0};
	enum tw_status status = resource_get(call->store, call->caller.owner.tenant, call->wait.kind,
					     call->wait.resource_id, &resource, error);
	if (status == TW_OK)
		status = respond_created(call, &resource, error);
	resource_clear(&resource);
	return status;
}

static void say_applied(struct api_call *call, uint32_t wait_s)
{
	char wait[24] = "";
	bool cancels = call->submit.queue.transient;
	if (wait_s)
		snprintf(wait, sizeof wait, "wait=%u%s", wait_s, cancels ? ", " : "");
	if (wait_s || cancels)
		response_header(&call->response, "Preference-Applied", "%s%s", wait,
				cancels ? "on_disconnect=cancel" : "");
}

/* Prefer: wait. The connection is held for the job, at most as long as the service allows. */
static void hold(struct api_call *call, const struct resource *resource)
{
	uint32_t wait_s = call->submit.wait_s;
	if (wait_s > call->settings->wait_limit_s)
		wait_s = call->settings->wait_limit_s;
	if (wait_s && !call_may_hold(call))
		wait_s = 0;
	say_applied(call, wait_s);
	if (!wait_s || job_state_is_final(resource->job.state))
		return;
	call->wait.kind = resource->kind;
	memcpy(call->wait.resource_id, resource->id, STORE_ID_SIZE);
	call_hold(call, &resource->job, wait_s, respond_awaited);
}

enum tw_status resource_respond_wanted(struct api_call *call, const struct resource *resource, struct tw_error *error)
{
	hold(call, resource);
	return call->wait.respond ? TW_OK : respond_created(call, resource, error);
}

/* Jobs that profit from what one worker has in memory: of what is made from the same, and dragged by the same hand. */
static struct job_request queue_of(const struct api_call *call, const struct resource_draft *draft)
{
	struct job_request queue = call->submit.queue;
	queue.weight = call->caller.key ? call->caller.key->weight : 0;
	if (draft->need_count)
		queue.affinity = job_affinity(draft->needs[0], queue.session);
	return queue;
}

enum tw_status resource_submit(struct api_call *call, const struct resource_draft *draft, struct resource *resource,
			       struct tw_error *error)
{
	struct resource_draft queued = *draft;
	enum resource_outcome outcome = RESOURCE_CREATED;
	queued.queue = queue_of(call, draft);
	enum tw_status status = resource_create(call->store, &queued, resource, &outcome, error);
	if (status != TW_OK)
		return status;
	if (queued.queue.supersedes)
		call_job_asked(call);
	if (outcome != RESOURCE_EXISTED)
		call_job_added(call, queued.queue.class == JOB_INTERACTIVE);
	return TW_OK;
}

enum tw_status resource_respond_create(struct api_call *call, const struct resource_draft *draft,
				       struct tw_error *error)
{
	struct resource resource = {0};
	enum tw_status status = resource_submit(call, draft, &resource, error);
	if (status != TW_OK)
		return status;
	body_upload_release(&call->upload);
	status = resource_respond_wanted(call, &resource, error);
	resource_clear(&resource);
	return status;
}
