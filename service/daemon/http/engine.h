/* libmicrohttpd, behind the strict front (server.h): it gets requests that have been judged, one on each connection,
 * over socket pairs, parses them once more, drives the exchange with the api, and sends the answer back. Whoever closes
 * his end of a pair has left. */
#ifndef SERVICE_DAEMON_HTTP_ENGINE_H
#define SERVICE_DAEMON_HTTP_ENGINE_H

#include "api/api.h"
#include "service/daemon/metrics.h"
#include "tightwire.h"

#include <stdatomic.h>
#include <stdbool.h>

#define ENGINE_PEER_SIZE 48

struct engine;

struct engine_settings {
	struct api *api; /* borrowed, as is metrics; both must outlive the engine */
	struct metrics *metrics;
	unsigned threads; /* that handle what only reads; what may wait for the store's writer has more of its own */
	unsigned connections; /* at once, at most */
};

/* What both ends of a pair know of a request. */
struct engine_link {
	atomic_uint users;
	atomic_bool is_held; /* it waits for a job, or its stream of events has nothing to say */
	char peer[ENGINE_PEER_SIZE];
};

enum tw_status engine_start(struct engine **engine, const struct engine_settings *settings,
			    struct tw_error *error) TW_NODISCARD;

/* Opens a pair for one request of the client `peer`; -1 where there is no room. The socket is the caller's,
 * non-blocking; the link is his until engine_unlink. */
int engine_connect(struct engine *engine, const char *peer, struct engine_link **link);
void engine_unlink(struct engine_link *link);

/* A job may have ended: whoever waits for one looks now. */
void engine_jobs_changed(struct engine *engine);

/* Requests that are not fully answered, and of these the ones that wait for a job. */
unsigned engine_active(const struct engine *engine);
unsigned engine_held(const struct engine *engine);

/* Answers those that are held, and ends streams of events. */
void engine_drain(struct engine *engine);

void engine_stop(struct engine *engine); /* NULL is allowed */

#endif
