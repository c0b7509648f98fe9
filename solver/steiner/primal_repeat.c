/* Purpose: H. Takahashi & A. Matsuyama, An approximate solution for the Steiner problem in graphs (Math. Japonica 24,
 * 1980), from many starts (C. W. Duin & S. Voss, Steiner tree heuristics: a survey, Operations Research Proceedings
 * 1993).
 *
 * A tree begins with one vertex; the terminal nearest to the tree is joined by its path, and the path's vertices become
 * part of the tree, until none is left. One Dijkstra does it: a vertex that joins the tree gets distance 0 and is
 * looked at again. The start decides which paths are shared, and on dense graphs and with many ties that decides
 * nearly everything. Then the tree's vertices are spanned anew by the lightest edges among them. */
#include "solver/steiner/primal_repeat.h"

#include "solver/steiner/heap.h"
#include "solver/steiner/primal_tree.h"

#include <string.h>

struct repeat {
	struct search *search;
	const uint64_t *cost;
	uint64_t *distance; /* [vertex_count] from the tree */
	uint32_t *from;     /* [vertex_count] edge towards the tree */
	uint8_t *is_in;     /* [vertex_count] in the tree */
	uint32_t *edges;    /* [edge_count] */
	struct heap heap;
	struct primal_tree tree;
};

static enum tw_status repeat_init(struct repeat *repeat, struct search *search, const uint64_t *cost)
{
	struct arena *arena = search->arena;
	const size_t n = search->instance.vertex_count, m = search->instance.edge_count;
	*repeat = (struct repeat){
		.search = search,
		.cost = cost,
		.distance = ARENA_ARRAY(arena, n, uint64_t),
		.from = ARENA_ARRAY(arena, n, uint32_t),
		.is_in = ARENA_ARRAY(arena, n, uint8_t),
		.edges = ARENA_ARRAY(arena, m, uint32_t),
		.heap = {.entry = ARENA_ARRAY(arena, 4 * m + 4 * n, struct heap_entry), .capacity = 4 * m + 4 * n},
	};
	if (!repeat->distance || !repeat->from || !repeat->is_in || !repeat->edges || !repeat->heap.entry)
		return TW_ERROR_MEMORY;
	return primal_tree_init(&repeat->tree, arena, &search->instance);
}

static void reach(struct repeat *repeat, uint32_t v, uint64_t distance, uint32_t edge)
{
	repeat->distance[v] = distance;
	repeat->from[v] = edge;
	heap_push(&repeat->heap, distance, v, 0);
}

/* The path from v to the tree becomes part of it. */
static void join(struct repeat *repeat, uint32_t v)
{
	const struct instance *instance = &repeat->search->instance;
	while (!repeat->is_in[v]) {
		const uint32_t e = repeat->from[v];
		repeat->is_in[v] = 1;
		reach(repeat, v, 0, e);
		if (e == INSTANCE_NONE)
			return;
		v ^= instance->ends[2 * e] ^ instance->ends[2 * e + 1];
	}
}

/* Marks the vertices of a tree that begins at `start`. False when the heap runs out of room, which it hardly does: then
 * this tree is given up. */
static int grow(struct repeat *repeat, uint32_t start)
{
	const struct instance *instance = &repeat->search->instance;
	struct heap *heap = &repeat->heap;
	uint32_t missing = instance->terminal_count;
	uint64_t work = instance->edge_count / 8;
	memset(repeat->distance, 0xff, instance->vertex_count * sizeof *repeat->distance);
	memset(repeat->is_in, 0, instance->vertex_count);
	heap->count = 0;
	reach(repeat, start, 0, INSTANCE_NONE);
	if (instance->terminal_at[start] == INSTANCE_NONE)
		join(repeat, start);
	while (missing && heap->count) {
		const struct heap_entry top = heap_pop(heap);
		const uint32_t v = top.item, end = instance->first[v + 1];
		if (top.key != repeat->distance[v])
			continue;
		if (instance->terminal_at[v] != INSTANCE_NONE && !repeat->is_in[v]) {
			join(repeat, v);
			missing--;
			continue;
		}
		if (heap->count + (end - instance->first[v]) + instance->vertex_count > heap->capacity)
			return 0;
		for (uint32_t a = instance->first[v]; a < end; a++) {
			const uint64_t distance = top.key + repeat->cost[instance->edge[a]];
			if (distance < repeat->distance[instance->head[a]])
				reach(repeat, instance->head[a], distance, instance->edge[a]);
		}
		work += end - instance->first[v];
	}
	repeat->search->work += 2 * work;
	return !missing;
}

static enum tw_status offer(struct repeat *repeat)
{
	const struct instance *instance = &repeat->search->instance;
	uint32_t count = 0;
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		for (uint32_t a = instance->first[v]; repeat->is_in[v] && a < instance->first[v + 1]; a++)
			if (instance->head[a] > v && repeat->is_in[instance->head[a]])
				repeat->edges[count++] = instance->edge[a];
	primal_tree_set(&repeat->tree, repeat->edges, count, 1);
	repeat->search->work += 8 * (uint64_t)count;
	if (repeat->tree.weight >= search_cutoff(repeat->search))
		return TW_OK;
	return search_offer(repeat->search, repeat->tree.edge, repeat->tree.edge_count);
}

enum tw_status primal_repeat(struct search *search, const uint64_t *cost, uint32_t skip, uint64_t effort)
{
	const struct instance *instance = &search->instance;
	const struct arena_mark mark = arena_mark(search->arena);
	const uint64_t end = search->work + effort;
	struct repeat repeat;
	enum tw_status status = repeat_init(&repeat, search, cost);
	for (uint32_t i = 0; i < instance->vertex_count && status == TW_OK && (!i || search->work < end); i++) {
		const uint32_t at = (uint32_t)(((uint64_t)skip + i) % instance->vertex_count);
		const uint32_t start = at < instance->terminal_count
					       ? instance->terminal[at]
					       : (uint32_t)((uint64_t)at * 7919 % instance->vertex_count);
		if (grow(&repeat, start))
			status = offer(&repeat);
		if (status == TW_OK && !search_spend(search, 1))
			status = TW_ERROR_CANCELLED;
	}
	arena_release(search->arena, mark);
	return status;
}
