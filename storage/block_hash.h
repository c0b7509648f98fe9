/* What tells that stored bytes are as they were written: hashes of the blocks of a chunk, one behind the other, so that
 * a part of it can be checked without the rest. BLAKE2b-128. Internal to this folder. */
#ifndef STORAGE_BLOCK_HASH_H
#define STORAGE_BLOCK_HASH_H

#include <stddef.h>
#include <stdint.h>

enum {
	BLOCK_BYTES = 64 << 10, /* the last one of a chunk is shorter */
	BLOCK_HASH_SIZE = 16,
	BLOCKS_MAX = 16, /* of a chunk */
};

void block_hash(const void *bytes, size_t size, uint8_t hash[BLOCK_HASH_SIZE]);

/* Of all blocks of a chunk; returns how many. */
size_t block_hash_all(const void *bytes, size_t size, uint8_t hashes[BLOCKS_MAX * BLOCK_HASH_SIZE]);

#endif
