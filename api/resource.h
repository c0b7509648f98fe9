/* What all resources have in common on the outside: how they are shown, listed, deleted, and read as bytes. */
#ifndef API_RESOURCE_H
#define API_RESOURCE_H

#include "api/call.h"

/* One resource as JSON, with the lists of its uploads, arrays and artifacts where `with_contents` is set. A new
 * reference. */
enum tw_status resource_show(struct api_call *call, const struct resource *resource, bool with_contents, json_t **json,
			     struct tw_error *error) TW_NODISCARD;

/* "/v1/fields/fld_…", "/v1/meshes/m_…/motions/mo_…". `parent`: the mesh of a motion; else ignored. */
void resource_path(enum resource_kind kind, const char *parent, const char *id, char *path, size_t size);

/* GET of one: the path's first parameter is its id, of a motion the second one, its mesh the first. */
enum tw_status resource_respond(struct api_call *call, enum resource_kind kind, struct tw_error *error) TW_NODISCARD;

/* GET of the collection: ?state= ?limit= ?cursor= and the Link header. `needs` as in struct resource_query; where it is
 * NULL, the query parameter `filter` ("field": layouts of one field; NULL for none) says it. */
enum tw_status resource_respond_list(struct api_call *call, enum resource_kind kind, const char *needs,
				     const char *filter, struct tw_error *error) TW_NODISCARD;

/* DELETE of one; ?dependents=true deletes what was made from it too. 204. */
enum tw_status resource_respond_delete(struct api_call *call, enum resource_kind kind,
				       struct tw_error *error) TW_NODISCARD;

/* GET of an array or artifact, streamed from the store, by the path's last parameter. */
enum tw_status resource_respond_blob(struct api_call *call, enum resource_kind kind, enum blob_role role,
				     struct tw_error *error) TW_NODISCARD;

/* Creates what the draft says and answers: 202 with Location for a new one, 200 for one that existed; holds the
 * connection while `Prefer: wait` asks for it. */
enum tw_status resource_respond_create(struct api_call *call, const struct resource_draft *draft,
				       struct tw_error *error) TW_NODISCARD;

/* Answers for a resource whose creator has waited: with what it is now. */
enum tw_status resource_respond_awaited(struct api_call *call, struct tw_error *error) TW_NODISCARD;

/* ?limit= and ?cursor= of a list. */
enum tw_status page_parameters(const struct api_call *call, uint32_t *limit, int64_t *cursor,
			       struct tw_error *error) TW_NODISCARD;

/* {"items": …, "next": …} and the Link header to the next page (`next` 0: none). Takes `items`. */
enum tw_status page_respond(struct api_call *call, json_t *items, int64_t next, struct tw_error *error) TW_NODISCARD;

#endif
