/* Dijkstra's queue of the dual: entries are distance << 32 | vertex, with lazy deletion.
 *
 * A hot queue (B. V. Cherkassky, A. V. Goldberg & C. Silverstein, Buckets, heaps, lists, and monotone priority queues,
 * SIAM J. Comput. 28, 1999): what is due soon lies in a small 4-ary heap, what is due later unsorted in buckets of
 * equal width, and what no bucket reaches in a list. Most entries of a mesh are out of date before their bucket is
 * opened, and never see the heap. Entries come out in ascending order, whatever the width. */
#ifndef SOLVER_STEINER_DUAL_QUEUE_H
#define SOLVER_STEINER_DUAL_QUEUE_H

#include "solver/arena.h"
#include "tightwire.h"

#include <assert.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { QUEUE_BUCKETS = 1024, QUEUE_WORDS = QUEUE_BUCKETS / 64 };

/* An empty queue has no entries and all bits clear. */
struct dual_queue {
	uint64_t *heap;  /* [heap_count] entries of the open bucket and of those before */
	uint64_t *entry; /* [entry_count] what was pushed beyond the open bucket since the queue was empty */
	uint32_t *next;  /* [entry_count] list of each bucket; UINT32_MAX ends it */
	size_t heap_count;
	uint32_t entry_count;
	uint32_t capacity;             /* of all three */
	unsigned shift;                /* a bucket is 1 << shift wide */
	uint32_t base;                 /* distance >> shift of bucket 0 */
	uint32_t open;                 /* the bucket whose entries are in the heap */
	uint32_t far;                  /* list of what lies beyond the buckets */
	uint32_t first[QUEUE_BUCKETS]; /* lists, valid where the bit is set */
	uint64_t used[QUEUE_WORDS];
};

/* An empty queue for up to `capacity` pushes at a time on edges of this mean cost. TW_ERROR_MEMORY. */
enum tw_status queue_init(struct dual_queue *queue, struct arena *arena, size_t capacity,
			  uint64_t mean_cost) TW_NODISCARD;

/* Opens the next bucket; false when nothing is left. For queue_pop only. */
bool queue_open_next(struct dual_queue *queue, const uint32_t *distance);

/* Empties the queue; distance[v] becomes UINT32_MAX for all that was in it. */
void queue_wipe(struct dual_queue *queue, uint32_t *distance);

static inline bool queue_is_true(uint64_t key, const uint32_t *distance)
{
	return distance[(uint32_t)key] == (uint32_t)(key >> 32);
}

static inline void queue_push_heap(struct dual_queue *queue, uint64_t key)
{
	uint64_t *const heap = queue->heap;
	size_t i = queue->heap_count++;
	assert(i < queue->capacity);
	while (i) {
		const size_t parent = (i - 1) >> 2;
		if (heap[parent] <= key)
			break;
		heap[i] = heap[parent];
		i = parent;
	}
	heap[i] = key;
}

/* Puts entry i into the list of a bucket behind the open one, or of what lies beyond. */
static inline void queue_file(struct dual_queue *queue, uint32_t i, uint32_t bucket)
{
	if (bucket >= QUEUE_BUCKETS) {
		queue->next[i] = queue->far;
		queue->far = i;
		return;
	}
	const uint64_t bit = (uint64_t)1 << (bucket % 64);
	queue->next[i] = queue->used[bucket / 64] & bit ? queue->first[bucket] : UINT32_MAX;
	queue->first[bucket] = i;
	queue->used[bucket / 64] |= bit;
}

static inline void queue_push(struct dual_queue *queue, uint64_t key)
{
	const uint32_t number = (uint32_t)(key >> 32) >> queue->shift;
	if (number <= queue->base + queue->open) {
		queue_push_heap(queue, key);
		return;
	}
	const uint32_t i = queue->entry_count++;
	assert(i < queue->capacity);
	queue->entry[i] = key;
	queue_file(queue, i, number - queue->base);
}

static inline uint64_t queue_pop_heap(struct dual_queue *queue)
{
	uint64_t *const heap = queue->heap;
	const size_t n = --queue->heap_count;
	const uint64_t top = heap[0], last = heap[n];
	size_t i = 0;
	for (;;) {
		const size_t child = 4 * i + 1;
		if (child >= n)
			break;
		size_t least = child;
		const size_t end = child + 4 < n ? child + 4 : n;
		for (size_t c = child + 1; c < end; c++)
			least = heap[c] < heap[least] ? c : least;
		if (heap[least] >= last)
			break;
		heap[i] = heap[least];
		i = least;
	}
	heap[i] = last;
	return top;
}

/* Takes the least entry out that is still true: whose vertex has that distance. False: there is none left, and the
 * queue is empty. */
static inline bool queue_pop(struct dual_queue *queue, const uint32_t *distance, uint64_t *key)
{
	do {
		while (queue->heap_count) {
			*key = queue_pop_heap(queue);
			if (queue_is_true(*key, distance))
				return true;
		}
	} while (queue_open_next(queue, distance));
	return false;
}

#endif
