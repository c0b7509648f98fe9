/* Stored arrays and artifacts as they are. */
#ifndef API_CONTENT_H
#define API_CONTENT_H

#include "api/call.h"

/* What answers where the store has no file of this name; *known is false where it has nothing to say. */
typedef enum tw_status content_missing(struct api_call *call, const struct resource *resource, const char *name,
				       bool *known, struct tw_error *error);

/* GET of an array or artifact by the path's last parameter, streamed from the store, with its hash as entity tag.
 * `missing` may be NULL. TW_ERROR_CONFLICT "not-computed" before the resource has succeeded. */
enum tw_status content_respond(struct api_call *call, enum resource_kind kind, enum blob_role role,
			       content_missing *missing, struct tw_error *error) TW_NODISCARD;

#endif
