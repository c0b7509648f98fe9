#include "api/drawing.h"

#include "api/drawing_list.h"
#include "api/header.h"
#include "api/job_view.h"
#include "api/resource_view.h"
#include "solver/layout/request.h"
#include "storage/jobs.h"
#include "storage/task.h"

/* Somebody waits for it: so it is interactive; and whoever leaves does not want it, unless others wait. */
static struct job_request queue_of(const char *field, bool is_async)
{
	return (struct job_request){
		.class = JOB_INTERACTIVE,
		.affinity = job_affinity(field, NULL),
		.transient = !is_async,
	};
}

static enum tw_status ask(struct api_call *call, const struct resource *layout, const char *name, bool is_async,
			  struct job *job, struct tw_error *error)
{
	char field[STORE_ID_SIZE];
	bool added = false;
	enum tw_status status = resource_first_need(call, layout->id, RESOURCE_FIELD, field, error);
	if (status != TW_OK)
		return status;
	const struct job_request queue = queue_of(field, is_async);
	status = task_ask(call->store, call->caller.owner, JOB_DRAW, layout->id, name, &queue, job, &added, error);
	if (status == TW_OK && added)
		call_job_added(call, true);
	return status;
}

static enum tw_status fail_as_job(const struct job *job, struct tw_error *error)
{
	if (job->state == JOB_FAILED)
		return tw_fail(error, job->failure.status, "drawing-failed", NULL,
			       "the job %s, which was to draw it, failed: %.300s (it can be redriven)", job->id,
			       job->failure.text);
	return tw_fail(error, TW_ERROR_LIMIT, "drawing-queued", NULL,
		       "the drawing is not made yet: the job %s is %s; ask again in a moment", job->id,
		       job_state_name(job->state));
}

static uint32_t wait_of(const struct api_call *call)
{
	const char *prefer = call_header(call, "Prefer");
	uint32_t limit_s = call->settings->wait_limit_s;
	uint32_t wait_s = header_prefer_wait_s(prefer);
	return wait_s && wait_s < limit_s ? wait_s : limit_s;
}

/* Once the job has ended, or the time is over: the file, or why there is none. */
static enum tw_status respond_awaited(struct api_call *call, struct tw_error *error)
{
	return content_respond(call, RESOURCE_LAYOUT, BLOB_ARTIFACT, drawing_respond, error);
}

static enum tw_status refuse_awaited(struct api_call *call, struct tw_error *error)
{
	struct job job = {0};
	enum tw_status status = job_get(call->store, call->caller.owner.tenant, call->waiter.job_id, &job, error);
	if (status == TW_OK)
		status = fail_as_job(&job, error);
	job_clear(&job);
	return status;
}

static enum tw_status respond_job(struct api_call *call, const struct job *job, struct tw_error *error)
{
	response_header(&call->response, "Preference-Applied", "respond-async");
	response_header(&call->response, "Location", "/v1/jobs/%s", job->id);
	return response_json(&call->response, 202, job_show(job), error);
}

static enum tw_status make(struct api_call *call, const struct resource *layout, const char *name,
			   struct tw_error *error)
{
	struct job job = {0};
	bool is_async = header_prefers(call_header(call, "Prefer"), "respond-async", NULL);
	uint32_t wait_s = wait_of(call);
	enum tw_status status = ask(call, layout, name, is_async, &job, error);
	if (status != TW_OK)
		return status;
	if (is_async && job.state != JOB_FAILED) {
		status = respond_job(call, &job, error);
	} else if (job.state == JOB_FAILED || !wait_s || !call_may_hold(call)) {
		status = fail_as_job(&job, error);
	} else {
		call->submit.queue.transient = true;
		call_hold(call, &job, wait_s, respond_awaited);
	}
	job_clear(&job);
	return status;
}

enum tw_status drawing_respond(struct api_call *call, const struct resource *layout, const char *name, bool *known,
			       struct tw_error *error)
{
	const char *media_type = layout_file_media_type(name);
	enum tw_status status = drawing_is_possible(call, layout, known, error);
	if (status != TW_OK || !*known)
		return status;
	if (!media_type)
		return drawing_refuse_name(name, error);
	if (call->wait.respond)
		return refuse_awaited(call, error);
	status = call_check_accept(call, media_type, error);
	if (status != TW_OK || !call_may_write(call))
		return status;
	return make(call, layout, name, error);
}
