/* Purpose: trees that grow from many starts (C. W. Duin & S. Voss, Steiner tree heuristics: a survey, Operations
 * Research Proceedings 1993). The start decides which paths are shared, and on dense graphs and with many ties that
 * decides nearly everything. The vertices of each tree are spanned anew by the lightest edges among them. */
#include "solver/steiner/primal/repeat.h"

#include "solver/steiner/primal/grow.h"
#include "solver/steiner/primal/span.h"
#include "solver/steiner/primal/tree.h"

#include <string.h>

enum { DENSE_VERTICES_MAX = 5000, DENSE_EDGES_OF_VERTEX = 4 };

struct repeat {
	struct search *search;
	uint8_t *is_in;  /* [vertex_count] in the tree */
	uint32_t *edges; /* [edge_count + vertex_count] */
	struct primal_tree tree;
	uint64_t end; /* of the work for starts */

	/* Where the graph is dense: exchanges of vertices, and the lightest tree of all starts. */
	bool is_dense;
	struct primal_span span;
	uint32_t *best; /* [best_count] */
	uint32_t best_count;
	fine_t best_weight;
};

/* Exchanges of vertices cost little and gain much where a vertex sees most of the tree; in meshes, where whole paths
 * have to be exchanged, they cost much and gain nothing. */
bool primal_repeat_is_dense(const struct instance *instance)
{
	return instance->vertex_count <= DENSE_VERTICES_MAX &&
	       instance->edge_count >= DENSE_EDGES_OF_VERTEX * (uint64_t)instance->vertex_count;
}

static enum tw_status repeat_init(struct repeat *repeat, struct search *search)
{
	const struct instance *instance = &search->instance;
	struct arena *arena = search->arena;
	const size_t n = instance->vertex_count;
	*repeat = (struct repeat){
		.search = search,
		.is_in = ARENA_ARRAY(arena, n, uint8_t),
		.edges = ARENA_ARRAY(arena, instance->edge_count + n, uint32_t),
		.is_dense = primal_repeat_is_dense(instance),
		.best_weight = FINE_MAX,
	};
	if (!repeat->is_in || !repeat->edges)
		return TW_ERROR_MEMORY;
	enum tw_status status = primal_tree_init(&repeat->tree, arena, instance);
	if (status != TW_OK || !repeat->is_dense)
		return status;
	repeat->best = ARENA_ARRAY(arena, n, uint32_t);
	return repeat->best ? primal_span_init(&repeat->span, arena, search) : TW_ERROR_MEMORY;
}

static enum tw_status offer_tree(struct repeat *repeat, const uint32_t *edges, uint32_t edge_count, fine_t weight)
{
	if (weight >= search_cutoff(repeat->search))
		return TW_OK;
	return search_offer(repeat->search, edges, edge_count);
}

/* Exchanges vertices of the tree. */
static enum tw_status polish(struct repeat *repeat)
{
	struct primal_span *span = &repeat->span;
	primal_span_set(span, repeat->tree.edge, repeat->tree.edge_count);
	primal_span_improve(span, repeat->end);
	if (span->weight < repeat->best_weight) {
		memcpy(repeat->best, span->tree, span->tree_count * sizeof *span->tree);
		repeat->best_count = span->tree_count;
		repeat->best_weight = span->weight;
	}
	return offer_tree(repeat, span->tree, span->tree_count, span->weight);
}

static enum tw_status wander(struct repeat *repeat, uint64_t random, uint64_t end)
{
	struct primal_span *span = &repeat->span;
	span->random = random;
	primal_span_set(span, repeat->best, repeat->best_count);
	primal_span_wander(span, end);
	return offer_tree(repeat, span->tree, span->tree_count, span->weight);
}

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
	return repeat->is_dense ? polish(repeat)
				: offer_tree(repeat, repeat->tree.edge, repeat->tree.edge_count, repeat->tree.weight);
}

enum tw_status primal_repeat(struct search *search, const fine_t *cost, uint32_t skip, uint64_t effort)
{
	const struct instance *instance = &search->instance;
	const struct arena_mark mark = arena_mark(search->arena);
	const uint32_t n = instance->vertex_count;
	const uint64_t end = search->work + effort;
	struct repeat repeat;
	enum tw_status status = repeat_init(&repeat, search);
	repeat.end = repeat.is_dense ? end - effort / 2 : end;
	for (uint32_t i = 0; i < n && status == TW_OK && (!i || search->work < repeat.end); i++) {
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
	if (status == TW_OK && repeat.best_count)
		status = wander(&repeat, skip, end);
	arena_release(search->arena, mark);
	return status;
}
