/* The HTTP server: libmicrohttpd on one side, the api on the other. A few threads serve all connections with epoll; a
 * connection that waits for a job (`Prefer: wait`) is suspended and costs no thread. */
#ifndef SERVICE_DAEMON_HTTP_H
#define SERVICE_DAEMON_HTTP_H

#include "api/api.h"
#include "service/daemon/metrics.h"
#include "tightwire.h"

#include <stdbool.h>

struct http_server;

struct http_settings {
	struct api *api; /* borrowed, as is metrics; both must outlive the server */
	struct metrics *metrics;
	int socket; /* a listening socket, taken over */
	unsigned threads;
	unsigned connections;    /* at once; one more is not accepted until another has gone */
	unsigned idle_timeout_s; /* for a connection without a complete request head, and for one that stalls */
};

enum tw_status http_start(struct http_server **server, const struct http_settings *settings,
			  struct tw_error *error) TW_NODISCARD;

/* To be called a few times a second, and with `jobs_changed` as soon as a job may have ended: answers held connections
 * that are due and closes those that dawdle. One thread at a time. */
void http_tick(struct http_server *server, bool jobs_changed);

/* Accepts no more connections and answers those that are held. */
void http_drain(struct http_server *server);

/* Requests that are not fully answered. */
unsigned http_active(const struct http_server *server);

/* Closes everything. NULL is allowed. */
void http_stop(struct http_server *server);

#endif
