/* The one table of what the outside can ask for. The server, the Allow header and the test against openapi.yaml all
 * read it. */
#ifndef API_ROUTE_H
#define API_ROUTE_H

#include "tightwire.h"

#include <stdbool.h>

struct api_call;

enum route_body {
	ROUTE_NO_BODY,
	ROUTE_JSON,   /* application/json, in memory, at most TW_LIMIT_JSON_BYTES */
	ROUTE_UPLOAD, /* raw bytes or multipart/form-data, streamed into the store */
	ROUTE_APPEND, /* raw bytes, streamed to the end of the upload that the path names */
};

#define ROUTE_PARAMETERS_MAX 3
#define ROUTE_PARAMETER_SIZE 96 /* no id or name is longer */

struct route {
	const char *method;
	const char *path; /* "/v1/meshes/{mesh}": a segment in braces matches anything but nothing */
	enum tw_status (*handle)(struct api_call *call, struct tw_error *error);
	const char *produces; /* media type for the Accept check; NULL: the handler checks */
	enum route_body body;
	/* ROUTE_UPLOAD: names of the parts that a form may have, the first the one that a raw body is; NULL-terminated
	 */
	const char *const *parts;
	unsigned flags;
	/* KEY_READ…: what the key must be allowed; of several, one will do, and then the handler asks for the one that
	 * the job in question wants. 0: answered without a key. */
	unsigned scopes;
};

#define ROUTE_STORELESS 1u /* answered also when the store is broken */
#define ROUTE_OPERATOR 2u  /* tells of the service as a whole: for the operator's keys only */

/* Ends with a row without method. */
extern const struct route api_routes[];

/* What a path's braces matched. */
struct route_match {
	const struct route *route; /* NULL: no route has this path and method */
	char parameters[ROUTE_PARAMETERS_MAX][ROUTE_PARAMETER_SIZE];
	bool path_known;
	char allow[64]; /* methods of the path, for Allow */
};

/* HEAD finds the route of GET. */
void route_find(const char *method, const char *path, struct route_match *match);

#endif
