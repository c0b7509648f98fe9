#include "api/handlers.h"
#include "api/job_view.h"
#include "api/page.h"
#include "api/resource.h"
#include "storage/jobs.h"

static enum tw_status respond_job(struct api_call *call, struct tw_error *error)
{
	struct job job = {0};
	enum tw_status status = job_get(call->store, call->match.parameters[0], &job, error);
	if (!status)
		status = response_json(&call->response, 200, job_show(&job), error);
	job_clear(&job);
	return status;
}

enum tw_status get_job(struct api_call *call, struct tw_error *error)
{
	enum tw_status status = query_only(&call->query, NULL, error);
	return status ? status : respond_job(call, error);
}

static enum tw_status parse_kind(const char *text, unsigned *kinds, struct tw_error *error)
{
	enum job_kind kind = JOB_IMPORT_MESH;
	*kinds = 0;
	if (!text)
		return TW_OK;
	if (!job_kind_by_name(text, &kind))
		return tw_fail(error, TW_ERROR_INPUT, "invalid-parameter", "kind",
			       "kind is one of import_mesh, import_motion, compute_field, compute_layout and record");
	*kinds = JOB_KIND_BIT(kind);
	return TW_OK;
}

enum tw_status list_jobs(struct api_call *call, struct tw_error *error)
{
	static const char *const known[] = {"kind", "state", "limit", "cursor", NULL};
	struct job_query query = {0};
	struct job_page page = {0};
	enum tw_status status = query_only(&call->query, known, error);
	if (!status)
		status = page_parameters(call, &query.limit, &query.cursor, error);
	if (!status)
		status = job_states_parse(query_get(&call->query, "state"), &query.states, error);
	if (!status)
		status = parse_kind(query_get(&call->query, "kind"), &query.kinds, error);
	if (!status)
		status = job_list(call->store, &query, &page, error);
	if (status)
		return status;
	json_t *items = json_array();
	for (size_t i = 0; i < page.count; i++)
		json_array_append_new(items, job_show(&page.jobs[i]));
	int64_t next = page.next;
	job_page_clear(&page);
	return page_respond(call, items, next, error);
}

enum tw_status cancel_job(struct api_call *call, struct tw_error *error)
{
	enum job_state state = JOB_QUEUED;
	enum tw_status status = query_only(&call->query, NULL, error);
	if (!status)
		status = job_cancel(call->store, call->match.parameters[0], &state, error);
	return status ? status : respond_job(call, error);
}

enum tw_status redrive_job(struct api_call *call, struct tw_error *error)
{
	enum tw_status status = query_only(&call->query, NULL, error);
	if (!status)
		status = job_redrive(call->store, call->match.parameters[0], error);
	if (status)
		return status;
	call_job_added(call);
	return respond_job(call, error);
}
