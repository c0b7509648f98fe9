/* One request on its way to the engine, and its answer on the way back. The head is written anew from what was read of
 * it, and the body from its validated data, so that the engine sees nothing that could be read in two ways. Of the
 * answer the head is looked at, for the client's connection is kept or closed by us. Nothing blocks. */
#ifndef SERVICE_DAEMON_HTTP_RELAY_H
#define SERVICE_DAEMON_HTTP_RELAY_H

#include "service/daemon/http/chunk.h"
#include "service/daemon/http/engine.h"
#include "service/daemon/http/head.h"

/* Bytes that a socket has not taken yet. */
struct pending {
	char *bytes; /* owned */
	size_t start, end, capacity;
};

/* Starts as RELAY_NONE. */
struct relay {
	int socket;  /* owned; -1 while there is no request */
	int watcher; /* the epoll instance that its owner has told of the socket; -1: none */
	struct engine_link *link;
	struct pending up, down;
	bool is_shut; /* the engine takes nothing any more */
	bool is_head; /* the request was HEAD */
	/* Of the answer. */
	struct pending head; /* as much as has come of it */
	bool has_begun;      /* its head is through */
	bool is_complete;
	bool is_chunked, has_length;
	struct chunk chunk;
	uint64_t left; /* of its body, where that has a length */
};

#define RELAY_NONE ((struct relay){.socket = -1, .watcher = -1})

enum relay_outcome { RELAY_CLEAR, RELAY_BLOCKED, RELAY_SHUT };

/* False when there is no room in the engine, or out of memory. */
bool relay_open(struct relay *relay, struct engine *engine, const struct head *head, const char *peer);
void relay_close(struct relay *relay);

/* The watcher knows the socket no more. Closing it is not enough for that: a process that is just being started holds a
 * copy of it for a moment, and epoll goes on telling of that. */
void relay_unwatch(struct relay *relay);

/* Hands on data of the body, or its end. False when out of memory. */
bool relay_put(struct relay *relay, const struct head *head, const char *data, size_t size);
bool relay_put_end(struct relay *relay, const struct head *head);

/* Sends what is pending to the engine. RELAY_SHUT: it takes no more, and what is pending is dropped. */
enum relay_outcome relay_push(struct relay *relay);
bool relay_has_pending(const struct pending *pending);

/* Takes more of the answer into `down`, which must be empty; `ends`: the client's connection is closed after it.
 * RELAY_SHUT: there is no more; is_complete says whether that was all. */
enum relay_outcome relay_pull(struct relay *relay, char *scratch, size_t size, bool ends);

/* Sends what is pending to the client; *moved grows by what it took. RELAY_SHUT: it is gone. */
enum relay_outcome relay_deliver(struct relay *relay, int client, uint64_t *moved);

#endif
