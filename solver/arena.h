/* A bump allocator with a budget: one per job, everything freed at once. Allocation is checked for overflow and against
 * the budget; a refusal is NULL and leaves the arena as it was. Not thread-safe: one arena per thread. */
#ifndef SOLVER_ARENA_H
#define SOLVER_ARENA_H

#include "tightwire.h"

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

/* Frees everything that was allocated after the mark was taken. */
struct arena_mark arena_mark(const struct arena *arena);
void arena_release(struct arena *arena, struct arena_mark mark);

/* Bytes handed out now, and the largest that ever was. */
size_t arena_used(const struct arena *arena);
size_t arena_peak(const struct arena *arena);

#endif
