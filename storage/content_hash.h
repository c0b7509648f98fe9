/* What names bytes, or a request, by their content: BLAKE2b-256, as `b2sum -l 256` prints it. */
#ifndef STORAGE_CONTENT_HASH_H
#define STORAGE_CONTENT_HASH_H

#include <sodium.h>
#include <stddef.h>
#include <stdint.h>

#define CONTENT_HASH_SIZE 32

struct content_hash {
	uint8_t bytes[CONTENT_HASH_SIZE];
};

/* Hashes what is added, in order. The struct may be kept and gone on with by the same version of libsodium. */
struct content_hasher {
	crypto_generichash_state state;
};

void content_hasher_init(struct content_hasher *hasher);
void content_hasher_add(struct content_hasher *hasher, const void *bytes, size_t size);
struct content_hash content_hasher_end(struct content_hasher *hasher);

struct content_hash content_hash_of(const void *bytes, size_t size);

#endif
