#include "api/key_table.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>

struct key_table {
	uint8_t seed[crypto_shorthash_KEYBYTES];
	size_t count;
	struct access_key *keys; /* owned */
	size_t bucket_count;     /* a power of two, at least the number of keys */
	uint32_t *first;         /* owned: [bucket_count], 1 + a key's index; 0: none */
	uint32_t *next;          /* owned: [count], the next in the same bucket, likewise */
};

static size_t bucket_of(const struct key_table *table, const uint8_t hash[SECRET_HASH_SIZE])
{
	uint64_t short_hash = 0;
	crypto_shorthash((uint8_t *)&short_hash, hash, SECRET_HASH_SIZE, table->seed);
	return (size_t)short_hash & (table->bucket_count - 1);
}

static void fill(struct key_table *table, const struct access_key *keys)
{
	randombytes_buf(table->seed, sizeof table->seed);
	if (table->count)
		memcpy(table->keys, keys, table->count * sizeof *keys);
	for (size_t i = 0; i < table->count; i++) {
		size_t bucket = bucket_of(table, keys[i].hash);
		table->next[i] = table->first[bucket];
		table->first[bucket] = (uint32_t)i + 1;
	}
}

struct key_table *key_table_new(const struct access_key *keys, size_t count)
{
	struct key_table *table = calloc(1, sizeof *table);
	if (!table || count > UINT32_MAX / 2) {
		free(table);
		return NULL;
	}
	table->count = count;
	table->bucket_count = 1;
	while (table->bucket_count < count)
		table->bucket_count *= 2;
	table->keys = calloc(count + 1, sizeof *table->keys);
	table->next = calloc(count + 1, sizeof *table->next);
	table->first = calloc(table->bucket_count, sizeof *table->first);
	if (table->keys && table->next && table->first) {
		fill(table, keys);
		return table;
	}
	key_table_free(table);
	return NULL;
}

void key_table_free(struct key_table *table)
{
	if (!table)
		return;
	free(table->keys);
	free(table->first);
	free(table->next);
	free(table);
}

const struct access_key *key_table_find(const struct key_table *table, const char *secret, int64_t now_ms)
{
	uint8_t hash[SECRET_HASH_SIZE];
	const struct access_key *found = NULL;
	secret_hash(secret, hash);
	for (uint32_t i = table->first[bucket_of(table, hash)]; i; i = table->next[i - 1])
		if (sodium_memcmp(table->keys[i - 1].hash, hash, sizeof hash) == 0)
			found = &table->keys[i - 1];
	return found && (!found->until_ms || now_ms < found->until_ms) ? found : NULL;
}

const struct access_key *key_table_keys(const struct key_table *table, size_t *count)
{
	*count = table->count;
	return table->keys;
}
