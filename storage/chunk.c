/* Writing chunks, and removing them. */
#include "storage/chunk.h"

#include "storage/sql.h"

#include <assert.h>
#include <sodium.h>

enum { SWEEP_CHUNKS = 32 }; /* removed at once: a write lock of some milliseconds */

static_assert(BLOB_HASH_SIZE == crypto_generichash_BYTES, "BLAKE2b-256");

enum tw_status chunk_add(struct store *store, int64_t blob, uint64_t position, const void *bytes, size_t size,
			 struct tw_error *error)
{
	assert(size <= BLOB_CHUNK);
	struct sql q = sql_query(store, "INSERT INTO chunk(blob, position, bytes) VALUES (?, ?, ?)");
	sql_bind_int(&q, blob);
	sql_bind_int(&q, (int64_t)position);
	sql_bind_bytes(&q, bytes, size);
	return sql_run(&q, NULL, error);
}

enum tw_status chunk_seal(struct store *store, int64_t blob, const uint8_t hash[BLOB_HASH_SIZE], struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE blob SET hash = ?, hash_state = NULL, touched_ms = ? WHERE number = ?");
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
	if (status != TW_OK)
		return status;
	crypto_generichash(blob->hash, sizeof blob->hash, bytes, blob->size, NULL, 0);
	return chunk_seal(store, blob->number, blob->hash, error);
}

/* Without the write lock: mostly there is nothing. */
static enum tw_status find_litter(struct store *store, int64_t before_ms, int64_t *blob, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number FROM blob WHERE resource IS NULL AND touched_ms < ?"
					" ORDER BY touched_ms LIMIT 1");
	sql_bind_int(&q, before_ms);
	*blob = sql_step(&q) ? sql_int(&q) : 0;
	return sql_end(&q, error);
}

static enum tw_status let_go(struct store *store, int64_t blob, int64_t before_ms, bool *gone, struct tw_error *error)
{
	int64_t changed = 0;
	struct sql q = sql_query(store, CHUNK_LET_GO " WHERE number = ? AND resource IS NULL AND touched_ms < ?");
	sql_bind_int(&q, blob);
	sql_bind_int(&q, before_ms);
	enum tw_status status = sql_run(&q, &changed, error);
	*gone = changed > 0;
	return status;
}

static enum tw_status remove_chunks(struct store *store, int64_t blob, int64_t *removed, struct tw_error *error)
{
	struct sql q = sql_query(store, "DELETE FROM chunk WHERE number IN"
					" (SELECT number FROM chunk WHERE blob = ? ORDER BY position LIMIT ?)");
	sql_bind_int(&q, blob);
	sql_bind_int(&q, SWEEP_CHUNKS);
	return sql_run(&q, removed, error);
}

static enum tw_status remove_row(struct store *store, int64_t blob, struct tw_error *error)
{
	struct sql q = sql_query(store, "DELETE FROM blob WHERE number = ?");
	sql_bind_int(&q, blob);
	return sql_run(&q, NULL, error);
}

/* It may have been taken up again since it was found. */
static enum tw_status remove_some(struct store *store, int64_t blob, int64_t before_ms, struct tw_error *error)
{
	bool gone = false;
	int64_t removed = 0;
	enum tw_status status = let_go(store, blob, before_ms, &gone, error);
	if (status == TW_OK && gone)
		status = remove_chunks(store, blob, &removed, error);
	return status == TW_OK && gone && removed < SWEEP_CHUNKS ? remove_row(store, blob, error) : status;
}

enum tw_status chunk_sweep(struct store *store, int64_t before_ms, bool *more, struct tw_error *error)
{
	int64_t blob = 0;
	enum tw_status status = find_litter(store, before_ms, &blob, error);
	*more = blob != 0;
	if (status != TW_OK || !blob)
		return status;
	status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = remove_some(store, blob, before_ms, error);
	return transaction_end(store, status, error);
}
