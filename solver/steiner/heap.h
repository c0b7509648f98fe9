/* A 4-ary min-heap of (key, item) with lazy deletion: an item may lie in it several times, and whoever pops compares
 * the key with the item's label. Children of one node share a cache line. Equal keys come out by item, so that the
 * order is the same everywhere. */
#ifndef SOLVER_STEINER_HEAP_H
#define SOLVER_STEINER_HEAP_H

#include "solver/steiner/fine.h"

#include <assert.h>
#include <stddef.h>

struct heap_entry {
	fine_t key;
	uint32_t item;
	uint32_t extra; /* the user's; not compared */
};

struct heap {
	struct heap_entry *entry; /* borrowed */
	size_t count, capacity;
};

static inline int heap_less(const struct heap_entry *a, const struct heap_entry *b)
{
	return a->key < b->key || (a->key == b->key && a->item < b->item);
}

/* There must be room. A Dijkstra that settles every vertex once pushes no more than an entry for every arc and every
 * start. */
static inline void heap_push(struct heap *heap, fine_t key, uint32_t item, uint32_t extra)
{
	assert(heap->count < heap->capacity);
	struct heap_entry *entry = heap->entry, new = {key, item, extra};
	size_t i = heap->count++;
	while (i) {
		size_t parent = (i - 1) / 4;
		if (!heap_less(&new, &entry[parent]))
			break;
		entry[i] = entry[parent];
		i = parent;
	}
	entry[i] = new;
}

static inline struct heap_entry heap_pop(struct heap *heap)
{
	assert(heap->count);
	struct heap_entry *entry = heap->entry, top = entry[0], last = entry[--heap->count];
	size_t count = heap->count, i = 0;
	for (;;) {
		size_t child = 4 * i + 1, least = child;
		if (child >= count)
			break;
		size_t end = child + 4 < count ? child + 4 : count;
		for (size_t c = child + 1; c < end; c++)
			if (heap_less(&entry[c], &entry[least]))
				least = c;
		if (!heap_less(&entry[least], &last))
			break;
		entry[i] = entry[least];
		i = least;
	}
	entry[i] = last;
	return top;
}

#endif
