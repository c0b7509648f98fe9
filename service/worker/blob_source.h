/* A stored upload as the stream that a motion is read from: a chunk at a time, so that a motion of any size takes a
 * megabyte. */
#ifndef SERVICE_WORKER_BLOB_SOURCE_H
#define SERVICE_WORKER_BLOB_SOURCE_H

#include "solver/motion/motion.h"
#include "storage/blob.h"

struct blob_source {
	struct store *store; /* borrowed */
	struct blob blob;
	uint64_t at;     /* where in the blob the buffer ends */
	size_t buffered; /* bytes in the buffer */
	size_t used;     /* of them, handed out */
	char *buffer;    /* owned, BLOB_CHUNK bytes */
};

/* The part of a resource's uploads. `*stream` borrows the source, which must stay where it is; blob_source_clear, also
 * after an error. */
enum tw_status blob_source_init(struct blob_source *source, struct store *store, const char *resource_id,
				const char *part, struct byte_source *stream, struct tw_error *error) TW_NODISCARD;
void blob_source_clear(struct blob_source *source);

#endif
