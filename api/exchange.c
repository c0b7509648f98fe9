/* An exchange goes through its stages and keeps the first error that it meets as its response. */
#include "api/exchange.h"

#include "api/call.h"
#include "api/header.h"
#include "api/origin.h"
#include "api/problem.h"
#include "storage/jobs.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>

#define REQUEST_ID_MAX 64

struct exchange {
	struct api_call call;
	struct api_policy *policy; /* taken */
	enum exchange_state state;
	char *target;
	char request_id[REQUEST_ID_MAX + 1];
	unsigned pause_ms; /* see exchange_pause_ms */
	size_t body_capacity;
	bool writes;   /* its handler must write, though it is a read */
	bool has_left; /* the client */
};

struct exchange *exchange_new(struct api *api, const char *target)
{
	struct exchange *exchange = calloc(1, sizeof *exchange);
	char *copy = strdup(target);
	if (!exchange || !copy) {
		free(exchange);
		free(copy);
		return NULL;
	}
	exchange->target = copy;
	exchange->call.api = api;
	exchange->policy = api_take_policy(api);
	exchange->call.settings = api_policy_settings(exchange->policy);
	return exchange;
}

/* A store is one thread's, and the exchange may have come from another. */
static enum tw_status settle(struct exchange *exchange, struct tw_error *error)
{
	struct api_call *call = &exchange->call;
	if (!call->store)
		return TW_OK;
	enum tw_status status = api_store(call->api, &call->store, error);
	if (status == TW_OK)
		body_upload_use(&call->upload, call->store);
	return status;
}

/* Only what is wanted by nobody else: no other waiter, no request that wants it for good, nothing that needs it. */
static void cancel_unwanted(struct api_call *call)
{
	struct tw_error error = {0};
	bool cancelled = false;
	enum tw_status status =
		job_cancel_unwanted(call->store, call->waiter.job_id, call->waiter.requests, &cancelled, &error);
	if (status != TW_OK)
		call_failed(call, NULL, &error);
	if (cancelled)
		call_job_asked(call);
}

static void end_waiting(struct exchange *exchange)
{
	struct api_call *call = &exchange->call;
	bool gives_up = exchange->has_left && call->submit.queue.transient;
	bool is_last = waiting_leave(api_waiting(call->api), &call->waiter, gives_up);
	if (is_last && gives_up && call->store)
		cancel_unwanted(call);
}

void exchange_free(struct exchange *exchange)
{
	if (!exchange)
		return;
	/* Without a store nothing can be discarded; the sweep will do it. */
	if (settle(exchange, NULL) != TW_OK)
		body_upload_release(&exchange->call.upload);
	end_waiting(exchange);
	body_upload_clear(&exchange->call.upload);
	response_clear(&exchange->call.response);
	free(exchange->call.body);
	free(exchange->target);
	api_return_policy(exchange->call.api, exchange->policy);
	free(exchange);
}

struct api_response *exchange_response(struct exchange *exchange)
{
	return &exchange->call.response;
}

const struct route *exchange_route(const struct exchange *exchange)
{
	return exchange->call.match.route;
}

const char *exchange_request_id(const struct exchange *exchange)
{
	return exchange->request_id;
}

/* --- the end of an exchange ------------------------------------------------------------------------------------- */

/* JSON in memory gets the hash of its bytes as entity tag; what is streamed has one from its handler. */
static void tag_bytes(struct api_call *call)
{
	struct api_response *response = &call->response;
	uint8_t hash[16];
	char text[2 * sizeof hash + 1];
	if (response->status != 200 || !response->bytes || response_get_header(response, "ETag"))
		return;
	crypto_generichash(hash, sizeof hash, (const uint8_t *)response->bytes, response->size, NULL, 0);
	sodium_bin2hex(text, sizeof text, hash, sizeof hash);
	if (!call_is_unchanged(call, text))
		return;
	free(response->bytes);
	response->bytes = NULL;
	response->size = 0;
}

static void allow_origin(struct api_call *call)
{
	const char *origin = call->settings->cors_origin;
	if (!origin || !origin[0])
		return;
	response_header(&call->response, "Access-Control-Allow-Origin", "%s", origin);
	response_header(&call->response, "Access-Control-Expose-Headers",
			"ETag, Link, Location, Preference-Applied, X-Request-Id");
	if (strcmp(origin, "*") != 0)
		response_header(&call->response, "Vary", "Origin");
}

static bool is_read(const struct api_call *call)
{
	return !strcmp(call->request.method, "GET") || !strcmp(call->request.method, "HEAD");
}

static enum exchange_state answer(struct exchange *exchange)
{
	struct api_call *call = &exchange->call;
	if (is_read(call) && !response_get_header(&call->response, "Cache-Control")) {
		response_header(&call->response, "Cache-Control", "no-cache");
		tag_bytes(call);
	}
	response_header(&call->response, "X-Request-Id", "%s", exchange->request_id);
	response_header(&call->response, "X-Content-Type-Options", "nosniff");
	allow_origin(call);
	exchange->state = EXCHANGE_ANSWERED;
	return exchange->state;
}

static enum exchange_state answer_problem(struct exchange *exchange, const struct tw_error *error)
{
	/* What was uploaded so far is of no use, and the disk may be what is full. */
	body_upload_clear(&exchange->call.upload);
	call_failed(&exchange->call, exchange->request_id, error);
	problem_respond(&exchange->call.response, error, exchange->request_id);
	return answer(exchange);
}

/* --- its beginning ---------------------------------------------------------------------------------------------- */

/* The client's id where it is short and printable, else a random one. */
static void choose_request_id(struct exchange *exchange)
{
	const char *given = call_header(&exchange->call, "X-Request-Id");
	static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_.:";
	if (given && *given && strlen(given) <= REQUEST_ID_MAX && strspn(given, letters) == strlen(given)) {
		memcpy(exchange->request_id, given, strlen(given) + 1);
		return;
	}
	uint8_t random[8];
	randombytes_buf(random, sizeof random);
	sodium_bin2hex(exchange->request_id, sizeof exchange->request_id, random, sizeof random);
}

static bool is_known_method(const char *method)
{
	static const char *const known[] = {"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"};
	for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
		if (!strcmp(method, known[i]))
			return true;
	return false;
}

static void respond_options(struct api_call *call)
{
	response_empty(&call->response, 204);
	response_header(&call->response, "Allow", "%s", call->match.allow);
	const char *origin = call->settings->cors_origin;
	if (!origin || !origin[0])
		return;
	response_header(&call->response, "Access-Control-Allow-Methods", "%s", call->match.allow);
	response_header(
		&call->response, "Access-Control-Allow-Headers",
		"Authorization, Cancel-After, Confirm-Delete, Content-Type, Idempotency-Key, If-None-Match, Job-Class, "
		"Job-Group, Job-Max-Running, Job-Priority, Not-Before, Prefer, Session, Supersedes, "
		"Upload-Complete, Upload-Offset, X-Request-Id");
	response_header(&call->response, "Access-Control-Max-Age", "600");
}

static enum tw_status find_route(struct exchange *exchange, struct tw_error *error)
{
	struct api_call *call = &exchange->call;
	if (!strcmp(exchange->target, "*")) {
		/* OPTIONS of the service as a whole (RFC 9110, 9.3.7). */
		snprintf(call->match.allow, sizeof call->match.allow, "GET, HEAD, POST, PATCH, DELETE, OPTIONS");
		return TW_OK;
	}
	if (!is_known_method(call->request.method))
		return tw_fail(error, TW_ERROR_UNSUPPORTED, "method-not-implemented", NULL,
			       "the method %.20s is not known here", call->request.method);
	enum tw_status status = query_parse(&call->query, exchange->target, error);
	if (status != TW_OK)
		return status;
	route_find(call->request.method, call->query.path, &call->match);
	if (!call->match.path_known)
		return tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-path", NULL,
			       "there is nothing at this path; see /openapi.yaml");
	if (!call->match.route && strcmp(call->request.method, "OPTIONS") != 0) {
		response_header(&call->response, "Allow", "%s", call->match.allow);
		return tw_fail(error, TW_ERROR_UNSUPPORTED, "method-not-allowed", NULL, "this path allows %s",
			       call->match.allow);
	}
	return TW_OK;
}

/* Slower with each wrong key, whoever else may be behind the same address (api/wrong_keys.h). */
static enum tw_status slow_down(struct exchange *exchange, struct tw_error *error)
{
	struct api_call *call = &exchange->call;
	const struct wrong_key_verdict verdict = api_count_wrong_key(call->api, call->request.address);
	exchange->pause_ms = verdict.pause_ms;
	response_header(&call->response, "Retry-After", "%u", verdict.retry_s);
	if (!verdict.too_many)
		return error->status;
	return tw_fail(error, TW_ERROR_LIMIT, "too-many-wrong-keys", "Authorization",
		       "too many wrong keys came from your address; a right one is let in at any time");
}

static enum tw_status refuse_scope(struct exchange *exchange, unsigned scopes, struct tw_error *error)
{
	char needed[KEY_SCOPES_SIZE], has[KEY_SCOPES_SIZE];
	key_print_scopes(scopes, needed);
	key_print_scopes(exchange->call.caller.scopes, has);
	for (char *comma = strchr(needed, ','); comma; comma = strchr(comma, ','))
		*comma = ' ';
	response_header(&exchange->call.response, "WWW-Authenticate",
			"Bearer realm=\"tightwire\", error=\"insufficient_scope\", scope=\"%s\"", needed);
	return call_refuse_scope(&exchange->call, scopes, error);
}

static enum tw_status check_key(struct exchange *exchange, struct tw_error *error)
{
	struct api_call *call = &exchange->call;
	const struct route *route = call->match.route;
	const char *authorization = call_header(call, "Authorization");
	if (!route->scopes)
		return TW_OK;
	if (api_admit(exchange->policy, authorization, &call->caller, error) != TW_OK) {
		response_header(&call->response, "WWW-Authenticate", "Bearer realm=\"tightwire\"");
		return authorization ? slow_down(exchange, error) : error->status;
	}
	if (!(route->scopes & call->caller.scopes))
		return refuse_scope(exchange, route->scopes, error);
	if (route->flags & ROUTE_OPERATOR && !call->caller.is_operator)
		return tw_fail(error, TW_ERROR_INPUT, "operators-only", "Authorization",
			       "this tells of the service as a whole, and is for keys of the tenant default");
	return TW_OK;
}

/* Where the head is judged twice, this is not: it counts. */
static enum tw_status count_request(struct exchange *exchange, struct tw_error *error)
{
	struct api_call *call = &exchange->call;
	unsigned retry_s = 0;
	enum tw_status status = api_count_request(call->api, &call->caller, &retry_s, error);
	if (retry_s)
		response_header(&call->response, "Retry-After", "%u", retry_s);
	return status;
}

/* Whether a page of another origin is behind the request (api/origin.h). */
static enum tw_status check_origin(const struct exchange *exchange, struct tw_error *error)
{
	const struct api_call *call = &exchange->call;
	const char *host = call->request.host ? call->request.host : "";
	if (api_policy_needs_key(exchange->policy))
		return TW_OK;
	if (*host && !origin_is_local_host(host, call->settings->host_names))
		return tw_fail(
			error, TW_ERROR_INPUT, "unknown-host", "Host",
			"a service without keys answers to localhost only, not to %.80s; see the setting host-names",
			host);
	if (!origin_is_welcome(call_header(call, "Origin"), host, call->settings->cors_origin))
		return tw_fail(error, TW_ERROR_INPUT, "foreign-origin", "Origin",
			       "pages of %.80s may not use this service; see the setting cors-origin",
			       call_header(call, "Origin"));
	return TW_OK;
}

/* What a request says about the job that it starts. */
static enum tw_status read_submit(struct api_call *call, struct tw_error *error)
{
	struct timespec now;
	if (strcmp(call->request.method, "POST") != 0 || !call->request.header)
		return TW_OK;
	clock_gettime(CLOCK_REALTIME, &now);
	int64_t now_ms = (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
	return submit_parse(&call->submit, call->request.header, call->request.context, now_ms, error);
}

static enum tw_status check_encoding(const struct api_call *call, struct tw_error *error)
{
	const char *encoding = call_header(call, "Content-Encoding");
	if (!encoding || !strcasecmp(encoding, "identity"))
		return TW_OK;
	return tw_fail(error, TW_ERROR_UNSUPPORTED, "unsupported-encoding", "Content-Encoding",
		       "the body came as %.40s; send it as it is", encoding);
}

/* Refuses a body by its announced length, before a byte of it is read. */
static enum tw_status check_length(const struct api_call *call, uint64_t limit, struct tw_error *error)
{
	uint64_t length = 0;
	if (!header_content_length(call_header(call, "Content-Length"), &length) || length <= limit)
		return TW_OK;
	return tw_fail(error, TW_ERROR_LIMIT, "too-large", "Content-Length", "the body may be at most %llu bytes",
		       (unsigned long long)limit);
}

static enum tw_status refuse_body(struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_INPUT, "body-not-allowed", NULL,
		       "this request takes no body, not even an empty object; what it can be told stands in its query");
}

/* A body that would be ignored is a misunderstanding. One of GET has no meaning in HTTP, so no client means it. */
static enum tw_status check_no_body(const struct api_call *call, struct tw_error *error)
{
	uint64_t length = 0;
	bool has_body = header_content_length(call_header(call, "Content-Length"), &length) && length > 0;
	return has_body ? refuse_body(error) : TW_OK;
}

static enum tw_status check_json_type(const struct api_call *call, struct tw_error *error)
{
	const char *content_type = call_header(call, "Content-Type");
	char media_type[64], charset[64];
	if (header_media_type(content_type, media_type, sizeof media_type) && !strcmp(media_type, "application/json")) {
		bool given = header_parameter(content_type, "charset", charset, sizeof charset);
		if (!given || !strcasecmp(charset, "utf-8"))
			return TW_OK;
		return tw_fail(error, TW_ERROR_UNSUPPORTED, "unsupported-media-type", "Content-Type",
			       "the body came in the character set %s; send UTF-8", charset);
	}
	return tw_fail(error, TW_ERROR_UNSUPPORTED, "unsupported-media-type", "Content-Type",
		       "the body came as %s; send JSON, with -H 'Content-Type: application/json'",
		       *media_type ? media_type : "no media type");
}

/* Where the query names the first part, the uploads are there already. */
static enum tw_status take_named_uploads(struct api_call *call, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	for (const char *const *part = call->match.route->parts; *part && status == TW_OK; part++) {
		const char *id = query_get(&call->query, *part);
		if (id)
			status = body_upload_take(&call->upload, call->store, call->caller.owner.tenant, *part, id,
						  error);
	}
	return status;
}

static enum tw_status prepare_upload(struct api_call *call, struct tw_error *error)
{
	const struct route *route = call->match.route;
	const char *name = NULL;
	enum tw_status status = check_length(call, call->settings->upload_limit_bytes, error);
	if (status == TW_OK)
		status = query_name(&call->query, &name, error);
	if (status != TW_OK)
		return status;
	if (query_get(&call->query, route->parts[0]))
		return take_named_uploads(call, error);
	return body_upload_init(&call->upload, call->store, call->caller.owner, route->parts,
				call_header(call, "Content-Type"), name, call->settings->upload_limit_bytes, error);
}

static enum tw_status prepare_append(struct api_call *call, struct tw_error *error)
{
	uint64_t offset = 0;
	const char *complete = call_header(call, "Upload-Complete");
	enum tw_status status = check_length(call, call->settings->upload_limit_bytes, error);
	if (status != TW_OK)
		return status;
	if (!header_content_length(call_header(call, "Upload-Offset"), &offset) || offset == UINT64_MAX)
		return tw_fail(error, TW_ERROR_INPUT, "malformed-header", "Upload-Offset",
			       "say at which byte the upload goes on, as a number");
	if (complete && strcmp(complete, "?1") != 0 && strcmp(complete, "?0") != 0)
		return tw_fail(error, TW_ERROR_INPUT, "malformed-header", "Upload-Complete", "this is ?1 or ?0");
	return body_upload_append(&call->upload, call->store, call->caller.owner.tenant, call->match.parameters[0],
				  offset, complete && !strcmp(complete, "?1"), call->settings->upload_limit_bytes,
				  error);
}

static enum tw_status prepare_body(struct api_call *call, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	switch (call->match.route->body) {
	case ROUTE_NO_BODY:
		status = is_read(call) ? TW_OK : check_no_body(call, error);
		return status != TW_OK ? status : check_length(call, TW_LIMIT_JSON_BYTES, error);
	case ROUTE_JSON:
		status = check_json_type(call, error);
		return status != TW_OK ? status : check_length(call, TW_LIMIT_JSON_BYTES, error);
	case ROUTE_UPLOAD:
		return prepare_upload(call, error);
	case ROUTE_APPEND:
		return prepare_append(call, error);
	}
	return TW_OK;
}

/* What can be said of a request without the store, and before its body. */
static enum tw_status judge(struct exchange *exchange, struct tw_error *error)
{
	struct api_call *call = &exchange->call;
	enum tw_status status = check_origin(exchange, error);
	if (status == TW_OK)
		status = find_route(exchange, error);
	if (status != TW_OK || !call->match.route)
		return status;
	status = check_key(exchange, error);
	if (status == TW_OK)
		status = check_encoding(call, error);
	if (status == TW_OK)
		status = read_submit(call, error);
	if (status == TW_OK && call->match.route->produces)
		status = call_check_accept(call, call->match.route->produces, error);
	return status;
}

enum exchange_state exchange_headers(struct exchange *exchange, const struct api_request *request)
{
	struct tw_error error = {0};
	exchange->call.request = *request;
	choose_request_id(exchange);
	if (judge(exchange, &error) != TW_OK)
		return answer_problem(exchange, &error);
	if (exchange->call.match.route)
		return EXCHANGE_READING;
	respond_options(&exchange->call);
	return answer(exchange);
}

bool exchange_needs_store(const struct exchange *exchange)
{
	return !(exchange->call.match.route->flags & ROUTE_STORELESS);
}

enum exchange_state exchange_open(struct exchange *exchange)
{
	struct api_call *call = &exchange->call;
	struct tw_error error = {0};
	enum tw_status status = TW_OK;
	if (exchange->state != EXCHANGE_READING)
		return exchange->state;
	status = count_request(exchange, &error);
	if (status == TW_OK && exchange_needs_store(exchange))
		status = api_store(call->api, &call->store, &error);
	if (status == TW_OK)
		status = prepare_body(call, &error);
	return status == TW_OK ? EXCHANGE_READING : answer_problem(exchange, &error);
}

enum exchange_state exchange_refuse(struct exchange *exchange, const struct api_request *request,
				    const struct tw_error *error)
{
	exchange->call.request = *request;
	if (!exchange->request_id[0])
		choose_request_id(exchange);
	return answer_problem(exchange, error);
}

/* --- its body and its handler ----------------------------------------------------------------------------------- */

static enum tw_status keep_json(struct exchange *exchange, const void *bytes, size_t size, struct tw_error *error)
{
	struct api_call *call = &exchange->call;
	if (size > TW_LIMIT_JSON_BYTES - call->body_size)
		return tw_fail(error, TW_ERROR_LIMIT, "too-large", NULL, "the body may be at most %u bytes",
			       TW_LIMIT_JSON_BYTES);
	if (call->body_size + size > exchange->body_capacity) {
		size_t capacity = 2 * (call->body_size + size);
		char *grown = realloc(call->body, capacity);
		if (!grown)
			return tw_fail_memory(error);
		call->body = grown;
		exchange->body_capacity = capacity;
	}
	memcpy(call->body + call->body_size, bytes, size);
	call->body_size += size;
	return TW_OK;
}

static bool is_streamed(const struct route *route)
{
	return route->body == ROUTE_UPLOAD || route->body == ROUTE_APPEND;
}

bool exchange_is_streamed(const struct exchange *exchange)
{
	return exchange->state == EXCHANGE_READING && is_streamed(exchange->call.match.route);
}

bool exchange_may_wait(const struct exchange *exchange)
{
	const struct api_call *call = &exchange->call;
	const struct route *route = call->match.route;
	if (exchange->has_left && call->waiter.is_waiting)
		return call->submit.queue.transient;
	return exchange->state == EXCHANGE_READING && route && (exchange->writes || strcmp(route->method, "GET") != 0);
}

enum exchange_state exchange_body(struct exchange *exchange, const void *bytes, size_t size)
{
	struct tw_error error = {0};
	enum tw_status status = TW_OK;
	if (exchange->state != EXCHANGE_READING)
		return exchange->state;
	bool streamed = is_streamed(exchange->call.match.route);
	if (streamed)
		status = settle(exchange, &error);
	if (streamed && status == TW_OK)
		status = body_upload_write(&exchange->call.upload, bytes, size, &error);
	else if (exchange->call.match.route->body == ROUTE_JSON)
		status = keep_json(exchange, bytes, size, &error);
	else if (!streamed && size && !is_read(&exchange->call))
		status = refuse_body(&error);
	return status != TW_OK ? answer_problem(exchange, &error) : exchange->state;
}

enum exchange_state exchange_end(struct exchange *exchange)
{
	struct api_call *call = &exchange->call;
	struct tw_error error = {0};
	enum tw_status status = TW_OK;
	if (exchange->state != EXCHANGE_READING)
		return exchange->state;
	call->may_write = exchange_may_wait(exchange);
	status = settle(exchange, &error);
	if (status == TW_OK && is_streamed(call->match.route))
		status = body_upload_finish(&call->upload, &error);
	if (status == TW_OK)
		status = call->match.route->handle(call, &error);
	if (status != TW_OK)
		return answer_problem(exchange, &error);
	exchange->writes = call->must_write && !call->may_write;
	if (exchange->writes)
		return EXCHANGE_READING;
	if (!call->wait.respond)
		return answer(exchange);
	exchange->state = EXCHANGE_HELD;
	return exchange->state;
}

bool exchange_is_due(struct exchange *exchange)
{
	struct store *store = NULL;
	struct job job = {0};
	if (api_store(exchange->call.api, &store, NULL) != TW_OK)
		return true;
	bool due =
		job_get(store, exchange->call.caller.owner.tenant, exchange->call.waiter.job_id, &job, NULL) != TW_OK ||
		job_state_is_final(job.state);
	job_clear(&job);
	return due;
}

unsigned exchange_pause_ms(const struct exchange *exchange)
{
	return exchange->pause_ms;
}

const char *exchange_key_name(const struct exchange *exchange)
{
	const struct access_key *key = exchange->call.caller.key;
	return key ? key->name : "-";
}

const char *exchange_tenant_name(const struct exchange *exchange)
{
	const struct access_key *key = exchange->call.caller.key;
	return key ? key->tenant : "-";
}

int64_t exchange_until_ms(const struct exchange *exchange)
{
	return exchange->call.wait.until_ms;
}

enum exchange_state exchange_resume(struct exchange *exchange)
{
	struct api_call *call = &exchange->call;
	struct tw_error error = {0};
	if (exchange->state != EXCHANGE_HELD)
		return exchange->state;
	if (settle(exchange, &error) != TW_OK)
		return answer_problem(exchange, &error);
	return call->wait.respond(call, &error) != TW_OK ? answer_problem(exchange, &error) : answer(exchange);
}

void exchange_leave(struct exchange *exchange)
{
	exchange->has_left = true;
}
