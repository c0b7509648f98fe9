#include "api/handlers.h"
#include "api/job_view.h"
#include "api/page.h"
#include "api/resource.h"
#include "solver/names.h"
#include "storage/bulk.h"
#include "storage/jobs.h"

#include <string.h>

/* Then a request that redrives many answers, and says that there are more. */
enum { REDRIVE_MS = 2000 };

static enum tw_status respond_job(struct api_call *call, struct tw_error *error)
{
	struct job job = {0};
	enum tw_status status = job_get(call->store, call->caller.owner.tenant, call->match.parameters[0], &job, error);
	if (status == TW_OK)
		status = response_json(&call->response, 200, job_show(&job), error);
	job_clear(&job);
	return status;
}

enum tw_status get_job(struct api_call *call, struct tw_error *error)
{
	enum tw_status status = query_only(&call->query, NULL, error);
	return status != TW_OK ? status : respond_job(call, error);
}

static enum tw_status parse_kind(const char *text, unsigned *kinds, struct tw_error *error)
{
	enum job_kind kind = JOB_IMPORT_MESH;
	const char *names[JOB_KINDS];
	*kinds = 0;
	if (!text)
		return TW_OK;
	if (job_kind_by_name(text, &kind)) {
		*kinds = JOB_KIND_BIT(kind);
		return TW_OK;
	}
	for (kind = JOB_IMPORT_MESH; kind < JOB_KINDS; kind++)
		names[kind] = job_kind_name(kind);
	return names_refuse(&(struct names){names, JOB_KINDS}, "kind of job", text, "invalid-parameter", "kind", error);
}

/* As a problem has it, or its last word alone. */
static const char *problem_slug(const char *text)
{
	static const char urn[] = "urn:tightwire:problem:";
	bool whole = text && !strncmp(text, urn, sizeof urn - 1);
	return whole ? text + sizeof urn - 1 : text;
}

enum tw_status list_jobs(struct api_call *call, struct tw_error *error)
{
	static const char *const known[] = {"kind", "state", "problem", "limit", "cursor", NULL};
	struct job_query query = {.tenant = call->caller.owner.tenant,
				  .failure_type = problem_slug(query_get(&call->query, "problem"))};
	struct job_page page = {0};
	enum tw_status status = query_only(&call->query, known, error);
	if (status == TW_OK)
		status = page_parameters(call, &query.limit, &query.cursor, error);
	if (status == TW_OK)
		status = job_states_parse(query_get(&call->query, "state"), &query.states, error);
	if (status == TW_OK)
		status = parse_kind(query_get(&call->query, "kind"), &query.kinds, error);
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
	call_job_added(call);
	return respond_job(call, error);
}

/* Failed ones where the request does not say. */
static enum tw_status parse_redrivable(const char *text, unsigned *states, struct tw_error *error)
{
	enum tw_status status = job_states_parse(text, states, error);
	if (status == TW_OK && !*states)
		*states = 1u << JOB_FAILED;
	if (status == TW_OK && *states & ~bulk_states(BULK_REDRIVE))
		status =
			tw_fail(error, TW_ERROR_INPUT, "invalid-parameter", "state",
				"only failed and cancelled jobs can be redriven; state is one of these, or both with a "
				"comma");
	return status;
}

static enum tw_status redrive_until(struct api_call *call, const struct job_query *query, int64_t until_ms,
				    struct bulk_progress *progress, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	while (status == TW_OK && !progress->done && call_now_ms() < until_ms) {
		uint64_t before = progress->changed;
		status = bulk_step(call->store, BULK_REDRIVE, query, progress, error);
		if (progress->changed > before)
			call_job_added(call);
	}
	return status;
}

enum tw_status redrive_jobs(struct api_call *call, struct tw_error *error)
{
	static const char *const known[] = {"kind", "state", "problem", NULL};
	struct job_query query = {.tenant = call->caller.owner.tenant,
				  .failure_type = problem_slug(query_get(&call->query, "problem"))};
	struct bulk_progress progress = {0};
	enum tw_status status = query_only(&call->query, known, error);
	if (status == TW_OK)
		status = parse_kind(query_get(&call->query, "kind"), &query.kinds, error);
	if (status == TW_OK)
		status = parse_redrivable(query_get(&call->query, "state"), &query.states, error);
	if (status == TW_OK)
		status = call_narrow_job_kinds(call, &query.kinds, error);
	if (status == TW_OK)
		status = redrive_until(call, &query, call_now_ms() + REDRIVE_MS, &progress, error);
	if (status != TW_OK)
		return status;
	json_t *json = json_pack("{s:I, s:b}", "redriven", (json_int_t)progress.changed, "more", !progress.done);
	return response_json(&call->response, 200, json, error);
}
