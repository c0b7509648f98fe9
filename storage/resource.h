/* Resources: meshes, motions, fields, layouts, recordings. All are kept alike: what was asked (options, as JSON that
 * nobody here reads), what it was made from (uploads, other resources), what came out (a summary, arrays, artifacts),
 * and the job that makes it, whose state is the resource's state.
 *
 * Meshes, motions and fields are addressed by content: their id is a hash of their kind, their uploads' bytes and file
 * types, their options, what they need in the given order, and for a motion its name. Asking for the same again gives
 * the same resource and no work. Layouts and recordings get a random id; an idempotency key makes asking twice safe. */
#ifndef STORAGE_RESOURCE_H
#define STORAGE_RESOURCE_H

#include "storage/job.h"

struct resource {
	char id[STORE_ID_SIZE];
	enum resource_kind kind;
	char *name;    /* owned, UTF-8; "" where none was given */
	char *options; /* owned, JSON: what was asked, in full, so that it can be computed again; NULL in a list */
	char *summary; /* owned, JSON: what came out; NULL until the job has succeeded */
	int64_t created_ms;
	struct job job;
};

void resource_clear(struct resource *resource);

struct resource_page {
	struct resource *resources; /* owned */
	size_t count;
	int64_t next; /* cursor of the following page, 0 after the last */
};

void resource_page_clear(struct resource_page *page);

/* All borrowed. */
struct resource_draft {
	enum resource_kind kind;
	const char *name;         /* may be NULL */
	const char *options;      /* JSON object in canonical form; NULL means {} */
	const char *const *needs; /* ids of the resources that it is made from: mesh before motions */
	size_t need_count;
	const char *const *uploads; /* ids of sealed uploads; the resource takes them over */
	size_t upload_count;
	const char *idempotency_key; /* may be NULL */
	int32_t priority;            /* higher is claimed earlier; 0 is usual */
	uint32_t attempts_max;       /* 0 for the default of 3 */
};

enum resource_outcome {
	RESOURCE_CREATED,
	RESOURCE_EXISTED, /* equal content, or the same idempotency key and request; the draft's uploads are discarded
			   */
	RESOURCE_RETRIED, /* equal content that had failed or was cancelled, and is queued again */
};

/* Keeps the resource and its queued job in one durable transaction. TW_ERROR_NOT_FOUND "no-such-resource" |
 * "no-such-upload" (the id stands in the text), TW_ERROR_CONFLICT "dependency-failed" when something that it needs has
 * failed, "idempotency-key-reused" for a key that came with another request, "upload-not-sealed". */
enum tw_status resource_create(struct store *store, const struct resource_draft *draft, struct resource *resource,
			       enum resource_outcome *outcome, struct tw_error *error) TW_NODISCARD;

/* TW_ERROR_NOT_FOUND "no-such-resource"; also when it is of another kind. */
enum tw_status resource_get(struct store *store, enum resource_kind kind, const char *id, struct resource *resource,
			    struct tw_error *error) TW_NODISCARD;

/* Newest first. Pages do not shift when resources are added while a client turns them. */
struct resource_query {
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
enum tw_status resource_delete(struct store *store, enum resource_kind kind, const char *id, bool with_dependents,
			       struct tw_error *error) TW_NODISCARD;

#endif
