/* Blocks in a list, newest first. A block is at least ARENA_BLOCK bytes; a larger request gets a block of its own. The
 * budget counts what was handed out, not what the blocks hold, so that it does not depend on the block size.
 *
 * Under AddressSanitizer every array is a block of just its size, so that a step beyond its end is seen. */
#include "solver/arena.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#if defined(__has_feature)
#define HAS_FEATURE(feature) __has_feature(feature)
#else
#define HAS_FEATURE(feature) 0
#endif

#if defined(__SANITIZE_ADDRESS__) || HAS_FEATURE(address_sanitizer)
enum { ARENA_BLOCK = 0 };
#else
enum { ARENA_BLOCK = 1 << 20 };
#endif

enum { ARENA_ALIGN = 64 };

struct block {
	struct block *older; /* owned */
	size_t capacity;     /* bytes behind the header */
	size_t used;
};

struct arena {
	struct block *newest; /* owned */
	size_t budget;
	size_t total;   /* bytes handed out */
	size_t charged; /* bytes that others hold */
	size_t peak;    /* of both */
};

static size_t round_up(size_t size)
{
	return (size + ARENA_ALIGN - 1) & ~(size_t)(ARENA_ALIGN - 1);
}

static char *block_bytes(struct block *block)
{
	return (char *)block + round_up(sizeof *block);
}

struct arena *arena_new(size_t budget)
{
	struct arena *arena = calloc(1, sizeof *arena);
	if (arena)
		arena->budget = budget ? budget : SIZE_MAX;
	return arena;
}

void arena_free(struct arena *arena)
{
	if (!arena)
		return;
	arena_release(arena, (struct arena_mark){0});
	free(arena);
}

static struct block *block_push(struct arena *arena, size_t size)
{
	size_t capacity = size > ARENA_BLOCK ? size : ARENA_BLOCK;
	size_t bytes;
	if (__builtin_add_overflow(capacity, round_up(sizeof(struct block)), &bytes))
		return NULL;
	void *memory;
	if (posix_memalign(&memory, ARENA_ALIGN, bytes))
		return NULL;
	struct block *block = memory;
	*block = (struct block){.older = arena->newest, .capacity = capacity};
	arena->newest = block;
	return block;
}

static void note_peak(struct arena *arena)
{
	if (arena->total + arena->charged > arena->peak)
		arena->peak = arena->total + arena->charged;
}

void *arena_array(struct arena *arena, size_t count, size_t size)
{
	size_t exact;
	if (__builtin_mul_overflow(count, size, &exact) || exact > SIZE_MAX - ARENA_ALIGN)
		return NULL;
	const size_t bytes = round_up(exact);
	if (bytes > arena->budget - arena->total - arena->charged)
		return NULL;
	struct block *block = arena->newest;
	if (!block || !ARENA_BLOCK || bytes > block->capacity - block->used)
		block = block_push(arena, ARENA_BLOCK ? bytes : exact);
	if (!block)
		return NULL;
	void *memory = block_bytes(block) + block->used;
	block->used += bytes;
	arena->total += bytes;
	note_peak(arena);
	return memory;
}

bool arena_charge(struct arena *arena, size_t bytes)
{
	if (bytes > arena->budget - arena->total - arena->charged)
		return false;
	arena->charged += bytes;
	note_peak(arena);
	return true;
}

void arena_discharge(struct arena *arena, size_t bytes)
{
	assert(bytes <= arena->charged);
	arena->charged -= bytes;
}

void *arena_zeroed(struct arena *arena, size_t count, size_t size)
{
	void *memory = arena_array(arena, count, size);
	if (memory)
		memset(memory, 0, count * size);
	return memory;
}

struct arena_mark arena_mark(const struct arena *arena)
{
	return (struct arena_mark){
		.block = arena->newest,
		.used = arena->newest ? arena->newest->used : 0,
		.total = arena->total,
	};
}

void arena_release(struct arena *arena, struct arena_mark mark)
{
	while (arena->newest && arena->newest != mark.block) {
		struct block *older = arena->newest->older;
		free(arena->newest);
		arena->newest = older;
	}
	if (arena->newest)
		arena->newest->used = mark.used;
	arena->total = mark.total;
}

size_t arena_used(const struct arena *arena)
{
	return arena->total + arena->charged;
}

size_t arena_peak(const struct arena *arena)
{
	return arena->peak;
}
