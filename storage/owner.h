/* Whose something is. */
#ifndef STORAGE_OWNER_H
#define STORAGE_OWNER_H

#include <stdint.h>

/* Tenants are numbers here, and names only to people. 0 is nobody: it finds nothing. */
#define TENANT_DEFAULT 1  /* "default": in every new store, and all there was in those of 0.1.0 */
#define TENANT_ANY (-1ll) /* workers, the rig and the supervisor work for all */

/* Whose something is, and which of the tenant's API keys asked for it (key.h): 0 for none, below 0 for one of a key
 * file. */
struct owner {
	int64_t tenant, client;
};
#define OWNER_DEFAULT ((struct owner){TENANT_DEFAULT, 0})

#endif
