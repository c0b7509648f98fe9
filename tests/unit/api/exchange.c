/* The api without a socket: requests made on the stack, responses looked at in memory. */
#include "api/exchange.h"

#include "api/route.h"
#include "storage/job_state.h"
#include "storage/queue.h"
#include "storage/resources.h"
#include "storage/sql.h"

#include <setjmp.h>
#include <sodium.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

struct fixture {
	char folder[64], url[128];
	struct api_settings settings;
	struct api *api;
	int jobs_added;
	bool ready;
	const char *headers[8][2]; /* of the next request */
	struct exchange *exchange;
	json_t *json; /* of the last response; NULL when it is none */
};

static void count_job(void *context, bool is_interactive)
{
	(void)is_interactive;
	((struct fixture *)context)->jobs_added++;
}

static bool is_ready(void *context, char *why, size_t size)
{
	snprintf(why, size, "not now");
	return ((struct fixture *)context)->ready;
}

static int set_up(void **state)
{
	struct fixture *f = calloc(1, sizeof *f);
	struct tw_error error = {0};
	snprintf(f->folder, sizeof f->folder, "/tmp/tightwire-api-XXXXXX");
	assert_non_null(mkdtemp(f->folder));
	snprintf(f->url, sizeof f->url, "sqlite:%s/store.db", f->folder);
	f->ready = true;
	f->settings = (struct api_settings){
		.store_url = f->url,
		.upload_limit_bytes = 1 << 20,
		.wait_limit_s = 5,
		.hooks = {.job_added = count_job, .ready = is_ready, .context = f},
	};
	assert_int_equal(api_open(&f->api, &f->settings, &error), TW_OK);
	*state = f;
	return 0;
}

static void forget(struct fixture *f)
{
	exchange_free(f->exchange);
	json_decref(f->json);
	f->exchange = NULL;
	f->json = NULL;
}

static int tear_down(void **state)
{
	struct fixture *f = *state;
	char command[128];
	forget(f);
	api_close(f->api);
	snprintf(command, sizeof command, "rm -rf %s", f->folder);
	int code = system(command); /* NOLINT(cert-env33-c): our own folder */
	free(f);
	return code;
}

static const char *find_header(void *context, const char *name)
{
	const struct fixture *f = context;
	for (size_t i = 0; i < 8 && f->headers[i][0]; i++)
		if (!strcasecmp(f->headers[i][0], name))
			return f->headers[i][1];
	return strcasecmp(name, "Content-Type") == 0 ? "application/json" : NULL;
}

static enum exchange_state drive(struct fixture *f, const char *method, const char *target, const char *body,
				 size_t size)
{
	struct api_request request = {.method = method, .header = find_header, .context = f};
	f->exchange = exchange_new(f->api, target);
	assert_non_null(f->exchange);
	enum exchange_state state = exchange_headers(f->exchange, &request);
	if (state == EXCHANGE_READING)
		state = exchange_open(f->exchange);
	for (size_t at = 0; state == EXCHANGE_READING && at < size; at += 7)
		state = exchange_body(f->exchange, body + at, size - at < 7 ? size - at : 7);
	if (state == EXCHANGE_READING)
		state = exchange_end(f->exchange);
	/* A read that has to write. */
	return state == EXCHANGE_READING && exchange_may_wait(f->exchange) ? exchange_end(f->exchange) : state;
}

/* Sends a request whose body comes in small pieces; the response's status. */
static unsigned ask(struct fixture *f, const char *method, const char *target, const char *body)
{
	forget(f);
	assert_int_equal(drive(f, method, target, body ? body : "", body ? strlen(body) : 0), EXCHANGE_ANSWERED);
	struct api_response *response = exchange_response(f->exchange);
	if (response->bytes)
		f->json = json_loadb(response->bytes, response->size, 0, NULL);
	return response->status;
}

static const char *text(const struct fixture *f, const char *name)
{
	return json_string_value(json_object_get(f->json, name));
}

static const char *header(const struct fixture *f, const char *name)
{
	return response_get_header(exchange_response(f->exchange), name);
}

static void set_header(struct fixture *f, const char *name, const char *value)
{
	f->headers[0][0] = name;
	f->headers[0][1] = value;
}

static void every_route_answers_with_its_own_template(void **state)
{
	struct fixture *f = *state;
	for (const struct route *r = api_routes; r->method; r++) {
		forget(f);
		(void)drive(f, r->method, r->path, "", 0);
		assert_ptr_equal(exchange_route(f->exchange), r);
	}
}

static void a_new_mesh_is_a_queued_job(void **state)
{
	struct fixture *f = *state;
	set_header(f, "Content-Type", "model/obj");
	assert_int_equal(ask(f, "POST", "/v1/meshes?name=suit.obj&unit=cm", "v 1 2 3\n"), 202);
	assert_int_equal(f->jobs_added, 1);
	assert_string_equal(text(f, "name"), "suit.obj");
	assert_string_equal(text(f, "state"), "queued");
	assert_string_equal(header(f, "Location"), text(f, "href"));
	char path[128];
	snprintf(path, sizeof path, "%s", text(f, "href"));
	assert_int_equal(ask(f, "GET", path, NULL), 200);
	assert_string_equal(json_string_value(json_object_get(json_object_get(f->json, "options"), "unit")), "cm");
}

static void the_same_mesh_again_is_no_new_job(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	set_header(f, "Content-Type", "model/obj");
	ask(f, "POST", "/v1/meshes?name=suit.obj", "v 1 2 3\n");
	snprintf(id, sizeof id, "%s", text(f, "id"));
	ask(f, "POST", "/v1/meshes?name=suit.obj", "v 1 2 3\n");
	assert_string_equal(text(f, "id"), id);
	assert_int_equal(f->jobs_added, 1);
}

static void an_early_refusal_reads_no_body(void **state)
{
	struct fixture *f = *state;
	struct api_request request = {.method = "POST", .header = find_header, .context = f};
	set_header(f, "Content-Length", "1048577");
	f->exchange = exchange_new(f->api, "/v1/meshes");
	assert_int_equal(exchange_headers(f->exchange, &request), EXCHANGE_READING);
	assert_int_equal(exchange_open(f->exchange), EXCHANGE_ANSWERED);
	assert_int_equal(exchange_body(f->exchange, "more", 4), EXCHANGE_ANSWERED);
	assert_int_equal(exchange_end(f->exchange), EXCHANGE_ANSWERED);
	assert_int_equal(exchange_response(f->exchange)->status, 413);
}

static void an_upload_above_the_limit_leaves_nothing(void **state)
{
	struct fixture *f = *state;
	size_t size = (1 << 20) + 1;
	char *body = malloc(size);
	memset(body, 'v', size);
	set_header(f, "Content-Type", "model/obj");
	assert_int_equal(drive(f, "POST", "/v1/meshes", body, size), EXCHANGE_ANSWERED);
	assert_int_equal(exchange_response(f->exchange)->status, 413);
	free(body);
	assert_int_equal(ask(f, "GET", "/v1/meshes", NULL), 200);
	assert_int_equal(json_array_size(json_object_get(f->json, "items")), 0);
	assert_int_equal(f->jobs_added, 0);
}

static void an_unfinished_exchange_can_be_dropped_at_any_time(void **state)
{
	struct fixture *f = *state;
	struct api_request request = {.method = "POST", .header = find_header, .context = f};
	f->exchange = exchange_new(f->api, "/v1/meshes");
	exchange_free(f->exchange);
	set_header(f, "Content-Type", "model/obj");
	f->exchange = exchange_new(f->api, "/v1/meshes");
	assert_int_equal(exchange_headers(f->exchange, &request), EXCHANGE_READING);
	exchange_free(f->exchange);
	f->exchange = exchange_new(f->api, "/v1/meshes");
	assert_int_equal(exchange_headers(f->exchange, &request), EXCHANGE_READING);
	assert_int_equal(exchange_open(f->exchange), EXCHANGE_READING);
	assert_int_equal(exchange_body(f->exchange, "v 1", 3), EXCHANGE_READING);
}

static void a_wait_is_held_until_the_job_has_ended(void **state)
{
	struct fixture *f = *state;
	char path[128];
	set_header(f, "Prefer", "wait=2");
	assert_int_equal(drive(f, "POST", "/v1/rig/recordings", "{}", 2), EXCHANGE_HELD);
	assert_false(exchange_is_due(f->exchange));
	struct exchange *held = f->exchange;
	f->exchange = NULL;
	ask(f, "GET", "/v1/jobs", NULL);
	json_t *job = json_array_get(json_object_get(f->json, "items"), 0);
	snprintf(path, sizeof path, "/v1/jobs/%s/cancel", json_string_value(json_object_get(job, "id")));
	assert_int_equal(ask(f, "POST", path, NULL), 200);
	assert_true(exchange_is_due(held));
	assert_int_equal(exchange_resume(held), EXCHANGE_ANSWERED);
	assert_int_equal(exchange_response(held)->status, 200);
	assert_string_equal(response_get_header(exchange_response(held), "Preference-Applied"), "wait=2");
	exchange_free(held);
}

static void a_wait_is_no_longer_than_the_service_allows(void **state)
{
	struct fixture *f = *state;
	set_header(f, "Prefer", "wait=500");
	assert_int_equal(drive(f, "POST", "/v1/rig/recordings", "{}", 2), EXCHANGE_HELD);
	assert_string_equal(header(f, "Preference-Applied"), "wait=5");
	assert_int_equal(exchange_resume(f->exchange), EXCHANGE_ANSWERED);
	assert_int_equal(exchange_response(f->exchange)->status, 202);
}

static bool never(void *context)
{
	(void)context;
	return false;
}

/* Its job is accepted all the same: waiting is a preference. */
static void where_too_many_wait_nobody_else_is_held(void **state)
{
	struct fixture *f = *state;
	struct tw_error error;
	struct api_settings settings = f->settings;
	settings.hooks.may_hold = never;
	set_header(f, "Prefer", "wait=5");
	assert_int_equal(api_reload(f->api, &settings, &error), TW_OK);
	assert_int_equal(ask(f, "POST", "/v1/rig/recordings", "{}"), 202);
	assert_null(header(f, "Preference-Applied"));
	assert_string_equal(header(f, "Retry-After"), "1");
	char path[128];
	snprintf(path, sizeof path, "/v1/jobs/%s/events",
		 json_string_value(json_object_get(json_object_get(f->json, "job"), "id")));
	assert_int_equal(ask(f, "GET", path, NULL), 503);
	assert_string_equal(header(f, "Retry-After"), "1");
}

enum { BEARER_SIZE = SECRET_SIZE + 7 };

static void write_keys(const struct fixture *f, const char *path, char key[BEARER_SIZE])
{
	char plain[SECRET_SIZE];
	uint8_t hash[SECRET_HASH_SIZE];
	(void)f;
	secret_make(plain);
	crypto_generichash(hash, sizeof hash, (const uint8_t *)plain, strlen(plain), NULL, 0);
	snprintf(key, BEARER_SIZE, "Bearer %s", plain);
	FILE *file = fopen(path, "w");
	assert_non_null(file);
	fprintf(file, "somebody ");
	for (size_t i = 0; i < sizeof hash; i++)
		fprintf(file, "%02x", hash[i]);
	fprintf(file, "\n");
	fclose(file);
	assert_int_equal(chmod(path, 0600), 0);
}

static void a_reload_changes_the_keys_of_what_begins_after_it(void **state)
{
	struct fixture *f = *state;
	struct tw_error error;
	char path[128], old_key[BEARER_SIZE], new_key[BEARER_SIZE];
	struct api_settings settings = f->settings;
	snprintf(path, sizeof path, "%s/keys", f->folder);
	settings.key_file = path;
	write_keys(f, path, old_key);
	assert_int_equal(api_reload(f->api, &settings, &error), TW_OK);
	assert_int_equal(ask(f, "GET", "/v1/jobs", NULL), 401);
	/* Once keys are needed they are: nobody takes that back while it runs. */
	assert_int_equal(api_reload(f->api, &f->settings, &error), TW_ERROR_CONFLICT);
	assert_string_equal(error.type, "keys-needed");
	set_header(f, "Authorization", old_key);
	assert_int_equal(ask(f, "GET", "/v1/jobs", NULL), 200);
	forget(f);
	f->exchange = exchange_new(f->api, "/v1/jobs"); /* begun with the old key */
	struct exchange *begun = f->exchange;
	f->exchange = NULL;
	write_keys(f, path, new_key);
	assert_int_equal(api_reload(f->api, &settings, &error), TW_OK);
	assert_int_equal(ask(f, "GET", "/v1/jobs", NULL), 401);
	struct api_request request = {.method = "GET", .header = find_header, .context = f};
	assert_int_equal(exchange_headers(begun, &request), EXCHANGE_READING);
	exchange_free(begun);
	set_header(f, "Authorization", new_key);
	assert_int_equal(ask(f, "GET", "/v1/jobs", NULL), 200);
	assert_int_equal(truncate(path, 0), 0);
	assert_int_equal(api_reload(f->api, &settings, &error), TW_ERROR_INPUT);
	assert_int_equal(ask(f, "GET", "/v1/jobs", NULL), 200);
}

static unsigned ask_from(struct fixture *f, const char *host, const char *origin)
{
	forget(f);
	set_header(f, "Origin", origin);
	if (!origin)
		f->headers[0][0] = NULL;
	f->exchange = exchange_new(f->api, "/v1/jobs/x/cancel");
	struct api_request request = {.method = "POST", .host = host, .header = find_header, .context = f};
	if (exchange_headers(f->exchange, &request) == EXCHANGE_READING)
		return 0;
	return exchange_response(f->exchange)->status;
}

static void a_page_of_another_origin_cannot_drive_a_service_without_keys(void **state)
{
	struct fixture *f = *state;
	struct tw_error error;
	static const char *const here[] = {"localhost", "localhost:8080", "LOCALHOST:1", "127.0.0.1:8080",
					   "127.9.9.9", "[::1]:8080",     "[::1]"};
	static const char *const elsewhere[] = {"evil.example",
						"evil.example:8080",
						"localhost.evil.example",
						"127.0.0.1.evil.example",
						"127.evil.example",
						"10.0.0.1",
						"[::2]:80",
						"localhost:80:90",
						"localhostx",
						"[::1].evil.example",
						"studio.local"};
	for (size_t i = 0; i < sizeof here / sizeof *here; i++) {
		char origin[64];
		snprintf(origin, sizeof origin, "http://%s", here[i]);
		assert_int_equal(ask_from(f, here[i], NULL), 0);
		assert_int_equal(ask_from(f, here[i], origin), 0);
		assert_int_equal(ask_from(f, here[i], "https://evil.example"), 403);
		assert_int_equal(ask_from(f, here[i], "http://localhost:9"), 403);
		assert_int_equal(ask_from(f, here[i], "null"), 403);
	}
	for (size_t i = 0; i < sizeof elsewhere / sizeof *elsewhere; i++)
		assert_int_equal(ask_from(f, elsewhere[i], NULL), 421);
	struct api_settings settings = f->settings;
	settings.host_names = "rack7, studio.local";
	settings.cors_origin = "https://studio.example";
	assert_int_equal(api_reload(f->api, &settings, &error), TW_OK);
	assert_int_equal(ask_from(f, "studio.local:8080", NULL), 0);
	assert_int_equal(ask_from(f, "studio.locale", NULL), 421);
	assert_int_equal(ask_from(f, "localhost:8080", "https://studio.example"), 0);
	assert_int_equal(ask_from(f, "localhost:8080", "https://studio.example.evil"), 403);
}

/* What a page can send without asking first: no type, text/plain, a form's. */
static void a_body_needs_a_media_type_that_no_page_may_send(void **state)
{
	struct fixture *f = *state;
	static const char *const simple[] = {"", "text/plain", "text/plain; charset=utf-8",
					     "application/x-www-form-urlencoded"};
	for (size_t i = 0; i < sizeof simple / sizeof *simple; i++) {
		set_header(f, "Content-Type", *simple[i] ? simple[i] : NULL);
		for (const struct route *r = api_routes; r->method; r++)
			if (r->body != ROUTE_NO_BODY && r->body != ROUTE_APPEND)
				assert_int_equal(ask(f, r->method, r->path, "{}"), 415);
	}
}

static void a_body_that_is_coded_is_refused(void **state)
{
	struct fixture *f = *state;
	set_header(f, "Content-Encoding", "gzip");
	for (const struct route *r = api_routes; r->method; r++)
		if (r->body != ROUTE_NO_BODY)
			assert_int_equal(ask(f, r->method, r->path, "{}"), 415);
	set_header(f, "Content-Encoding", "identity");
	assert_int_equal(ask(f, "POST", "/v1/rig/recordings", "\xEF\xBB\xBF{\"duration_s\":5.0}"), 202);
}

static void a_service_that_drains_is_alive_and_not_ready(void **state)
{
	struct fixture *f = *state;
	assert_int_equal(ask(f, "GET", "/readyz", NULL), 200);
	f->ready = false;
	assert_int_equal(ask(f, "GET", "/readyz", NULL), 503);
	assert_string_equal(text(f, "detail"), "not now");
	assert_int_equal(ask(f, "GET", "/livez", NULL), 200);
}

static void a_header_of_a_response_cannot_be_split(void **state)
{
	struct api_response response = {0};
	(void)state;
	response_header(&response, "X-A", "%s", "a\r\nSet-Cookie: b");
	assert_null(response_get_header(&response, "X-A"));
	response_header(&response, "X-A", "1");
	response_header(&response, "x-a", "2");
	assert_string_equal(response_get_header(&response, "X-A"), "2");
	response_clear(&response);
}

/* A layout whose search is done, by the way that workers take. */
static void make_layout(struct fixture *f, char id[STORE_ID_SIZE])
{
	static const uint64_t numbers[9] = {0};
	const struct tw_array trees = {job_kind_row(JOB_DRAW)->source, TW_U64, 1, 9, numbers};
	const struct job_artifact artifact = {"layout.json", "application/json", "{}", 2};
	const struct job_result result = {
		.summary = "{}", .arrays = &trees, .array_count = 1, .artifacts = &artifact, .artifact_count = 1};
	const struct resource_draft field = {.owner = OWNER_DEFAULT, .kind = RESOURCE_FIELD};
	const struct claim_query query = {.kinds = JOB_KINDS_ALL, .worker = "tester", .lease_ms = 5000};
	struct store *store = NULL;
	struct resource resource;
	struct job_ticket ticket;
	enum resource_outcome outcome;
	char field_id[STORE_ID_SIZE];
	bool found = false;
	assert_int_equal(store_open(&store, f->url, NULL), TW_OK);
	assert_int_equal(resource_create(store, &field, &resource, &outcome, NULL), TW_OK);
	snprintf(field_id, sizeof field_id, "%s", resource.id);
	resource_clear(&resource);
	const struct resource_draft layout = {.owner = OWNER_DEFAULT,
					      .kind = RESOURCE_LAYOUT,
					      .needs = (const char *const[]){field_id},
					      .need_count = 1};
	assert_int_equal(resource_create(store, &layout, &resource, &outcome, NULL), TW_OK);
	snprintf(id, STORE_ID_SIZE, "%s", resource.id);
	resource_clear(&resource);
	for (int i = 0; i < 2; i++) {
		assert_int_equal(job_claim(store, &query, &ticket, &found, NULL), TW_OK);
		assert_true(found);
		assert_int_equal(job_finish(store, &ticket, &result, NULL), TW_OK);
	}
	store_close(store);
}

/* Threads that only read never wait for the store's writer: the step is taken once more, elsewhere. */
static void a_read_that_has_to_write_says_so_first(void **state)
{
	struct fixture *f = *state;
	struct api_request request = {.method = "GET", .header = find_header, .context = f};
	char layout[STORE_ID_SIZE], target[128];
	make_layout(f, layout);
	snprintf(target, sizeof target, "/v1/layouts/%s/pattern.svg", layout);
	for (int asked = 0; asked < 2; asked++) {
		forget(f);
		f->exchange = exchange_new(f->api, target);
		assert_int_equal(exchange_headers(f->exchange, &request), EXCHANGE_READING);
		assert_int_equal(exchange_open(f->exchange), EXCHANGE_READING);
		assert_false(exchange_may_wait(f->exchange));
		assert_int_equal(exchange_end(f->exchange), EXCHANGE_READING);
		assert_true(exchange_may_wait(f->exchange));
		assert_int_equal(exchange_end(f->exchange), EXCHANGE_HELD);
		assert_false(exchange_may_wait(f->exchange)); /* from here on it reads */
		assert_int_equal(exchange_resume(f->exchange), EXCHANGE_ANSWERED);
		assert_int_equal(exchange_response(f->exchange)->status, 503);
	}
	assert_int_equal(f->jobs_added, 1); /* for both */
	assert_int_equal(ask(f, "GET", "/v1/jobs?kind=draw", NULL), 200);
	assert_int_equal(json_array_size(json_object_get(f->json, "items")), 1);
	snprintf(target, sizeof target, "/v1/layouts/%s/layout.json", layout);
	assert_int_equal(ask(f, "GET", target, NULL), 200);
}

/* Where the service itself ends a request, its client has not left. */
static void only_a_client_that_leaves_cancels(void **state)
{
	struct fixture *f = *state;
	set_header(f, "Prefer", "wait=5, on_disconnect=cancel");
	for (int leaves = 0; leaves < 2; leaves++) {
		forget(f);
		assert_int_equal(drive(f, "POST", "/v1/rig/recordings", "{}", 2), EXCHANGE_HELD);
		assert_string_equal(header(f, "Preference-Applied"), "wait=5, on_disconnect=cancel");
		if (leaves)
			exchange_leave(f->exchange);
		assert_int_equal(exchange_may_wait(f->exchange), leaves);
		assert_int_equal(ask(f, "GET", "/v1/jobs?state=cancelled", NULL), 200);
		assert_int_equal(json_array_size(json_object_get(f->json, "items")), leaves);
	}
}

static void a_job_without_a_resource_is_shown_like_any_other(void **state)
{
	struct fixture *f = *state;
	struct tw_error error = {0};
	struct store *store = NULL;
	char target[128];
	assert_int_equal(store_open(&store, f->url, &error), TW_OK);
	assert_int_equal(transaction_begin(store, true, &error), TW_OK);
	int64_t number = 0;
	enum tw_status status =
		job_state_add(store, OWNER_DEFAULT, 0, JOB_COMPUTE_LAYOUT, &(struct job_request){0}, &number, &error);
	assert_int_equal(transaction_end(store, status, &error), TW_OK);
	store_close(store);
	assert_int_equal(ask(f, "GET", "/v1/jobs?state=queued", NULL), 200);
	const json_t *job = json_array_get(json_object_get(f->json, "items"), 0);
	assert_string_equal(json_string_value(json_object_get(job, "kind")), "compute_layout");
	assert_true(json_is_null(json_object_get(job, "resource")));
	snprintf(target, sizeof target, "/v1/jobs/%s/cancel", json_string_value(json_object_get(job, "id")));
	assert_int_equal(ask(f, "POST", target, NULL), 200);
	assert_string_equal(text(f, "state"), "cancelled");
	assert_int_equal(ask(f, "POST", "/v1/jobs/redrive?state=cancelled", NULL), 200);
	assert_int_equal(json_integer_value(json_object_get(f->json, "redriven")), 1);
	assert_int_equal(f->jobs_added, 1);
}

#define CLAIM(claim) cmocka_unit_test_setup_teardown(claim, set_up, tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		CLAIM(every_route_answers_with_its_own_template),
		CLAIM(a_new_mesh_is_a_queued_job),
		CLAIM(the_same_mesh_again_is_no_new_job),
		CLAIM(an_early_refusal_reads_no_body),
		CLAIM(an_upload_above_the_limit_leaves_nothing),
		CLAIM(an_unfinished_exchange_can_be_dropped_at_any_time),
		CLAIM(a_wait_is_held_until_the_job_has_ended),
		CLAIM(a_wait_is_no_longer_than_the_service_allows),
		CLAIM(where_too_many_wait_nobody_else_is_held),
		CLAIM(a_read_that_has_to_write_says_so_first),
		CLAIM(only_a_client_that_leaves_cancels),
		CLAIM(a_reload_changes_the_keys_of_what_begins_after_it),
		CLAIM(a_page_of_another_origin_cannot_drive_a_service_without_keys),
		CLAIM(a_body_needs_a_media_type_that_no_page_may_send),
		CLAIM(a_body_that_is_coded_is_refused),
		CLAIM(a_service_that_drains_is_alive_and_not_ready),
		CLAIM(a_job_without_a_resource_is_shown_like_any_other),
		cmocka_unit_test(a_header_of_a_response_cannot_be_split),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
