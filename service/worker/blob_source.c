/* A blob as a stream, a chunk in memory. */
#include "service/worker/blob_source.h"

#include <stdlib.h>
#include <string.h>

static enum tw_status refill(struct blob_source *source, struct tw_error *error)
{
	source->used = 0;
	source->buffered = 0;
	enum tw_status status = blob_read(source->store, source->blob.number, source->at, source->buffer, BLOB_CHUNK,
					  &source->buffered, error);
	source->at += source->buffered;
	return status;
}

static enum tw_status read_stream(void *context, void *bytes, size_t size, size_t *got, struct tw_error *error)
{
	struct blob_source *source = context;
	char *to = bytes;
	*got = 0;
	while (*got < size) {
		if (source->used == source->buffered) {
			enum tw_status status = refill(source, error);
			if (status != TW_OK || !source->buffered)
				return status;
		}
		size_t part = source->buffered - source->used;
		part = part < size - *got ? part : size - *got;
		memcpy(to + *got, source->buffer + source->used, part);
		source->used += part;
		*got += part;
	}
	return TW_OK;
}

static enum tw_status seek_stream(void *context, uint64_t offset, struct tw_error *error)
{
	struct blob_source *source = context;
	(void)error;
	uint64_t first = source->at - source->buffered;
	if (offset >= first && offset <= source->at) {
		source->used = (size_t)(offset - first);
		return TW_OK;
	}
	source->at = offset < source->blob.size ? offset : source->blob.size;
	source->buffered = 0;
	source->used = 0;
	return TW_OK;
}

enum tw_status blob_source_init(struct blob_source *source, struct store *store, const char *resource_id,
				const char *part, struct byte_source *stream, struct tw_error *error)
{
	memset(source, 0, sizeof *source);
	source->store = store;
	enum tw_status status = blob_find(store, resource_id, BLOB_UPLOAD, part, &source->blob, error);
	if (status != TW_OK)
		return status;
	source->buffer = malloc(BLOB_CHUNK);
	if (!source->buffer)
		return tw_fail_memory(error);
	*stream = (struct byte_source){read_stream, seek_stream, source, source->blob.size};
	return TW_OK;
}

void blob_source_clear(struct blob_source *source)
{
	free(source->buffer);
	source->buffer = NULL;
}
