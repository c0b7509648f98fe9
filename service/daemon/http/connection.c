#include "service/daemon/http/connection.h"

#include "api/route.h"
#include "service/log.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define HEAD_SIZE_FIRST 2048u /* of the buffer; most heads fit */
#define CHUNKED_READ (64u << 10)
#define READS_AT_ONCE 16 /* of a body; then others have their turn, however fast this client sends */
#define EXCUSED_MS 2000  /* for one connection too many to say what it wants */
/* After an answer that came before the whole request: how much, and how long, is still read and thrown away. Closing at
 * once would reset the connection, and the client might never see the answer. Whoever was let in may be in the middle
 * of a large upload; whoever was not gets no more than it takes to be polite. */
#define LINGER_BYTES (256u << 20)
#define LINGER_MS 10000
#define LINGER_STRANGER_BYTES (256u << 10)
#define LINGER_STRANGER_MS 1000
#define STATUS_CLIENT_GONE 499 /* in log and metrics, where a client has left before it got an answer */

/* One run of a connection. */
struct turn {
	bool uses_store;
	char *scratch;
	int64_t now_ms;
	unsigned reads;
	enum connection_outcome outcome; /* once there is nothing more to do now */
};

static int64_t now_us(void)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

/* The steps below say whether the connection goes on; if not, this is why. */
static bool stop(struct turn *turn, enum connection_outcome outcome)
{
	turn->outcome = outcome;
	return false;
}

static bool wait_for(struct http_connection *c, struct turn *turn, unsigned events)
{
	c->events = events;
	c->waits_from_ms = turn->now_ms;
	return stop(turn, CONNECTION_WAITS);
}

static bool enter(struct http_connection *c, enum connection_phase phase, int64_t now_ms)
{
	c->phase = phase;
	c->since_ms = now_ms;
	c->waits_from_ms = c->waited_ms = 0;
	c->moved = 0;
	return true;
}

/* --- life -----------------------------------------------------------------------------------------------------------
 */

struct http_connection *http_connection_new(struct http_context *context, int socket, const char *peer)
{
	struct http_connection *c = calloc(1, sizeof *c);
	if (!c)
		return NULL;
	c->context = context;
	c->socket = socket;
	snprintf(c->peer, sizeof c->peer, "%s", peer);
	enter(c, CONNECTION_IDLE, now_us() / 1000);
	return c;
}

static void end_request(struct http_connection *c, bool is_complete)
{
	struct http_context *context = c->context;
	if (!c->exchange)
		return;
	double seconds = (double)(now_us() - c->started_us) / 1e6;
	const struct route *route = exchange_route(c->exchange);
	unsigned status = exchange_response(c->exchange)->status;
	if (!status || c->phase == CONNECTION_HELD)
		status = STATUS_CLIENT_GONE;
	metrics_count_request(context->metrics, route, status, seconds);
	log_event(LOG_LEVEL_INFO, "request", "id=%s peer=%s method=%s route=\"%s\" status=%u ms=%.2f received=%llu%s",
		  exchange_request_id(c->exchange), c->peer, c->head.method ? c->head.method : "",
		  route ? route->path : "", status, seconds * 1e3, (unsigned long long)c->received,
		  is_complete ? "" : " aborted=true");
	reply_clear(&c->reply);
	exchange_free(c->exchange);
	c->exchange = NULL;
	head_clear(&c->head);
	atomic_fetch_sub(&context->active, 1);
}

static void set_held(struct http_connection *c, bool held)
{
	struct http_context *context = c->context;
	unsigned count = held ? atomic_fetch_add(&context->held, 1) + 1 : atomic_fetch_sub(&context->held, 1) - 1;
	metrics_set_held(context->metrics, count);
}

static bool is_held(const struct http_connection *c)
{
	return c->phase == CONNECTION_HELD || c->phase == CONNECTION_STREAMING;
}

void http_connection_free(struct http_connection *c)
{
	if (is_held(c))
		set_held(c, false);
	end_request(c, false);
	head_clear(&c->head);
	close(c->socket);
	free(c->in);
	free(c->rest);
	free(c);
}

/* --- answers --------------------------------------------------------------------------------------------------------
 */

/* Whether the request has been read to its end, so that the next one can follow. A body that is here already is
 * skipped. */
static bool skip_body(struct http_connection *c)
{
	if (c->head.is_chunked)
		return c->chunk.state == CHUNK_END;
	size_t here = c->in_size - c->in_used;
	size_t skipped = here < c->body_left ? here : (size_t)c->body_left;
	c->in_used += skipped;
	c->body_left -= skipped;
	return !c->body_left;
}

static bool begin_reply(struct http_connection *c, struct turn *turn)
{
	bool is_old = c->head.is_old;
	struct api_response *response = exchange_response(c->exchange);
	c->is_cut = c->is_cut || !skip_body(c);
	c->ends = c->ends || c->is_cut || atomic_load(&c->context->draining);
	struct reply_terms terms = {
		.is_head = c->head.method && !strcmp(c->head.method, "HEAD"), .is_old = is_old, .ends = c->ends};
	if (!reply_begin(&c->reply, response, &terms))
		return stop(turn, CONNECTION_ENDS);
	return enter(c, CONNECTION_SENDING, turn->now_ms);
}

static const char *find_header(void *context, const char *name)
{
	return head_find(context, name);
}

static struct api_request request_of(struct http_connection *c)
{
	return (struct api_request){
		.method = c->head.method ? c->head.method : "",
		.host = c->head.host ? c->head.host : "",
		.header = find_header,
		.context = &c->head,
	};
}

/* Answers with an error of the server's own; the connection ends with it. */
static bool refuse(struct http_connection *c, struct turn *turn, const struct tw_error *error)
{
	const struct api_request request = request_of(c);
	exchange_refuse(c->exchange, &request, error);
	c->ends = true;
	return begin_reply(c, turn);
}

static bool refuse_late(struct http_connection *c, struct turn *turn, const char *text)
{
	struct tw_error error = {0};
	(void)tw_fail(&error, TW_ERROR_INPUT, "request-timeout", NULL, "%s", text);
	c->is_cut = true;
	return refuse(c, turn, &error);
}

/* --- heads ----------------------------------------------------------------------------------------------------------
 */

static bool begin_request(struct http_connection *c)
{
	c->started_us = now_us();
	c->received = 0;
	c->chunk = (struct chunk){0};
	c->ends = c->is_cut = c->is_stranger = false;
	c->exchange = exchange_new(c->context->api, c->head.target ? c->head.target : "");
	if (c->exchange)
		atomic_fetch_add(&c->context->active, 1);
	return c->exchange;
}

static bool refuse_head(struct http_connection *c, struct turn *turn, const struct tw_error *error)
{
	if (!begin_request(c))
		return stop(turn, CONNECTION_ENDS);
	c->is_cut = c->is_stranger = true;
	return refuse(c, turn, error);
}

static bool take_head(struct http_connection *c, struct turn *turn)
{
	if (!begin_request(c))
		return stop(turn, CONNECTION_ENDS);
	const struct api_request request = request_of(c);
	c->in_used = c->head.size;
	c->body_left = c->head.body_bytes;
	c->ends = c->head.ends || c->excuse;
	if (exchange_headers(c->exchange, &request) == EXCHANGE_ANSWERED) {
		c->is_stranger = true;
		return begin_reply(c, turn);
	}
	if (c->excuse && exchange_needs_store(c->exchange)) {
		c->is_stranger = true;
		return refuse(c, turn, c->excuse);
	}
	return enter(c, CONNECTION_OPENING, turn->now_ms);
}

static bool grow_in(struct http_connection *c, size_t needed)
{
	if (needed <= c->in_capacity)
		return true;
	size_t capacity = c->in_capacity ? c->in_capacity : HEAD_SIZE_FIRST;
	while (capacity < needed)
		capacity *= 2;
	char *grown = realloc(c->in, capacity);
	if (!grown)
		return false;
	c->in = grown;
	c->in_capacity = capacity;
	return true;
}

static bool receive_head(struct http_connection *c, struct turn *turn)
{
	if (++turn->reads > READS_AT_ONCE)
		return wait_for(c, turn, EPOLLIN);
	if (!grow_in(c, c->in_size + 1))
		return stop(turn, CONNECTION_ENDS);
	size_t room = (c->in_capacity < HEAD_SIZE_MAX ? c->in_capacity : HEAD_SIZE_MAX) - c->in_size;
	ssize_t got = recv(c->socket, c->in + c->in_size, room, MSG_DONTWAIT);
	if (got < 0 && (errno == EAGAIN || errno == EINTR))
		return wait_for(c, turn, EPOLLIN);
	if (got <= 0)
		return stop(turn, CONNECTION_ENDS);
	c->in_size += (size_t)got;
	return true;
}

static bool read_head(struct http_connection *c, struct turn *turn)
{
	struct tw_error error;
	enum head_outcome outcome = HEAD_INCOMPLETE;
	if (c->in_size && c->phase == CONNECTION_IDLE) {
		enter(c, CONNECTION_HEAD, turn->now_ms);
		c->request_ms = turn->now_ms;
	}
	if (c->in_size)
		outcome = head_parse(&c->head, c->in, c->in_size, &error);
	if (outcome == HEAD_REFUSED)
		return refuse_head(c, turn, &error);
	return outcome == HEAD_COMPLETE ? take_head(c, turn) : receive_head(c, turn);
}

/* --- bodies ---------------------------------------------------------------------------------------------------------
 */

static bool open_request(struct http_connection *c, struct turn *turn)
{
	static const char go_on[] = "HTTP/1.1 100 Continue\r\n\r\n";
	if (exchange_needs_store(c->exchange) && !turn->uses_store)
		return stop(turn, CONNECTION_NEEDS_STORE);
	if (exchange_open(c->exchange) == EXCHANGE_ANSWERED)
		return begin_reply(c, turn);
	bool has_body = c->head.is_chunked || c->body_left;
	if (has_body && c->head.expects && c->in_used == c->in_size &&
	    send(c->socket, go_on, sizeof go_on - 1, MSG_NOSIGNAL | MSG_DONTWAIT) != (ssize_t)(sizeof go_on - 1))
		return stop(turn, CONNECTION_ENDS);
	return enter(c, CONNECTION_BODY, turn->now_ms);
}

static bool hold(struct http_connection *c, struct turn *turn)
{
	enter(c, CONNECTION_HELD, turn->now_ms);
	set_held(c, true);
	c->events = EPOLLRDHUP;
	return stop(turn, CONNECTION_IS_HELD);
}

static bool end_body(struct http_connection *c, struct turn *turn)
{
	enum exchange_state state = exchange_end(c->exchange);
	if (state == EXCHANGE_HELD && !atomic_load(&c->context->draining))
		return hold(c, turn);
	if (state == EXCHANGE_HELD)
		exchange_resume(c->exchange);
	return begin_reply(c, turn);
}

static bool is_body_over(const struct http_connection *c)
{
	return c->head.is_chunked ? c->chunk.state == CHUNK_END : c->body_left == 0;
}

/* Gives the exchange what of the bytes is body; how many were used up. Stops early once it has its answer. */
static size_t feed(struct http_connection *c, const char *bytes, size_t size, enum exchange_state *state)
{
	size_t used = 0;
	*state = EXCHANGE_READING;
	while (used < size && *state == EXCHANGE_READING && !is_body_over(c) && c->chunk.state != CHUNK_BROKEN) {
		const char *data = bytes + used;
		size_t data_size = size - used;
		if (c->head.is_chunked) {
			used += chunk_take(&c->chunk, bytes + used, size - used, &data, &data_size);
		} else {
			data_size = data_size < c->body_left ? data_size : (size_t)c->body_left;
			c->body_left -= data_size;
			used += data_size;
		}
		c->received += data_size;
		if (data_size)
			*state = exchange_body(c->exchange, data, data_size);
	}
	c->moved += used;
	metrics_count_received(c->context->metrics, used);
	return used;
}

/* Bytes behind the end of a chunked body are the beginning of the next request. They stand apart until then: the head
 * points into `in`. */
static bool keep_rest(struct http_connection *c, const char *bytes, size_t size)
{
	if (!size)
		return true;
	c->rest = malloc(size);
	if (!c->rest)
		return false;
	memcpy(c->rest, bytes, size);
	c->rest_size = size;
	return true;
}

static bool after_feed(struct http_connection *c, struct turn *turn, enum exchange_state state)
{
	struct tw_error error = {0};
	if (state == EXCHANGE_ANSWERED)
		return begin_reply(c, turn);
	if (c->chunk.state != CHUNK_BROKEN)
		return true;
	(void)tw_fail(&error, TW_ERROR_INPUT, "malformed-request", "body",
		      "the body is not in chunks as HTTP writes them");
	c->is_cut = true;
	return refuse(c, turn, &error);
}

static bool receive_body(struct http_connection *c, struct turn *turn)
{
	enum exchange_state state;
	size_t room = c->head.is_chunked                  ? CHUNKED_READ
		      : c->body_left < CONNECTION_SCRATCH ? (size_t)c->body_left
							  : CONNECTION_SCRATCH;
	if (++turn->reads > READS_AT_ONCE)
		return wait_for(c, turn, EPOLLIN);
	ssize_t got = recv(c->socket, turn->scratch, room, MSG_DONTWAIT);
	if (got < 0 && (errno == EAGAIN || errno == EINTR))
		return wait_for(c, turn, EPOLLIN);
	if (got <= 0)
		return stop(turn, CONNECTION_ENDS);
	size_t used = feed(c, turn->scratch, (size_t)got, &state);
	if (!keep_rest(c, turn->scratch + used, (size_t)got - used))
		return stop(turn, CONNECTION_ENDS);
	return after_feed(c, turn, state);
}

static bool read_body(struct http_connection *c, struct turn *turn)
{
	enum exchange_state state;
	if (is_body_over(c))
		return end_body(c, turn);
	if (c->in_used == c->in_size)
		return receive_body(c, turn);
	c->in_used += feed(c, c->in + c->in_used, c->in_size - c->in_used, &state);
	return after_feed(c, turn, state);
}

/* --- sending ------------------------------------------------------------------------------------------------------ */

static void set_in(struct http_connection *c, char *bytes, size_t size)
{
	free(c->in);
	c->in = bytes;
	c->in_size = c->in_capacity = size;
}

/* What has come behind the request is the beginning of the next. */
static bool go_idle(struct http_connection *c, struct turn *turn)
{
	if (c->rest || c->in_used == c->in_size) {
		set_in(c, c->rest, c->rest_size);
		c->rest = NULL;
		c->rest_size = 0;
	} else {
		c->in_size -= c->in_used;
		memmove(c->in, c->in + c->in_used, c->in_size);
	}
	c->in_used = 0;
	enter(c, CONNECTION_IDLE, turn->now_ms);
	return turn->uses_store ? stop(turn, CONNECTION_IS_IDLE) : true;
}

static bool finish(struct http_connection *c, struct turn *turn)
{
	end_request(c, true);
	if (!c->ends)
		return go_idle(c, turn);
	if (!c->is_cut || shutdown(c->socket, SHUT_WR))
		return stop(turn, CONNECTION_ENDS);
	return enter(c, CONNECTION_LINGERING, turn->now_ms);
}

static bool send_reply(struct http_connection *c, struct turn *turn)
{
	bool draining = atomic_load(&c->context->draining);
	switch (reply_send(&c->reply, c->socket, draining, &c->moved)) {
	case REPLY_DONE:
		return finish(c, turn);
	case REPLY_BLOCKED:
		return wait_for(c, turn, EPOLLOUT);
	case REPLY_WAITING:
		enter(c, CONNECTION_STREAMING, turn->now_ms);
		set_held(c, true);
		c->events = EPOLLRDHUP;
		return stop(turn, CONNECTION_WAITS);
	default:
		return stop(turn, CONNECTION_ENDS);
	}
}

static bool linger(struct http_connection *c, struct turn *turn)
{
	uint64_t limit = c->is_stranger ? LINGER_STRANGER_BYTES : LINGER_BYTES;
	if (++turn->reads > READS_AT_ONCE)
		return wait_for(c, turn, EPOLLIN);
	ssize_t got = recv(c->socket, turn->scratch, CONNECTION_SCRATCH, MSG_DONTWAIT);
	if (got < 0 && (errno == EAGAIN || errno == EINTR))
		return wait_for(c, turn, EPOLLIN);
	if (got <= 0 || (c->moved += (uint64_t)got) > limit)
		return stop(turn, CONNECTION_ENDS);
	return true;
}

/* --- turns ----------------------------------------------------------------------------------------------------------
 */

static bool step(struct http_connection *c, struct turn *turn)
{
	switch (c->phase) {
	case CONNECTION_IDLE:
	case CONNECTION_HEAD:
		return read_head(c, turn);
	case CONNECTION_OPENING:
		return open_request(c, turn);
	case CONNECTION_BODY:
		return read_body(c, turn);
	case CONNECTION_SENDING:
		return send_reply(c, turn);
	case CONNECTION_LINGERING:
		return linger(c, turn);
	case CONNECTION_HELD:
	case CONNECTION_STREAMING:
		break; /* of these only the client's leaving is an event */
	}
	return stop(turn, CONNECTION_ENDS);
}

static enum connection_outcome run(struct http_connection *c, struct turn *turn)
{
	while (step(c, turn))
		;
	return turn->outcome;
}

enum connection_outcome http_connection_run(struct http_connection *c, bool uses_store, char *scratch, int64_t now_ms)
{
	struct turn turn = {uses_store, scratch, now_ms, 0, CONNECTION_WAITS};
	if (c->waits_from_ms)
		c->waited_ms += now_ms - c->waits_from_ms;
	c->waits_from_ms = 0;
	return run(c, &turn);
}

enum connection_outcome http_connection_look(struct http_connection *c, bool changed, char *scratch, int64_t now_ms)
{
	struct turn turn = {true, scratch, now_ms, 0, CONNECTION_WAITS};
	bool draining = atomic_load(&c->context->draining);
	if (c->phase == CONNECTION_HELD) {
		if (!draining && now_ms < exchange_until_ms(c->exchange) && !(changed && exchange_is_due(c->exchange)))
			return CONNECTION_WAITS;
		set_held(c, false);
		c->phase = CONNECTION_SENDING;
		exchange_resume(c->exchange);
		(void)begin_reply(c, &turn);
	} else if (c->phase == CONNECTION_STREAMING) {
		if (!draining && !changed)
			return CONNECTION_WAITS;
		set_held(c, false);
		enter(c, CONNECTION_SENDING, now_ms);
	} else {
		return CONNECTION_WAITS;
	}
	return turn.outcome == CONNECTION_WAITS ? run(c, &turn) : turn.outcome;
}

/* --- time -----------------------------------------------------------------------------------------------------------
 */

/* Whether the client moves fewer bytes than it must, on the average and after a grace. Only the time that we waited for
 * it counts: what we do with what it sent may take long. */
static bool is_slow(const struct http_connection *c, int64_t now_ms)
{
	int64_t stalled_ms = c->waits_from_ms ? now_ms - c->waits_from_ms : 0;
	int64_t judged_ms = c->waited_ms + stalled_ms - 1000 * HTTP_GRACE_S;
	if (stalled_ms > 1000 * (int64_t)atomic_load(&c->context->limits.idle_s))
		return true;
	return judged_ms > 0 && c->moved < (uint64_t)judged_ms * atomic_load(&c->context->limits.rate_bytes_s) / 1000;
}

static bool is_over(const struct http_connection *c, int64_t now_ms, const atomic_uint *limit_s)
{
	int64_t limit_ms = 1000 * (int64_t)atomic_load(limit_s);
	if (c->excuse && limit_ms > EXCUSED_MS)
		limit_ms = EXCUSED_MS;
	return now_ms - c->since_ms > limit_ms;
}

static bool is_late(const struct http_connection *c, int64_t now_ms)
{
	return now_ms - c->request_ms > 1000 * (int64_t)atomic_load(&c->context->limits.request_s);
}

static enum connection_outcome end_late(struct http_connection *c, struct turn *turn, const char *text)
{
	struct tw_error error = {0};
	(void)tw_fail(&error, TW_ERROR_INPUT, "request-timeout", NULL, "%s", text);
	bool goes_on = c->phase == CONNECTION_HEAD ? refuse_head(c, turn, &error) : refuse_late(c, turn, text);
	return goes_on ? run(c, turn) : turn->outcome;
}

enum connection_outcome http_connection_check_time(struct http_connection *c, char *scratch, int64_t now_ms)
{
	struct turn turn = {c->phase != CONNECTION_HEAD, scratch, now_ms, 0, CONNECTION_WAITS};
	struct http_limits *limits = &c->context->limits;
	switch (c->phase) {
	case CONNECTION_IDLE:
		return atomic_load(&c->context->draining) || is_over(c, now_ms, &limits->idle_s) ? CONNECTION_ENDS
												 : CONNECTION_WAITS;
	case CONNECTION_HEAD:
		return is_over(c, now_ms, &limits->head_s) ? end_late(c, &turn, "the head of the request took too long")
							   : CONNECTION_WAITS;
	case CONNECTION_BODY:
		if (is_late(c, now_ms))
			return end_late(c, &turn, "the request took too long; send large files with POST /v1/uploads");
		return is_slow(c, now_ms) ? end_late(c, &turn, "the body came too slowly") : CONNECTION_WAITS;
	case CONNECTION_SENDING:
		return is_slow(c, now_ms) ? CONNECTION_ENDS : CONNECTION_WAITS;
	case CONNECTION_LINGERING:
		return now_ms - c->since_ms > (c->is_stranger ? LINGER_STRANGER_MS : LINGER_MS) ? CONNECTION_ENDS
												: CONNECTION_WAITS;
	default:
		return CONNECTION_WAITS;
	}
}
