#include "solver/motion/source.h"

#include <string.h>

static enum tw_status memory_read(void *context, void *bytes, size_t size, size_t *got, struct tw_error *error)
{
	(void)error;
	struct byte_memory *memory = context;
	size_t left = memory->size - memory->at;
	*got = size < left ? size : left;
	if (*got > 0)
		memcpy(bytes, (const char *)memory->bytes + memory->at, *got);
	memory->at += *got;
	return TW_OK;
}

static enum tw_status memory_seek(void *context, uint64_t offset, struct tw_error *error)
{
	(void)error;
	struct byte_memory *memory = context;
	memory->at = offset < memory->size ? (size_t)offset : memory->size;
	return TW_OK;
}

struct byte_source byte_source_memory(struct byte_memory *memory)
{
	return (struct byte_source){.read = memory_read, .seek = memory_seek, .context = memory, .size = memory->size};
}
