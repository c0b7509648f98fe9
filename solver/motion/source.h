/* Where the bytes of a motion come from. */
#ifndef SOLVER_MOTION_SOURCE_H
#define SOLVER_MOTION_SOURCE_H

#include "tightwire.h"

/* A stream that can go on from anywhere: an upload's chunks, a file, memory. */
struct byte_source {
	/* Fills up to `size` bytes; *got < size only at the end. */
	enum tw_status (*read)(void *context, void *bytes, size_t size, size_t *got, struct tw_error *error);
	/* The next byte read is the one at `offset`; beyond the end there is none. */
	enum tw_status (*seek)(void *context, uint64_t offset, struct tw_error *error);
	void *context;
	uint64_t size; /* bytes in all; UINT64_MAX when unknown */
};

/* Reads from memory. `memory` and what it points to must outlive the source. */
struct byte_memory {
	const void *bytes;
	size_t size;
	size_t at; /* starts as 0 */
};
struct byte_source byte_source_memory(struct byte_memory *memory);

#endif
