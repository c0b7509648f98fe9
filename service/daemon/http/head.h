/* The head of an HTTP/1.1 request (RFC 9112), read strictly: two readers of the same bytes must never see two requests,
 * so whatever the standard calls invalid is refused, not repaired. Pure: bytes in, fields out.
 *
 * Refused, among others: a line that ends with a bare LF or CR, a blank before a colon, a folded line, a control
 * character, Content-Length or Host twice or not as the standard writes them, a Transfer-Encoding that is not "chunked"
 * alone, both kinds of length at once. */
#ifndef SERVICE_DAEMON_HTTP_HEAD_H
#define SERVICE_DAEMON_HTTP_HEAD_H

#include "tightwire.h"

#include <stdbool.h>

#define HEAD_SIZE_MAX (16u << 10)
#define HEAD_TARGET_MAX 8000u
#define HEAD_FIELDS_MAX 100

struct head_field {
	const char *name, *value; /* borrowed: of the bytes, or of `joined` */
};

/* Starts as {0}. All texts point into the bytes that were parsed, which are cut into strings. */
struct head {
	size_t scanned; /* of an incomplete head: where the next call goes on looking for its end */
	size_t start;   /* of the request line, behind empty lines */
	size_t size;    /* with its empty line */
	const char *method;
	const char *target;  /* "/path?query", also of a target in absolute form; "*" */
	const char *host;    /* of the absolute form, else of Host; "" where there is none */
	bool is_old;         /* HTTP/1.0: answers are never chunked, connections do not go on */
	bool ends;           /* the client wants the connection closed */
	bool expects;        /* it waits for 100 Continue */
	bool is_chunked;     /* the body's length; where neither is said there is no body */
	uint64_t body_bytes; /* by Content-Length */
	size_t field_count;
	struct head_field fields[HEAD_FIELDS_MAX]; /* a list that came in several lines is one */
	char *joined;                              /* owned */
};

enum head_outcome { HEAD_INCOMPLETE, HEAD_COMPLETE, HEAD_REFUSED };

/* Looks at the bytes that have come so far; `bytes` may move between calls that say HEAD_INCOMPLETE. HEAD_REFUSED fills
 * the error: "malformed-request" | "malformed-header" | "uri-too-long" | "head-too-large" | "version-not-supported" |
 * "expectation-failed" | "out-of-memory". */
enum head_outcome head_parse(struct head *head, char *bytes, size_t size, struct tw_error *error);

/* The value of a field, its name in any case; NULL where there is none. */
const char *head_find(const struct head *head, const char *name);

/* Frees what is held and makes it {0} again. */
void head_clear(struct head *head);

#endif
