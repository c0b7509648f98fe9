/* Lists, page by page. */
#ifndef API_PAGE_H
#define API_PAGE_H

#include "api/call.h"

/* ?limit= and ?cursor= of a list; cursors are the numbers of rows, veiled (api/veil.h). TW_ERROR_INPUT
 * "invalid-parameter". */
enum tw_status page_parameters(const struct api_call *call, uint32_t *limit, int64_t *cursor,
			       struct tw_error *error) TW_NODISCARD;

/* {"items": …, "next": …} and the Link header to the next page (`next` 0: none). Takes `items`. */
enum tw_status page_respond(struct api_call *call, json_t *items, int64_t next, struct tw_error *error) TW_NODISCARD;

/* The same for a cursor that is text already, and needs no veil; NULL: none. */
enum tw_status page_respond_text(struct api_call *call, json_t *items, const char *next,
				 struct tw_error *error) TW_NODISCARD;

#endif
