/* Purpose: shortest-path heuristic, the slower and better kind.
 *
 * H. Takahashi & A. Matsuyama, An approximate solution for the Steiner problem in graphs (Math. Japonica 24, 1980): a
 * tree grows from one terminal; the terminal that is nearest to the tree is joined by a shortest path, until all are.
 * One Dijkstra serves for all paths: the vertices of a new path go back into the queue at distance 0, and only what
 * comes nearer to the tree is looked at again. */
#include "solver/steiner/primal/grow.h"

#include "solver/steiner/heap.h"

#include <assert.h>
#include <string.h>

struct growth {
	const struct instance *instance;
	struct heap heap;
	fine_t *distance; /* [vertex_count] to the tree */
	uint32_t *toward; /* [vertex_count] edge towards it */
	uint8_t *joined;  /* [vertex_count] in the tree */
	uint32_t *edges;
	uint32_t count;
};

static void join(struct growth *growth, uint32_t v)
{
	const struct instance *instance = growth->instance;
	while (!growth->joined[v]) {
		const uint32_t e = growth->toward[v];
		growth->joined[v] = 1;
		growth->distance[v] = 0;
		heap_push(&growth->heap, 0, v, 0);
		assert(growth->count < instance->vertex_count);
		growth->edges[growth->count++] = e;
		v ^= instance->ends[2 * e] ^ instance->ends[2 * e + 1];
	}
}

/* Joins the `apart` terminals outside of the tree. Returns how many could not be. */
static uint32_t grow(struct growth *growth, struct search *search, const fine_t *cost, const uint8_t *allowed,
		     uint32_t apart, uint64_t effort)
{
	const struct instance *instance = growth->instance;
	uint64_t work = 0;
	while (growth->heap.count && apart && work < effort) {
		const struct heap_entry top = heap_pop(&growth->heap);
		const uint32_t v = top.item, begin = instance->first[v], end = instance->first[v + 1];
		if (top.key != growth->distance[v])
			continue;
		if (instance->terminal_at[v] != INSTANCE_NONE && !growth->joined[v]) {
			apart--;
			join(growth, v);
			continue;
		}
		work += end - begin;
		/* A whole path may follow. */
		if (growth->heap.count + (end - begin) + instance->vertex_count > growth->heap.capacity)
			break;
		for (uint32_t a = begin; a < end; a++) {
			const uint32_t u = instance->head[a];
			const fine_t longer = top.key + cost[instance->edge[a]];
			if (longer >= growth->distance[u] || (allowed && !allowed[u]))
				continue;
			growth->distance[u] = longer;
			growth->toward[u] = instance->edge[a];
			heap_push(&growth->heap, longer, u, 0);
		}
	}
	search->work += work;
	return apart;
}

enum tw_status primal_grow_tree(struct search *search, const fine_t *cost, const uint8_t *allowed, uint32_t start,
				uint64_t effort, uint32_t *edges, uint32_t *edge_count)
{
	const struct instance *instance = &search->instance;
	struct arena *arena = search->arena;
	const struct arena_mark mark = arena_mark(arena);
	const size_t n = instance->vertex_count, capacity = 2 * (size_t)instance->edge_count + 3 * n;
	struct growth growth = {
		.instance = instance,
		.heap = {.entry = ARENA_ARRAY(arena, capacity, struct heap_entry), .capacity = capacity},
		.distance = ARENA_ARRAY(arena, n, fine_t),
		.toward = ARENA_ARRAY(arena, n, uint32_t),
		.joined = ARENA_ZEROED(arena, n, uint8_t),
		.edges = edges,
	};
	enum tw_status status = TW_ERROR_MEMORY;
	*edge_count = 0;
	if (growth.heap.entry && growth.distance && growth.toward && growth.joined) {
		memset(growth.distance, 0xff, n * sizeof *growth.distance);
		growth.distance[start] = 0;
		growth.joined[start] = 1;
		heap_push(&growth.heap, 0, start, 0);
		const uint32_t apart = instance->terminal_count - (instance->terminal_at[start] != INSTANCE_NONE);
		*edge_count = grow(&growth, search, cost, allowed, apart, effort) ? 0 : growth.count;
		status = TW_OK;
	}
	arena_release(arena, mark);
	return status;
}
