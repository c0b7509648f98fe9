/* What the api answers: status, headers, and a body that is either bytes in memory or a stream which is read piece by
 * piece, so that a large stored array never lies in the daemon as a whole. */
#ifndef API_RESPONSE_H
#define API_RESPONSE_H

#include "tightwire.h"

#include <jansson.h>
#include <stdbool.h>

#define API_HEADERS_MAX 16
#define API_STREAM_UNKNOWN UINT64_MAX

/* Bytes made while they are sent. The maker embeds it as first member of a larger struct. */
struct api_stream {
	uint64_t size;   /* API_STREAM_UNKNOWN: it ends when it ends */
	bool is_waiting; /* set by read: it gave nothing because there is nothing yet; ask again later */
	/* Gives up to `size` bytes from `offset` on; *got 0 only at the end, or with is_waiting. */
	enum tw_status (*read)(struct api_stream *stream, uint64_t offset, void *bytes, size_t size, size_t *got);
	void (*close)(struct api_stream *stream); /* frees it */
};

struct api_header {
	const char *name; /* static */
	char *value;      /* owned */
};

struct api_response {
	unsigned status; /* 0: none yet */
	size_t header_count;
	struct api_header headers[API_HEADERS_MAX];
	char *bytes; /* owned, malloc; NULL for none */
	size_t size;
	struct api_stream *stream; /* owned; instead of bytes */
};

/* An embedded response starts as all zeros. response_clear frees what it owns and makes it so again. */
void response_clear(struct api_response *response);

/* Sets a header, replacing one of that name. A value with control characters, or one header too many, is left out: the
 * values come from our own tables and ids. */
TW_PRINTF(3, 4) void response_header(struct api_response *response, const char *name, const char *format, ...);
const char *response_get_header(const struct api_response *response, const char *name); /* NULL: not set */

/* Answers with a JSON document and takes the reference to it. `json` may be NULL: memory ran out while it was made. */
enum tw_status response_json(struct api_response *response, unsigned status, json_t *json,
			     struct tw_error *error) TW_NODISCARD;

/* Answers with bytes (malloc), which it takes, also when it fails. */
enum tw_status response_bytes(struct api_response *response, unsigned status, const char *media_type, char *bytes,
			      size_t size, struct tw_error *error) TW_NODISCARD;

/* Answers with a stream, which it takes. */
void response_stream(struct api_response *response, const char *media_type, struct api_stream *stream);

/* Answers without a body. */
void response_empty(struct api_response *response, unsigned status);

#endif
