/* Purpose: R. T. Wong, A dual ascent approach for Steiner tree problems on a directed graph (Math. Program. 28, 1984).
 *
 * The set of vertices from which a target is reached by arcs of cost 0, as long as the root is not in it, is entered by
 * every arborescence: the cheapest arc into it is added to the bound and taken off all of them. The target with the
 * smallest set comes first. Every step makes an arc free, so there are no more steps than arcs. */
#include "solver/steiner/cut/ascent.h"

#include "solver/steiner/stamp.h"

#include <string.h>

struct ascent {
	const struct cut_problem *problem;
	int64_t *cost;
	uint32_t *set;    /* [vertex_count] the current set */
	uint32_t *inside; /* [vertex_count] == mark: in the set */
	uint32_t mark;
	uint32_t *size; /* [target_count] of the target's last set; 0: the root was in it */
};

/* Collects the target's set. Returns its size, 0 when it holds the root. */
static uint32_t collect(struct ascent *ascent, uint32_t target)
{
	const struct cut_problem *problem = ascent->problem;
	const struct instance *instance = problem->instance;
	uint32_t count = 0;
	uint64_t work = 0;
	ascent->mark = stamp_next(ascent->mark, ascent->inside, instance->vertex_count);
	ascent->inside[target] = ascent->mark;
	ascent->set[count++] = target;
	for (uint32_t i = 0; i < count; i++) {
		const uint32_t v = ascent->set[i];
		work += instance->first[v + 1] - instance->first[v];
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t u = instance->head[a], arc = cut_arc_out(problem, v, a) ^ 1;
			if (ascent->inside[u] == ascent->mark || ascent->cost[arc] || !problem->allowed[arc])
				continue;
			if (u == problem->root)
				return 0;
			ascent->inside[u] = ascent->mark;
			ascent->set[count++] = u;
		}
	}
	problem->search->work += work;
	return count;
}

/* Takes the cheapest cost off the arcs into the set; INT64_MAX when there is no such arc. *free: one that is free now.
 */
static int64_t raise_cut(struct ascent *ascent, uint32_t count, uint32_t *free)
{
	const struct cut_problem *problem = ascent->problem;
	const struct instance *instance = problem->instance;
	int64_t least = INT64_MAX;
	for (int pass = 0; pass < 2 && (pass == 0 || least != INT64_MAX); pass++)
		for (uint32_t i = 0; i < count; i++) {
			const uint32_t v = ascent->set[i];
			for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
				const uint32_t arc = cut_arc_out(problem, v, a) ^ 1;
				if (ascent->inside[instance->head[a]] == ascent->mark || !problem->allowed[arc])
					continue;
				if (pass) {
					ascent->cost[arc] -= least;
				} else if (ascent->cost[arc] < least) {
					least = ascent->cost[arc];
					*free = arc;
				}
			}
		}
	return least;
}

static uint32_t smallest(const struct cut_problem *problem, const uint32_t *size)
{
	uint32_t best = problem->target_count;
	for (uint32_t t = 0; t < problem->target_count; t++)
		if (size[t] && (best == problem->target_count || size[t] < size[best]))
			best = t;
	return best;
}

static enum tw_status raise_all(struct ascent *ascent, struct cut_pool *pool, int64_t *gain)
{
	const struct cut_problem *problem = ascent->problem;
	for (uint32_t t; (t = smallest(problem, ascent->size)) < problem->target_count;) {
		const uint32_t last = ascent->size[t], count = collect(ascent, problem->target[t]);
		ascent->size[t] = count;
		/* A set that grew much waits for its turn. */
		if (!count || (count > 2 * last && smallest(problem, ascent->size) != t))
			continue;
		uint32_t free = INSTANCE_NONE;
		const int64_t raised = raise_cut(ascent, count, &free);
		if (raised == INT64_MAX) {
			*gain = INT64_MAX;
			return TW_OK;
		}
		*gain += raised;
		if (pool &&
		    cut_pool_add(pool, problem, problem->target[t], ascent->set, count, ascent->inside, ascent->mark))
			pool->basic[pool->count - 1] = free;
		if (!search_spend(problem->search, 2 * count))
			return TW_ERROR_CANCELLED;
	}
	return TW_OK;
}

enum tw_status cut_ascend(const struct cut_problem *problem, int64_t *cost, struct cut_pool *pool, int64_t *gain)
{
	struct arena *arena = problem->search->arena;
	const struct arena_mark mark = arena_mark(arena);
	const size_t n = problem->instance->vertex_count;
	struct ascent ascent = {
		.problem = problem,
		.cost = cost,
		.set = ARENA_ARRAY(arena, n, uint32_t),
		.inside = ARENA_ZEROED(arena, n, uint32_t),
		.mark = STAMP_FIRST,
		.size = ARENA_ARRAY(arena, n, uint32_t),
	};
	enum tw_status status = ascent.set && ascent.inside && ascent.size ? TW_OK : TW_ERROR_MEMORY;
	*gain = 0;
	if (status == TW_OK) {
		for (uint32_t t = 0; t < problem->target_count; t++)
			ascent.size[t] = 1;
		status = raise_all(&ascent, pool, gain);
	}
	arena_release(arena, mark);
	return status;
}
