#include "api/call.h"

#include "api/header.h"
#include "api/problem.h"

#include <string.h>
#include <time.h>

const char *call_header(const struct api_call *call, const char *name)
{
	return call->request.header ? call->request.header(call->request.context, name) : NULL;
}

bool call_may_write(struct api_call *call)
{
	call->must_write = true;
	return call->may_write;
}

void call_hold(struct api_call *call, const struct job *job, uint32_t wait_s,
	       enum tw_status (*respond)(struct api_call *call, struct tw_error *error))
{
	waiting_join(api_waiting(call->api), &call->waiter, job->id, job->transient);
	call->wait.respond = respond;
	call->wait.until_ms = call_now_ms() + 1000 * (int64_t)wait_s;
}

bool call_may_hold(const struct api_call *call)
{
	const struct api_hooks *hooks = &call->settings->hooks;
	return !hooks->may_hold || hooks->may_hold(hooks->context);
}

void call_job_added(const struct api_call *call, bool is_interactive)
{
	const struct api_hooks *hooks = &call->settings->hooks;
	if (hooks->job_added)
		hooks->job_added(hooks->context, is_interactive);
}

void call_job_asked(const struct api_call *call)
{
	const struct api_hooks *hooks = &call->settings->hooks;
	if (hooks->job_asked)
		hooks->job_asked(hooks->context);
}

/* Some of 500 and above are no fault of the service: a version or method that it does not speak (505, 501), a limit
 * that is reached (503), a disk that is full (507), which the metrics tell. */
static bool is_own_fault(const struct tw_error *error)
{
	switch (error->status) {
	case TW_ERROR_INPUT:
	case TW_ERROR_UNSUPPORTED:
	case TW_ERROR_LIMIT:
	case TW_ERROR_FULL:
		return false;
	default:
		return problem_status(error) >= 500;
	}
}

void call_failed(const struct api_call *call, const char *request_id, const struct tw_error *error)
{
	const struct api_hooks *hooks = &call->settings->hooks;
	if (hooks->failed && is_own_fault(error))
		hooks->failed(hooks->context, request_id, error);
}

bool call_is_unchanged(struct api_call *call, const char *etag)
{
	response_header(&call->response, "ETag", "\"%s\"", etag);
	if (!header_matches_etag(call_header(call, "If-None-Match"), response_get_header(&call->response, "ETag")))
		return false;
	response_empty(&call->response, 304);
	return true;
}

enum tw_status call_check_accept(const struct api_call *call, const char *media_type, struct tw_error *error)
{
	if (header_accepts(call_header(call, "Accept"), media_type))
		return TW_OK;
	return tw_fail(error, TW_ERROR_UNSUPPORTED, "not-acceptable", "Accept", "this resource is %s only", media_type);
}

enum tw_status call_refuse_scope(const struct api_call *call, unsigned scopes, struct tw_error *error)
{
	char needed[KEY_SCOPES_SIZE], has[KEY_SCOPES_SIZE];
	key_print_scopes(scopes, needed);
	key_print_scopes(call->caller.scopes, has);
	char *comma = strchr(needed, ',');
	return tw_fail(error, TW_ERROR_INPUT, "missing-scope", "Authorization",
		       "this needs a key with the scope %.*s%s%s; yours has %s",
		       comma ? (int)(comma - needed) : KEY_SCOPES_SIZE, needed, comma ? " or " : "",
		       comma ? comma + 1 : "", has);
}

unsigned call_job_scope(enum job_kind kind)
{
	return kind == JOB_RECORD ? KEY_RIG : KEY_SUBMIT;
}

enum tw_status call_check_job_kind(const struct api_call *call, enum job_kind kind, struct tw_error *error)
{
	unsigned scope = call_job_scope(kind);
	return call->caller.scopes & scope ? TW_OK : call_refuse_scope(call, scope, error);
}

enum tw_status call_narrow_job_kinds(const struct api_call *call, unsigned *kinds, struct tw_error *error)
{
	unsigned allowed = 0, asked = *kinds ? *kinds : JOB_KINDS_ALL, needed = 0;
	for (enum job_kind kind = 0; kind < JOB_KINDS; kind++) {
		if (call->caller.scopes & call_job_scope(kind))
			allowed |= JOB_KIND_BIT(kind);
		if (asked & JOB_KIND_BIT(kind))
			needed |= call_job_scope(kind);
	}
	*kinds = asked & allowed;
	return *kinds ? TW_OK : call_refuse_scope(call, needed, error);
}

int64_t call_now_ms(void)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}
