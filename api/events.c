/* A job as server-sent events (WHATWG HTML, 9.2): its state now, then every change that is noticed, to the last. The
 * server asks again and again; what has not changed since gives nothing, and now and then a comment, so that proxies
 * and clients see that the connection lives. */
#include "api/handlers.h"
#include "api/header.h"
#include "api/job_view.h"
#include "api/veil.h"
#include "storage/jobs.h"

#include <stdlib.h>
#include <string.h>

#define COMMENT_MS 15000

struct event_stream {
	struct api_stream stream;
	struct store *store; /* borrowed: of the thread that sends */
	struct api *api;     /* borrowed */
	struct api_pass pass;
	int64_t tenant;
	uint8_t veil[ACCESS_VEIL_SIZE];
	char id[ROUTE_PARAMETER_SIZE];
	int64_t change; /* of the job as it was sent last */
	bool is_final;  /* the last event is in `text` */
	int64_t comment_at_ms;
	char *text; /* owned; what is being sent */
	size_t size, used;
};

static enum tw_status set_text(struct event_stream *events, char *text)
{
	free(events->text);
	events->text = text;
	events->size = text ? strlen(text) : 0;
	events->used = 0;
	events->comment_at_ms = call_now_ms() + COMMENT_MS;
	return text ? TW_OK : TW_ERROR_MEMORY;
}

static enum tw_status print_event(struct event_stream *events, const struct job *job)
{
	char *event = NULL, id[VEIL_TEXT_SIZE];
	json_t *json = job_show(job);
	char *data = json ? json_dumps(json, JSON_COMPACT) : NULL;
	json_decref(json);
	veil_print(events->veil, job->change, id);
	if (data && asprintf(&event, "id: %s\nevent: job\ndata: %s\n\n", id, data) < 0)
		event = NULL;
	free(data);
	return set_text(events, event);
}

/* Makes the next text, or leaves it empty where nothing has happened. A job that was deleted ends the stream, and so
 * does a key that was revoked. */
static enum tw_status refill(struct event_stream *events)
{
	struct job job = {0};
	if (!api_pass_is_good(events->api, &events->pass)) {
		events->is_final = true;
		return TW_OK;
	}
	enum tw_status status = job_get(events->store, events->tenant, events->id, &job, NULL);
	if (status == TW_ERROR_NOT_FOUND) {
		events->is_final = true;
		return TW_OK;
	}
	if (status == TW_OK && job.change != events->change) {
		events->change = job.change;
		events->is_final = job_state_is_final(job.state);
		status = print_event(events, &job);
	} else if (status == TW_OK && call_now_ms() >= events->comment_at_ms) {
		status = set_text(events, strdup(":\n\n"));
	}
	job_clear(&job);
	return status;
}

static enum tw_status read_events(struct api_stream *stream, uint64_t offset, void *bytes, size_t size, size_t *got)
{
	struct event_stream *events = (struct event_stream *)stream;
	(void)offset;
	enum tw_status status = events->used < events->size || events->is_final ? TW_OK : refill(events);
	size_t left = events->size - events->used;
	*got = left < size ? left : size;
	if (*got)
		memcpy(bytes, events->text + events->used, *got);
	events->used += *got;
	stream->is_waiting = !*got && !events->is_final;
	return status;
}

static void close_events(struct api_stream *stream)
{
	struct event_stream *events = (struct event_stream *)stream;
	free(events->text);
	free(events);
}

/* A page's EventSource can send no headers. */
static enum tw_status read_preference(struct api_call *call, struct tw_error *error)
{
	const char *text = query_get(&call->query, "on_disconnect");
	if (text && strcmp(text, "cancel") != 0 && strcmp(text, "keep") != 0)
		return tw_fail(error, TW_ERROR_INPUT, "invalid-parameter", "on_disconnect",
			       "on_disconnect is cancel or keep");
	call->submit.queue.transient =
		text ? !strcmp(text, "cancel") : header_prefers(call_header(call, "Prefer"), "on_disconnect", "cancel");
	return TW_OK;
}

enum tw_status get_job_events(struct api_call *call, struct tw_error *error)
{
	static const char *const known[] = {"on_disconnect", NULL};
	struct job job = {0};
	enum tw_status status = query_only(&call->query, known, error);
	if (status == TW_OK)
		status = read_preference(call, error);
	if (status == TW_OK)
		status = job_get(call->store, call->caller.owner.tenant, call->match.parameters[0], &job, error);
	/* Who leaves cancels then. */
	if (status == TW_OK && call->submit.queue.transient)
		status = call_check_job_kind(call, job.kind, error);
	int64_t requests = job.transient;
	job_clear(&job);
	if (status != TW_OK)
		return status;
	if (!call_may_hold(call))
		return tw_fail(error, TW_ERROR_LIMIT, "too-many-waiting", NULL,
			       "too many clients wait for jobs now; try again in a moment, or ask for the job itself");
	struct event_stream *events = calloc(1, sizeof *events);
	if (!events)
		return tw_fail_memory(error);
	events->stream = (struct api_stream){.size = API_STREAM_UNKNOWN, .read = read_events, .close = close_events};
	events->store = call->store;
	events->api = call->api;
	events->pass = api_pass_of(&call->caller);
	events->tenant = call->caller.owner.tenant;
	memcpy(events->veil, call->caller.veil, sizeof events->veil);
	events->change = -1;
	memcpy(events->id, call->match.parameters[0], sizeof events->id);
	response_header(&call->response, "Cache-Control", "no-store");
	response_header(&call->response, "X-Accel-Buffering", "no");
	waiting_join(api_waiting(call->api), &call->waiter, events->id, requests);
	response_stream(&call->response, "text/event-stream", &events->stream);
	return TW_OK;
}
