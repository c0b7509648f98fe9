/* Writing chunks. */
#include "storage/chunk.h"

#include "storage/block_hash.h"
#include "storage/sql.h"
#include "storage/store.h"

#include <assert.h>

static_assert(BLOB_CHUNK == BLOCKS_MAX * BLOCK_BYTES, "the blocks of a chunk");

static enum tw_status add_hashes(struct store *store, int64_t chunk, const void *bytes, size_t size,
				 struct tw_error *error)
{
	uint8_t hashes[BLOCKS_MAX * BLOCK_HASH_SIZE];
	size_t count = block_hash_all(bytes, size, hashes);
	struct sql q = sql_query(store, "INSERT INTO chunk_hash(chunk, hashes) VALUES (?, ?)");
	sql_bind_int(&q, chunk);
	sql_bind_bytes(&q, hashes, count * BLOCK_HASH_SIZE);
	return sql_run(&q, NULL, error);
}

enum tw_status chunk_add(struct store *store, int64_t blob, uint64_t position, const void *bytes, size_t size,
			 struct tw_error *error)
{
	assert(size <= BLOB_CHUNK);
	struct sql q = sql_query(store, "INSERT INTO chunk(blob, position, bytes) VALUES (?, ?, ?)");
	sql_bind_int(&q, blob);
	sql_bind_int(&q, (int64_t)position);
	sql_bind_bytes(&q, bytes, size);
	enum tw_status status = sql_run(&q, NULL, error);
	return status == TW_OK ? add_hashes(store, sql_inserted(store), bytes, size, error) : status;
}

enum tw_status chunk_seal(struct store *store, int64_t blob, const struct content_hash *hash, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE blob SET hash = ?, hash_state = NULL, touched_ms = ? WHERE number = ?");
	sql_bind_bytes(&q, hash->bytes, sizeof hash->bytes);
	sql_bind_int(&q, store_lease_now_ms(store));
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
	sql_bind_int(&q, store_lease_now_ms(store));
	return sql_run(&q, NULL, error);
}

enum tw_status chunk_write_blob(struct store *store, int64_t resource, struct blob *blob, const void *bytes,
				struct tw_error *error)
{
	enum tw_status status = insert_row(store, resource, blob, error);
	blob->number = sql_inserted(store);
	const char *from = bytes;
	uint64_t position = 0;
	for (uint64_t left = blob->size; status == TW_OK && left; position++) {
		size_t size = left < BLOB_CHUNK ? (size_t)left : BLOB_CHUNK;
		status = chunk_add(store, blob->number, position, from, size, error);
		from += size;
		left -= size;
	}
	if (status != TW_OK)
		return status;
	blob->hash = content_hash_of(bytes, blob->size);
	return chunk_seal(store, blob->number, &blob->hash, error);
}
