/* Writing chunks. */
#include "storage/chunk.h"

#include "storage/block_hash.h"
#include "storage/id.h"
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

/* `resource` 0: nobody's yet, and then it has the id of an upload. */
static enum tw_status insert_row(struct store *store, int64_t resource, struct blob *blob, struct tw_error *error)
{
	char id[STORE_ID_SIZE];
	id_random(id, "staged");
	struct sql q =
		sql_query(store, "INSERT INTO blob(resource, upload, role, name, media_type, type, columns, rows,"
				 " size, touched_ms, tenant, client) VALUES (nullif(?1, 0), ?2, ?3, ?4, ?5, ?6, ?7,"
				 " ?8, ?9, ?10, coalesce((SELECT tenant FROM resource WHERE number = ?1), 0),"
				 " coalesce((SELECT client FROM resource WHERE number = ?1), 0))");
	sql_bind_int(&q, resource);
	sql_bind_text(&q, resource ? NULL : id);
	sql_bind_int(&q, blob->role);
	sql_bind_text(&q, blob->name);
	sql_bind_text(&q, blob->media_type);
	sql_bind_int(&q, blob->type);
	sql_bind_int(&q, blob->columns);
	sql_bind_int(&q, (int64_t)blob->rows);
	sql_bind_int(&q, (int64_t)blob->size);
	sql_bind_int(&q, store_lease_now_ms(store));
	enum tw_status status = sql_run(&q, NULL, error);
	blob->number = sql_inserted(store);
	return status;
}

static enum tw_status add_part(struct store *store, const struct blob *blob, uint64_t position, const void *bytes,
			       struct tw_error *error)
{
	uint64_t from = position * BLOB_CHUNK;
	size_t size = blob->size - from < BLOB_CHUNK ? (size_t)(blob->size - from) : BLOB_CHUNK;
	return chunk_add(store, blob->number, position, (const char *)bytes + from, size, error);
}

enum tw_status chunk_write_blob(struct store *store, int64_t resource, struct blob *blob, const void *bytes,
				struct tw_error *error)
{
	enum tw_status status = insert_row(store, resource, blob, error);
	for (uint64_t position = 0; status == TW_OK && position * BLOB_CHUNK < blob->size; position++)
		status = add_part(store, blob, position, bytes, error);
	if (status != TW_OK)
		return status;
	blob->hash = content_hash_of(bytes, blob->size);
	return chunk_seal(store, blob->number, &blob->hash, error);
}

static enum tw_status stage_row(struct store *store, struct blob *blob, struct tw_error *error)
{
	enum tw_status status = transaction_begin_alone(store, error);
	if (status != TW_OK)
		return status;
	status = insert_row(store, 0, blob, error);
	if (status == TW_OK)
		status = chunk_seal(store, blob->number, &blob->hash, error);
	return transaction_end(store, status, error);
}

static enum tw_status stage_part(struct store *store, const struct blob *blob, uint64_t position, const void *bytes,
				 struct tw_error *error)
{
	enum tw_status status = transaction_begin_alone(store, error);
	if (status != TW_OK)
		return status;
	status = add_part(store, blob, position, bytes, error);
	return transaction_end(store, status, error);
}

enum tw_status chunk_stage_blob(struct store *store, struct blob *blob, const void *bytes, struct tw_error *error)
{
	blob->hash = content_hash_of(bytes, blob->size);
	enum tw_status status = stage_row(store, blob, error);
	for (uint64_t position = 0; status == TW_OK && position * BLOB_CHUNK < blob->size; position++)
		status = stage_part(store, blob, position, bytes, error);
	return status;
}

enum tw_status chunk_adopt(struct store *store, int64_t resource, int64_t blob, struct tw_error *error)
{
	int64_t adopted = 0;
	struct sql q = sql_query(store, "UPDATE blob SET resource = ?1, upload = NULL, " CHUNK_OWNED_BY_RESOURCE
					" WHERE number = ?2"
					" AND resource IS NULL AND upload IS NOT NULL");
	sql_bind_int(&q, resource);
	sql_bind_int(&q, blob);
	enum tw_status status = sql_run(&q, &adopted, error);
	if (status == TW_OK && adopted != 1)
		status = tw_fail(error, TW_ERROR_IO, "store-io", NULL, "what was written ahead was swept; try again");
	return status;
}
