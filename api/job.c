#include "api/handlers.h"
#include "api/job_query.h"
#include "api/job_view.h"
#include "api/page.h"
#include "api/resource.h"
#include "storage/attempt.h"
#include "storage/jobs.h"

#include <stdlib.h>

static enum tw_status add_history(struct api_call *call, json_t *json, const char *id, struct tw_error *error)
{
	struct attempt *attempts = NULL;
	size_t count = 0;
	json_t *list = json_array();
	enum tw_status status = attempt_list(call->store, id, &attempts, &count, error);
	for (size_t i = 0; status == TW_OK && i < count; i++)
		json_array_append_new(list, job_show_attempt(&attempts[i]));
	json_object_set_new(json, "history", list);
	free(attempts);
	return status;
}

static enum tw_status respond_job(struct api_call *call, struct tw_error *error)
{
	struct job job = {0};
	enum tw_status status = job_get(call->store, call->caller.owner.tenant, call->match.parameters[0], &job, error);
	json_t *json = status == TW_OK ? job_show(&job) : NULL;
	if (status == TW_OK)
		status = add_history(call, json, job.id, error);
	job_clear(&job);
	if (status == TW_OK)
		return response_json(&call->response, 200, json, error);
	json_decref(json);
	return status;
}

enum tw_status get_job(struct api_call *call, struct tw_error *error)
{
	enum tw_status status = query_only(&call->query, NULL, error);
	return status != TW_OK ? status : respond_job(call, error);
}

enum tw_status list_jobs(struct api_call *call, struct tw_error *error)
{
	static const char *const more[] = {"limit", "cursor", NULL};
	struct job_query query;
	struct job_page page = {0};
	enum tw_status status = job_query_parse(call, more, &query, error);
	if (status == TW_OK)
		status = page_parameters(call, &query.limit, &query.cursor, error);
	if (status == TW_OK)
		status = job_list(call->store, &query, &page, error);
	if (status != TW_OK)
		return status;
	json_t *items = json_array();
	for (size_t i = 0; i < page.count; i++)
		json_array_append_new(items, job_show(&page.jobs[i]));
	int64_t next = page.next;
	job_page_clear(&page);
	return page_respond(call, items, next, error);
}

/* Whether the caller may end or redrive the job that the path names. */
static enum tw_status check_scope(struct api_call *call, struct tw_error *error)
{
	struct job job = {0};
	enum tw_status status = job_get(call->store, call->caller.owner.tenant, call->match.parameters[0], &job, error);
	if (status == TW_OK)
		status = call_check_job_kind(call, job.kind, error);
	job_clear(&job);
	return status;
}

enum tw_status cancel_job(struct api_call *call, struct tw_error *error)
{
	enum job_state state = JOB_QUEUED;
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = check_scope(call, error);
	if (status == TW_OK)
		status = job_cancel(call->store, call->caller.owner.tenant, call->match.parameters[0], &state, error);
	if (status != TW_OK)
		return status;
	call_job_asked(call);
	return respond_job(call, error);
}

enum tw_status redrive_job(struct api_call *call, struct tw_error *error)
{
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = check_scope(call, error);
	if (status == TW_OK)
		status = job_redrive(call->store, call->caller.owner.tenant, call->match.parameters[0], error);
	if (status != TW_OK)
		return status;
	call_job_added(call, true);
	return respond_job(call, error);
}
