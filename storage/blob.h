/* Bytes in the store: uploads as they came, computed arrays, artifacts. A blob is a row with its size and hash, and its
 * bytes in chunks of BLOB_CHUNK (the last one shorter), so that neither writer nor reader ever holds more than a chunk.
 */
#ifndef STORAGE_BLOB_H
#define STORAGE_BLOB_H

#include "storage/content_hash.h"
#include "storage/store.h"

#define BLOB_CHUNK (1u << 20)
#define BLOB_NAME_SIZE 128

/* The type of the error that says that stored bytes are not what was written. */
#define BLOB_DAMAGED "stored-bytes-damaged"

enum blob_role {
	BLOB_UPLOAD,   /* name: the part, "worn" "pattern" "motion" "frames"; media_type: as the client said */
	BLOB_ARRAY,    /* name: the array's; with type, columns and rows */
	BLOB_ARTIFACT, /* name: the file's, "pattern.svg" */
};

struct blob {
	int64_t number; /* what blob_read wants */
	enum blob_role role;
	char name[BLOB_NAME_SIZE];
	char file_name[BLOB_NAME_SIZE]; /* of an upload, "suit.obj"; else "" */
	char media_type[BLOB_NAME_SIZE];
	enum tw_type type; /* type, columns and rows: arrays only */
	uint32_t columns;
	uint64_t rows;
	uint64_t size;            /* bytes */
	struct content_hash hash; /* zero while it is being written */
	int64_t read_ms; /* of a file that can be made again (task.h): when it was read, roughly, by the lease clock;
			    else 0 */
};

/* The blob of a resource by role and name. TW_ERROR_NOT_FOUND "no-such-blob". */
enum tw_status blob_find(struct store *store, const char *resource_id, enum blob_role role, const char *name,
			 struct blob *blob, struct tw_error *error) TW_NODISCARD;

/* All blobs of a resource in one role, in the order in which they were written. `*blobs` is heap memory, to be freed.
 */
enum tw_status blob_list(struct store *store, const char *resource_id, enum blob_role role, struct blob **blobs,
			 size_t *count, struct tw_error *error) TW_NODISCARD;

/* Copies at most `size` bytes from `offset`; `*got` is smaller only at the end of the blob, and 0 there. Holds no lock
 * and no memory between calls. Reads whole chunks fastest. TW_ERROR_NOT_FOUND when it was deleted meanwhile.
 *
 * What is read is checked against the hashes that were kept when it was written: TW_ERROR_IO BLOB_DAMAGED, and then
 * `bytes` are not to be used. (Blobs that 0.1.0 wrote have none.) */
enum tw_status blob_read(struct store *store, int64_t number, uint64_t offset, void *bytes, size_t size, size_t *got,
			 struct tw_error *error) TW_NODISCARD;

#endif
