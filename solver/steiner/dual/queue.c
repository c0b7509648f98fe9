/* Purpose: the rare steps of the dual's queue: opening a bucket, moving the buckets on. */
#include "solver/steiner/dual/queue.h"

#include <assert.h>
#include <string.h>

/* Buckets for an edge of mean cost: with 16, 64 and 256 splits of suits and s23k grew their balls in 24, 22, 20 ms. */
enum { BUCKETS_FOR_AN_EDGE = 256 };

static void start_anew(struct dual_queue *queue)
{
	queue->heap_count = 0;
	queue->entry_count = 0;
	queue->base = 0;
	queue->open = 0;
	queue->far = UINT32_MAX;
}

enum tw_status queue_init(struct dual_queue *queue, struct arena *arena, size_t capacity, uint64_t mean_cost)
{
	assert(capacity < UINT32_MAX);
	*queue = (struct dual_queue){
		.heap = ARENA_ARRAY(arena, capacity, uint64_t),
		.entry = ARENA_ARRAY(arena, capacity, uint64_t),
		.next = ARENA_ARRAY(arena, capacity, uint32_t),
		.capacity = (uint32_t)capacity,
	};
	while (mean_cost >> queue->shift > BUCKETS_FOR_AN_EDGE && queue->shift < 31)
		queue->shift++;
	start_anew(queue);
	return queue->heap && queue->entry && queue->next ? TW_OK : TW_ERROR_MEMORY;
}

/* The first bucket with entries; QUEUE_BUCKETS when all are empty. */
static uint32_t first_used(const struct dual_queue *queue)
{
	for (uint32_t word = queue->open / 64; word < QUEUE_WORDS; word++)
		if (queue->used[word])
			return 64 * word + (uint32_t)__builtin_ctzll(queue->used[word]);
	return QUEUE_BUCKETS;
}

static void clear_bit(struct dual_queue *queue, uint32_t bucket)
{
	queue->used[bucket / 64] &= ~((uint64_t)1 << (bucket % 64));
}

/* The buckets move on to where the nearest of the far entries lies. */
static void move_on(struct dual_queue *queue, const uint32_t *distance)
{
	uint32_t list = queue->far, least = UINT32_MAX;
	for (uint32_t i = list; i != UINT32_MAX; i = queue->next[i])
		if (queue_is_true(queue->entry[i], distance)) {
			const uint32_t number = (uint32_t)(queue->entry[i] >> 32) >> queue->shift;
			least = number < least ? number : least;
		}
	queue->base = least == UINT32_MAX ? queue->base : least;
	queue->open = 0;
	queue->far = UINT32_MAX;
	while (list != UINT32_MAX) {
		const uint32_t i = list, bucket = ((uint32_t)(queue->entry[i] >> 32) >> queue->shift) - queue->base;
		list = queue->next[i];
		if (!queue_is_true(queue->entry[i], distance))
			continue;
		if (!bucket)
			queue_push_heap(queue, queue->entry[i]);
		else
			queue_file(queue, i, bucket);
	}
}

bool queue_open_next(struct dual_queue *queue, const uint32_t *distance)
{
	const uint32_t bucket = first_used(queue);
	if (bucket < QUEUE_BUCKETS) {
		queue->open = bucket;
		clear_bit(queue, bucket);
		for (uint32_t i = queue->first[bucket]; i != UINT32_MAX; i = queue->next[i])
			if (queue_is_true(queue->entry[i], distance))
				queue_push_heap(queue, queue->entry[i]);
		return true;
	}
	if (queue->far != UINT32_MAX) {
		move_on(queue, distance);
		return true;
	}
	start_anew(queue);
	return false;
}

static void forget(const struct dual_queue *queue, uint32_t list, uint32_t *distance)
{
	for (uint32_t i = list; i != UINT32_MAX; i = queue->next[i])
		distance[(uint32_t)queue->entry[i]] = UINT32_MAX;
}

void queue_wipe(struct dual_queue *queue, uint32_t *distance)
{
	for (size_t i = 0; i < queue->heap_count; i++)
		distance[(uint32_t)queue->heap[i]] = UINT32_MAX;
	for (uint32_t bucket = first_used(queue); bucket < QUEUE_BUCKETS; bucket = first_used(queue)) {
		forget(queue, queue->first[bucket], distance);
		clear_bit(queue, bucket);
	}
	forget(queue, queue->far, distance);
	start_anew(queue);
}
