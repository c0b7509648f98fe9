/* One HTTP request and its answer. A server drives an exchange through
 *
 *     exchange_new      the request line is known
 *     exchange_headers  the headers are known: routing and permissions are decided here, without the store
 *     exchange_open     the body begins: limits, and the first use of the store
 *     exchange_body     each piece of the body
 *     exchange_end      the body is over
 *     exchange_free     the response is sent, or the client is gone
 *
 * and looks at its state after each step. EXCHANGE_READING: go on. EXCHANGE_ANSWERED: send exchange_response; what
 * remains of the body is of no interest. After exchange_end EXCHANGE_READING says that the request, which usually only
 * reads, has to write: exchange_may_wait has become true, and exchange_end is called once more. EXCHANGE_HELD (`Prefer:
 * wait`): keep the connection without a thread, ask exchange_is_due when a job may have ended, and call exchange_resume
 * once it says so, or at exchange_until_ms.
 *
 * An exchange is one thread's at a time, and may go to another between two steps. Different exchanges may be driven by
 * different threads at once. Where exchange_may_wait says so, exchange_body, _end and _free may have to wait for the
 * store's writer, and are better called where nobody else has to wait for that; all else waits for nothing. */
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

/* Whether what follows uses the store, and so may take its time. */
bool exchange_needs_store(const struct exchange *exchange);
enum exchange_state exchange_open(struct exchange *exchange);

/* In place of any step before the answer, where the server itself refuses the request: answers with the error. */
enum exchange_state exchange_refuse(struct exchange *exchange, const struct api_request *request,
				    const struct tw_error *error);
enum exchange_state exchange_body(struct exchange *exchange, const void *bytes, size_t size);
enum exchange_state exchange_end(struct exchange *exchange);

/* False for what only reads, and has nothing to cancel. Once the headers are known. */
bool exchange_may_wait(const struct exchange *exchange);

/* The body goes into the store as it comes, rather than into memory: large pieces cost less. */
bool exchange_is_streamed(const struct exchange *exchange);

/* Held: whether what it waits for has come; and when it waits no longer, in milliseconds of CLOCK_MONOTONIC. */
bool exchange_is_due(struct exchange *exchange);
int64_t exchange_until_ms(const struct exchange *exchange);
enum exchange_state exchange_resume(struct exchange *exchange);

/* Once answered. The exchange keeps the response, which a sender reads: a stream on the thread that ended the exchange.
 */
struct api_response *exchange_response(struct exchange *exchange);

/* Once answered: how long a server keeps the answer back, without a thread, before it sends it; 0 but for clients that
 * guess keys. */
unsigned exchange_pause_ms(const struct exchange *exchange);

/* The client has left before it got its answer: exchange_free then cancels what only it waited for, where it said so.
 * Not where the service itself ends the request. */
void exchange_leave(struct exchange *exchange);

/* For logs and metrics: the row of api_routes, NULL where none matched. */
const struct route *exchange_route(const struct exchange *exchange);
const char *exchange_request_id(const struct exchange *exchange);
const char *exchange_key_name(const struct exchange *exchange);    /* "-": none, or not let in */
const char *exchange_tenant_name(const struct exchange *exchange); /* the key's; likewise */

#endif
