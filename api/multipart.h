/* multipart/form-data (RFC 7578) as a stream: bytes in, parts out, nothing larger than one header block is held. */
#ifndef API_MULTIPART_H
#define API_MULTIPART_H

#include "tightwire.h"

#include <stdbool.h>

#define MULTIPART_BOUNDARY_MAX 70 /* RFC 2046, 5.1.1 */
#define MULTIPART_NAME_MAX 64
#define MULTIPART_FILE_NAME_MAX 255
#define MULTIPART_HEADER_MAX 2048 /* bytes of one part's headers */

struct multipart_part {
	char name[MULTIPART_NAME_MAX + 1];
	char file_name[MULTIPART_FILE_NAME_MAX + 1]; /* empty where not given */
	char media_type[128];                        /* empty where not given */
};

/* What happens with the parts, in order: begin, data…, end for each. An error stops the parser for good. */
struct multipart_sink {
	enum tw_status (*begin)(void *context, const struct multipart_part *part, struct tw_error *error);
	enum tw_status (*data)(void *context, const void *bytes, size_t size, struct tw_error *error);
	enum tw_status (*end)(void *context, struct tw_error *error);
	void *context;
};

enum multipart_state {
	MULTIPART_PREAMBLE,  /* before the first boundary */
	MULTIPART_DELIMITER, /* behind a boundary: "\r\n" goes on, "--" ends */
	MULTIPART_HEADERS,
	MULTIPART_DATA,
	MULTIPART_EPILOGUE, /* behind the last boundary: ignored */
};

struct multipart {
	struct multipart_sink sink;
	enum multipart_state state;
	char delimiter[MULTIPART_BOUNDARY_MAX + 5]; /* "\r\n--" boundary */
	size_t delimiter_size;
	size_t matched; /* how much of the delimiter, or of what may follow it, has been seen */
	char after[2];  /* the two bytes behind a boundary */
	struct multipart_part part;
	char header[MULTIPART_HEADER_MAX + 1];
	size_t header_size;
};

/* Starts a parser for a Content-Type value. TW_ERROR_INPUT "malformed-header" when it has no usable boundary. */
enum tw_status multipart_init(struct multipart *multipart, const char *content_type, struct multipart_sink sink,
			      struct tw_error *error) TW_NODISCARD;

/* Takes the next bytes of the body, cut anywhere. */
enum tw_status multipart_feed(struct multipart *multipart, const void *bytes, size_t size,
			      struct tw_error *error) TW_NODISCARD;

/* The body is over: TW_ERROR_INPUT "malformed-multipart" when its last boundary has not come. */
enum tw_status multipart_finish(const struct multipart *multipart, struct tw_error *error) TW_NODISCARD;

#endif
