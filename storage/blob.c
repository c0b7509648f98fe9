/* Finding and reading blobs. */
#include "storage/blob.h"

#include "storage/block_hash.h"
#include "storage/sql.h"

#include <stdlib.h>
#include <string.h>

#define BLOB_COLUMNS                                                                                                   \
	"b.number, b.role, b.name, b.file_name, b.media_type, b.type, b.columns, b.rows, b.size, b.hash,"              \
	" b.of_task * b.touched_ms"

static void read_blob(struct sql *q, struct blob *blob)
{
	size_t hash_size;
	blob->number = sql_int(q);
	blob->role = (enum blob_role)sql_int(q);
	sql_copy_text(q, blob->name, sizeof blob->name);
	sql_copy_text(q, blob->file_name, sizeof blob->file_name);
	sql_copy_text(q, blob->media_type, sizeof blob->media_type);
	blob->type = (enum tw_type)sql_int(q);
	blob->columns = (uint32_t)sql_int(q);
	blob->rows = (uint64_t)sql_int(q);
	blob->size = (uint64_t)sql_int(q);
	const void *hash = sql_bytes(q, &hash_size);
	memset(&blob->hash, 0, sizeof blob->hash);
	if (hash && hash_size == sizeof blob->hash.bytes)
		memcpy(blob->hash.bytes, hash, hash_size);
	blob->read_ms = sql_int(q);
}

enum tw_status blob_find(struct store *store, const char *resource_id, enum blob_role role, const char *name,
			 struct blob *blob, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT " BLOB_COLUMNS " FROM blob b JOIN resource r ON r.number = b.resource"
					" WHERE r.id = ? AND b.role = ? AND b.name = ?");
	sql_bind_text(&q, resource_id);
	sql_bind_int(&q, role);
	sql_bind_text(&q, name);
	bool found = sql_step(&q);
	if (found)
		read_blob(&q, blob);
	enum tw_status status = sql_end(&q, error);
	if (status == TW_OK && !found)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-blob", NULL, "%s has no \"%.100s\"", resource_id,
				 name);
	return status;
}

enum tw_status blob_list(struct store *store, const char *resource_id, enum blob_role role, struct blob **blobs,
			 size_t *count, struct tw_error *error)
{
	struct blob *list = NULL;
	size_t used = 0;
	size_t room = 0;
	struct sql q = sql_query(store, "SELECT " BLOB_COLUMNS " FROM blob b JOIN resource r ON r.number = b.resource"
					" WHERE r.id = ? AND b.role = ? ORDER BY b.number");
	sql_bind_text(&q, resource_id);
	sql_bind_int(&q, role);
	while (sql_step(&q)) {
		if (used == room) {
			room = room ? 2 * room : 8;
			struct blob *more = realloc(list, room * sizeof *list);
			if (!more) {
				q.code = SQLITE_NOMEM;
				break;
			}
			list = more;
		}
		read_blob(&q, &list[used++]);
	}
	enum tw_status status = sql_end(&q, error);
	if (status != TW_OK) {
		free(list);
		return status;
	}
	*blobs = list;
	*count = used;
	return TW_OK;
}

static enum tw_status gone(struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-blob", NULL, "it was deleted");
}

static enum tw_status blob_extent(struct store *store, int64_t number, uint64_t *size, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT size FROM blob WHERE number = ?"
					" AND (resource IS NOT NULL OR upload IS NOT NULL)");
	sql_bind_int(&q, number);
	bool found = sql_step(&q);
	*size = found ? (uint64_t)sql_int(&q) : 0;
	enum tw_status status = sql_end(&q, error);
	return status == TW_OK && !found ? gone(error) : status;
}

/* A chunk, as far as reading it has to know it. */
struct chunk {
	int64_t blob;
	int64_t row;
	uint64_t position;
	size_t size;
	uint8_t hashes[BLOCKS_MAX * BLOCK_HASH_SIZE];
	bool has_hashes; /* chunks of 0.1.0 have none */
};

static enum tw_status find_chunk(struct store *store, struct chunk *chunk, struct tw_error *error)
{
	size_t size = 0;
	struct sql q =
		sql_query(store, "SELECT c.number, h.hashes FROM chunk c"
				 " LEFT JOIN chunk_hash h ON h.chunk = c.number WHERE c.blob = ? AND c.position = ?");
	sql_bind_int(&q, chunk->blob);
	sql_bind_int(&q, (int64_t)chunk->position);
	bool found = sql_step(&q);
	if (found) {
		chunk->row = sql_int(&q);
		const void *hashes = sql_bytes(&q, &size);
		chunk->has_hashes = hashes && size <= sizeof chunk->hashes &&
				    size == (chunk->size + BLOCK_BYTES - 1) / BLOCK_BYTES * BLOCK_HASH_SIZE;
		if (chunk->has_hashes)
			memcpy(chunk->hashes, hashes, size);
	}
	enum tw_status status = sql_end(&q, error);
	return status == TW_OK && !found ? gone(error) : status;
}

static enum tw_status check_block(const struct chunk *chunk, size_t block, const void *bytes, size_t size,
				  struct tw_error *error)
{
	uint8_t hash[BLOCK_HASH_SIZE];
	if (!chunk->has_hashes)
		return TW_OK;
	block_hash(bytes, size, hash);
	if (!memcmp(hash, chunk->hashes + block * BLOCK_HASH_SIZE, sizeof hash))
		return TW_OK;
	return tw_fail(error, TW_ERROR_IO, BLOB_DAMAGED, NULL,
		       "stored bytes are not what was written (blob %lld, from byte %llu): check the disk, and restore "
		       "the store from a backup",
		       (long long)chunk->blob,
		       (unsigned long long)(chunk->position * BLOB_CHUNK + block * BLOCK_BYTES));
}

/* Of the block, `size` bytes from `offset` in it. */
static enum tw_status read_block(sqlite3_blob *handle, const struct chunk *chunk, size_t block, size_t offset,
				 char *bytes, size_t size, struct tw_error *error)
{
	char scratch[BLOCK_BYTES];
	size_t from = block * BLOCK_BYTES;
	size_t whole = chunk->size - from < BLOCK_BYTES ? chunk->size - from : BLOCK_BYTES;
	char *to = size == whole ? bytes : scratch;
	int code = sqlite3_blob_read(handle, to, (int)whole, (int)from);
	/* Shorter than its blob says, for one. */
	if (code != SQLITE_OK)
		return code == SQLITE_ERROR ? gone(error) : connection_fail(NULL, code, error);
	enum tw_status status = check_block(chunk, block, to, whole, error);
	if (status == TW_OK && to == scratch)
		memcpy(bytes, scratch + offset, size);
	return status;
}

/* Opened and closed each time: an open handle holds a snapshot, behind which the WAL could not be emptied. */
static enum tw_status read_chunk(struct store *store, const struct chunk *chunk, size_t offset, char *bytes,
				 size_t size, struct tw_error *error)
{
	sqlite3_blob *handle = NULL;
	int code = sqlite3_blob_open(store->connection->db, "main", "chunk", "bytes", chunk->row, 0, &handle);
	enum tw_status status = code == SQLITE_OK      ? TW_OK
				: code == SQLITE_ERROR ? gone(error) /* deleted meanwhile */
						       : connection_fail(store->connection->db, code, error);
	while (status == TW_OK && size) {
		size_t inside = offset % BLOCK_BYTES;
		size_t part = BLOCK_BYTES - inside < size ? BLOCK_BYTES - inside : size;
		status = read_block(handle, chunk, offset / BLOCK_BYTES, inside, bytes, part, error);
		bytes += part;
		offset += part;
		size -= part;
	}
	sqlite3_blob_close(handle);
	return status;
}

static enum tw_status read_chunks(struct store *store, int64_t number, uint64_t offset, void *bytes, size_t size,
				  size_t *got, struct tw_error *error)
{
	uint64_t end;
	enum tw_status status = blob_extent(store, number, &end, error);
	char *to = bytes;
	*got = 0;
	while (status == TW_OK && *got < size && offset < end) {
		struct chunk chunk = {.blob = number, .position = offset / BLOB_CHUNK};
		uint64_t left = end - chunk.position * BLOB_CHUNK;
		uint64_t inside = offset % BLOB_CHUNK;
		chunk.size = left < BLOB_CHUNK ? (size_t)left : BLOB_CHUNK;
		size_t part = chunk.size - (size_t)inside;
		part = part < size - *got ? part : size - *got;
		status = find_chunk(store, &chunk, error);
		if (status == TW_OK)
			status = read_chunk(store, &chunk, (size_t)inside, to + *got, part, error);
		if (status == TW_OK) {
			*got += part;
			offset += part;
		}
	}
	return status;
}

/* In one snapshot: the numbers of removed chunks are given to new ones. */
enum tw_status blob_read(struct store *store, int64_t number, uint64_t offset, void *bytes, size_t size, size_t *got,
			 struct tw_error *error)
{
	*got = 0;
	enum tw_status status = snapshot_begin(store, error);
	if (status != TW_OK)
		return status;
	status = read_chunks(store, number, offset, bytes, size, got, error);
	return transaction_end(store, status, error);
}
