/* What a handler sees of a request. A handler parses, checks, makes one storage call and responds; it returns an error
 * instead of responding, which becomes a problem. Known only within api/. */
#ifndef API_CALL_H
#define API_CALL_H

#include "api/api.h"
#include "api/caller.h"
#include "api/query.h"
#include "api/request.h"
#include "api/response.h"
#include "api/route.h"
#include "api/submit.h"
#include "api/upload.h"
#include "api/waiting.h"
#include "storage/resources.h"

struct api_call {
	struct api *api;                     /* borrowed */
	const struct api_settings *settings; /* borrowed, of this request's policy */
	struct store *store;                 /* borrowed: this thread's */
	struct caller caller;
	struct api_request request;
	struct submit submit; /* of POST: how a job that it starts is queued */
	struct query query;
	struct route_match match; /* match.parameters[0] is the path's first {…} */
	char *body;               /* ROUTE_JSON: [body_size], owned */
	size_t body_size;
	struct body_upload upload; /* ROUTE_UPLOAD: sealed when the handler runs */
	struct api_response response;

	bool may_write;  /* the handler is called where it may wait for the store's writer */
	bool must_write; /* set by call_may_write */

	/* Set by a handler that wants the connection held, by call_hold: it has not responded yet. */
	struct waiter waiter;
	struct {
		/* Responds once the job has ended or the time is over; it only reads. NULL: nothing is waited for. */
		enum tw_status (*respond)(struct api_call *call, struct tw_error *error);
		char resource_id[STORE_ID_SIZE]; /* what respond may want to know */
		enum resource_kind kind;
		int64_t until_ms; /* CLOCK_MONOTONIC */
	} wait;
};

/* The header's value, NULL where there is none. */
const char *call_header(const struct api_call *call, const char *name);

/* Whether the handler of a request that usually only reads may write to the store now. Where not, it returns TW_OK
 * without an answer, and is called once more where it may. */
bool call_may_write(struct api_call *call);

/* Holds the connection until the job has ended, for at most `wait_s`; then `respond` answers. */
void call_hold(struct api_call *call, const struct job *job, uint32_t wait_s,
	       enum tw_status (*respond)(struct api_call *call, struct tw_error *error));

/* Whether the request, or its stream of events, may wait for a job: not where too many do. */
bool call_may_hold(const struct api_call *call);

/* Tells the service that there is work, interactive perhaps. */
void call_job_added(const struct api_call *call, bool is_interactive);

/* Tells the service that jobs were cancelled or removed, running ones perhaps. */
void call_job_asked(const struct api_call *call);

/* Tells the service, for its log, of an error, where that is the service's own failure. */
void call_failed(const struct api_call *call, const char *request_id, const struct tw_error *error);

/* Sets ETag and answers 304 when the request's If-None-Match names it: true, and there is nothing left to do. `etag`
 * comes without quotes. */
bool call_is_unchanged(struct api_call *call, const char *etag);

/* Fails with "not-acceptable" unless Accept welcomes the media type. */
enum tw_status call_check_accept(const struct api_call *call, const char *media_type,
				 struct tw_error *error) TW_NODISCARD;

/* TW_ERROR_INPUT "missing-scope": one of these would do, and the caller has none. */
enum tw_status call_refuse_scope(const struct api_call *call, unsigned scopes, struct tw_error *error);

/* The scope that work with jobs of this kind asks for, to begin, cancel or redrive them. */
unsigned call_job_scope(enum job_kind kind);

/* Fails as call_refuse_scope where the caller may not. */
enum tw_status call_check_job_kind(const struct api_call *call, enum job_kind kind,
				   struct tw_error *error) TW_NODISCARD;

/* Leaves of the kinds (JOB_KIND_BIT…; 0 for all) those that the caller may work with; fails as call_refuse_scope where
 * none is left. */
enum tw_status call_narrow_job_kinds(const struct api_call *call, unsigned *kinds, struct tw_error *error) TW_NODISCARD;

/* Milliseconds of CLOCK_MONOTONIC. */
int64_t call_now_ms(void);

#endif
