/* How blobs are written: inside the transaction that the caller has begun. Internal to this folder. */
#ifndef STORAGE_CHUNK_H
#define STORAGE_CHUNK_H

#include "storage/blob.h"

/* One chunk of at most BLOB_CHUNK bytes at its place in a blob, with the hashes of its blocks. */
enum tw_status chunk_add(struct store *store, int64_t blob, uint64_t position, const void *bytes, size_t size,
			 struct tw_error *error) TW_NODISCARD;

/* Ends a blob: with its hash it can be used. */
enum tw_status chunk_seal(struct store *store, int64_t blob, const struct content_hash *hash,
			  struct tw_error *error) TW_NODISCARD;

/* A whole blob of a resource from memory. Of `blob`, number and hash are results; role, name, media_type, type,
 * columns, rows and size say what it is. */
enum tw_status chunk_write_blob(struct store *store, int64_t resource, struct blob *blob, const void *bytes,
				struct tw_error *error) TW_NODISCARD;

/* The same for what is large, ahead of the transaction that will give it to a resource: a chunk is a transaction of its
 * own, so that others can write in between. It belongs to nobody until chunk_adopt; where that never comes, store_sweep
 * removes it. */
enum tw_status chunk_stage_blob(struct store *store, struct blob *blob, const void *bytes,
				struct tw_error *error) TW_NODISCARD;
enum tw_status chunk_adopt(struct store *store, int64_t resource, int64_t blob, struct tw_error *error) TW_NODISCARD;

/* Begins a statement that lets go of blobs: nobody finds them any more, and store_sweep removes their chunks bit by
 * bit. (Removing a large upload at once would hold the write lock for longer than others wait for it.) */
#define CHUNK_LET_GO "UPDATE blob SET resource = NULL, upload = NULL, tenant = 0, client = 0, touched_ms = 0"

/* Sets the owner of a blob to that of the resource which is parameter 1 of the statement. */
#define CHUNK_OWNED_BY_RESOURCE "(tenant, client) = (SELECT r.tenant, r.client FROM resource r WHERE r.number = ?1)"

#endif
