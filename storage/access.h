/* Who is let in, as a daemon keeps it in memory, and what it tells of the use of keys. */
#ifndef STORAGE_ACCESS_H
#define STORAGE_ACCESS_H

#include "storage/key.h"

/* With what a tenant's cursors are veiled, so that they do not tell how much others ask for; from its salt, so that
 * every daemon has the same. */
enum { ACCESS_VEIL_SIZE = 16 };

/* A secret that is good. */
struct access_key {
	uint8_t hash[SECRET_HASH_SIZE];
	struct owner owner;
	uint8_t veil[ACCESS_VEIL_SIZE]; /* of the tenant */
	unsigned scopes;
	uint32_t weight;  /* of its jobs in the queue; 0: as usual */
	int64_t until_ms; /* since 1970; 0: for ever */
	struct key_limits limits;
	char tenant[TENANT_NAME_SIZE], name[KEY_NAME_SIZE]; /* for the log */
};

struct access {
	int64_t change;         /* see access_change */
	bool keys_needed;       /* there is a key, or has been one */
	int64_t default_tenant; /* whose is what comes without a key, or with one of a key file */
	uint8_t default_veil[ACCESS_VEIL_SIZE];
	struct access_key *keys; /* owned */
	size_t count;
};

/* In one snapshot. The caller clears it. */
enum tw_status access_read(struct store *store, struct access *access, struct tw_error *error) TW_NODISCARD;
void access_clear(struct access *access);

/* A number that grows whenever what access_read gives may have changed; a cheap read, for several times a second. */
enum tw_status access_change(struct store *store, int64_t *change, struct tw_error *error) TW_NODISCARD;

/* How a key was used since this was told last. */
struct access_use {
	int64_t client;
	int64_t requests;
	int64_t last_ms; /* since 1970 */
};

/* Adds it up in the store; not durable. Clients without a row are passed over. */
enum tw_status access_add_uses(struct store *store, const struct access_use *uses, size_t count,
			       struct tw_error *error) TW_NODISCARD;

#endif
