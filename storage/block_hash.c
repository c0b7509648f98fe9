#include "storage/block_hash.h"

#include <assert.h>
#include <sodium.h>

void block_hash(const void *bytes, size_t size, uint8_t hash[BLOCK_HASH_SIZE])
{
	crypto_generichash(hash, BLOCK_HASH_SIZE, bytes, size, NULL, 0);
}

size_t block_hash_all(const void *bytes, size_t size, uint8_t hashes[BLOCKS_MAX * BLOCK_HASH_SIZE])
{
	size_t count = 0;
	assert(size <= (size_t)BLOCKS_MAX * BLOCK_BYTES);
	for (size_t at = 0; at < size; at += BLOCK_BYTES, count++)
		block_hash((const char *)bytes + at, size - at < BLOCK_BYTES ? size - at : BLOCK_BYTES,
			   hashes + count * BLOCK_HASH_SIZE);
	return count;
}
