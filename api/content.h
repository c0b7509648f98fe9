/* Stored arrays and artifacts as they are. */
#ifndef API_CONTENT_H
#define API_CONTENT_H

#include "api/call.h"

/* GET of an array or artifact by the path's last parameter, streamed from the store, with its hash as entity tag.
 * TW_ERROR_CONFLICT "not-computed" before the resource has succeeded. */
enum tw_status content_respond(struct api_call *call, enum resource_kind kind, enum blob_role role,
			       struct tw_error *error) TW_NODISCARD;

#endif
