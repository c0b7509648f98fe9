/* The HTTP server: connections on one side (connection.h), the api on the other.
 *
 * One thread accepts, reads heads, and answers what asks for nothing of the store: /livez, and every refusal. It never
 * waits for anything but sockets, so it always answers. A request that was let in moves with its connection to one of
 * the threads that relay it to libmicrohttpd (engine.h), and comes back when it is answered.
 *
 * Beyond its limits a client is not left waiting: a few connections more are accepted for as long as it takes to tell
 * them 503, or 429 to an address that has too many, or to answer /livez. Connections that are idle make room first. */
#ifndef SERVICE_DAEMON_HTTP_SERVER_H
#define SERVICE_DAEMON_HTTP_SERVER_H

#include "api/api.h"
#include "service/daemon/http/limits.h"
#include "service/daemon/metrics.h"
#include "tightwire.h"

#include <stdbool.h>

#define HTTP_RESERVE 256u /* connections beyond the limit */

struct http_server;

struct http_settings {
	struct api *api; /* borrowed, as is metrics; both must outlive the server */
	struct metrics *metrics;
	int socket;                       /* a listening socket, taken over; non-blocking */
	unsigned threads;                 /* that handle requests, beside the one that reads heads */
	const struct http_limits *limits; /* copied */
};

/* *server is set before the first request is read, NULL after an error. */
enum tw_status http_start(struct http_server **server, const struct http_settings *settings,
			  struct tw_error *error) TW_NODISCARD;

/* From now on. May be called from any thread, as all of these. */
void http_set_limits(struct http_server *server, const struct http_limits *limits);

/* A job may have ended: whoever waits for one looks now and not at the next tick. */
void http_jobs_changed(struct http_server *server);

/* Whether one more request may wait for a job. */
bool http_may_hold(const struct http_server *server);

/* Accepts no more connections, answers those that are held, and ends streams of events. */
void http_drain(struct http_server *server);

/* Requests that are not fully answered. */
unsigned http_active(const struct http_server *server);

/* Closes everything. NULL is allowed. */
void http_stop(struct http_server *server);

#endif
