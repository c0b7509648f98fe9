/* Loops: a thread with an epoll each, and the connections that it has. A connection belongs to one loop at a time and
 * moves through the other's inbox. Loop 0 is the front: it has the listening socket and the heads. The others relay. */
#include "service/daemon/http/server.h"

#include "service/clock.h"
#include "service/daemon/http/address.h"
#include "service/daemon/http/connection.h"
#include "service/log.h"

#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#define ENGINE_CONNECTIONS 65536u /* of the limits in front of it each is lower */
#define RELAYS 2                  /* threads that relay: they copy, and wait for nothing but sockets */
#define EVENTS_AT_ONCE 64
#define ACCEPTS_AT_ONCE 64
#define TICK_MS 200 /* between looks at the time of connections */

struct client {
	struct http_connection *connection; /* owned */
	struct client *next, *previous;
	struct loop *loop; /* whose it is */
	uint64_t address;
	bool is_known; /* to epoll, with `events` */
	unsigned events;
	unsigned relay_events; /* that epoll knows of the relay, where it has a watcher */
	bool is_dead;          /* to be freed when the events at hand have been seen to */
};

struct loop {
	struct http_server *server;
	pthread_t thread;
	bool is_running;
	int epoll, wake; /* wake: an eventfd */
	struct client *clients, *dead;
	unsigned excused_count; /* front: of its clients, those beyond the limits */
	int64_t next_tick_ms;
	atomic_uint load; /* clients, for whoever chooses a loop */
	pthread_mutex_t lock;
	struct client *inbox;      /* guarded by `lock` */
	struct epoll_event *batch; /* borrowed: events at hand that have not been seen to */
	int batch_size;
	char scratch[CONNECTION_SCRATCH];
};

struct http_server {
	struct http_context context;
	struct address_table *addresses;
	int socket;
	bool is_paused; /* front: the listening socket is not looked at, for want of descriptors */
	atomic_bool stopping;
	atomic_uint clients;
	struct engine *engine; /* owned */
	unsigned loop_count;   /* the front and RELAYS */
	struct loop **loops;   /* owned */
};

static const struct tw_error too_many = {
	.status = TW_ERROR_LIMIT,
	.type = "too-many-connections",
	.text = "the service has as many connections as it can serve; try again in a moment",
};
static const struct tw_error too_many_of_yours = {
	.status = TW_ERROR_LIMIT,
	.type = "too-many-of-one-address",
	.text = "your address has too many connections; close some, or use one for several requests",
};

static bool is_front(const struct loop *loop)
{
	return loop == loop->server->loops[0];
}

/* --- clients of a loop ----------------------------------------------------------------------------------------------
 */

static void link_client(struct loop *loop, struct client *client)
{
	client->loop = loop;
	client->previous = NULL;
	client->next = loop->clients;
	if (client->next)
		client->next->previous = client;
	loop->clients = client;
	loop->excused_count += client->connection->excuse != NULL;
}

static void unlink_client(struct loop *loop, struct client *client)
{
	if (client->next)
		client->next->previous = client->previous;
	if (client->previous)
		client->previous->next = client->next;
	else
		loop->clients = client->next;
	loop->excused_count -= client->connection->excuse != NULL;
}

static void wake(struct loop *loop)
{
	/* A full counter wakes too. */
	if (write(loop->wake, &(uint64_t){1}, sizeof(uint64_t)) < 0)
		return;
}

/* Epoll of this loop knows it no more, and what it has told already is not seen to. */
static void leave(struct loop *loop, struct client *client)
{
	if (client->is_known)
		epoll_ctl(loop->epoll, EPOLL_CTL_DEL, client->connection->socket, NULL);
	relay_unwatch(&client->connection->relay);
	client->is_known = false;
	for (int i = 0; i < loop->batch_size; i++)
		if (loop->batch[i].data.ptr == client)
			loop->batch[i].data.ptr = NULL;
}

static void drop(struct loop *loop, struct client *client)
{
	struct http_server *server = loop->server;
	unlink_client(loop, client);
	leave(loop, client);
	http_connection_free(client->connection);
	client->connection = NULL;
	address_remove(server->addresses, client->address);
	metrics_set_connections(server->context.metrics, atomic_fetch_sub(&server->clients, 1) - 1);
	atomic_fetch_sub(&loop->load, 1);
	client->is_dead = true;
	client->next = loop->dead;
	loop->dead = client;
}

static void bury(struct loop *loop)
{
	while (loop->dead) {
		struct client *client = loop->dead;
		loop->dead = client->next;
		free(client);
	}
}

/* The relay with the fewest clients. */
static struct loop *choose_relay(const struct http_server *server)
{
	struct loop *best = server->loops[1];
	for (unsigned i = 2; i < server->loop_count; i++)
		if (atomic_load(&server->loops[i]->load) < atomic_load(&best->load))
			best = server->loops[i];
	return best;
}

static void move(struct loop *from, struct loop *to, struct client *client)
{
	unlink_client(from, client);
	leave(from, client);
	atomic_fetch_sub(&from->load, 1);
	atomic_fetch_add(&to->load, 1);
	pthread_mutex_lock(&to->lock);
	client->next = to->inbox;
	to->inbox = client;
	pthread_mutex_unlock(&to->lock);
	wake(to);
}

static bool tell_epoll(struct loop *loop, int socket, struct client *client, bool *is_known, unsigned *known,
		       unsigned events)
{
	struct epoll_event event = {.events = events, .data.ptr = client};
	if (*is_known && *known == events)
		return true;
	int code = epoll_ctl(loop->epoll, *is_known ? EPOLL_CTL_MOD : EPOLL_CTL_ADD, socket, &event);
	*is_known = true;
	*known = events;
	return code == 0;
}

/* Tells epoll what the connection waits for. The relay's socket is taken away while nothing is wanted of it: that its
 * other end is closed would be told again and again. */
static void listen_to(struct loop *loop, struct client *client)
{
	struct http_connection *c = client->connection;
	struct relay *relay = &c->relay;
	bool is_relay_known = relay->watcher >= 0, is_wanted = c->phase == CONNECTION_RELAYING && c->relay_events;
	bool goes = tell_epoll(loop, c->socket, client, &client->is_known, &client->events, c->events);
	if (!is_wanted)
		relay_unwatch(relay);
	else if (goes)
		goes = tell_epoll(loop, relay->socket, client, &is_relay_known, &client->relay_events, c->relay_events);
	if (is_wanted && is_relay_known)
		relay->watcher = loop->epoll;
	if (!goes)
		drop(loop, client);
}

static void obey(struct loop *loop, struct client *client, enum connection_outcome outcome)
{
	struct http_server *server = loop->server;
	struct http_connection *c = client->connection;
	while (outcome == CONNECTION_IS_IDLE && is_front(loop))
		outcome = http_connection_run(c, false, loop->scratch, monotonic_ms());
	switch (outcome) {
	case CONNECTION_WAITS:
		listen_to(loop, client);
		return;
	case CONNECTION_NEEDS_ENGINE:
		move(loop, choose_relay(server), client);
		return;
	case CONNECTION_IS_IDLE:
		move(loop, server->loops[0], client);
		return;
	case CONNECTION_ENDS:
		drop(loop, client);
		return;
	}
}

static void run(struct loop *loop, struct client *client)
{
	obey(loop, client, http_connection_run(client->connection, !is_front(loop), loop->scratch, monotonic_ms()));
}

/* --- new connections ------------------------------------------------------------------------------------------------
 */

/* The client that has been idle for longest. */
static struct client *find_idle(const struct loop *front)
{
	struct client *oldest = NULL;
	for (struct client *client = front->clients; client; client = client->next) {
		const struct http_connection *c = client->connection;
		if (c->excuse || c->phase != CONNECTION_IDLE)
			continue;
		if (!oldest || c->since_ms < oldest->connection->since_ms)
			oldest = client;
	}
	return oldest;
}

/* Of those beyond the limits the one that can go first: who has its answer, then who has been there for longest. */
static struct client *find_excused(const struct loop *front)
{
	struct client *first = NULL;
	for (struct client *client = front->clients; client; client = client->next) {
		const struct http_connection *c = client->connection;
		if (!c->excuse)
			continue;
		if (c->phase == CONNECTION_LINGERING)
			return client;
		if (!first || c->since_ms < first->connection->since_ms)
			first = client;
	}
	return first;
}

/* Makes room where there is none; NULL, or why the new client is one too many. */
static const struct tw_error *find_excuse(struct loop *front, unsigned of_address)
{
	struct http_server *server = front->server;
	const struct http_limits *limits = &server->context.limits;
	unsigned usual = atomic_load(&server->clients) - front->excused_count;
	if (of_address > atomic_load(&limits->per_address))
		return &too_many_of_yours;
	if (usual < atomic_load(&limits->connections))
		return NULL;
	struct client *idle = find_idle(front);
	if (!idle)
		return &too_many;
	drop(front, idle);
	return NULL;
}

static void welcome(struct loop *front, int socket, const struct sockaddr_storage *address)
{
	struct http_server *server = front->server;
	char peer[CONNECTION_PEER_SIZE];
	struct client *client = calloc(1, sizeof *client);
	uint64_t key = address_key(address, peer);
	if (client)
		client->connection = http_connection_new(&server->context, socket, peer, key);
	if (!client || !client->connection) {
		free(client);
		close(socket);
		return;
	}
	client->address = key;
	client->connection->excuse = find_excuse(front, address_add(server->addresses, key));
	struct client *oldest =
		client->connection->excuse && front->excused_count >= HTTP_RESERVE ? find_excused(front) : NULL;
	if (oldest)
		drop(front, oldest);
	metrics_set_connections(server->context.metrics, atomic_fetch_add(&server->clients, 1) + 1);
	atomic_fetch_add(&front->load, 1);
	link_client(front, client);
	run(front, client);
}

static void pause_listening(struct http_server *server, bool pause)
{
	struct epoll_event event = {.events = EPOLLIN, .data.ptr = server};
	server->is_paused = pause;
	epoll_ctl(server->loops[0]->epoll, pause ? EPOLL_CTL_DEL : EPOLL_CTL_ADD, server->socket, &event);
}

/* Answers go out at once, and a client whose machine went away without a word is found out. */
static void tune(int socket)
{
	const struct {
		int level, name, value;
	} options[] = {
		{IPPROTO_TCP, TCP_NODELAY, 1},    {SOL_SOCKET, SO_KEEPALIVE, 1}, {IPPROTO_TCP, TCP_KEEPIDLE, 30},
		{IPPROTO_TCP, TCP_KEEPINTVL, 10}, {IPPROTO_TCP, TCP_KEEPCNT, 3},
	};
	for (size_t i = 0; i < sizeof options / sizeof *options; i++)
		(void)setsockopt(socket, options[i].level, options[i].name, &options[i].value, sizeof(int));
}

static void accept_some(struct loop *front)
{
	struct http_server *server = front->server;
	for (unsigned i = 0; i < ACCEPTS_AT_ONCE; i++) {
		struct sockaddr_storage address = {0};
		socklen_t size = sizeof address;
		int socket = accept4(server->socket, (struct sockaddr *)&address, &size, SOCK_NONBLOCK | SOCK_CLOEXEC);
		if (socket >= 0) {
			tune(socket);
			welcome(front, socket, &address);
			continue;
		}
		if (errno == ECONNABORTED || errno == EINTR)
			continue;
		if (errno == EAGAIN)
			return;
		if (!atomic_load(&server->context.draining))
			log_event(LOG_LEVEL_WARNING, "accept", "text=\"%s\"", strerror(errno));
		pause_listening(server, true);
		return;
	}
}

/* --- time -----------------------------------------------------------------------------------------------------------
 */

static void check_time(struct loop *loop, int64_t now)
{
	struct client *next = NULL;
	loop->next_tick_ms = now + TICK_MS;
	for (struct client *client = loop->clients; client; client = next) {
		next = client->next;
		enum connection_outcome outcome = http_connection_check_time(client->connection, loop->scratch, now);
		if (outcome != CONNECTION_WAITS || client->events != client->connection->events ||
		    client->connection->phase == CONNECTION_RELAYING)
			obey(loop, client, outcome);
	}
	if (is_front(loop) && loop->server->is_paused && !atomic_load(&loop->server->context.draining))
		pause_listening(loop->server, false);
}

/* --- loops ----------------------------------------------------------------------------------------------------------
 */

static void empty_inbox(struct loop *loop)
{
	pthread_mutex_lock(&loop->lock);
	struct client *client = loop->inbox;
	loop->inbox = NULL;
	pthread_mutex_unlock(&loop->lock);
	while (client) {
		struct client *next = client->next;
		link_client(loop, client);
		run(loop, client);
		client = next;
	}
}

static void take_event(struct loop *loop, const struct epoll_event *event)
{
	uint64_t count = 0;
	if (event->data.ptr == loop->server) {
		accept_some(loop);
	} else if (event->data.ptr == loop) {
		if (read(loop->wake, &count, sizeof count) < 0)
			return;
	} else if (event->data.ptr) {
		run(loop, event->data.ptr);
	}
}

static int timeout_of(const struct loop *loop, int64_t now)
{
	return loop->next_tick_ms > now ? (int)(loop->next_tick_ms - now) : 0;
}

static void *run_loop(void *context)
{
	struct loop *loop = context;
	struct http_server *server = loop->server;
	struct epoll_event events[EVENTS_AT_ONCE];
	while (!atomic_load(&server->stopping)) {
		int count = epoll_wait(loop->epoll, events, EVENTS_AT_ONCE, timeout_of(loop, monotonic_ms()));
		for (int i = 0; i < count; i++) {
			loop->batch = events + i + 1;
			loop->batch_size = count - i - 1;
			take_event(loop, &events[i]);
		}
		loop->batch_size = 0;
		bury(loop);
		empty_inbox(loop);
		int64_t now = monotonic_ms();
		bool draining = atomic_load(&server->context.draining);

		if (now >= loop->next_tick_ms || draining)
			check_time(loop, now);
		bury(loop);
	}
	/* Here, because what an exchange has begun in the store is this thread's. */
	while (loop->clients)
		drop(loop, loop->clients);
	bury(loop);
	return NULL;
}

static enum tw_status open_loop(struct http_server *server, unsigned i, struct tw_error *error)
{
	struct loop *loop = calloc(1, sizeof *loop);
	if (!loop)
		return tw_fail_memory(error);
	server->loops[i] = loop;
	loop->server = server;
	pthread_mutex_init(&loop->lock, NULL);
	loop->epoll = epoll_create1(EPOLL_CLOEXEC);
	loop->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
	struct epoll_event woken = {.events = EPOLLIN, .data.ptr = loop};
	struct epoll_event newcomers = {.events = EPOLLIN, .data.ptr = server};
	if (loop->epoll < 0 || loop->wake < 0 || epoll_ctl(loop->epoll, EPOLL_CTL_ADD, loop->wake, &woken) ||
	    (i == 0 && epoll_ctl(loop->epoll, EPOLL_CTL_ADD, server->socket, &newcomers)))
		return tw_fail(error, TW_ERROR_IO, "http", NULL, "the HTTP server cannot be started: %s",
			       strerror(errno));
	return TW_OK;
}

static enum tw_status start_loops(struct http_server *server, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	for (unsigned i = 0; i < server->loop_count && status == TW_OK; i++)
		status = open_loop(server, i, error);
	for (unsigned i = 0; i < server->loop_count && status == TW_OK; i++) {
		struct loop *loop = server->loops[i];
		loop->is_running = pthread_create(&loop->thread, NULL, run_loop, loop) == 0;
		if (!loop->is_running)
			status = tw_fail(error, TW_ERROR_IO, "http", NULL, "no thread for the HTTP server");
	}
	return status;
}

void http_set_limits(struct http_server *server, const struct http_limits *limits)
{
	struct http_limits *own = &server->context.limits;
	atomic_store(&own->connections, atomic_load(&limits->connections));
	atomic_store(&own->per_address, atomic_load(&limits->per_address));
	atomic_store(&own->held, atomic_load(&limits->held));
	atomic_store(&own->idle_s, atomic_load(&limits->idle_s));
	atomic_store(&own->head_s, atomic_load(&limits->head_s));
	atomic_store(&own->request_s, atomic_load(&limits->request_s));
	atomic_store(&own->rate_bytes_s, atomic_load(&limits->rate_bytes_s));
}

static enum tw_status start_engine(struct http_server *server, const struct http_settings *settings,
				   struct tw_error *error)
{
	const struct engine_settings own = {
		.api = settings->api,
		.metrics = settings->metrics,
		.threads = settings->threads,
		.connections = ENGINE_CONNECTIONS,
	};
	enum tw_status status = engine_start(&server->engine, &own, error);
	server->context.engine = server->engine;
	return status;
}

enum tw_status http_start(struct http_server **server, const struct http_settings *settings, struct tw_error *error)
{
	*server = NULL;
	struct http_server *made = calloc(1, sizeof *made);
	if (!made) {
		close(settings->socket);
		return tw_fail_memory(error);
	}
	made->socket = settings->socket;
	made->context.api = settings->api;
	made->context.metrics = settings->metrics;
	made->loop_count = 1 + RELAYS;
	http_set_limits(made, settings->limits);
	made->addresses = address_table_new();
	made->loops = calloc(made->loop_count, sizeof(struct loop *));
	*server = made; /* before its threads may ask for it */
	enum tw_status status =
		made->addresses && made->loops ? start_engine(made, settings, error) : tw_fail_memory(error);
	if (status == TW_OK)
		status = start_loops(made, error);
	if (status != TW_OK) {
		http_stop(made);
		*server = NULL;
	}
	return status;
}

static void wake_all(struct http_server *server)
{
	for (unsigned i = 0; i < server->loop_count; i++)
		wake(server->loops[i]);
}

void http_jobs_changed(struct http_server *server)
{
	engine_jobs_changed(server->engine);
}

bool http_may_hold(const struct http_server *server)
{
	return engine_held(server->engine) < atomic_load(&server->context.limits.held);
}

void http_drain(struct http_server *server)
{
	atomic_store(&server->context.draining, true);
	epoll_ctl(server->loops[0]->epoll, EPOLL_CTL_DEL, server->socket, NULL);
	shutdown(server->socket, SHUT_RDWR);
	engine_drain(server->engine);
	wake_all(server);
}

unsigned http_active(const struct http_server *server)
{
	if (!server || !server->engine)
		return 0;
	/* A request that is relayed is counted on both sides, but one side may be done with it before the other. */
	unsigned here = atomic_load(&server->context.active), there = engine_active(server->engine);
	return here > there ? here : there;
}

static void close_loop(struct loop *loop)
{
	while (loop->inbox) { /* whoever was on the move has nothing in the store */
		struct client *client = loop->inbox;
		loop->inbox = client->next;
		link_client(loop, client);
		drop(loop, client);
	}
	bury(loop);
	if (loop->epoll >= 0)
		close(loop->epoll);
	if (loop->wake >= 0)
		close(loop->wake);
	pthread_mutex_destroy(&loop->lock);
	free(loop);
}

void http_stop(struct http_server *server)
{
	if (!server)
		return;
	atomic_store(&server->stopping, true);
	for (unsigned i = 0; server->loops && i < server->loop_count; i++) {
		if (!server->loops[i] || !server->loops[i]->is_running)
			continue;
		wake(server->loops[i]);
		pthread_join(server->loops[i]->thread, NULL);
	}
	for (unsigned i = 0; server->loops && i < server->loop_count; i++)
		if (server->loops[i])
			close_loop(server->loops[i]);
	engine_stop(server->engine);
	close(server->socket);
	address_table_free(server->addresses);
	free(server->loops);
	free(server);
}
