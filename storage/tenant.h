/* Tenants: whose everything is. Each resource, upload and job belongs to one; what a client asks for is found among its
 * tenant's own, and what is another's is not there, to the last byte of the answer. The same content in two tenants is
 * two resources: a tenant's salt goes into its content addresses. */
#ifndef STORAGE_TENANT_H
#define STORAGE_TENANT_H

#include "storage/owner.h"
#include "storage/store.h"

enum { TENANT_NAME_SIZE = 65 };

/* TW_ERROR_INPUT "tenant-name" (1 to 64 of a-z 0-9 - _ . and no - _ . at the beginning), TW_ERROR_CONFLICT
 * "tenant-exists". */
enum tw_status tenant_create(struct store *store, const char *name, int64_t *number,
			     struct tw_error *error) TW_NODISCARD;

/* TW_ERROR_NOT_FOUND "no-such-tenant". */
enum tw_status tenant_find(struct store *store, const char *name, int64_t *number, struct tw_error *error) TW_NODISCARD;

/* TW_ERROR_NOT_FOUND "no-such-tenant" of a deleted one. */
enum tw_status tenant_name(struct store *store, int64_t number, char name[TENANT_NAME_SIZE],
			   struct tw_error *error) TW_NODISCARD;

/* Within a transaction that adds something of the tenant: TW_ERROR_NOT_FOUND "no-such-tenant" where it has been
 * deleted. */
enum tw_status tenant_check(struct store *store, int64_t tenant, struct tw_error *error) TW_NODISCARD;

/* Deletes the tenant: from now on nobody can name it, its keys let nobody in, and what it has cannot be found. Its data
 * go bit by bit, in tenant_sweep. "default" is there again at once, as a new tenant. TW_ERROR_NOT_FOUND
 * "no-such-tenant". */
enum tw_status tenant_delete(struct store *store, const char *name, struct tw_error *error) TW_NODISCARD;

/* A step of removing what deleted tenants had: some dozens of resources, in a transaction of its own, so that others
 * can write between two steps; whatever ends the process, the next step goes on. *more: there is more of it. Where
 * there is nothing, a cheap read. */
enum tw_status tenant_sweep(struct store *store, bool *more, struct tw_error *error) TW_NODISCARD;

struct tenant {
	char name[TENANT_NAME_SIZE]; /* "" while it is being deleted */
	int64_t number;
	int64_t created_ms;
	int64_t keys; /* that are not revoked */
};

/* Oldest first, at most `limit`, from the one behind `after` (0: the first). */
enum tw_status tenant_list(struct store *store, int64_t after, struct tenant *tenants, size_t limit, size_t *count,
			   struct tw_error *error) TW_NODISCARD;

#endif
