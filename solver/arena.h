/* A bump allocator with a budget: one per job, everything freed at once. Allocation is checked for overflow and against
 * the budget; a refusal is NULL and leaves the arena as it was. Not thread-safe: one arena per thread. */
#ifndef SOLVER_ARENA_H
#define SOLVER_ARENA_H

#include "tightwire.h"

#include <stdbool.h>

struct arena;

/* A place in the arena to return to. */
struct arena_mark {
	void *block;
	size_t used;
	size_t total;
};

/* `budget`: bytes that may be held at once, 0 for no limit. NULL when out of memory. Free with arena_free. */
struct arena *arena_new(size_t budget);
void arena_free(struct arena *arena); /* NULL is allowed */

/* `count` objects of `size` bytes, aligned to 64 bytes, zeroed (`arena_zeroed`) or not (`arena_array`). NULL when the
 * product overflows, the budget is spent or memory is out. A count of 0 gives a valid pointer. */
void *arena_array(struct arena *arena, size_t count, size_t size) TW_NODISCARD;
void *arena_zeroed(struct arena *arena, size_t count, size_t size) TW_NODISCARD;

#define ARENA_ARRAY(arena, count, type) ((type *)arena_array((arena), (count), sizeof(type)))
#define ARENA_ZEROED(arena, count, type) ((type *)arena_zeroed((arena), (count), sizeof(type)))

/* Counts memory that somebody else holds (a library, which has no arena) against the budget: false, and nothing is
 * counted, where it does not fit. Marks do not touch it; arena_discharge gives it back. */
bool arena_charge(struct arena *arena, size_t bytes) TW_NODISCARD;
void arena_discharge(struct arena *arena, size_t bytes);

/* Frees everything that was allocated after the mark was taken. */
struct arena_mark arena_mark(const struct arena *arena);
void arena_release(struct arena *arena, struct arena_mark mark);

/* Bytes handed out and charged now, and the largest that ever were. */
size_t arena_used(const struct arena *arena);
size_t arena_peak(const struct arena *arena);

#endif
