/* An answer of our own on its way to the socket: a head, and bytes from memory. */
#ifndef SERVICE_DAEMON_HTTP_REPLY_H
#define SERVICE_DAEMON_HTTP_REPLY_H

#include "api/response.h"

#include <stdbool.h>

/* Starts as {0}. */
struct reply {
	const struct api_response *response; /* borrowed */
	char *head;                          /* owned */
	size_t head_size;
	size_t sent; /* of head and bytes, as one count */
	bool has_body;
};

/* Writes the head; `is_head`: the request was HEAD, `ends`: say that the connection will be closed. The response must
 * not be a stream. False when out of memory. */
bool reply_begin(struct reply *reply, const struct api_response *response, bool is_head, bool ends);

/* Sends until the socket blocks. REPLY_BLOCKED: go on when it can be written to. REPLY_BROKEN: the client is gone.
 * *sent grows by what the socket took. */
enum reply_outcome { REPLY_DONE, REPLY_BLOCKED, REPLY_BROKEN };
enum reply_outcome reply_send(struct reply *reply, int socket, uint64_t *sent);

void reply_clear(struct reply *reply);

#endif
