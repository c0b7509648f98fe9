/* The chunked transfer coding (RFC 9112, 7.1), read strictly and a piece at a time. Extensions and trailers are
 * skipped. Pure. */
#ifndef SERVICE_DAEMON_HTTP_CHUNK_H
#define SERVICE_DAEMON_HTTP_CHUNK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum chunk_state {
	CHUNK_SIZE,  /* its digits */
	CHUNK_BLANK, /* between them and an extension */
	CHUNK_EXTENSION,
	CHUNK_SIZE_LF,
	CHUNK_DATA,
	CHUNK_DATA_CR,
	CHUNK_DATA_LF,
	CHUNK_TRAILER_START, /* of a line */
	CHUNK_TRAILER,
	CHUNK_TRAILER_LF,
	CHUNK_LAST_LF,
	CHUNK_END,
	CHUNK_BROKEN, /* for good */
};

/* Starts as {0}. */
struct chunk {
	enum chunk_state state;
	uint64_t left;   /* of the data */
	unsigned digits; /* of the size */
	unsigned extra;  /* bytes of this chunk's extension, or of all trailers */
};

/* Takes bytes from the front up to the end of one piece of data, the end of the body, or all of them. Returns how many;
 * *data and *data_size are what of them is data (0: none). chunk->state says whether it is over or broken. */
size_t chunk_take(struct chunk *chunk, const char *bytes, size_t size, const char **data, size_t *data_size);

#endif
