/* A response on its way to the socket: its head, then bytes from memory or from a stream, with a length where it is
 * known and in chunks where not. */
#ifndef SERVICE_DAEMON_HTTP_REPLY_H
#define SERVICE_DAEMON_HTTP_REPLY_H

#include "api/response.h"

#include <stdbool.h>

/* Starts as {0}. */
struct reply {
	struct api_response *response; /* borrowed */
	char *head;                    /* owned */
	size_t head_size;
	char *block; /* owned: what a stream gave, with its chunk's frame */
	size_t block_start, block_end;
	size_t sent;     /* of what is being sent: head and bytes, or head and block, as one count */
	uint64_t offset; /* in the stream */
	bool has_body, is_chunked, is_over;
};

struct reply_terms {
	bool is_head; /* the request was HEAD: no body */
	bool is_old;  /* HTTP/1.0: what has no length ends with the connection */
	bool ends;    /* say that the connection will be closed */
};

/* Writes the head. False when out of memory. */
bool reply_begin(struct reply *reply, struct api_response *response, const struct reply_terms *terms);

/* Sends until the socket blocks, or so much that others have their turn. `truncate`: a stream that has nothing to send
 * yet ends. REPLY_BLOCKED: go on when the socket can be written to. REPLY_WAITING: the stream has nothing yet.
 * REPLY_BROKEN: the client is gone, or the stream failed in the middle; all that can be done is to close. *sent grows
 * by what the socket took. */
enum reply_outcome { REPLY_DONE, REPLY_BLOCKED, REPLY_WAITING, REPLY_BROKEN };
enum reply_outcome reply_send(struct reply *reply, int socket, bool truncate, uint64_t *sent);

void reply_clear(struct reply *reply);

#endif
