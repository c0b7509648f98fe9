/* Keys by what clients show of them. Looking one up takes the same time whatever is shown: the place in the table is a
 * keyed hash (SipHash with a secret of this process) of a hash, so nobody can steer where he looks, and all that stands
 * there is compared whole. */
#ifndef API_KEY_TABLE_H
#define API_KEY_TABLE_H

#include "storage/access.h"

struct key_table;

/* Copies the keys. NULL when out of memory. */
struct key_table *key_table_new(const struct access_key *keys, size_t count);
void key_table_free(struct key_table *table); /* NULL is allowed */

/* The key that this is the secret of, and that is good at `now_ms` (since 1970); NULL: none. Borrowed. */
const struct access_key *key_table_find(const struct key_table *table, const char *secret, int64_t now_ms);

/* All, in no order; borrowed. */
const struct access_key *key_table_keys(const struct key_table *table, size_t *count);

#endif
