#include "service/daemon/http/connection.h"

#include "api/route.h"
#include "service/clock.h"
#include "service/daemon/http/account.h"
#include "service/log.h"

#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
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

/* One run of a connection. */
struct turn {
	bool relays;
	char *scratch;
	int64_t now_ms;
	unsigned reads;
	enum connection_outcome outcome; /* once there is nothing more to do now */
};

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

struct http_connection *http_connection_new(struct http_context *context, int socket, const char *peer,
					    uint64_t address)
{
	struct http_connection *c = calloc(1, sizeof *c);
	if (!c)
		return NULL;
	c->context = context;
	c->socket = socket;
	c->address = address;
	c->relay = RELAY_NONE;
	snprintf(c->peer, sizeof c->peer, "%s", peer);
	enter(c, CONNECTION_IDLE, monotonic_ms());
	return c;
}

/* The engine accounts for what it was given. */
static void account_for(const struct http_connection *c, bool is_complete)
{
	account_request(c->context->metrics, &(struct account){
						     .exchange = c->exchange,
						     .peer = c->peer,
						     .method = c->head.method,
						     .status = exchange_response(c->exchange)->status,
						     .started_us = c->started_us,
						     .received = c->received,
						     .is_complete = is_complete,
					     });
}

static void end_request(struct http_connection *c, bool is_complete)
{
	if (!c->exchange)
		return;
	if (c->phase != CONNECTION_RELAYING)
		account_for(c, is_complete);
	reply_clear(&c->reply);
	relay_close(&c->relay);
	exchange_free(c->exchange);
	c->exchange = NULL;
	head_clear(&c->head);
	atomic_fetch_sub(&c->context->active, 1);
}

void http_connection_free(struct http_connection *c)
{
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
	const struct api_response *response = exchange_response(c->exchange);
	c->is_cut = c->is_cut || !skip_body(c);
	c->ends = c->ends || c->is_cut || atomic_load(&c->context->draining);
	bool is_head = c->head.method && !strcmp(c->head.method, "HEAD");
	if (!reply_begin(&c->reply, response, is_head, c->ends))
		return stop(turn, CONNECTION_ENDS);
	return enter(c, exchange_pause_ms(c->exchange) ? CONNECTION_PAUSED : CONNECTION_SENDING, turn->now_ms);
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
		.address = c->address,
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
	relay_close(&c->relay);
	c->is_cut = true;
	return refuse(c, turn, &error);
}

/* --- heads ----------------------------------------------------------------------------------------------------------
 */

static bool begin_request(struct http_connection *c)
{
	c->started_us = monotonic_us();
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

static bool refuse_unserved(struct http_connection *c, struct turn *turn)
{
	struct tw_error error = {0};
	(void)tw_fail(&error, TW_ERROR_LIMIT, "too-many-connections", NULL,
		      "the service has as many requests as it can serve; try again in a moment");
	relay_close(&c->relay);
	return refuse(c, turn, &error);
}

static bool open_request(struct http_connection *c, struct turn *turn)
{
	bool needs_engine = exchange_needs_store(c->exchange);
	if (needs_engine && !turn->relays)
		return stop(turn, CONNECTION_NEEDS_ENGINE);
	if (needs_engine && !relay_open(&c->relay, c->context->engine, &c->head, c->peer))
		return refuse_unserved(c, turn);
	if (needs_engine)
		return enter(c, CONNECTION_RELAYING, turn->now_ms);
	if (exchange_open(c->exchange) == EXCHANGE_ANSWERED)
		return begin_reply(c, turn);
	return enter(c, CONNECTION_BODY, turn->now_ms);
}

static bool end_body(struct http_connection *c, struct turn *turn)
{
	exchange_end(c->exchange);
	return begin_reply(c, turn);
}

static bool is_body_over(const struct http_connection *c)
{
	return c->head.is_chunked ? c->chunk.state == CHUNK_END : c->body_left == 0;
}

/* Hands on what of the bytes is body, to the engine where the request is relayed; how many were used up. */
static size_t feed(struct http_connection *c, const char *bytes, size_t size, bool *fits)
{
	size_t used = 0;
	*fits = true;
	while (used < size && *fits && !is_body_over(c) && c->chunk.state != CHUNK_BROKEN) {
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
		if (c->phase == CONNECTION_RELAYING)
			*fits = relay_put(&c->relay, &c->head, data, data_size) &&
				(!is_body_over(c) || relay_put_end(&c->relay, &c->head));
	}
	c->moved += used;
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

static bool refuse_chunks(struct http_connection *c, struct turn *turn)
{
	struct tw_error error = {0};
	(void)tw_fail(&error, TW_ERROR_INPUT, "malformed-request", "body",
		      "the body is not in chunks as HTTP writes them");
	relay_close(&c->relay);
	c->is_cut = true;
	return refuse(c, turn, &error);
}

enum body_outcome { BODY_CAME, BODY_BLOCKED, BODY_BROKEN, BODY_ENDS };

/* More of the body: what came behind the head, then from the socket. */
static enum body_outcome take_body(struct http_connection *c, struct turn *turn)
{
	bool fits = true;
	if (c->in_used < c->in_size) {
		c->in_used += feed(c, c->in + c->in_used, c->in_size - c->in_used, &fits);
	} else {
		size_t room = c->head.is_chunked                  ? CHUNKED_READ
			      : c->body_left < CONNECTION_SCRATCH ? (size_t)c->body_left
								  : CONNECTION_SCRATCH;
		ssize_t got = recv(c->socket, turn->scratch, room, MSG_DONTWAIT);
		if (got < 0 && (errno == EAGAIN || errno == EINTR))
			return BODY_BLOCKED;
		if (got <= 0)
			return BODY_ENDS;
		size_t used = feed(c, turn->scratch, (size_t)got, &fits);
		fits = fits && keep_rest(c, turn->scratch + used, (size_t)got - used);
	}
	if (c->chunk.state == CHUNK_BROKEN)
		return BODY_BROKEN;
	return fits ? BODY_CAME : BODY_ENDS;
}

static bool read_body(struct http_connection *c, struct turn *turn)
{
	if (is_body_over(c))
		return end_body(c, turn);
	if (++turn->reads > READS_AT_ONCE)
		return wait_for(c, turn, EPOLLIN);
	switch (take_body(c, turn)) {
	case BODY_CAME:
		return true;
	case BODY_BLOCKED:
		return wait_for(c, turn, EPOLLIN);
	case BODY_BROKEN:
		return refuse_chunks(c, turn);
	default:
		return stop(turn, CONNECTION_ENDS);
	}
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
	return turn->relays ? stop(turn, CONNECTION_IS_IDLE) : true;
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
	switch (reply_send(&c->reply, c->socket, &c->moved)) {
	case REPLY_DONE:
		return finish(c, turn);
	case REPLY_BLOCKED:
		return wait_for(c, turn, EPOLLOUT);
	default:
		return stop(turn, CONNECTION_ENDS);
	}
}

/* --- relaying -------------------------------------------------------------------------------------------------------
 */

/* Whether the client has left: reset its connection or, where it waits for a job, closed at least its half of it. */
static bool has_left(const struct http_connection *c)
{
	struct pollfd socket = {c->socket, atomic_load(&c->relay.link->is_held) ? POLLRDHUP : 0, 0};
	return poll(&socket, 1, 0) > 0 && (socket.revents & (POLLERR | POLLHUP | POLLRDHUP));
}

static bool wants_body(const struct http_connection *c)
{
	return !is_body_over(c) && !c->relay.is_shut && !relay_has_pending(&c->relay.up);
}

static bool wait_for_both(struct http_connection *c, struct turn *turn)
{
	bool has_down = relay_has_pending(&c->relay.down), is_held = atomic_load(&c->relay.link->is_held);
	c->events = (wants_body(c) ? (unsigned)EPOLLIN : 0u) | (has_down ? (unsigned)EPOLLOUT : 0u) |
		    (is_held ? (unsigned)EPOLLRDHUP : 0u);
	c->relay_events =
		(relay_has_pending(&c->relay.up) ? (unsigned)EPOLLOUT : 0u) | (has_down ? 0u : (unsigned)EPOLLIN);
	if (wants_body(c) || has_down)
		c->waits_from_ms = turn->now_ms;
	return stop(turn, CONNECTION_WAITS);
}

/* Body to the engine. False: nothing moved, or *outcome says why it is over. */
static bool push(struct http_connection *c, struct turn *turn, enum body_outcome *outcome)
{
	bool had_pending = relay_has_pending(&c->relay.up);
	*outcome = BODY_BLOCKED;
	if (had_pending && relay_push(&c->relay) == RELAY_BLOCKED)
		return false;
	if (!wants_body(c))
		return had_pending;
	*outcome = take_body(c, turn);
	if (*outcome == BODY_CAME && is_body_over(c)) {
		c->moved = 0;
		c->waited_ms = 0;
	}
	return *outcome == BODY_CAME;
}

/* Answer to the client. An answer that comes before the end of the body ends the connection. */
static enum relay_outcome pull(struct http_connection *c, struct turn *turn)
{
	struct relay *relay = &c->relay;
	enum relay_outcome outcome = relay_deliver(relay, c->socket, &c->moved);
	if (outcome != RELAY_CLEAR || relay->is_complete)
		return outcome;
	bool is_early = !is_body_over(c);
	bool ends = c->ends || is_early || atomic_load(&c->context->draining);
	bool had_begun = relay->has_begun;
	outcome = relay_pull(relay, turn->scratch, CONNECTION_SCRATCH, ends);
	if (relay->has_begun && !had_begun) {
		c->ends = ends;
		c->is_cut = is_early;
		relay->is_shut = relay->is_shut || is_early;
	}
	return outcome == RELAY_SHUT && relay->is_complete ? RELAY_CLEAR : outcome;
}

static bool relay_request(struct http_connection *c, struct turn *turn)
{
	while (turn->reads++ < READS_AT_ONCE) {
		enum body_outcome body = BODY_BLOCKED;
		bool moves = push(c, turn, &body);
		if (body == BODY_BROKEN)
			return refuse_chunks(c, turn);
		if (body == BODY_ENDS)
			return stop(turn, CONNECTION_ENDS);
		enum relay_outcome answer = pull(c, turn);
		if (answer == RELAY_SHUT)
			return stop(turn, CONNECTION_ENDS);
		if (answer == RELAY_CLEAR && c->relay.is_complete && !relay_has_pending(&c->relay.down))
			return finish(c, turn);
		if (!moves && answer == RELAY_BLOCKED)
			return has_left(c) ? stop(turn, CONNECTION_ENDS) : wait_for_both(c, turn);
	}
	return wait_for_both(c, turn);
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

/* Until http_connection_check_time says that it is over. */
static bool wait_out_pause(struct http_connection *c, struct turn *turn)
{
	struct pollfd socket = {c->socket, 0, 0};
	bool is_gone = poll(&socket, 1, 0) > 0;
	return is_gone ? stop(turn, CONNECTION_ENDS) : wait_for(c, turn, 0);
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
	case CONNECTION_RELAYING:
		return relay_request(c, turn);
	case CONNECTION_PAUSED:
		return wait_out_pause(c, turn);
	case CONNECTION_SENDING:
		return send_reply(c, turn);
	case CONNECTION_LINGERING:
		return linger(c, turn);
	}
	return stop(turn, CONNECTION_ENDS);
}

static enum connection_outcome run(struct http_connection *c, struct turn *turn)
{
	while (step(c, turn))
		;
	return turn->outcome;
}

enum connection_outcome http_connection_run(struct http_connection *c, bool relays, char *scratch, int64_t now_ms)
{
	struct turn turn = {relays, scratch, now_ms, 0, CONNECTION_WAITS};
	if (c->waits_from_ms)
		c->waited_ms += now_ms - c->waits_from_ms;
	c->waits_from_ms = 0;
	return run(c, &turn);
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

static enum connection_outcome check_relay(struct http_connection *c, struct turn *turn)
{
	bool is_late_now = !is_body_over(c) && is_late(c, turn->now_ms);
	bool is_slow_now = c->waits_from_ms && is_slow(c, turn->now_ms);
	int64_t waits_from_ms = c->waits_from_ms;
	if (!is_late_now && !is_slow_now) {
		(void)wait_for_both(c, turn); /* it may wait for a job now, or no longer */
		c->waits_from_ms = waits_from_ms;
		return CONNECTION_WAITS;
	}
	if (c->relay.has_begun || is_body_over(c))
		return CONNECTION_ENDS;
	return end_late(c, turn,
			is_late_now ? "the request took too long; send large files with POST /v1/uploads"
				    : "the body came too slowly");
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
	case CONNECTION_RELAYING:
		return check_relay(c, &turn);
	case CONNECTION_PAUSED:
		if (now_ms - c->since_ms < exchange_pause_ms(c->exchange))
			return CONNECTION_WAITS;
		enter(c, CONNECTION_SENDING, now_ms);
		return run(c, &turn);
	case CONNECTION_SENDING:
		return is_slow(c, now_ms) ? CONNECTION_ENDS : CONNECTION_WAITS;
	case CONNECTION_LINGERING:
		return now_ms - c->since_ms > (c->is_stranger ? LINGER_STRANGER_MS : LINGER_MS) ? CONNECTION_ENDS
												: CONNECTION_WAITS;
	default:
		return CONNECTION_WAITS;
	}
}
