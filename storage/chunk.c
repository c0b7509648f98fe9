/* Chunks and the hash over them. */
#include "storage/chunk.h"

#include "storage/sql.h"

#include <assert.h>
#include <sodium.h>

static_assert(BLOB_HASH_SIZE == crypto_generichash_BYTES, "BLAKE2b-256");

enum tw_status chunk_add(struct store *store, int64_t blob, uint64_t position, const void *bytes, size_t size,
			 struct tw_error *error)
{
	assert(size <= BLOB_CHUNK);
	uint8_t hash[BLOB_HASH_SIZE];
	crypto_generichash(hash, sizeof hash, bytes, size, NULL, 0);
	struct sql q = sql_query(store, "INSERT INTO chunk(blob, position, hash, bytes) VALUES (?, ?, ?, ?)");
	sql_bind_int(&q, blob);
	sql_bind_int(&q, (int64_t)position);
	sql_bind_bytes(&q, hash, sizeof hash);
	sql_bind_bytes(&q, bytes, size);
	return sql_run(&q, NULL, error);
}

static enum tw_status hash_of_chunks(struct store *store, int64_t blob, uint8_t hash[BLOB_HASH_SIZE],
				     struct tw_error *error)
{
	crypto_generichash_state state;
	crypto_generichash_init(&state, NULL, 0, BLOB_HASH_SIZE);
	struct sql q = sql_query(store, "SELECT hash FROM chunk WHERE blob = ? ORDER BY position");
	sql_bind_int(&q, blob);
	while (sql_step(&q)) {
		size_t size;
		const void *bytes = sql_bytes(&q, &size);
		crypto_generichash_update(&state, bytes, size);
	}
	crypto_generichash_final(&state, hash, BLOB_HASH_SIZE);
	return sql_end(&q, error);
}

enum tw_status chunk_seal(struct store *store, int64_t blob, uint8_t hash[BLOB_HASH_SIZE], struct tw_error *error)
{
	enum tw_status status = hash_of_chunks(store, blob, hash, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, "UPDATE blob SET hash = ?, touched_ms = ? WHERE number = ?");
	sql_bind_bytes(&q, hash, BLOB_HASH_SIZE);
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, blob);
	return sql_run(&q, NULL, error);
}

static enum tw_status insert_row(struct store *store, int64_t resource, const struct blob *blob, struct tw_error *error)
{
	struct sql q = sql_query(store, "INSERT INTO blob(resource, role, name, media_type, type, columns, rows, size,"
					" touched_ms) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)");
	sql_bind_int(&q, resource);
	sql_bind_int(&q, blob->role);
	sql_bind_text(&q, blob->name);
	sql_bind_text(&q, blob->media_type);
	sql_bind_int(&q, blob->type);
	sql_bind_int(&q, blob->columns);
	sql_bind_int(&q, (int64_t)blob->rows);
	sql_bind_int(&q, (int64_t)blob->size);
	sql_bind_int(&q, store_now_ms(store));
	return sql_run(&q, NULL, error);
}

enum tw_status chunk_write_blob(struct store *store, int64_t resource, struct blob *blob, const void *bytes,
				struct tw_error *error)
{
	enum tw_status status = insert_row(store, resource, blob, error);
	blob->number = sqlite3_last_insert_rowid(store->db);
	const char *from = bytes;
	uint64_t position = 0;
	for (uint64_t left = blob->size; status == TW_OK && left; position++) {
		size_t size = left < BLOB_CHUNK ? (size_t)left : BLOB_CHUNK;
		status = chunk_add(store, blob->number, position, from, size, error);
		from += size;
		left -= size;
	}
	return status == TW_OK ? chunk_seal(store, blob->number, blob->hash, error) : status;
}
