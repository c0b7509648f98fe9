/* What requests for all kinds of resources have in common: to get, list, delete and create one. */
#ifndef API_RESOURCE_H
#define API_RESOURCE_H

#include "api/call.h"

/* The resource that the path names: its first parameter is the id, of a motion the second one, and the first its mesh,
 * which is checked. TW_ERROR_NOT_FOUND. The caller clears it. */
enum tw_status resource_find(struct api_call *call, enum resource_kind kind, struct resource *resource,
			     struct tw_error *error) TW_NODISCARD;

/* GET of one, that resource_find finds. */
enum tw_status resource_respond(struct api_call *call, enum resource_kind kind, struct tw_error *error) TW_NODISCARD;

/* GET of the collection: ?state= ?limit= ?cursor= and the Link header. `needs` as in struct resource_query; where it is
 * NULL, the query parameter `filter` ("field": layouts of one field; NULL for none) says it. */
enum tw_status resource_respond_list(struct api_call *call, enum resource_kind kind, const char *needs,
				     const char *filter, struct tw_error *error) TW_NODISCARD;

/* DELETE of one; ?dependents=true deletes what was made from it too. 204. */
enum tw_status resource_respond_delete(struct api_call *call, enum resource_kind kind,
				       struct tw_error *error) TW_NODISCARD;

/* Creates what the draft says, its job queued as the request asks for, and wakes the workers. */
enum tw_status resource_submit(struct api_call *call, const struct resource_draft *draft, struct resource *resource,
			       struct tw_error *error) TW_NODISCARD;

/* Creates what the draft says and answers: 202 with Location for a new one, 200 for one that existed; holds the
 * connection while `Prefer: wait` asks for it. */
enum tw_status resource_respond_create(struct api_call *call, const struct resource_draft *draft,
				       struct tw_error *error) TW_NODISCARD;

/* The answer to somebody who wants a resource that may not be there yet: holds the connection while `Prefer: wait` asks
 * for it, else 200 for one whose job has ended, or 202. */
enum tw_status resource_respond_wanted(struct api_call *call, const struct resource *resource,
				       struct tw_error *error) TW_NODISCARD;

#endif
