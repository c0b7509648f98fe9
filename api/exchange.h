/* One HTTP request and its answer. A server drives an exchange through
 *
 *     exchange_new      the request line is known
 *     exchange_headers  the headers are known: routing, limits and permissions are decided here, before any body
 *     exchange_body     each piece of the body
 *     exchange_end      the body is over
 *     exchange_free     the response is sent, or the client is gone
 *
 * and looks at its state after each step. EXCHANGE_READING: go on. EXCHANGE_ANSWERED: send exchange_response; what
 * remains of the body is of no interest. EXCHANGE_HELD (`Prefer: wait`): keep the connection without a thread, ask
 * exchange_is_due now and then (or when a job has ended), and call exchange_resume once it says so.
 *
 * An exchange stays with one thread, which has a connection to the store for all its exchanges; only exchange_is_due
 * may be called from another. Different exchanges may be driven by different threads at once. */
#ifndef API_EXCHANGE_H
#define API_EXCHANGE_H

#include "api/api.h"
#include "api/request.h"
#include "api/response.h"
#include "tightwire.h"

#include <stdbool.h>

struct exchange;
struct route;

/* `target` as it came, still percent-encoded: "/v1/meshes?limit=3"; copied. NULL when out of memory. */
struct exchange *exchange_new(struct api *api, const char *target);
void exchange_free(struct exchange *exchange); /* NULL is allowed; an unfinished upload is dropped */

enum exchange_state { EXCHANGE_READING, EXCHANGE_ANSWERED, EXCHANGE_HELD };

/* What *request points to, its header function included, must stay valid until the exchange is freed. */
enum exchange_state exchange_headers(struct exchange *exchange, const struct api_request *request);
/* In place of it, for a head that the server itself refuses: answers with the error. */
enum exchange_state exchange_refuse(struct exchange *exchange, const struct api_request *request,
				    const struct tw_error *error);
enum exchange_state exchange_body(struct exchange *exchange, const void *bytes, size_t size);
enum exchange_state exchange_end(struct exchange *exchange);

/* Held: whether what it waits for has come, or its time `now_ms` (CLOCK_MONOTONIC) is over. */
bool exchange_is_due(struct exchange *exchange, int64_t now_ms);
enum exchange_state exchange_resume(struct exchange *exchange);

/* Once answered. The exchange keeps the response; a sender may take its `bytes` or `stream` by setting it to NULL. A
 * stream must be closed before its exchange's thread ends. */
struct api_response *exchange_response(struct exchange *exchange);

/* For logs and metrics: the row of api_routes, NULL where none matched. */
const struct route *exchange_route(const struct exchange *exchange);
const char *exchange_request_id(const struct exchange *exchange);

#endif
