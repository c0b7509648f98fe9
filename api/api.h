/* The api as a whole: one per daemon, one exchange per HTTP request. A server drives an exchange through
 *
 *     api_exchange_new      the request line is known
 *     api_exchange_headers  the headers are known: routing, limits and permissions are decided here, before any body
 *     api_exchange_body     each piece of the body
 *     api_exchange_end      the body is over
 *     api_exchange_free     the response is sent, or the client is gone
 *
 * and looks at its state after each step. API_READING: go on. API_ANSWERED: send api_exchange_response; what remains of
 * the body is of no interest. API_HELD (`Prefer: wait`): keep the connection without a thread, ask
 * api_exchange_is_due now and then (or when a job has ended), and call api_exchange_resume once it says so.
 *
 * An exchange stays with one thread, which has a connection to the store for all its exchanges; only
 * api_exchange_is_due may be called from another. Different exchanges may be driven by different threads at once. */
#ifndef API_API_H
#define API_API_H

#include "api/request.h"
#include "api/response.h"
#include "tightwire.h"

#include <stdbool.h>

struct api;
struct api_exchange;
struct route;

/* What the service around it does for the api. Functions may be NULL; they are called from any thread. */
struct api_hooks {
	void (*job_added)(void *context);                     /* there is work in the queue: wake a worker */
	char *(*metrics)(void *context);                      /* text for /metrics in the Prometheus format; malloc */
	bool (*ready)(void *context, char *why, size_t size); /* false, with a reason, while draining */
	void *context;
};

struct api_settings {
	const char *store_url;       /* borrowed for the life of the api, like all texts here */
	uint64_t upload_limit_bytes; /* of one upload */
	uint32_t wait_limit_s;       /* longest `Prefer: wait` that is honoured */
	const char *cors_origin;     /* "https://studio.example", "*", or empty for no CORS */
	const char *key_file;        /* file of API keys (api/key.h); empty for none */
	struct api_hooks hooks;
};

/* Opens the store once, to see that it works, and reads the key file. Free with api_close, after all exchanges. */
enum tw_status api_open(struct api **api, const struct api_settings *settings, struct tw_error *error) TW_NODISCARD;
void api_close(struct api *api); /* NULL is allowed */

/* `target` as it came, still percent-encoded: "/v1/meshes?limit=3"; copied. NULL when out of memory. */
struct api_exchange *api_exchange_new(struct api *api, const char *target);
void api_exchange_free(struct api_exchange *exchange); /* NULL is allowed; an unfinished upload is dropped */

enum api_state { API_READING, API_ANSWERED, API_HELD };

/* What *request points to, its header function included, must stay valid until the exchange is freed. */
enum api_state api_exchange_headers(struct api_exchange *exchange, const struct api_request *request);
/* In place of it, for a head that the server itself refuses: answers with the error. */
enum api_state api_exchange_refuse(struct api_exchange *exchange, const struct api_request *request,
				   const struct tw_error *error);
enum api_state api_exchange_body(struct api_exchange *exchange, const void *bytes, size_t size);
enum api_state api_exchange_end(struct api_exchange *exchange);

/* Held: whether what it waits for has come, or its time `now_ms` (CLOCK_MONOTONIC) is over. */
bool api_exchange_is_due(struct api_exchange *exchange, int64_t now_ms);
enum api_state api_exchange_resume(struct api_exchange *exchange);

/* Once answered. The exchange keeps the response; a sender may take its `bytes` or `stream` by setting it to NULL. A
 * stream must be closed before its exchange's thread ends. */
struct api_response *api_exchange_response(struct api_exchange *exchange);

/* For logs and metrics: the row of api_routes, NULL where none matched. */
const struct route *api_exchange_route(const struct api_exchange *exchange);
const char *api_exchange_request_id(const struct api_exchange *exchange);

#endif
