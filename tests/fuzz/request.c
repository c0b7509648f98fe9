/* Any bytes as a request to the api, without a socket: "METHOD TARGET\n", header lines "Name: value\n", an empty line,
 * the body. Whatever comes, there is an answer; an error is a problem in JSON. */
#include "api/exchange.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#define HEADERS_MAX 16

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

struct head {
	char *method, *target;
	char *names[HEADERS_MAX], *values[HEADERS_MAX];
	size_t count;
	int has_json;
};

static char folder[64];

static void remove_store(void)
{
	static const char *const files[] = {"store.db", "store.db-wal", "store.db-shm", "store.db-gate"};
	char path[128];
	for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
		snprintf(path, sizeof path, "%s/%s", folder, files[i]);
		unlink(path);
	}
	rmdir(folder);
}

/* In memory where the system has a place for that: a disk would be waited for at every commit. */
static struct api *open_api(void)
{
	struct api *api = NULL;
	struct tw_error error;
	static char url[128];
	struct api_settings settings = {
		.store_url = url, .upload_limit_bytes = 4096, .wait_limit_s = 1, .cors_origin = "*"};
	snprintf(folder, sizeof folder, "%s/tightwire-fuzz-XXXXXX", access("/dev/shm", W_OK) ? "/tmp" : "/dev/shm");
	if (!mkdtemp(folder) || atexit(remove_store))
		abort();
	snprintf(url, sizeof url, "sqlite:%s/store.db?limit_bytes=%u", folder, 256u << 20);
	if (api_open(&api, &settings, &error))
		abort();
	return api;
}

static const char *find_header(void *context, const char *name)
{
	const struct head *head = context;
	for (size_t i = 0; i < head->count; i++)
		if (!strcasecmp(head->names[i], name))
			return head->values[i];
	/* What the body looks like, so that an input need not say it to be read. */
	if (strcasecmp(name, "Content-Type") != 0)
		return NULL;
	return head->has_json ? "application/json" : "model/obj";
}

/* Cuts the head off the text in place; what is left is the body. NULL when there is no request line. */
static char *cut_head(char *text, struct head *head)
{
	char *line = strsep(&text, "\n");
	head->method = strsep(&line, " ");
	head->target = line;
	while (text && (line = strsep(&text, "\n")) && *line && head->count < HEADERS_MAX) {
		char *name = strsep(&line, ":");
		if (!line)
			continue;
		head->names[head->count] = name;
		head->values[head->count++] = line + (*line == ' ');
	}
	return head->target ? (text ? text : "") : NULL;
}

static void check_answer(const struct api_response *response)
{
	if (response->status < 200 || response->status > 599)
		abort();
	if (response->status < 400)
		return;
	json_t *problem = json_loadb(response->bytes, response->size, 0, NULL);
	if (!json_is_string(json_object_get(problem, "type")) || !json_is_integer(json_object_get(problem, "status")))
		abort();
	json_decref(problem);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct api *api;
	struct head head = {0};
	if (!api)
		api = open_api();
	char *text = malloc(size + 1);
	if (!text)
		return 0;
	memcpy(text, data, size);
	text[size] = 0;
	char *body = cut_head(text, &head);
	struct exchange *exchange = body ? exchange_new(api, head.target) : NULL;
	if (exchange) {
		head.has_json = *body == '{';
		struct api_request request = {.method = head.method, .header = find_header, .context = &head};
		size_t body_size = body >= text && body <= text + size ? (size_t)(text + size - body) : 0;
		enum exchange_state state = exchange_headers(exchange, &request);
		if (state == EXCHANGE_READING)
			state = exchange_open(exchange);
		for (size_t at = 0; state == EXCHANGE_READING && at < body_size; at += 64)
			state = exchange_body(exchange, body + at, body_size - at < 64 ? body_size - at : 64);
		if (state == EXCHANGE_READING)
			state = exchange_end(exchange);
		if (state == EXCHANGE_READING) /* a read that has to write */
			state = exchange_end(exchange);
		if (state == EXCHANGE_HELD)
			state = exchange_resume(exchange);
		check_answer(exchange_response(exchange));
		exchange_free(exchange);
	}
	free(text);
	return 0;
}
