/* Creating, finding, listing and removing resources. */
#ifndef STORAGE_RESOURCES_H
#define STORAGE_RESOURCES_H

#include "storage/resource.h"

enum resource_outcome {
	RESOURCE_CREATED,
	RESOURCE_EXISTED, /* equal content, or the same idempotency key and request; the draft's uploads are discarded
			   */
	RESOURCE_RETRIED, /* equal content that had failed or was cancelled, and is queued again */
};

/* Keeps the resource and its queued job in one durable transaction. TW_ERROR_NOT_FOUND "no-such-resource" |
 * "no-such-upload" (the id stands in the text; what is another tenant's is not there), TW_ERROR_CONFLICT
 * "dependency-failed" when something that it needs has failed, "idempotency-key-reused" for a key that came with
 * another request, "upload-not-sealed", TW_ERROR_NOT_FOUND "no-such-tenant", and the limits of the owner's key
 * (key_check_limits). */
enum tw_status resource_create(struct store *store, const struct resource_draft *draft, struct resource *resource,
			       enum resource_outcome *outcome, struct tw_error *error) TW_NODISCARD;

/* TW_ERROR_NOT_FOUND "no-such-resource"; also when it is of another kind, or another tenant's. */
enum tw_status resource_get(struct store *store, int64_t tenant, enum resource_kind kind, const char *id,
			    struct resource *resource, struct tw_error *error) TW_NODISCARD;

/* Whether today's release would compute it, or what makes it outdated, otherwise. */
enum tw_status resource_is_outdated(struct store *store, const struct resource *resource, bool *outdated,
				    struct tw_error *error) TW_NODISCARD;

/* Newest first. Pages do not shift when resources are added while a client turns them. */
struct resource_query {
	int64_t tenant; /* not TENANT_ANY */
	enum resource_kind kind;
	const char *needs; /* only those made directly from this resource ("motions of a mesh"); NULL for all */
	unsigned states;   /* 1u << state…; 0 for all */
	int64_t cursor;    /* 0, or `next` of the page before */
	uint32_t limit;    /* 1…1000 */
};
enum tw_status resource_list(struct store *store, const struct resource_query *query, struct resource_page *page,
			     struct tw_error *error) TW_NODISCARD;

/* The ids of what a resource was made from, of one kind, in the draft's order. `*ids` is heap memory, to be freed. */
enum tw_status resource_needs(struct store *store, const char *id, enum resource_kind kind, char (**ids)[STORE_ID_SIZE],
			      size_t *count, struct tw_error *error) TW_NODISCARD;

/* Removes a resource with its job, uploads and results. What was made from it keeps it: TW_ERROR_CONFLICT
 * "resource-in-use", unless `with_dependents`, which removes those too. A worker that is busy with it loses its lease.
 */
enum tw_status resource_delete(struct store *store, int64_t tenant, enum resource_kind kind, const char *id,
			       bool with_dependents, struct tw_error *error) TW_NODISCARD;

#endif
