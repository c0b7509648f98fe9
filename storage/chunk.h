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

/* Begins a statement that lets go of blobs: nobody finds them any more, and store_sweep removes their chunks bit by
 * bit. (Removing a large upload at once would hold the write lock for longer than others wait for it.) */
#define CHUNK_LET_GO "UPDATE blob SET resource = NULL, upload = NULL, touched_ms = 0"

#endif
