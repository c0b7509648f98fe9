/* Purpose: trees that grow from many starts (C. W. Duin & S. Voss, Steiner tree heuristics: a survey, Operations
 * Research Proceedings 1993). The start decides which paths are shared, and on dense graphs and with many ties that
 * decides nearly everything. The vertices of each tree are spanned anew by the lightest edges among them. */
#include "solver/steiner/primal/repeat.h"

#include "solver/steiner/primal/grow.h"
#include "solver/steiner/primal/tree.h"

#include <string.h>

struct repeat {
	struct search *search;
	uint8_t *is_in;  /* [vertex_count] in the tree */
	uint32_t *edges; /* [edge_count + vertex_count] */
	struct primal_tree tree;
};

/* The lightest edges among the vertices of the tree in `edges`. */
static enum tw_status offer(struct repeat *repeat, uint32_t start, uint32_t edge_count)
{
	const struct instance *instance = &repeat->search->instance;
	uint32_t count = 0;
	memset(repeat->is_in, 0, instance->vertex_count);
	repeat->is_in[start] = 1;
	for (uint32_t i = 0; i < 2 * edge_count; i++)
		repeat->is_in[instance->ends[2 * repeat->edges[i / 2] + i % 2]] = 1;
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		for (uint32_t a = instance->first[v]; repeat->is_in[v] && a < instance->first[v + 1]; a++)
			if (instance->head[a] > v && repeat->is_in[instance->head[a]])
				repeat->edges[count++] = instance->edge[a];
	primal_tree_set(&repeat->tree, repeat->edges, count, 1);
	repeat->search->work += 8 * (uint64_t)count + instance->vertex_count / 8;
	if (repeat->tree.weight >= search_cutoff(repeat->search))
		return TW_OK;
	return search_offer(repeat->search, repeat->tree.edge, repeat->tree.edge_count);
}

enum tw_status primal_repeat(struct search *search, const fine_t *cost, uint32_t skip, uint64_t effort)
{
	const struct instance *instance = &search->instance;
	const struct arena_mark mark = arena_mark(search->arena);
	const size_t n = instance->vertex_count;
	const uint64_t end = search->work + effort;
	struct repeat repeat = {
		.search = search,
		.is_in = ARENA_ARRAY(search->arena, n, uint8_t),
		.edges = ARENA_ARRAY(search->arena, instance->edge_count + n, uint32_t),
	};
	enum tw_status status = repeat.is_in && repeat.edges ? primal_tree_init(&repeat.tree, search->arena, instance)
							     : TW_ERROR_MEMORY;
	for (uint32_t i = 0; i < n && status == TW_OK && (!i || search->work < end); i++) {
		const uint32_t at = (uint32_t)(((uint64_t)skip + i) % n);
		const uint32_t start =
			at < instance->terminal_count ? instance->terminal[at] : (uint32_t)((uint64_t)at * 7919 % n);
		uint32_t count;
		status = primal_grow_tree(search, cost, NULL, start, UINT64_MAX, repeat.edges, &count);
		if (status == TW_OK && count)
			status = offer(&repeat, start, count);
		if (status == TW_OK && !search_spend(search, instance->edge_count / 8 + 1))
			status = TW_ERROR_CANCELLED;
	}
	arena_release(search->arena, mark);
	return status;
}
