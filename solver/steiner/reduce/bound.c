/* Purpose: T. Polzin & S. Vahdati Daneshmand, Improved algorithms for the Steiner problem in networks (Discrete Appl.
 * Math. 112, 2001): bounds and reductions that feed each other.
 *
 * A dual ascent (cut/ascent.c) from a root proves a bound and leaves reduced costs. A tree that uses the arc u -> v
 * weighs at least the bound plus the reduced way from the root over the arc to a terminal, as in fix.c; an edge
 * goes when both its arcs cost too much. What an ascent reaches, and with it what can be deleted, depends much on the
 * root: so several roots take turns, and every one works on what the others left. The arcs without reduced cost hold
 * good trees ("ascend and prune"): the path heuristic, for which these are cheap, gives better trees, and these delete
 * more. After each pass come the general reductions, for which deletion has opened the way.
 *
 * All figures are whole units of the caller's, and a bound that is not below the best tree proves that there is no
 * better one. Strict: only what costs as much as the best tree goes, so the instance keeps every better tree. */
#include "solver/steiner/reduce/bound.h"

#include "solver/steiner/cut/ascent.h"
#include "solver/steiner/heap.h"
#include "solver/steiner/primal/primal.h"
#include "solver/steiner/primal/repeat.h"
#include "solver/steiner/reduce/reduce.h"

#include <string.h>

enum {
	EDGES_MAX = 60000,
	PASSES_MAX = 8,
	ROOTS = 6,
	GAIN_PERCENT = 3,
	SUPPORT_FACTOR = 16,
	TREE_SHARE = 20,
	DENSE_SHARE = 200,
	DENSE_LEAST = 300000,
	EXCHANGE_SHARE = 40,
	WORK_SHARE = 100,
	DENSE_WORK_SHARE = 400,
	LEAST_WORK = 5000000,
	LIMIT_PART = 8
};

#define FAR INT64_MAX

struct bounder {
	struct search *search;
	struct cut_problem problem;
	int64_t *reduced;     /* [arc_count] */
	int64_t *from_root;   /* [vertex_count] */
	int64_t *to_terminal; /* [vertex_count] */
	fine_t *path_cost;    /* [edge_count] */
	uint8_t *keep;        /* [edge_count] */
	struct heap heap;
};

static enum tw_status bounder_init(struct bounder *bounder, struct search *search)
{
	struct arena *arena = search->arena;
	const struct instance *instance = &search->instance;
	const size_t n = instance->vertex_count, m = instance->edge_count;
	*bounder = (struct bounder){
		.search = search,
		.problem = {.search = search,
			    .instance = instance,
			    .arc_count = (uint32_t)(2 * m),
			    .cost = ARENA_ARRAY(arena, 2 * m, int64_t),
			    .allowed = ARENA_ARRAY(arena, 2 * m, uint8_t),
			    .gone = ARENA_ZEROED(arena, 2 * m, uint8_t),
			    .target = ARENA_ARRAY(arena, n, uint32_t)},
		.reduced = ARENA_ARRAY(arena, 2 * m, int64_t),
		.from_root = ARENA_ARRAY(arena, n, int64_t),
		.to_terminal = ARENA_ARRAY(arena, n, int64_t),
		.path_cost = ARENA_ARRAY(arena, m, fine_t),
		.keep = ARENA_ARRAY(arena, m, uint8_t),
		.heap = {.entry = ARENA_ARRAY(arena, 2 * m + n, struct heap_entry), .capacity = 2 * m + n},
	};
	const struct cut_problem *problem = &bounder->problem;
	if (!problem->cost || !problem->allowed || !problem->gone || !problem->target || !bounder->reduced ||
	    !bounder->from_root || !bounder->to_terminal || !bounder->path_cost || !bounder->keep ||
	    !bounder->heap.entry)
		return TW_ERROR_MEMORY;
	for (size_t arc = 0; arc < 2 * m; arc++)
		problem->cost[arc] = (int64_t)(instance->weight[arc / 2] >> instance->shift);
	memset(bounder->keep, 1, m);
	return TW_OK;
}

static void set_root(struct bounder *bounder, uint32_t root)
{
	struct cut_problem *problem = &bounder->problem;
	const struct instance *instance = problem->instance;
	problem->root = instance->terminal[root];
	problem->target_count = 0;
	for (uint32_t t = 0; t < instance->terminal_count; t++)
		if (t != root)
			problem->target[problem->target_count++] = instance->terminal[t];
	problem->terminal_target_count = problem->target_count;
	for (uint32_t arc = 0; arc < problem->arc_count; arc++)
		problem->allowed[arc] = bounder->keep[arc / 2] && cut_head(problem, arc) != problem->root;
	memcpy(bounder->reduced, problem->cost, problem->arc_count * sizeof *problem->cost);
}

/* Reduced distances below `limit`, from the root, or (backward) to the nearest target. */
static void measure(struct bounder *bounder, int backward, int64_t limit, int64_t *distance)
{
	const struct cut_problem *problem = &bounder->problem;
	const struct instance *instance = problem->instance;
	struct heap *heap = &bounder->heap;
	heap->count = 0;
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		distance[v] = FAR;
	for (uint32_t i = 0; i < (backward ? problem->target_count : 1); i++) {
		const uint32_t v = backward ? problem->target[i] : problem->root;
		distance[v] = 0;
		heap_push(heap, 0, v, 0);
	}
	while (heap->count) {
		const struct heap_entry top = heap_pop(heap);
		const uint32_t v = top.item;
		if ((int64_t)top.key != distance[v])
			continue;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t u = instance->head[a], arc = cut_arc_out(problem, v, a) ^ (uint32_t)backward;
			if (!problem->allowed[arc] || bounder->reduced[arc] >= limit - distance[v])
				continue;
			const int64_t longer = distance[v] + bounder->reduced[arc];
			if (longer >= distance[u])
				continue;
			distance[u] = longer;
			heap_push(heap, (fine_t)longer, u, 0);
		}
	}
	bounder->search->work += 2 * (uint64_t)instance->edge_count;
}

/* Whether a tree that uses the arc may exceed the bound by less than `room`. */
static int is_affordable(const struct bounder *bounder, uint32_t arc, int64_t room)
{
	const int64_t before = bounder->from_root[cut_tail(&bounder->problem, arc)];
	const int64_t after = bounder->to_terminal[cut_head(&bounder->problem, arc)];
	return bounder->problem.allowed[arc] && before < room && after < room - before &&
	       bounder->reduced[arc] < room - before - after;
}

/* The least weight of the instance's trees, in the caller's units, that is of no use any more. */
static int64_t useless_from(const struct search *search)
{
	const struct instance *instance = &search->instance;
	const fine_t whole = search_cutoff(search) + instance->base;
	const fine_t units = (whole >> instance->shift) + ((whole & (((fine_t)1 << instance->shift) - 1)) != 0);
	const fine_t base = instance->base >> instance->shift;
	return units > base ? (int64_t)(units - base) : 0;
}

/* A tree along arcs that cost nothing any more. */
static enum tw_status find_tree(struct bounder *bounder)
{
	const struct instance *instance = bounder->problem.instance;
	for (uint32_t e = 0; e < instance->edge_count; e++) {
		const int is_free = !bounder->reduced[2 * e] || !bounder->reduced[2 * e + 1];
		bounder->path_cost[e] = bounder->keep[e] ? instance->weight[e] : FINE_MAX >> 24;
		bounder->path_cost[e] *= is_free ? 1 : SUPPORT_FACTOR;
	}
	return primal_repeat(bounder->search, bounder->path_cost, 0, TREE_SHARE * (uint64_t)instance->edge_count);
}

static void report_bound(struct search *search, int64_t bound)
{
	const struct instance *instance = &search->instance;
	const fine_t fine = ((fine_t)bound + (instance->base >> instance->shift)) << instance->shift;
	search_bound(search, fine > instance->base ? fine - instance->base : 0);
}

static enum tw_status ascend_from(struct bounder *bounder, uint32_t root, int *empty)
{
	struct search *search = bounder->search;
	const struct instance *instance = &search->instance;
	int64_t bound = 0;
	set_root(bounder, root);
	enum tw_status status = cut_ascend(&bounder->problem, bounder->reduced, NULL, &bound);
	/* Also what an interrupted ascent has proven. */
	if (bound < useless_from(search))
		report_bound(search, bound);
	if (status == TW_OK && bound < useless_from(search))
		status = find_tree(bounder);
	if (status != TW_OK)
		return status;
	const int64_t room = useless_from(search) - bound;
	*empty = bound == INT64_MAX || room <= 0;
	if (*empty)
		return TW_OK;
	measure(bounder, 0, room, bounder->from_root);
	measure(bounder, 1, room, bounder->to_terminal);
	for (uint32_t e = 0; e < instance->edge_count; e++)
		bounder->keep[e] &= is_affordable(bounder, 2 * e, room) || is_affordable(bounder, 2 * e + 1, room);
	return TW_OK;
}

/* Of what the deletion can do the tree decides as much as the bound. In dense graphs the first tree is a third too
 * heavy (SteinLib's i640-141: 7,090 of 5,199), and one of the first pass is within 3 per cent. */
static enum tw_status find_first_trees(struct search *search, uint32_t pass)
{
	const struct instance *instance = &search->instance;
	const bool is_worth_more = !pass && primal_repeat_is_dense(instance);
	const uint64_t effort = is_worth_more ? DENSE_LEAST + DENSE_SHARE * (uint64_t)instance->edge_count
					      : TREE_SHARE * (uint64_t)instance->edge_count;
	return primal_repeat(search, instance->weight, pass, effort);
}

/* One pass over some roots, then the deletion. */
static enum tw_status run_pass(struct search *search, uint32_t pass, int *empty)
{
	const struct arena_mark mark = arena_mark(search->arena);
	const uint32_t terminals = search->instance.terminal_count;
	struct bounder bounder;
	enum tw_status status = bounder_init(&bounder, search);
	if (status == TW_OK)
		status = find_first_trees(search, pass);
	for (uint32_t i = 0; i < ROOTS && i < terminals && status == TW_OK && !*empty; i++)
		status = ascend_from(&bounder, (uint32_t)(((uint64_t)i * terminals / ROOTS + pass) % terminals), empty);
	if (status == TW_OK && !*empty)
		status = primal_improve(search, NULL, EXCHANGE_SHARE * (uint64_t)search->instance.edge_count);
	if (status == TW_OK && !*empty)
		status = instance_keep(&search->instance, search->arena, bounder.keep, NULL);
	arena_release(search->arena, mark);
	return status;
}

static enum tw_status run_passes(struct search *search, int *empty)
{
	enum tw_status status = TW_OK;
	for (uint32_t pass = 0; pass < PASSES_MAX && search->instance.terminal_count > 1; pass++) {
		const uint64_t before = search->instance.edge_count;
		status = run_pass(search, pass, empty);
		if (status == TW_OK && !*empty)
			status = reduce_instance(search);
		if (status != TW_OK || *empty || (before - search->instance.edge_count) * 100 < GAIN_PERCENT * before)
			break;
	}
	return status;
}

enum tw_status reduce_by_bounds(struct search *search, int *empty)
{
	*empty = 0;
	const struct instance *instance = &search->instance;
	const bool is_dense = primal_repeat_is_dense(instance);
	if (!search_uses(search, STEINER_FIXING) || search_cutoff(search) == FINE_MAX ||
	    (search->graph->edge_count > EDGES_MAX && !is_dense))
		return TW_OK;
	/* Ascents by cuts are slow where ways are long, and there those by balls do as well. */
	const uint64_t budget_end = search->budget_end;
	uint64_t budget = LEAST_WORK + (is_dense ? DENSE_WORK_SHARE : WORK_SHARE) * (uint64_t)instance->edge_count;
	/* A short search must come to its first bound. */
	const uint64_t limit = search->options->work_limit;
	if (limit && budget > limit / LIMIT_PART)
		budget = limit / LIMIT_PART + 1;
	search_set_budget(search, budget);
	const enum tw_status status = run_passes(search, empty);
	search->budget_end = budget_end;
	search->next_poll = search->stop ? 0 : search->work;
	return status == TW_ERROR_CANCELLED && !search->stop ? TW_OK : status;
}
