/* Purpose: which terminals lie near each other, and which in the middle.
 *
 * One Dijkstra from all terminals splits the graph into Voronoi regions; the region graph, whose edges are the shortest
 * ways across borders, tells distances between terminals well enough to choose by. */
#include "solver/steiner/dual/survey.h"

#include "solver/steiner/dual/coarse.h"
#include "solver/steiner/dual/queue.h"

#include <assert.h>
#include <string.h>

/* Of more terminals only the nearest are looked for, and none is in the middle: a Dijkstra over the region graph takes
 * time quadratic in them. NEAR_COUNT covers the largest group of improve.c. */
enum { MIDDLE_TERMINALS = 256, NEAR_COUNT = 24 };

/* Scratch, and the regions. */
struct regions {
	const struct instance *instance;
	unsigned coarse_shift;
	uint32_t *base;          /* [vertex_count] index of the nearest terminal */
	uint32_t *distance;      /* [vertex_count] to it */
	uint32_t *border;        /* [terminal_count * terminal_count] shortest ways between neighbouring regions */
	uint32_t *reach;         /* [terminal_count] from one terminal over borders */
	uint8_t *done;           /* [terminal_count] */
	struct dual_queue queue; /* room for 2 * edge_count + terminal_count */
};

static enum tw_status allocate(struct regions *regions, struct search *search, unsigned coarse_shift)
{
	struct arena *arena = search->arena;
	const struct instance *instance = &search->instance;
	const size_t n = instance->vertex_count, k = instance->terminal_count;
	*regions = (struct regions){
		.instance = instance,
		.coarse_shift = coarse_shift,
		.base = ARENA_ARRAY(arena, n, uint32_t),
		.distance = ARENA_ARRAY(arena, n, uint32_t),
		.border = ARENA_ARRAY(arena, k * k, uint32_t),
		.reach = ARENA_ARRAY(arena, k, uint32_t),
		.done = ARENA_ARRAY(arena, k, uint8_t),
	};
	if (!regions->base || !regions->distance || !regions->border || !regions->reach || !regions->done)
		return TW_ERROR_MEMORY;
	uint64_t sum = 0;
	for (uint32_t e = 0; e < instance->edge_count; e++)
		sum += coarse_of(instance->weight[e], coarse_shift);
	return queue_init(&regions->queue, arena, 2 * (size_t)instance->edge_count + k,
			  instance->edge_count ? sum / instance->edge_count : 0);
}

static void grow_regions(struct regions *regions)
{
	const struct instance *instance = regions->instance;
	uint32_t *base = regions->base, *distance = regions->distance;
	memset(base, 0xff, instance->vertex_count * sizeof *base);
	memset(distance, 0xff, instance->vertex_count * sizeof *distance);
	for (uint32_t t = 0; t < instance->terminal_count; t++) {
		distance[instance->terminal[t]] = 0;
		base[instance->terminal[t]] = t;
		queue_push(&regions->queue, instance->terminal[t]);
	}
	for (uint64_t key; queue_pop(&regions->queue, distance, &key);) {
		const uint32_t v = (uint32_t)key, d = (uint32_t)(key >> 32);
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t u = instance->head[a];
			const uint32_t longer =
				d + coarse_of(instance->weight[instance->edge[a]], regions->coarse_shift);
			if (longer >= distance[u] || longer >= DUAL_FAR)
				continue;
			distance[u] = longer;
			base[u] = base[v];
			queue_push(&regions->queue, (uint64_t)longer << 32 | u);
		}
	}
}

static void measure_borders(struct regions *regions)
{
	const struct instance *instance = regions->instance;
	const uint32_t *base = regions->base, *distance = regions->distance, k = instance->terminal_count;
	memset(regions->border, 0xff, (size_t)k * k * sizeof *regions->border);
	for (uint32_t e = 0; e < instance->edge_count; e++) {
		const uint32_t u = instance->ends[2 * e], v = instance->ends[2 * e + 1], a = base[u], b = base[v];
		if (a == b || a == INSTANCE_NONE || b == INSTANCE_NONE)
			continue;
		const uint32_t length =
			distance[u] + coarse_of(instance->weight[e], regions->coarse_shift) + distance[v];
		if (length < regions->border[(size_t)a * k + b])
			regions->border[(size_t)a * k + b] = regions->border[(size_t)b * k + a] = length;
	}
}

/* The terminal nearest to t of those that are not done; t when there is none. */
static uint32_t next_nearest(const struct regions *regions, uint32_t t)
{
	uint32_t best = t;
	for (uint32_t b = 0; b < regions->instance->terminal_count; b++)
		if (!regions->done[b] && (best == t || regions->reach[b] < regions->reach[best]))
			best = b;
	return best;
}

/* A Dijkstra over the region graph, given as a dense matrix for the few terminals at hand. */
static void find_near(struct regions *regions, struct dual_survey *survey, uint32_t t)
{
	const uint32_t k = regions->instance->terminal_count;
	uint32_t *reach = regions->reach, *near = survey->near + (size_t)t * survey->near_count, count = 0;
	uint64_t sum = 0, furthest = 0;
	memcpy(reach, regions->border + (size_t)t * k, k * sizeof *reach);
	memset(regions->done, 0, k);
	reach[t] = 0;
	regions->done[t] = 1;
	const uint32_t wanted = k <= MIDDLE_TERMINALS ? k - 1 : survey->near_count;
	for (uint32_t found = 0; found < wanted; found++) {
		const uint32_t best = next_nearest(regions, t);
		assert(best != t);
		regions->done[best] = 1;
		if (count < survey->near_count)
			near[count++] = best;
		if (reach[best] == UINT32_MAX)
			continue;
		sum += reach[best];
		furthest = reach[best];
		for (uint32_t b = 0; b < k; b++) {
			const uint32_t hop = regions->border[(size_t)best * k + b];
			if (hop != UINT32_MAX && reach[best] + hop < reach[b])
				reach[b] = reach[best] + hop;
		}
	}
	survey->middle[t] = k <= MIDDLE_TERMINALS ? sum / k + furthest : 0;
	survey->near_distance[t] = count ? reach[near[0]] : 0;
}

enum tw_status dual_survey_make(struct dual_survey *survey, struct search *search, unsigned coarse_shift)
{
	struct arena *arena = search->arena;
	const size_t k = search->instance.terminal_count;
	survey->near_count = (uint32_t)(k - 1 < NEAR_COUNT ? k - 1 : NEAR_COUNT);
	survey->near = ARENA_ARRAY(arena, k * survey->near_count, uint32_t);
	survey->near_distance = ARENA_ARRAY(arena, k, uint32_t);
	survey->middle = ARENA_ARRAY(arena, k, uint64_t);
	if (!survey->near || !survey->near_distance || !survey->middle)
		return TW_ERROR_MEMORY;
	const struct arena_mark mark = arena_mark(arena);
	struct regions regions;
	const enum tw_status status = allocate(&regions, search, coarse_shift);
	if (status == TW_OK) {
		grow_regions(&regions);
		measure_borders(&regions);
		for (uint32_t t = 0; t < k; t++)
			find_near(&regions, survey, t);
		search->work += 2 * (uint64_t)search->instance.edge_count;
	}
	arena_release(arena, mark);
	return status;
}
