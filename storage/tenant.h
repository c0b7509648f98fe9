/* Tenants: whose everything is. Each resource, upload and job belongs to one; what a client asks for is found among its
 * tenant's own, and what is another's is not there, to the last byte of the answer. The same content in two tenants is
 * two resources: a tenant's salt goes into its content addresses. */
#ifndef STORAGE_TENANT_H
#define STORAGE_TENANT_H

#include "storage/store.h"

/* Tenants are numbers here, and names only to people. 0 is nobody: it finds nothing. */
#define TENANT_DEFAULT 1  /* "default": in every new store, and all there was in those of 0.1.0 */
#define TENANT_ANY (-1ll) /* workers, the rig and the supervisor work for all */

/* Whose something is, and which of the tenant's API keys asked for it (key.h): 0 for none, below 0 for one of a key
 * file. */
struct owner {
	int64_t tenant, client;
};
#define OWNER_DEFAULT ((struct owner){TENANT_DEFAULT, 0})

enum { TENANT_NAME_SIZE = 65 };

/* TW_ERROR_INPUT "tenant-name" (1 to 64 of a-z 0-9 - _ . and no - _ . at the beginning), TW_ERROR_CONFLICT
 * "tenant-exists". */
enum tw_status tenant_create(struct store *store, const char *name, int64_t *number,
			     struct tw_error *error) TW_NODISCARD;

/* TW_ERROR_NOT_FOUND "no-such-tenant". */
enum tw_status tenant_find(struct store *store, const char *name, int64_t *number, struct tw_error *error) TW_NODISCARD;

#endif
