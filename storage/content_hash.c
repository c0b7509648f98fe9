#include "storage/content_hash.h"

#include <assert.h>

static_assert(CONTENT_HASH_SIZE == crypto_generichash_BYTES, "BLAKE2b-256");

void content_hasher_init(struct content_hasher *hasher)
{
	crypto_generichash_init(&hasher->state, NULL, 0, CONTENT_HASH_SIZE);
}

void content_hasher_add(struct content_hasher *hasher, const void *bytes, size_t size)
{
	crypto_generichash_update(&hasher->state, bytes, size);
}

struct content_hash content_hasher_end(struct content_hasher *hasher)
{
	struct content_hash hash;
	crypto_generichash_final(&hasher->state, hash.bytes, sizeof hash.bytes);
	return hash;
}

struct content_hash content_hash_of(const void *bytes, size_t size)
{
	struct content_hasher hasher;
	content_hasher_init(&hasher);
	content_hasher_add(&hasher, bytes, size);
	return content_hasher_end(&hasher);
}
