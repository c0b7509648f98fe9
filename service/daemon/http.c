/* How libmicrohttpd is used.
 *
 * One request is one api_exchange, made when the request line is known (uri log callback, the only place that has the
 * target as it came) and freed by the completion callback. In between the access handler is called once with the
 * headers, once for each piece of the body, once at its end, and once more after every resume.
 *
 * A response to the headers alone makes the library close the connection, since it will not read the body. So early
 * answers are given at once only where the body is large (or the client waits for 100 Continue); a small body is read
 * to its end first, and the connection lives on.
 *
 * The library's own timeout counts from the last byte, so a client that sends a byte now and then would hold its
 * connection for ever. Every open socket therefore stands in a list with the time since which it owes us a request
 * head; http_tick shuts down the sockets that owe it for too long.
 *
 * A step that may have to wait for the store's writer is not taken by the library's threads, which serve other clients
 * meanwhile, but by the executor's, while the connection is suspended; then the access handler is called once more.
 *
 * Threads: the library's own, which never share a connection, the executor's, and the one that calls http_tick,
 * http_drain and http_stop. `lock` guards the two lists. A held request is in the list only while it is suspended:
 * before its response (`Prefer: wait`), or within it (a stream that has nothing to send yet). */
#include "service/daemon/http.h"

#include "api/exchange.h"
#include "api/header.h"
#include "service/daemon/executor.h"
#include "service/log.h"

#include <microhttpd.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define CONNECTION_MEMORY (64u << 10)  /* head of a request, and its read buffer */
#define WRITE_THREADS 16               /* that may wait for the store's writer, and for the disk, at once */
#define PIECE_BYTES (256u << 10)       /* of an upload that are handed on at once */
#define STREAM_BLOCK (256u << 10)      /* read from the store at once */
#define EARLY_ANSWER_BYTES (16u << 20) /* bodies above this are not read when the answer is known before them */
#define SWALLOW_BYTES (1ull << 30)     /* of a body that has become pointless */
#define TICK_HELD_MS 50                /* for jobs that end in a worker which is not ours */
#define TICK_PEERS_MS 500
#define STATUS_CLIENT_GONE 499 /* in log and metrics, where a client has left before it got an answer */

enum phase { PHASE_HEAD, PHASE_BODY, PHASE_ENDING, PHASE_HELD, PHASE_SENDING };

/* An open socket. */
struct peer {
	struct peer *next, *previous;
	int socket;
	atomic_llong owes_since_ms; /* since when a request head is owed; 0 while a request is being served */
	atomic_bool receives;       /* a body is on its way */
	unsigned seen_gone;         /* times that http_tick found it closed by the client; only its thread uses this */
};

struct http_request {
	struct http_server *server;
	struct MHD_Connection *connection; /* borrowed; NULL before the head is complete */
	struct exchange *exchange;         /* owned */
	struct http_request *next_held;
	char method[16];
	enum phase phase;
	unsigned status;
	uint64_t received; /* bytes of the body */
	uint64_t swallowed;
	int64_t started_us;
	char *piece; /* owned, PIECE_BYTES: of an upload, what is not handed on yet; NULL for none */
	size_t piece_size;
	struct task task;          /* the executor's while it is busy */
	atomic_bool is_busy;       /* the exchange is in the executor's hands */
	enum exchange_state state; /* as the executor left it */
};

struct http_server {
	struct http_settings settings;
	struct MHD_Daemon *daemon;
	struct executor *executor; /* owned */
	bool stopping;             /* it takes no more; guarded by `lock` */
	MHD_socket quiesced;       /* the listening socket, ours again since http_drain; else MHD_INVALID_SOCKET */
	pthread_mutex_t lock;
	struct peer *peers;
	struct http_request *held;
	unsigned peer_count, held_count;
	atomic_uint active;
	atomic_bool draining;
	int64_t next_held_ms, next_peers_ms; /* when http_tick looks through the lists again */
};

static int64_t now_us(void)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

/* --- sockets ---------------------------------------------------------------------------------------------------- */

static void open_peer(struct http_server *server, int socket, void **context)
{
	struct peer *peer = calloc(1, sizeof *peer);
	*context = peer;
	if (!peer)
		return;
	peer->socket = socket;
	atomic_init(&peer->owes_since_ms, now_us() / 1000);
	pthread_mutex_lock(&server->lock);
	peer->next = server->peers;
	if (peer->next)
		peer->next->previous = peer;
	server->peers = peer;
	metrics_set_connections(server->settings.metrics, ++server->peer_count);
	pthread_mutex_unlock(&server->lock);
}

static void close_peer(struct http_server *server, struct peer *peer)
{
	if (!peer)
		return;
	pthread_mutex_lock(&server->lock);
	if (peer->next)
		peer->next->previous = peer->previous;
	if (peer->previous)
		peer->previous->next = peer->next;
	else
		server->peers = peer->next;
	metrics_set_connections(server->settings.metrics, --server->peer_count);
	pthread_mutex_unlock(&server->lock);
	free(peer);
}

static void on_connection(void *context, struct MHD_Connection *connection, void **socket_context,
			  enum MHD_ConnectionNotificationCode code)
{
	const union MHD_ConnectionInfo *info = NULL;
	if (code == MHD_CONNECTION_NOTIFY_STARTED) {
		info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
		open_peer(context, info ? info->connect_fd : -1, socket_context);
	} else {
		close_peer(context, *socket_context);
		*socket_context = NULL;
	}
}

static void set_peer(struct MHD_Connection *connection, int64_t owes_since_ms, bool receives)
{
	const union MHD_ConnectionInfo *info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
	struct peer *peer = info ? info->socket_context : NULL;
	if (!peer)
		return;
	atomic_store(&peer->owes_since_ms, owes_since_ms);
	atomic_store(&peer->receives, receives);
}

/* Whether the client has closed while we still wait for bytes of it, found so twice: once it could be that its last
 * bytes were only just read. */
static bool is_gone(struct peer *peer)
{
	char byte = 0;
	bool waits = atomic_load(&peer->receives) || atomic_load(&peer->owes_since_ms);
	bool closed = waits && recv(peer->socket, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
	peer->seen_gone = closed ? peer->seen_gone + 1 : 0;
	return peer->seen_gone == 2;
}

static void close_dawdlers(struct http_server *server, int64_t now_ms)
{
	int64_t patience_ms = 1000 * (int64_t)server->settings.idle_timeout_s;
	pthread_mutex_lock(&server->lock);
	for (struct peer *peer = server->peers; peer; peer = peer->next) {
		int64_t since_ms = atomic_load(&peer->owes_since_ms);
		if ((since_ms && now_ms - since_ms > patience_ms) || is_gone(peer))
			shutdown(peer->socket, SHUT_RDWR);
	}
	pthread_mutex_unlock(&server->lock);
}

/* --- held connections ------------------------------------------------------------------------------------------- */

static void hold(struct http_request *request)
{
	struct http_server *server = request->server;
	/* Suspended before it is in the list: whoever finds it there may resume it. */
	MHD_suspend_connection(request->connection);
	pthread_mutex_lock(&server->lock);
	request->next_held = server->held;
	server->held = request;
	metrics_set_held(server->settings.metrics, ++server->held_count);
	pthread_mutex_unlock(&server->lock);
}

/* Resumes what is due; with `all` everything. A stream that waits is always due: reading it tells. */
static void resume_held(struct http_server *server, bool all)
{
	int64_t now_ms = now_us() / 1000;
	pthread_mutex_lock(&server->lock);
	for (struct http_request **link = &server->held; *link;) {
		struct http_request *request = *link;
		if (!all && request->phase == PHASE_HELD && !exchange_is_due(request->exchange, now_ms)) {
			link = &request->next_held;
			continue;
		}
		*link = request->next_held;
		metrics_set_held(server->settings.metrics, --server->held_count);
		MHD_resume_connection(request->connection);
	}
	pthread_mutex_unlock(&server->lock);
}

/* --- responses -------------------------------------------------------------------------------------------------- */

/* A stream on its way out. The library may keep it a little longer than the request. */
struct sending {
	struct api_stream *stream;    /* owned */
	struct http_request *request; /* borrowed; valid while the library reads */
};

static ssize_t read_stream(void *context, uint64_t offset, char *bytes, size_t size)
{
	struct sending *sending = context;
	struct api_stream *stream = sending->stream;
	size_t got = 0;
	if (stream->read(stream, offset, bytes, size, &got))
		return MHD_CONTENT_READER_END_WITH_ERROR;
	if (got || !stream->is_waiting || atomic_load(&sending->request->server->draining))
		return got ? (ssize_t)got : MHD_CONTENT_READER_END_OF_STREAM;
	hold(sending->request);
	return 0;
}

static void close_stream(void *context)
{
	struct sending *sending = context;
	sending->stream->close(sending->stream);
	free(sending);
}

static struct MHD_Response *make_stream(struct http_request *request, struct api_response *response)
{
	uint64_t size = response->stream->size == API_STREAM_UNKNOWN ? MHD_SIZE_UNKNOWN : response->stream->size;
	struct sending *sending = malloc(sizeof *sending);
	if (!sending)
		return NULL;
	*sending = (struct sending){response->stream, request};
	struct MHD_Response *made =
		MHD_create_response_from_callback(size, STREAM_BLOCK, read_stream, sending, close_stream);
	if (made)
		response->stream = NULL;
	else
		free(sending);
	return made;
}

/* The body changes hands: from the response to the library. */
static struct MHD_Response *make_response(struct http_request *request, struct api_response *response)
{
	struct MHD_Response *made = NULL;
	if (response->stream)
		return make_stream(request, response);
	made = response->bytes ? MHD_create_response_from_buffer(response->size, response->bytes, MHD_RESPMEM_MUST_FREE)
			       : MHD_create_response_from_buffer(0, (void *)"", MHD_RESPMEM_PERSISTENT);
	if (made)
		response->bytes = NULL;
	return made;
}

static enum MHD_Result send_response(struct http_request *request)
{
	struct api_response *response = exchange_response(request->exchange);
	struct MHD_Response *made = make_response(request, response);
	if (!made)
		return MHD_NO;
	for (size_t i = 0; i < response->header_count; i++)
		MHD_add_response_header(made, response->headers[i].name, response->headers[i].value);
	if (atomic_load(&request->server->draining))
		MHD_add_response_header(made, "Connection", "close");
	request->status = response->status;
	request->phase = PHASE_SENDING;
	enum MHD_Result result = MHD_queue_response(request->connection, response->status, made);
	MHD_destroy_response(made);
	return result;
}

/* --- requests --------------------------------------------------------------------------------------------------- */

static const char *find_header(void *context, const char *name)
{
	return MHD_lookup_connection_value(context, MHD_HEADER_KIND, name);
}

static void *on_request_line(void *context, const char *target, struct MHD_Connection *connection)
{
	struct http_server *server = context;
	struct http_request *request = calloc(1, sizeof *request);
	(void)connection;
	if (!request)
		return NULL;
	request->server = server;
	request->started_us = now_us();
	request->exchange = exchange_new(server->settings.api, target);
	if (!request->exchange) {
		free(request);
		return NULL;
	}
	atomic_fetch_add(&server->active, 1);
	return request;
}

/* Whether an answer that is known before the body should not wait for it. */
static bool should_answer_early(const struct http_request *request)
{
	uint64_t length = 0;
	const char *expect = find_header(request->connection, "Expect");
	return expect || (header_content_length(find_header(request->connection, "Content-Length"), &length) &&
			  length > EARLY_ANSWER_BYTES);
}

/* How many times a header that says where the body ends stands in the head. */
struct framing {
	unsigned lengths, encodings;
};

static enum MHD_Result count_framing(void *context, enum MHD_ValueKind kind, const char *name, const char *value)
{
	struct framing *framing = context;
	(void)kind;
	(void)value;
	framing->lengths += !strcasecmp(name, "Content-Length");
	framing->encodings += !strcasecmp(name, "Transfer-Encoding");
	return MHD_YES;
}

/* A head that says in two ways, or in one that we do not understand, where its body ends (RFC 9112, 6.3). The library
 * takes the first; another server on the way may take the other, and then what one reads as a body is a request to the
 * other. */
static bool is_ambiguous(const struct http_request *request)
{
	struct framing framing = {0};
	const char *encoding = find_header(request->connection, "Transfer-Encoding");
	MHD_get_connection_values(request->connection, MHD_HEADER_KIND, count_framing, &framing);
	return framing.lengths + framing.encodings > 1 || (encoding && strcasecmp(encoding, "chunked") != 0);
}

static enum MHD_Result refuse_ambiguous(struct http_request *request, const struct api_request *head)
{
	struct tw_error error = {0};
	(void)tw_fail(&error, TW_ERROR_INPUT, "malformed-header", "Content-Length",
		      "say once where the body ends: one Content-Length, or Transfer-Encoding: chunked");
	exchange_refuse(request->exchange, head, &error);
	set_peer(request->connection, 0, false);
	return send_response(request);
}

static enum MHD_Result take_head(struct http_request *request, struct MHD_Connection *connection, const char *method)
{
	request->connection = connection;
	request->phase = PHASE_BODY;
	snprintf(request->method, sizeof request->method, "%s", method);
	set_peer(connection, 0, true);
	struct api_request head = {request->method, find_header, connection};
	if (is_ambiguous(request))
		return refuse_ambiguous(request, &head);
	if (exchange_headers(request->exchange, &head) != EXCHANGE_ANSWERED || !should_answer_early(request))
		return MHD_YES;
	set_peer(connection, 0, false);
	return send_response(request);
}

/* --- steps that may have to wait -------------------------------------------------------------------------------- */

static void run_step(struct http_request *request)
{
	if (request->piece_size)
		request->state = exchange_body(request->exchange, request->piece, request->piece_size);
	request->piece_size = 0;
	if (request->phase == PHASE_ENDING)
		request->state = exchange_end(request->exchange);
}

static struct http_request *request_of(struct task *task)
{
	return (struct http_request *)((char *)task - offsetof(struct http_request, task));
}

static void run_elsewhere(struct task *task)
{
	struct http_request *request = request_of(task);
	run_step(request);
	struct MHD_Connection *connection = request->connection;
	atomic_store(&request->is_busy, false);
	MHD_resume_connection(connection);
}

/* False where the executor takes nothing any more. */
static bool execute(struct http_server *server, struct task *task, void (*run)(struct task *task))
{
	task->run = run;
	pthread_mutex_lock(&server->lock);
	bool takes = !server->stopping;
	if (takes)
		executor_run(server->executor, task);
	pthread_mutex_unlock(&server->lock);
	return takes;
}

/* Hands on what has come of the body and, in PHASE_ENDING, its end. */
static void take_step(struct http_request *request)
{
	atomic_store(&request->is_busy, true);
	MHD_suspend_connection(request->connection);
	if (!execute(request->server, &request->task, run_elsewhere))
		run_elsewhere(&request->task);
}

static enum MHD_Result collect_piece(struct http_request *request, const char *bytes, size_t *size)
{
	size_t part = PIECE_BYTES - request->piece_size;
	part = part < *size ? part : *size;
	if (!request->piece)
		request->piece = malloc(PIECE_BYTES);
	if (!request->piece)
		return MHD_NO;
	memcpy(request->piece + request->piece_size, bytes, part);
	request->piece_size += part;
	request->received += part;
	*size -= part;
	metrics_count_received(request->server->settings.metrics, part);
	if (request->piece_size == PIECE_BYTES)
		take_step(request);
	return MHD_YES;
}

/* `*size` becomes what was not taken yet. */
static enum MHD_Result take_body(struct http_request *request, const char *bytes, size_t *size)
{
	if (exchange_is_streamed(request->exchange))
		return collect_piece(request, bytes, size);
	size_t taken = *size;
	*size = 0;
	request->received += taken;
	metrics_count_received(request->server->settings.metrics, taken);
	if (exchange_body(request->exchange, bytes, taken) != EXCHANGE_ANSWERED)
		return MHD_YES;
	request->swallowed += taken;
	return request->swallowed <= SWALLOW_BYTES ? MHD_YES : MHD_NO;
}

static enum MHD_Result take_end(struct http_request *request)
{
	set_peer(request->connection, 0, false);
	if (request->phase == PHASE_BODY) {
		request->phase = PHASE_ENDING;
		if (exchange_may_wait(request->exchange)) {
			take_step(request);
			return MHD_YES;
		}
		run_step(request);
	} else if (request->phase == PHASE_HELD) {
		request->state = exchange_resume(request->exchange);
	}
	if (request->state != EXCHANGE_HELD)
		return send_response(request);
	if (atomic_load(&request->server->draining)) {
		exchange_resume(request->exchange);
		return send_response(request);
	}
	request->phase = PHASE_HELD;
	hold(request);
	return MHD_YES;
}

static enum MHD_Result on_access(void *context, struct MHD_Connection *connection, const char *url, const char *method,
				 const char *version, const char *upload_data, size_t *upload_data_size,
				 void **request_context)
{
	struct http_request *request = *request_context;
	(void)context;
	(void)url;
	(void)version;
	if (!request)
		return MHD_NO;
	if (request->phase == PHASE_HEAD)
		return take_head(request, connection, method);
	/* More of the body may lie in the library's buffer: it will be shown again. */
	if (atomic_load(&request->is_busy))
		return MHD_YES;
	return *upload_data_size ? take_body(request, upload_data, upload_data_size) : take_end(request);
}

static void log_request(const struct http_request *request, double seconds, enum MHD_RequestTerminationCode code)
{
	const struct route *route = exchange_route(request->exchange);
	log_event(LOG_LEVEL_INFO, "request", "id=%s method=%s route=\"%s\" status=%u ms=%.2f received=%llu%s",
		  exchange_request_id(request->exchange), request->method, route ? route->path : "", request->status,
		  seconds * 1e3, (unsigned long long)request->received,
		  code == MHD_REQUEST_TERMINATED_COMPLETED_OK ? "" : " aborted=true");
}

static void free_request(struct http_request *request)
{
	struct http_server *server = request->server;
	exchange_free(request->exchange);
	free(request->piece);
	free(request);
	atomic_fetch_sub(&server->active, 1);
}

static void free_elsewhere(struct task *task)
{
	free_request(request_of(task));
}

static void on_completed(void *context, struct MHD_Connection *connection, void **request_context,
			 enum MHD_RequestTerminationCode code)
{
	struct http_server *server = context;
	struct http_request *request = *request_context;
	if (!request)
		return;
	*request_context = NULL;
	double seconds = (double)(now_us() - request->started_us) / 1e6;
	if (request->connection) {
		set_peer(connection, now_us() / 1000, false);
		if (!request->status)
			request->status = STATUS_CLIENT_GONE;
		metrics_count_request(server->settings.metrics, exchange_route(request->exchange), request->status,
				      seconds);
		log_request(request, seconds, code);
	}
	/* What a client has left half sent is discarded. */
	bool may_wait = exchange_may_wait(request->exchange);
	if (!may_wait || !execute(server, &request->task, free_elsewhere))
		free_request(request);
}

/* The api decodes the target itself. */
static size_t leave_escapes(void *context, struct MHD_Connection *connection, char *text)
{
	(void)context;
	(void)connection;
	return strlen(text);
}

static void log_library(void *context, const char *format, va_list arguments)
{
	char text[512];
	(void)context;
	vsnprintf(text, sizeof text, format, arguments);
	text[strcspn(text, "\n")] = 0;
	log_event(LOG_LEVEL_DEBUG, "http", "text=\"%s\"", text);
}

/* --- the server ------------------------------------------------------------------------------------------------- */

static struct MHD_Daemon *start_daemon(struct http_server *server)
{
	const struct http_settings *s = &server->settings;
	unsigned flags = MHD_USE_EPOLL | MHD_USE_INTERNAL_POLLING_THREAD | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ITC |
			 MHD_USE_ERROR_LOG;
	struct MHD_OptionItem pool[] = {
		{s->threads > 1 ? MHD_OPTION_THREAD_POOL_SIZE : MHD_OPTION_END, (intptr_t)s->threads, NULL},
		{MHD_OPTION_END, 0, NULL},
	};
	/* The library shares the limit out among its threads, at least one each. */
	return MHD_start_daemon(
		flags, 0, NULL, NULL, on_access, server, MHD_OPTION_EXTERNAL_LOGGER, log_library, server,
		MHD_OPTION_LISTEN_SOCKET, (MHD_socket)s->socket, MHD_OPTION_CONNECTION_LIMIT, s->connections,
		MHD_OPTION_CONNECTION_TIMEOUT, s->idle_timeout_s, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
		(size_t)CONNECTION_MEMORY, MHD_OPTION_STRICT_FOR_CLIENT, 1, MHD_OPTION_SIGPIPE_HANDLED_BY_APP, 1,
		MHD_OPTION_UNESCAPE_CALLBACK, leave_escapes, server, MHD_OPTION_URI_LOG_CALLBACK, on_request_line,
		server, MHD_OPTION_NOTIFY_COMPLETED, on_completed, server, MHD_OPTION_NOTIFY_CONNECTION, on_connection,
		server, MHD_OPTION_ARRAY, pool, MHD_OPTION_END);
}

enum tw_status http_start(struct http_server **server, const struct http_settings *settings, struct tw_error *error)
{
	struct http_server *made = calloc(1, sizeof *made);
	*server = NULL;
	if (!made)
		return tw_fail_memory(error);
	made->settings = *settings;
	made->quiesced = MHD_INVALID_SOCKET;
	pthread_mutex_init(&made->lock, NULL);
	enum tw_status status = executor_new(&made->executor, WRITE_THREADS, error);
	if (status != TW_OK) {
		pthread_mutex_destroy(&made->lock);
		free(made);
		return status;
	}
	made->daemon = start_daemon(made);
	if (!made->daemon) {
		executor_free(made->executor);
		pthread_mutex_destroy(&made->lock);
		free(made);
		return tw_fail(error, TW_ERROR_IO, "http", NULL,
			       "the HTTP server cannot be started; see --log-level debug");
	}
	*server = made;
	return TW_OK;
}

void http_tick(struct http_server *server, bool jobs_changed)
{
	int64_t now_ms = now_us() / 1000;
	if (jobs_changed || now_ms >= server->next_held_ms) {
		server->next_held_ms = now_ms + TICK_HELD_MS;
		/* Whoever was held while the drain began must not wait for its end. */
		resume_held(server, atomic_load(&server->draining));
	}
	if (now_ms < server->next_peers_ms)
		return;
	server->next_peers_ms = now_ms + TICK_PEERS_MS;
	close_dawdlers(server, now_ms);
}

void http_drain(struct http_server *server)
{
	atomic_store(&server->draining, true);
	/* Shut down, so that clients are refused; not closed, because the threads may still have it in their hands. */
	server->quiesced = MHD_quiesce_daemon(server->daemon);
	if (server->quiesced != MHD_INVALID_SOCKET)
		shutdown(server->quiesced, SHUT_RDWR);
	resume_held(server, true);
}

unsigned http_active(const struct http_server *server)
{
	return atomic_load(&server->active);
}

void http_stop(struct http_server *server)
{
	if (!server)
		return;
	pthread_mutex_lock(&server->lock);
	server->stopping = true;
	pthread_mutex_unlock(&server->lock);
	executor_free(server->executor);
	resume_held(server, true);
	MHD_stop_daemon(server->daemon);
	if (server->quiesced != MHD_INVALID_SOCKET)
		close(server->quiesced);
	pthread_mutex_destroy(&server->lock);
	free(server);
}
