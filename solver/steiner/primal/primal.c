/* Purpose: the primal side of the search: where trees come from, and how they get better.
 *
 * A tree comes from a shortest-path heuristic; exchanges (exchange.c) make it better. With a dual they
 * stay in its *corridor*, the vertices through which trees pass cheaply by reduced costs: few vertices, and the
 * better the dual, the surer that an optimum lies among them (pruning guided by duals goes back to T. Polzin & S.
 * Vahdati Daneshmand, Improved algorithms for the Steiner problem in networks, Discrete Appl. Math. 112, 2001).
 * Measured on meshes, exchanges from any start end in the same tree, the best of the corridor; so there is one start,
 * and the effort goes into wider corridors. Nothing is proven here: steiner_verify sees every tree. */
#include "solver/steiner/primal/primal.h"

#include "solver/steiner/primal/exchange.h"
#include "solver/steiner/primal/grow.h"
#include "solver/steiner/primal/path.h"

#include <stdlib.h>
#include <string.h>

enum { CORRIDOR_FIRST = 1500, REGION_LEAST = 6000, REGION_SHARE = 16 };
enum { FIRST_ROOTS = 2, FIRST_WORK = 1000000, GROW_SHARE = 20 };

/* Trees that grow from a few terminals, as long as that takes little: they are much lighter than the first. */
static enum tw_status offer_grown(struct search *search, uint32_t *edges)
{
	const uint32_t terminals = search->instance.terminal_count;
	const uint64_t work_end = search->work + FIRST_WORK;
	for (uint32_t i = 0; i < FIRST_ROOTS && search->work < work_end; i++) {
		const uint32_t start = search->instance.terminal[(uint64_t)i * terminals / FIRST_ROOTS];
		uint32_t count;
		enum tw_status status =
			primal_grow_tree(search, search->instance.weight, NULL, start,
					 GROW_SHARE * (uint64_t)search->instance.edge_count, edges, &count);
		if (status == TW_OK && count)
			status = search_offer(search, edges, count);
		if (status != TW_OK)
			return status == TW_ERROR_MEMORY ? TW_OK : status;
	}
	return TW_OK;
}

enum tw_status primal_first(struct search *search)
{
	const struct arena_mark mark = arena_mark(search->arena);
	const size_t room = (size_t)search->instance.vertex_count + search->instance.terminal_count;
	uint32_t *edges = ARENA_ARRAY(search->arena, room, uint32_t), count = 0;
	enum tw_status status =
		edges ? primal_path_connect(search, search->instance.weight, NULL, edges, &count) : TW_ERROR_MEMORY;
	if (status == TW_OK)
		status = search_offer(search, edges, count);
	if (status == TW_OK && search_uses(search, STEINER_PRIMAL) && search->instance.terminal_count > 2)
		status = offer_grown(search, edges);
	arena_release(search->arena, mark);
	return status;
}

/* What primal_improve works with, allocated once. */
struct improver {
	struct search *search;
	const struct dual *dual; /* may be NULL */
	struct primal_tree tree;
	struct primal_connect connect;
	struct primal_exchange exchange;
	fine_t *cost;      /* [edge_count] for the shortest-path heuristic */
	uint32_t *edges;   /* [vertex_count + terminal_count] a start */
	uint8_t *corridor; /* [vertex_count] */
	uint64_t *passage; /* [vertex_count] reduced cost of the cheapest way through the vertex */
	uint64_t *sorted;  /* [vertex_count] passages, ascending */
	uint64_t work_end;
};

static int compare_numbers(const void *a, const void *b)
{
	const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
	return (x > y) - (x < y);
}

static enum tw_status improver_init(struct improver *improver, struct search *search, const struct dual *dual)
{
	struct arena *arena = search->arena;
	const size_t n = search->instance.vertex_count, m = search->instance.edge_count;
	*improver = (struct improver){
		.search = search,
		.dual = dual,
		.cost = ARENA_ARRAY(arena, m, fine_t),
		.edges = ARENA_ARRAY(arena, n + search->instance.terminal_count, uint32_t),
		.corridor = ARENA_ARRAY(arena, n, uint8_t),
		.passage = ARENA_ARRAY(arena, n, uint64_t),
		.sorted = ARENA_ARRAY(arena, n, uint64_t),
	};
	if (!improver->cost || !improver->edges || !improver->corridor || !improver->passage || !improver->sorted)
		return TW_ERROR_MEMORY;
	enum tw_status status = primal_tree_init(&improver->tree, arena, &search->instance);
	if (status == TW_OK)
		status = primal_connect_init(&improver->connect, arena, search);
	if (status == TW_OK)
		status = primal_exchange_init(&improver->exchange, arena, &improver->tree, &improver->connect);
	return status;
}

/* The reduced cost of passing each vertex: a tree that does weighs at least as much more than the bound. */
static enum tw_status measure_passages(struct improver *improver)
{
	struct search *search = improver->search;
	const uint32_t n = search->instance.vertex_count;
	const struct arena_mark mark = arena_mark(search->arena);
	uint32_t *from_root = ARENA_ARRAY(search->arena, n, uint32_t);
	uint32_t *to_terminal = ARENA_ARRAY(search->arena, n, uint32_t);
	const enum tw_status status = from_root && to_terminal ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		dual_from_root(improver->dual, search, UINT32_MAX, from_root);
		dual_to_terminal(improver->dual, search, UINT32_MAX, to_terminal);
		for (uint32_t v = 0; v < n; v++)
			improver->passage[v] = improver->sorted[v] = (uint64_t)from_root[v] + to_terminal[v];
		qsort(improver->sorted, n, sizeof *improver->sorted, compare_numbers);
	}
	arena_release(search->arena, mark);
	return status;
}

/* About `wanted` vertices with the cheapest passages, but as many as connect the terminals. Returns how many. */
static uint32_t choose_corridor(struct improver *improver, uint32_t wanted)
{
	const struct instance *instance = &improver->search->instance;
	const uint32_t n = instance->vertex_count;
	uint64_t most = wanted < n ? improver->sorted[wanted] : UINT64_MAX;
	uint32_t count = 0;
	for (uint32_t t = 0; t < instance->terminal_count; t++)
		if (improver->passage[instance->terminal[t]] > most)
			most = improver->passage[instance->terminal[t]];
	for (uint32_t v = 0; v < n; v++)
		count += improver->corridor[v] = improver->passage[v] <= most;
	improver->connect.allowed = improver->corridor;
	return count;
}

/* The best tree's edges cost nothing: what of it is still in the instance becomes the start, and gaps are bridged. */
static enum tw_status cost_of_best(struct improver *improver)
{
	struct search *search = improver->search;
	const struct instance *instance = &search->instance;
	const struct arena_mark mark = arena_mark(search->arena);
	uint8_t *is_best = ARENA_ARRAY(search->arena, instance->edge_count, uint8_t);
	const enum tw_status status = is_best ? search_mark_best(search, is_best) : TW_ERROR_MEMORY;
	for (uint32_t e = 0; status == TW_OK && e < instance->edge_count; e++)
		improver->cost[e] = is_best[e] ? 0 : instance->weight[e];
	arena_release(search->arena, mark);
	return status;
}

/* The current tree becomes a new one, inside the corridor. */
static enum tw_status start_new(struct improver *improver)
{
	struct search *search = improver->search;
	const fine_t *weight = search->instance.weight;
	uint32_t count = 0;
	enum tw_status status = primal_grow_tree(
		search, weight, improver->connect.allowed, search->instance.terminal[improver->dual->root],
		GROW_SHARE * (uint64_t)search->instance.edge_count, improver->edges, &count);
	if (status == TW_OK && !count)
		status = primal_path_connect(search, weight, improver->connect.allowed, improver->edges, &count);
	if (status == TW_OK)
		primal_tree_set(&improver->tree, improver->edges, count, 1);
	return status;
}

/* The current tree becomes what is left of the best one. */
static enum tw_status start_from_best(struct improver *improver)
{
	uint32_t count = 0;
	enum tw_status status = cost_of_best(improver);
	if (status == TW_OK)
		status = primal_path_connect(improver->search, improver->cost, NULL, improver->edges, &count);
	if (status == TW_OK)
		primal_tree_set(&improver->tree, improver->edges, count, 1);
	return status;
}

static enum tw_status exchange(struct improver *improver, uint32_t pieces_least, uint32_t pieces_most)
{
	/* On a finer mesh the same part of a suit has more vertices. */
	const uint32_t share = improver->search->instance.vertex_count / REGION_SHARE;
	const uint32_t region_max = share > REGION_LEAST ? share : REGION_LEAST;
	for (uint32_t pieces = pieces_least; pieces <= pieces_most; pieces++)
		primal_exchange_all(&improver->exchange, pieces, region_max, improver->work_end);
	return search_offer(improver->search, improver->tree.edge, improver->tree.edge_count);
}

/* Wider and wider corridors, until all vertices are in that a better tree could use. The first tree is a new one even
 * if it is heavier than the best: exchanges do not lead back into the corridor from outside. */
static enum tw_status widen(struct improver *improver)
{
	struct search *search = improver->search;
	const uint32_t n = search->instance.vertex_count;
	enum tw_status status = measure_passages(improver);
	if (status != TW_OK)
		return status;
	uint32_t wanted = choose_corridor(improver, CORRIDOR_FIRST);
	status = start_new(improver);
	if (status == TW_OK)
		status = exchange(improver, 2, 4);
	if (status == TW_OK && improver->tree.weight > search_cutoff(search))
		status = start_from_best(improver);
	while (status == TW_OK && search->work < improver->work_end && !search->stop) {
		const fine_t gap = search_cutoff(search) - dual_fine_bound(improver->dual);
		if (wanted >= n || improver->sorted[wanted] > gap >> improver->dual->coarse_shift)
			break;
		wanted = choose_corridor(improver, 2 * wanted);
		status = exchange(improver, 3, 4);
	}
	return status;
}

enum tw_status primal_improve(struct search *search, const struct dual *dual, uint64_t effort)
{
	if (!search_uses(search, STEINER_PRIMAL) || search->instance.terminal_count < 3 || search_is_proven(search))
		return TW_OK;
	const struct arena_mark mark = arena_mark(search->arena);
	struct improver improver;
	enum tw_status status = improver_init(&improver, search, dual);
	improver.work_end = search->work + effort;
	if (status == TW_OK && dual) {
		status = widen(&improver);
	} else if (status == TW_OK) {
		status = start_from_best(&improver);
		if (status == TW_OK)
			status = exchange(&improver, 2, 3);
	}
	arena_release(search->arena, mark);
	/* Short of memory for a better tree, the search goes on with the one it has. */
	return status == TW_ERROR_MEMORY ? TW_OK : status;
}
