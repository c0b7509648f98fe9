/* Purpose: shortest-path heuristic.
 *
 * K. Mehlhorn, A faster approximation algorithm for the Steiner problem in graphs (IPL 27, 1988): one Dijkstra from all
 * terminals at once splits the graph into Voronoi regions; a minimum spanning tree of the region graph, whose edges are
 * the shortest paths across region borders, expands to a tree of at most 2 (1 - 1/k) times the optimum. */
#include "solver/steiner/primal/path.h"

#include "solver/steiner/heap.h"
#include "solver/steiner/union_find.h"

#include <stdlib.h>
#include <string.h>

struct voronoi {
	fine_t *distance; /* [vertex_count] to the nearest terminal */
	uint32_t *base;   /* [vertex_count] index of that terminal */
	uint32_t *arc;    /* [vertex_count] edge towards it, INSTANCE_NONE at the terminal */
};

struct border {
	fine_t length; /* of the path between the two terminals */
	uint32_t edge;
};

static int compare_borders(const void *a, const void *b)
{
	const struct border *x = a, *y = b;
	if (x->length != y->length)
		return x->length < y->length ? -1 : 1;
	return (x->edge > y->edge) - (x->edge < y->edge);
}

static void grow_regions(struct search *search, const fine_t *cost, const uint8_t *allowed,
			 const struct voronoi *voronoi, struct heap *heap)
{
	const struct instance *instance = &search->instance;
	memset(voronoi->distance, 0xff, instance->vertex_count * sizeof(fine_t));
	for (uint32_t t = 0; t < instance->terminal_count; t++) {
		uint32_t v = instance->terminal[t];
		voronoi->distance[v] = 0;
		voronoi->base[v] = t;
		voronoi->arc[v] = INSTANCE_NONE;
		heap_push(heap, 0, v, 0);
	}
	while (heap->count) {
		struct heap_entry top = heap_pop(heap);
		uint32_t v = top.item;
		if (top.key != voronoi->distance[v])
			continue;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			uint32_t u = instance->head[a], e = instance->edge[a];
			fine_t distance = top.key + cost[e];
			if (distance >= voronoi->distance[u] || (allowed && !allowed[u]))
				continue;
			voronoi->distance[u] = distance;
			voronoi->base[u] = voronoi->base[v];
			voronoi->arc[u] = e;
			heap_push(heap, distance, u, 0);
		}
		search->work += instance->first[v + 1] - instance->first[v];
	}
}

static uint32_t list_borders(const struct instance *instance, const fine_t *cost, const struct voronoi *voronoi,
			     struct border *borders)
{
	uint32_t count = 0;
	for (uint32_t e = 0; e < instance->edge_count; e++) {
		uint32_t u = instance->ends[2 * e], v = instance->ends[2 * e + 1];
		if (voronoi->distance[u] == FINE_MAX || voronoi->distance[v] == FINE_MAX ||
		    voronoi->base[u] == voronoi->base[v])
			continue;
		borders[count++] = (struct border){
			.length = voronoi->distance[u] + cost[e] + voronoi->distance[v],
			.edge = e,
		};
	}
	qsort(borders, count, sizeof *borders, compare_borders);
	return count;
}

/* Adds the path from v to the terminal of its region. */
static uint32_t add_path(const struct instance *instance, const struct voronoi *voronoi, uint32_t v, uint8_t *seen,
			 uint32_t *edges, uint32_t count)
{
	while (voronoi->arc[v] != INSTANCE_NONE && !seen[v]) {
		uint32_t e = voronoi->arc[v];
		seen[v] = 1;
		edges[count++] = e;
		v ^= instance->ends[2 * e] ^ instance->ends[2 * e + 1];
	}
	return count;
}

enum tw_status primal_path_connect(struct search *search, const fine_t *cost, const uint8_t *allowed, uint32_t *edges,
				   uint32_t *edge_count)
{
	const struct instance *instance = &search->instance;
	struct arena *arena = search->arena;
	const struct arena_mark mark = arena_mark(arena);
	const size_t n = instance->vertex_count, m = instance->edge_count, k = instance->terminal_count;
	const struct voronoi voronoi = {
		.distance = ARENA_ARRAY(arena, n, fine_t),
		.base = ARENA_ARRAY(arena, n, uint32_t),
		.arc = ARENA_ARRAY(arena, n, uint32_t),
	};
	struct heap heap = {.entry = ARENA_ARRAY(arena, 2 * m + k, struct heap_entry), .capacity = 2 * m + k};
	uint32_t *parent = ARENA_ARRAY(arena, k, uint32_t);
	uint8_t *seen = ARENA_ZEROED(arena, n, uint8_t);
	enum tw_status status = TW_ERROR_MEMORY;
	if (voronoi.distance && voronoi.base && voronoi.arc && heap.entry && parent && seen) {
		grow_regions(search, cost, allowed, &voronoi, &heap);
		struct border *borders = (struct border *)heap.entry; /* the heap is empty now, and larger */
		const uint32_t border_count = list_borders(instance, cost, &voronoi, borders);
		uint32_t count = 0;
		for (uint32_t t = 0; t < k; t++)
			parent[t] = t;
		for (uint32_t i = 0; i < border_count; i++) {
			const uint32_t u = instance->ends[2 * borders[i].edge];
			const uint32_t v = instance->ends[2 * borders[i].edge + 1];
			const uint32_t a = union_find(parent, voronoi.base[u]), b = union_find(parent, voronoi.base[v]);
			if (a == b)
				continue;
			parent[a] = b;
			edges[count++] = borders[i].edge;
			count = add_path(instance, &voronoi, u, seen, edges, count);
			count = add_path(instance, &voronoi, v, seen, edges, count);
		}
		*edge_count = count;
		status = TW_OK;
	}
	arena_release(arena, mark);
	return status;
}
