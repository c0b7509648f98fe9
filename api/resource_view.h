/* Resources as JSON. */
#ifndef API_RESOURCE_VIEW_H
#define API_RESOURCE_VIEW_H

#include "api/call.h"

/* One resource, with the lists of its uploads, arrays and artifacts where `with_contents` is set. A new reference. */
enum tw_status resource_show(struct api_call *call, const struct resource *resource, bool with_contents, json_t **json,
			     struct tw_error *error) TW_NODISCARD;

/* The one resource of a kind that another was made from, "" where there is none: the mesh of a motion, the field of a
 * layout. */
enum tw_status resource_first_need(struct api_call *call, const char *id, enum resource_kind kind,
				   char need[STORE_ID_SIZE], struct tw_error *error) TW_NODISCARD;

/* "f64", as clients see it. */
const char *array_type_name(enum tw_type type);

#endif
