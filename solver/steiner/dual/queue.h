/* Dijkstra's queue of the dual: a 4-ary min-heap of distance << 32 | vertex, with lazy deletion. */
#ifndef SOLVER_STEINER_DUAL_QUEUE_H
#define SOLVER_STEINER_DUAL_QUEUE_H

#include <stddef.h>
#include <stdint.h>

static inline void queue_push(uint64_t *queue, size_t *count, uint64_t key)
{
	size_t i = (*count)++;
	while (i) {
		size_t parent = (i - 1) >> 2;
		if (queue[parent] <= key)
			break;
		queue[i] = queue[parent];
		i = parent;
	}
	queue[i] = key;
}

static inline uint64_t queue_pop(uint64_t *queue, size_t *count)
{
	uint64_t top = queue[0], last = queue[--*count];
	size_t n = *count, i = 0;
	for (;;) {
		size_t child = 4 * i + 1;
		if (child >= n)
			break;
		size_t least = child, end = child + 4 < n ? child + 4 : n;
		for (size_t c = child + 1; c < end; c++)
			least = queue[c] < queue[least] ? c : least;
		if (queue[least] >= last)
			break;
		queue[i] = queue[least];
		i = least;
	}
	queue[i] = last;
	return top;
}

#endif
