/* How libmicrohttpd is used.
 *
 * One request is one exchange, made when the request line is known (uri log callback, the only place that has the
 * target as it came) and freed by the completion callback. In between the access handler is called once with the
 * headers, once for each piece of the body, once at its end, and once more after every resume. A connection carries one
 * request and ends with it: what is kept alive is the client's connection, in front.
 *
 * A step that may have to wait for the store's writer is not taken by the library's threads, which serve other clients
 * meanwhile, but by the executor's, while the connection is suspended; then the access handler is called once more.
 *
 * Threads: the library's own, which never share a connection, the executor's, and one that looks after those who wait
 * for jobs. `lock` guards the list of held requests: a request is in it only while it is suspended, before its response
 * (`Prefer: wait`) or within it (a stream that has nothing to send yet). The library does not look at the socket of a
 * suspended connection, so that thread does: whose client has left is resumed, and ends. */
#include "service/daemon/http/engine.h"

#include "api/exchange.h"
#include "api/header.h"
#include "service/clock.h"
#include "service/daemon/executor.h"
#include "service/daemon/http/account.h"
#include "service/log.h"

#include <errno.h>
#include <microhttpd.h>
#include <poll.h>
#include <pthread.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#define CONNECTION_MEMORY (64u << 10) /* head of a request, and its read buffer */
/* Threads that may wait for the store's writer, and for the disk, at once. Where each wait takes 5 ms more, 32 clients
 * submit 1,370 a second with 16 threads and 2,180 with 32. */
#define WRITE_THREADS 32
#define PIECE_BYTES (256u << 10)       /* of an upload that are handed on at once */
#define STREAM_BLOCK (256u << 10)      /* read from the store at once */
#define EARLY_ANSWER_BYTES (16u << 20) /* bodies above this are not read when the answer is known before them */
#define SWALLOW_BYTES (1ull << 30)     /* of a body that has become pointless */
#define LOOK_MS 50       /* between looks for jobs that ended in a worker which is not ours, while somebody waits */
#define LOOK_ALL_MS 1000 /* between looks at all who wait, changed or not: a job may have been deleted */

enum phase { PHASE_HEAD, PHASE_BODY, PHASE_ENDING, PHASE_HELD, PHASE_SENDING };

struct http_request {
	struct engine *engine;
	struct MHD_Connection *connection; /* borrowed; NULL before the head is complete */
	struct exchange *exchange;         /* owned */
	struct engine_link *link;          /* shared */
	struct http_request *next_held;
	char method[16];
	enum phase phase;
	int socket;   /* our end of the pair, the library's */
	bool is_gone; /* the client has left while the connection was suspended */
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

struct engine {
	struct engine_settings settings;
	struct MHD_Daemon *daemon;
	struct executor *executor;
	pthread_mutex_t lock;
	struct http_request *held;
	bool stopping; /* guarded by lock: the executor takes nothing any more */
	atomic_uint active, held_count;
	atomic_bool draining, is_over;
	pthread_t keeper; /* looks after those who wait */
	bool has_keeper;
	int wake; /* eventfd */
};

/* --- pairs ------------------------------------------------------------------------------------------------------ */

void engine_unlink(struct engine_link *link)
{
	if (link && atomic_fetch_sub(&link->users, 1) == 1)
		free(link);
}

/* The library keeps an address with each connection; ours holds the link. */
int engine_connect(struct engine *engine, const char *peer, struct engine_link **link)
{
	int ends[2];
	struct engine_link *made = calloc(1, sizeof *made);
	struct sockaddr_un address = {.sun_family = AF_UNIX};
	if (!made || socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends)) {
		free(made);
		return -1;
	}
	atomic_init(&made->users, 2);
	snprintf(made->peer, sizeof made->peer, "%s", peer);
	memcpy(address.sun_path, &made, sizeof(struct engine_link *));
	*link = made;
	if (MHD_add_connection(engine->daemon, ends[1], (struct sockaddr *)&address, sizeof address) == MHD_YES)
		return ends[0];
	/* The library has closed its end. */
	close(ends[0]);
	free(made);
	return -1;
}

static void on_connection(void *context, struct MHD_Connection *connection, void **socket_context,
			  enum MHD_ConnectionNotificationCode code)
{
	(void)context;
	const union MHD_ConnectionInfo *info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
	if (code == MHD_CONNECTION_NOTIFY_STARTED && info) {
		const struct sockaddr_un *address = (const struct sockaddr_un *)(const void *)info->client_addr;
		memcpy(socket_context, address->sun_path, sizeof(void *));
	} else {
		engine_unlink(*socket_context);
		*socket_context = NULL;
	}
}

/* --- held connections ------------------------------------------------------------------------------------------- */

static void wake(struct engine *engine)
{
	/* A full counter wakes too. */
	if (write(engine->wake, &(uint64_t){1}, sizeof(uint64_t)) < 0)
		return;
}

static void hold(struct http_request *request)
{
	struct engine *engine = request->engine;
	/* Suspended before it is in the list: whoever finds it there may resume it. */
	MHD_suspend_connection(request->connection);
	pthread_mutex_lock(&engine->lock);
	request->next_held = engine->held;
	engine->held = request;
	atomic_store(&request->link->is_held, true);
	unsigned before = atomic_fetch_add(&engine->held_count, 1);
	metrics_set_held(engine->settings.metrics, before + 1);
	pthread_mutex_unlock(&engine->lock);
	if (!before)
		wake(engine); /* the keeper sleeps while there is nobody */
}

static bool has_left(const struct http_request *request)
{
	struct pollfd end = {request->socket, POLLRDHUP, 0};
	return poll(&end, 1, 0) > 0 && (end.revents & (POLLRDHUP | POLLHUP | POLLERR));
}

static bool is_due(struct http_request *request, int64_t now_ms, bool changed)
{
	request->is_gone = has_left(request);
	if (request->is_gone)
		return true;
	if (request->phase != PHASE_HELD)
		return changed; /* reading the stream tells */
	return now_ms >= exchange_until_ms(request->exchange) || (changed && exchange_is_due(request->exchange));
}

/* Resumes what is due; with `all` everything. */
static void resume_held(struct engine *engine, bool changed, bool all)
{
	int64_t now_ms = monotonic_ms();
	pthread_mutex_lock(&engine->lock);
	for (struct http_request **link = &engine->held; *link;) {
		struct http_request *request = *link;
		if (!is_due(request, now_ms, changed) && !all) {
			link = &request->next_held;
			continue;
		}
		*link = request->next_held;
		atomic_store(&request->link->is_held, false);
		metrics_set_held(engine->settings.metrics, atomic_fetch_sub(&engine->held_count, 1) - 1);
		MHD_resume_connection(request->connection);
	}
	pthread_mutex_unlock(&engine->lock);
}

/* The store is asked once for all who wait whether anything has changed. */
static void *keep(void *context)
{
	struct engine *engine = context;
	int64_t seen = -1, look_all_ms = 0;
	while (!atomic_load(&engine->is_over)) {
		uint64_t count = 0;
		struct pollfd wake = {engine->wake, POLLIN, 0};
		if (poll(&wake, 1, atomic_load(&engine->held_count) ? LOOK_MS : -1) > 0 &&
		    read(engine->wake, &count, sizeof count) < 0 && errno != EAGAIN)
			break;
		int64_t now_ms = monotonic_ms(), change = seen;
		if (!atomic_load(&engine->held_count))
			continue;
		bool is_known = api_change(engine->settings.api, &change);
		bool changed = !is_known || change != seen || now_ms >= look_all_ms;
		if (now_ms >= look_all_ms)
			look_all_ms = now_ms + LOOK_ALL_MS;
		seen = change;
		resume_held(engine, changed, atomic_load(&engine->draining));
	}
	return NULL;
}

void engine_jobs_changed(struct engine *engine)
{
	wake(engine);
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
	if (sending->request->is_gone || stream->read(stream, offset, bytes, size, &got) != TW_OK)
		return MHD_CONTENT_READER_END_WITH_ERROR;
	if (got || !stream->is_waiting || atomic_load(&sending->request->engine->draining))
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
	struct engine *engine = context;
	struct http_request *request = calloc(1, sizeof *request);
	(void)connection;
	if (!request)
		return NULL;
	request->engine = engine;
	request->started_us = monotonic_us();
	request->exchange = exchange_new(engine->settings.api, target);
	if (!request->exchange) {
		free(request);
		return NULL;
	}
	atomic_fetch_add(&engine->active, 1);
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

static enum MHD_Result take_head(struct http_request *request, struct MHD_Connection *connection, const char *method)
{
	const union MHD_ConnectionInfo *info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
	request->connection = connection;
	request->link = info->socket_context;
	info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
	request->socket = info->connect_fd;
	request->phase = PHASE_BODY;
	snprintf(request->method, sizeof request->method, "%s", method);
	const struct api_request head = {
		.method = request->method,
		.host = find_header(connection, "Host"),
		.header = find_header,
		.context = connection,
	};
	enum exchange_state state = exchange_headers(request->exchange, &head);
	if (state == EXCHANGE_READING)
		state = exchange_open(request->exchange);
	return state == EXCHANGE_ANSWERED && should_answer_early(request) ? send_response(request) : MHD_YES;
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
static bool execute(struct engine *engine, struct task *task, void (*run)(struct task *task))
{
	task->run = run;
	pthread_mutex_lock(&engine->lock);
	bool takes = !engine->stopping;
	if (takes)
		executor_run(engine->executor, task);
	pthread_mutex_unlock(&engine->lock);
	return takes;
}

/* Hands on what has come of the body and, in PHASE_ENDING, its end. */
static void take_step(struct http_request *request)
{
	atomic_store(&request->is_busy, true);
	MHD_suspend_connection(request->connection);
	if (!execute(request->engine, &request->task, run_elsewhere))
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
	metrics_count_received(request->engine->settings.metrics, part);
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
	metrics_count_received(request->engine->settings.metrics, taken);
	if (exchange_body(request->exchange, bytes, taken) != EXCHANGE_ANSWERED)
		return MHD_YES;
	request->swallowed += taken;
	return request->swallowed <= SWALLOW_BYTES ? MHD_YES : MHD_NO;
}

static enum MHD_Result take_end(struct http_request *request)
{
	if (request->phase == PHASE_BODY) {
		request->phase = PHASE_ENDING;
		if (!exchange_may_wait(request->exchange))
			run_step(request);
		if (exchange_may_wait(request->exchange)) {
			take_step(request);
			return MHD_YES;
		}
	} else if (request->is_gone) {
		return MHD_NO;
	} else if (request->phase == PHASE_HELD) {
		request->state = exchange_resume(request->exchange);
	}
	if (request->state != EXCHANGE_HELD)
		return send_response(request);
	if (atomic_load(&request->engine->draining)) {
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

static void account_for(const struct http_request *request, enum MHD_RequestTerminationCode code)
{
	account_request(request->engine->settings.metrics,
			&(struct account){
				.exchange = request->exchange,
				.peer = request->link->peer,
				.method = request->method,
				.status = request->status,
				.started_us = request->started_us,
				.received = request->received,
				.is_complete = code == MHD_REQUEST_TERMINATED_COMPLETED_OK,
			});
}

static void free_request(struct http_request *request)
{
	struct engine *engine = request->engine;
	exchange_free(request->exchange);
	free(request->piece);
	free(request);
	atomic_fetch_sub(&engine->active, 1);
}

static void free_elsewhere(struct task *task)
{
	free_request(request_of(task));
}

static void on_completed(void *context, struct MHD_Connection *connection, void **request_context,
			 enum MHD_RequestTerminationCode code)
{
	struct engine *engine = context;
	(void)connection;
	struct http_request *request = *request_context;
	if (!request)
		return;
	*request_context = NULL;
	if (request->connection)
		account_for(request, code);
	bool is_alone = code == MHD_REQUEST_TERMINATED_WITH_ERROR || code == MHD_REQUEST_TERMINATED_READ_ERROR ||
			code == MHD_REQUEST_TERMINATED_CLIENT_ABORT;
	if ((request->is_gone || is_alone) && !atomic_load(&engine->draining))
		exchange_leave(request->exchange);
	/* What a client has left half sent is discarded, and what it waited for perhaps cancelled. */
	bool may_wait = exchange_may_wait(request->exchange);
	if (!may_wait || !execute(engine, &request->task, free_elsewhere))
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

/* --- life ------------------------------------------------------------------------------------------------------- */

static struct MHD_Daemon *start_daemon(struct engine *engine)
{
	const struct engine_settings *s = &engine->settings;
	unsigned flags = MHD_USE_EPOLL | MHD_USE_INTERNAL_POLLING_THREAD | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ITC |
			 MHD_USE_ERROR_LOG | MHD_USE_NO_LISTEN_SOCKET;
	struct MHD_OptionItem pool[] = {
		{s->threads > 1 ? MHD_OPTION_THREAD_POOL_SIZE : MHD_OPTION_END, (intptr_t)s->threads, NULL},
		{MHD_OPTION_END, 0, NULL},
	};
	return MHD_start_daemon(flags, 0, NULL, NULL, on_access, engine, MHD_OPTION_EXTERNAL_LOGGER, log_library,
				engine, MHD_OPTION_CONNECTION_LIMIT, s->connections, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
				(size_t)CONNECTION_MEMORY, MHD_OPTION_STRICT_FOR_CLIENT, 1,
				MHD_OPTION_SIGPIPE_HANDLED_BY_APP, 1, MHD_OPTION_UNESCAPE_CALLBACK, leave_escapes,
				engine, MHD_OPTION_URI_LOG_CALLBACK, on_request_line, engine,
				MHD_OPTION_NOTIFY_COMPLETED, on_completed, engine, MHD_OPTION_NOTIFY_CONNECTION,
				on_connection, engine, MHD_OPTION_ARRAY, pool, MHD_OPTION_END);
}

enum tw_status engine_start(struct engine **engine, const struct engine_settings *settings, struct tw_error *error)
{
	*engine = NULL;
	struct engine *made = calloc(1, sizeof *made);
	if (!made)
		return tw_fail_memory(error);
	made->settings = *settings;
	pthread_mutex_init(&made->lock, NULL);
	made->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
	enum tw_status status = executor_new(&made->executor, WRITE_THREADS, error);
	if (status == TW_OK)
		made->daemon = start_daemon(made);
	if (status == TW_OK && made->daemon && made->wake >= 0)
		made->has_keeper = pthread_create(&made->keeper, NULL, keep, made) == 0;
	if (status == TW_OK && !made->has_keeper)
		status = tw_fail(error, TW_ERROR_IO, "http", NULL,
				 "the HTTP server cannot be started; see --log-level debug");
	if (status != TW_OK) {
		engine_stop(made);
		return status;
	}
	*engine = made;
	return TW_OK;
}

unsigned engine_active(const struct engine *engine)
{
	return atomic_load(&engine->active);
}

unsigned engine_held(const struct engine *engine)
{
	return atomic_load(&engine->held_count);
}

void engine_drain(struct engine *engine)
{
	atomic_store(&engine->draining, true);
	wake(engine);
}

void engine_stop(struct engine *engine)
{
	if (!engine)
		return;
	atomic_store(&engine->draining, true);
	atomic_store(&engine->is_over, true);
	if (engine->has_keeper) {
		wake(engine);
		pthread_join(engine->keeper, NULL);
	}
	/* What is suspended must go on before the library can end; what the executor has, it ends first. */
	pthread_mutex_lock(&engine->lock);
	engine->stopping = true;
	pthread_mutex_unlock(&engine->lock);
	executor_free(engine->executor);
	resume_held(engine, true, true);
	if (engine->daemon)
		MHD_stop_daemon(engine->daemon);
	if (engine->wake >= 0)
		close(engine->wake);
	pthread_mutex_destroy(&engine->lock);
	free(engine);
}
