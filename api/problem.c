#include "api/problem.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

/* The types that HTTP itself has a status for. All others follow from their tw_status. */
static const struct {
	const char *type;
	unsigned status;
} own_status[] = {
	{"json-malformed", 400},
	{"json-too-deep", 400},
	{"malformed-query", 400},
	{"malformed-multipart", 400},
	{"malformed-header", 400},
	{"incomplete-body", 400},
	{"body-not-allowed", 400},
	{"invalid-parameter", 400},
	{"option-unknown", 400},
	{"unknown-parameter", 400},
	{"malformed-request", 400},
	{"unauthorized", 401},
	{"not-confirmed", 400},
	{"foreign-origin", 403},
	{"missing-scope", 403},
	{"operators-only", 403},
	{"request-timeout", 408},
	{"expectation-failed", 417},
	{"unknown-host", 421},
	{"too-many-of-one-address", 429},
	{"too-many-wrong-keys", 429},
	{"limit-requests-per-second", 429},
	{"limit-requests-per-minute", 429},
	{"limit-queued-jobs", 429},
	{"limit-stored-bytes", 429},
	{"head-too-large", 431},
	{"too-many-connections", 503},
	{"too-many-waiting", 503},
	{"drawing-queued", 503},
	{"version-not-supported", 505},
	{"method-not-allowed", 405},
	{"not-acceptable", 406},
	{"unsupported-media-type", 415},
	{"unsupported-encoding", 415},
	{"uri-too-long", 414},
	{"method-not-implemented", 501},
	{"not-ready", 503},
	{"store-busy", 503},
	{"store-gone", 503},
	{"idempotency-key-reused", 422},
};

static const struct {
	unsigned http;
	const char *type; /* where the error names none */
} by_status[] = {
	[TW_OK] = {500, "internal"},
	[TW_ERROR_INPUT] = {422, "invalid-input"},
	[TW_ERROR_NOT_FOUND] = {404, "not-found"},
	[TW_ERROR_CONFLICT] = {409, "conflict"},
	[TW_ERROR_LIMIT] = {413, "too-large"},
	[TW_ERROR_MEMORY] = {503, "out-of-memory"},
	[TW_ERROR_IO] = {500, "input-output"},
	[TW_ERROR_FULL] = {507, "store-full"},
	[TW_ERROR_CANCELLED] = {409, "cancelled"},
	[TW_ERROR_UNSUPPORTED] = {422, "unsupported"},
	[TW_ERROR_INTERNAL] = {500, "internal"},
};

static const char *error_type(const struct tw_error *error)
{
	return error->type ? error->type : by_status[error->status].type;
}

unsigned problem_status(const struct tw_error *error)
{
	for (size_t i = 0; error->type && i < sizeof own_status / sizeof own_status[0]; i++)
		if (!strcmp(own_status[i].type, error->type))
			return own_status[i].status;
	return by_status[error->status].http;
}

/* "mesh-non-manifold-edge" reads "Mesh non manifold edge". */
static json_t *title_of(const char *type)
{
	char title[64];
	snprintf(title, sizeof title, "%s", type);
	title[0] = (char)toupper((unsigned char)title[0]);
	for (char *p = title; *p; p++)
		if (*p == '-')
			*p = ' ';
	return json_string(title);
}

/* Texts may quote bytes of the input; what is not UTF-8 is replaced rather than lost. */
static json_t *text_of(const char *text)
{
	json_t *string = json_string(text);
	if (string)
		return string;
	char ascii[sizeof((struct tw_error *)0)->text];
	snprintf(ascii, sizeof ascii, "%s", text);
	for (char *p = ascii; *p; p++)
		if ((unsigned char)*p > 126)
			*p = '?';
	return json_string(ascii);
}

static json_t *place_of(const struct tw_error *error)
{
	json_t *place = json_object();
	json_object_set_new(place, error->where[0] == '/' ? "pointer" : "place", text_of(error->where));
	json_object_set_new(place, "detail", text_of(error->text));
	return place;
}

json_t *problem_json(const struct tw_error *error)
{
	char type[128];
	snprintf(type, sizeof type, PROBLEM_URN "%s", error_type(error));
	json_t *problem = json_object();
	json_object_set_new(problem, "type", json_string(type));
	json_object_set_new(problem, "title", title_of(error_type(error)));
	json_object_set_new(problem, "status", json_integer(problem_status(error)));
	json_object_set_new(problem, "detail", text_of(error->text));
	if (error->where[0]) {
		json_t *errors = json_array();
		json_array_append_new(errors, place_of(error));
		json_object_set_new(problem, "errors", errors);
	}
	return problem;
}

void problem_respond(struct api_response *response, const struct tw_error *error, const char *request_id)
{
	free(response->bytes);
	if (response->stream)
		response->stream->close(response->stream);
	response->stream = NULL;
	json_t *problem = problem_json(error);
	if (request_id)
		json_object_set_new(problem, "request_id", json_string(request_id));
	response->bytes = problem ? json_dumps(problem, JSON_COMPACT) : NULL;
	response->size = response->bytes ? strlen(response->bytes) : 0;
	response->status = problem_status(error);
	response_header(response, "Content-Type", "application/problem+json");
	response_header(response, "Cache-Control", "no-store");
	if ((response->status == 503 || response->status == 429) && !response_get_header(response, "Retry-After"))
		response_header(response, "Retry-After", "1");
	json_decref(problem);
}
