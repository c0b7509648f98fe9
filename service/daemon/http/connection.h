/* One connection: heads in, answers out, one request after the other. It never blocks on a socket and knows neither
 * threads nor epoll: its loop (server.c) runs it when a socket of its is ready, or its time is up.
 *
 *     IDLE ─► HEAD ─► OPENING ─┬─► BODY ─► SENDING ─┬─► IDLE
 *                       │      └─► RELAYING ────────┤
 *                       └ (refused) ─► (PAUSED) ─► SENDING ─┴─► LINGERING ─► closed
 *
 * What asks for nothing of the store (/livez, a refusal) is answered here, by the thread that reads heads. With
 * everything else the connection moves to a thread that relays it to the engine (CONNECTION_NEEDS_ENGINE), and comes
 * back for the next head (CONNECTION_IS_IDLE). */
#ifndef SERVICE_DAEMON_HTTP_CONNECTION_H
#define SERVICE_DAEMON_HTTP_CONNECTION_H

#include "api/exchange.h"
#include "service/daemon/http/chunk.h"
#include "service/daemon/http/head.h"
#include "service/daemon/http/limits.h"
#include "service/daemon/http/relay.h"
#include "service/daemon/http/reply.h"
#include "service/daemon/metrics.h"

#include <stdatomic.h>

enum connection_phase {
	CONNECTION_IDLE,      /* between requests */
	CONNECTION_HEAD,      /* a part of a head is there */
	CONNECTION_OPENING,   /* the head is judged */
	CONNECTION_BODY,      /* of a request that needs no store: thrown away */
	CONNECTION_RELAYING,  /* body to the engine, answer back */
	CONNECTION_PAUSED,    /* an answer of our own is kept back: the client guesses keys */
	CONNECTION_SENDING,   /* an answer of our own */
	CONNECTION_LINGERING, /* answered and half closed: what still comes is thrown away, so that the answer is read
			       */
};

/* What all connections of a server share. */
struct http_context {
	struct api *api; /* borrowed, as are the others */
	struct metrics *metrics;
	struct engine *engine;
	struct http_limits limits;
	atomic_uint active; /* requests that are not fully answered */
	atomic_bool draining;
};

#define CONNECTION_PEER_SIZE ENGINE_PEER_SIZE

struct http_connection {
	struct http_context *context; /* borrowed */
	int socket;
	char peer[CONNECTION_PEER_SIZE]; /* the client's address as text */
	uint64_t address;                /* and as address_key */
	const struct tw_error *excuse;   /* borrowed; it is one too many: only what needs no store is answered, once */
	enum connection_phase phase;
	unsigned events;       /* of epoll that it waits for at its socket; 0: only that the client leaves */
	unsigned relay_events; /* and at the relay's */
	char *in;              /* owned: [in_capacity]; a head and what came behind it */
	size_t in_size, in_capacity, in_used;
	char *rest; /* owned: what came behind a body in chunks */
	size_t rest_size;
	struct head head;
	struct chunk chunk;
	uint64_t body_left;        /* bytes of a body with a length */
	struct exchange *exchange; /* owned; NULL between requests */
	struct reply reply;        /* of our own */
	struct relay relay;
	uint64_t received; /* bytes of the request's body */
	bool ends;         /* after this answer */
	bool is_cut;       /* the answer comes before the end of the request, or there is no telling where that is */
	bool is_stranger;  /* refused by its head */

	/* Of the phase. */
	int64_t since_ms;      /* when it began; of a head: its first byte */
	int64_t request_ms;    /* when the request's first byte came */
	int64_t waits_from_ms; /* since when we wait for the client; 0: we do not */
	int64_t waited_ms;     /* for the client before that */
	uint64_t moved;        /* bytes read of the body, or taken by the socket of the answer */
	int64_t started_us;    /* of the request, for the log */
};

/* What its loop has to do with it. */
enum connection_outcome {
	CONNECTION_WAITS,        /* for its events */
	CONNECTION_NEEDS_ENGINE, /* phase OPENING: go on where requests are relayed */
	CONNECTION_IS_IDLE,      /* go on where heads are read */
	CONNECTION_ENDS,         /* close */
};

/* Takes the socket over. NULL when out of memory, and then the socket is the caller's. */
struct http_connection *http_connection_new(struct http_context *context, int socket, const char *peer,
					    uint64_t address);

/* The client is gone, or is sent away: what it has begun is dropped. Closes the socket and frees. */
void http_connection_free(struct http_connection *connection);

/* Does what can be done now. `scratch` has CONNECTION_SCRATCH bytes that nobody else uses meanwhile. `relays`: this is
 * a thread that relays, not the one that reads heads. */
#define CONNECTION_SCRATCH (256u << 10)
enum connection_outcome http_connection_run(struct http_connection *connection, bool relays, char *scratch,
					    int64_t now_ms);

/* Whether its time is up; if so, goes on with what follows: the answer 408, or the end. */
enum connection_outcome http_connection_check_time(struct http_connection *connection, char *scratch, int64_t now_ms);

#endif
