/* Purpose: which terminals lie near each other, and which in the middle.
 *
 * One Dijkstra from all terminals splits the graph into Voronoi regions; the region graph, whose edges are the shortest
 * ways across borders, tells distances between terminals well enough to choose by. */
#include "solver/steiner/dual/dual.h"
#include "solver/steiner/dual/queue.h"

#include <string.h>

enum { MIDDLE_TERMINALS = 256 };

/* Distances between neighbouring Voronoi regions, and from them the nearest terminals of each: a Dijkstra over the
 * small region graph, given as a dense matrix for the few terminals at hand. */
static void find_near(struct dual *dual, const uint32_t *base, const uint32_t *distance, uint32_t *border)
{
	const struct instance *instance = dual->instance;
	uint32_t k = instance->terminal_count;
	memset(border, 0xff, (size_t)k * k * sizeof *border);
	for (uint32_t e = 0; e < instance->edge_count; e++) {
		uint32_t u = instance->ends[2 * e], v = instance->ends[2 * e + 1], a = base[u], b = base[v];
		if (a == b || a == INSTANCE_NONE || b == INSTANCE_NONE)
			continue;
		uint32_t length = distance[u] + dual_coarse(dual, instance->weight[e]) + distance[v];
		if (length < border[(size_t)a * k + b])
			border[(size_t)a * k + b] = border[(size_t)b * k + a] = length;
	}
	for (uint32_t t = 0; t < k; t++) {
		uint32_t *reach = dual->distance, *near = dual->near + (size_t)t * dual->near_count, count = 0;
		for (uint32_t b = 0; b < k; b++)
			reach[b] = border[(size_t)t * k + b];
		reach[t] = 0;
		uint8_t *done = (uint8_t *)dual->stack;
		memset(done, 0, k);
		done[t] = 1;
		uint64_t sum = 0, furthest = 0;
		/* All distances for a few terminals, only the nearest for many. */
		uint32_t wanted = k <= MIDDLE_TERMINALS ? k - 1 : dual->near_count;
		for (uint32_t found = 0; found < wanted; found++) {
			uint32_t best = t;
			for (uint32_t b = 0; b < k; b++)
				if (!done[b] && (best == t || reach[b] < reach[best]))
					best = b;
			done[best] = 1;
			if (count < dual->near_count)
				near[count++] = best;
			if (reach[best] == UINT32_MAX)
				continue;
			sum += reach[best];
			furthest = reach[best];
			for (uint32_t b = 0; b < k; b++) {
				uint32_t hop = border[(size_t)best * k + b];
				if (hop != UINT32_MAX && reach[best] + hop < reach[b])
					reach[b] = reach[best] + hop;
			}
		}
		dual->middle[t] = k <= MIDDLE_TERMINALS ? sum / k + furthest : 0;
		dual->near_distance[t] = count ? reach[near[0]] : 0;
	}
	memset(dual->distance, 0xff, k * sizeof *dual->distance);
}

enum tw_status dual_survey(struct dual *dual, struct search *search)
{
	const struct instance *instance = dual->instance;
	size_t n = instance->vertex_count, k = instance->terminal_count;
	struct arena_mark mark = arena_mark(search->arena);
	uint32_t *base = ARENA_ARRAY(search->arena, n, uint32_t);
	uint32_t *border = ARENA_ARRAY(search->arena, k * k, uint32_t);
	if (!base || !border)
		return TW_ERROR_MEMORY;
	uint32_t *distance = dual->distance;
	size_t count = 0;
	memset(base, 0xff, n * sizeof *base);
	for (uint32_t t = 0; t < k; t++) {
		distance[instance->terminal[t]] = 0;
		base[instance->terminal[t]] = t;
		queue_push(dual->queue, &count, instance->terminal[t]);
	}
	while (count) {
		uint64_t key = queue_pop(dual->queue, &count);
		uint32_t v = (uint32_t)key, d = (uint32_t)(key >> 32);
		if (d != distance[v])
			continue;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			uint32_t u = dual->arc[a].tail, longer = d + dual->arc[a].cost;
			if (longer >= distance[u] || longer >= DUAL_FAR)
				continue;
			distance[u] = longer;
			base[u] = base[v];
			queue_push(dual->queue, &count, (uint64_t)longer << 32 | u);
		}
	}
	uint32_t *kept = ARENA_ARRAY(search->arena, n, uint32_t);
	if (kept) {
		memcpy(kept, distance, n * sizeof *kept);
		memset(distance, 0xff, n * sizeof *distance);
		find_near(dual, base, kept, border);
	}
	search->work += 2 * instance->edge_count;
	arena_release(search->arena, mark);
	return kept ? TW_OK : TW_ERROR_MEMORY;
}
