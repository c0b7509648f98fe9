/* What is done to many jobs at once, in steps, for a while; the client asks again where there are more. */
#include "api/handlers.h"
#include "api/job_query.h"
#include "api/job_view.h"
#include "storage/bulk.h"

/* Then a request answers, and says that there are more. */
enum { BULK_MS = 2000 };

/* Which jobs, and what is said of them. */
struct bulk {
	enum bulk_action action;
	const char *done; /* "redriven" */
	unsigned states;  /* where the request names none */
	void (*tell)(const struct api_call *call);
};

static void tell_added(const struct api_call *call)
{
	call_job_added(call, true);
}

static enum tw_status check_states(const struct bulk *bulk, struct job_query *query, struct tw_error *error)
{
	unsigned possible = bulk_states(bulk->action);
	if (!query->states)
		query->states = bulk->states;
	if (!(query->states & ~possible))
		return TW_OK;
	return tw_fail(error, TW_ERROR_INPUT, "invalid-parameter", "state",
		       "only %s jobs can be %s; state is one of these, or both with a comma",
		       bulk->action == BULK_CANCEL ? "queued and running" : "failed and cancelled", bulk->done);
}

static enum tw_status go_on(struct api_call *call, const struct bulk *bulk, const struct job_query *query,
			    struct bulk_progress *progress, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	int64_t until_ms = call_now_ms() + BULK_MS;
	while (status == TW_OK && !progress->done && call_now_ms() < until_ms) {
		uint64_t before = progress->changed;
		status = bulk_step(call->store, bulk->action, query, progress, error);
		if (progress->changed > before)
			bulk->tell(call);
	}
	return status;
}

static enum tw_status respond(struct api_call *call, const struct bulk *bulk, struct tw_error *error)
{
	struct job_query query;
	struct bulk_progress progress = {0};
	enum tw_status status = job_query_parse(call, NULL, &query, error);
	if (status == TW_OK)
		status = check_states(bulk, &query, error);
	if (status == TW_OK)
		status = call_narrow_job_kinds(call, &query.kinds, error);
	if (status == TW_OK)
		status = go_on(call, bulk, &query, &progress, error);
	if (status != TW_OK)
		return status;
	json_t *json = json_pack("{s:I, s:b}", bulk->done, (json_int_t)progress.changed, "more", !progress.done);
	return response_json(&call->response, 200, json, error);
}

enum tw_status redrive_jobs(struct api_call *call, struct tw_error *error)
{
	static const struct bulk redrive = {BULK_REDRIVE, "redriven", 1u << JOB_FAILED, tell_added};
	return respond(call, &redrive, error);
}

/* Which ones, has to be said: nobody means all of them. */
enum tw_status cancel_jobs(struct api_call *call, struct tw_error *error)
{
	static const struct bulk cancel = {BULK_CANCEL, "cancelled", 0, call_job_asked};
	if (call->query.pair_count == 0)
		return tw_fail(error, TW_ERROR_INPUT, "invalid-parameter", NULL,
			       "say which jobs: by kind, state, class, group or older_than; all of them are "
			       "?state=queued,running");
	return respond(call, &cancel, error);
}
