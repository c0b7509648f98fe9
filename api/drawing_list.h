/* Which files of a layout are made when somebody first asks for them. */
#ifndef API_DRAWING_LIST_H
#define API_DRAWING_LIST_H

#include "api/call.h"

#include <jansson.h>

/* Whether files of this layout that the store does not have can be made: not before it has a result, and not where an
 * older release has made all that there were. */
enum tw_status drawing_is_possible(struct api_call *call, const struct resource *layout, bool *possible,
				   struct tw_error *error) TW_NODISCARD;

/* Adds to a layout's list of files (JSON) those that can be made and are not there yet. */
void drawing_add_to_list(json_t *list, const char *path);

/* Fails with "no-such-blob", and says which files there can be. */
enum tw_status drawing_refuse_name(const char *name, struct tw_error *error) TW_NODISCARD;

#endif
