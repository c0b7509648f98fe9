/* Resources: meshes, motions, fields, layouts, recordings. All are kept alike: what was asked (options, as JSON that
 * nobody here reads), what it was made from (uploads, other resources), what came out (a summary, arrays, artifacts),
 * and the job that makes it, whose state is the resource's state.
 *
 * Meshes, motions and fields are addressed by content: their id is a hash of their tenant's salt, their kind and its
 * computation version, their uploads' bytes and file types, their options, what they need in the given order, and for a
 * motion its name. Asking for the same again gives the same resource and no work, until a release computes it
 * differently. Layouts and recordings get a random id; an idempotency key makes asking twice safe. */
#ifndef STORAGE_RESOURCE_H
#define STORAGE_RESOURCE_H

#include "storage/job.h"
#include "storage/tenant.h"

struct resource {
	char id[STORE_ID_SIZE];
	struct owner owner;
	enum resource_kind kind;
	uint32_t version; /* the computation version that made it, or, before that, the one that asked */
	char *name;       /* owned, UTF-8; "" where none was given */
	char *options;    /* owned, JSON: what was asked, in full, so that it can be computed again; NULL in a list */
	char *summary;    /* owned, JSON: what came out; NULL until the job has succeeded */
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
	struct owner owner;
	const char *name;    /* may be NULL */
	const char *options; /* JSON object in canonical form; NULL means {} */
	/* What tells whether a request under an idempotency key is the same: in the form that every release has given
	 * it, so that a key finds its answer after an upgrade; NULL: the options. */
	const char *asked;
	const char *const *needs; /* ids of the resources that it is made from: mesh before motions */
	size_t need_count;
	const char *const *uploads; /* ids of sealed uploads; the resource takes them over */
	size_t upload_count;
	const char *idempotency_key; /* may be NULL */
	struct job_request queue;    /* how the job that makes it is queued */
};

#endif
