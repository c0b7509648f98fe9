/* Marks that are not wiped between uses: an entry of an array is marked when it equals the current stamp. The arrays
 * start as zeros, and are wiped when the stamps are used up. */
#ifndef SOLVER_STEINER_STAMP_H
#define SOLVER_STEINER_STAMP_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* The last but one, so that a second mark can be told from the first without a wipe in between. */
#define STAMP_LAST (UINT32_MAX - 1)

/* Where stamps begin. With asserts on, so near to the end that every test sees them used up. */
#ifdef NDEBUG
#define STAMP_FIRST 0u
#else
#define STAMP_FIRST (STAMP_LAST - 40)
#endif

/* The stamp that follows; nothing has it. */
static inline uint32_t stamp_next(uint32_t stamp, uint32_t *marks, size_t count)
{
	if (stamp < STAMP_LAST)
		return stamp + 1;
	memset(marks, 0, count * sizeof *marks);
	return 1;
}

#endif
