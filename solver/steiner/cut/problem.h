/* What the parts of the branch and cut share: a node of the search tree, seen as a directed problem.
 *
 * Edge e is two arcs: 2e from ends[2e] to ends[2e + 1], and 2e + 1 back; so arc a leads from ends[a] to ends[a ^ 1]. A
 * tree becomes an arborescence away from the root terminal: x = 1 on its arcs, and every vertex set without the root
 * that holds a target is entered by one of them at least. */
#ifndef SOLVER_STEINER_CUT_PROBLEM_H
#define SOLVER_STEINER_CUT_PROBLEM_H

#include "solver/steiner/search.h"

#include <assert.h>

struct cut_problem {
	struct search *search;           /* borrowed */
	const struct instance *instance; /* borrowed: search->instance */
	uint32_t root;                   /* vertex */
	uint32_t arc_count;              /* 2 * edge_count */
	unsigned fraction_bits;          /* so that rounding the program's prices down loses little */
	int64_t *cost;                   /* [arc_count] the caller's weight << fraction_bits */
	uint8_t *allowed;                /* [arc_count] 0: fixed to zero in this node */
	uint8_t *gone;                   /* [arc_count] 1: fixed to zero everywhere; rows need not name it */
	uint32_t *target; /* [vertex_count] vertices to be reached: the terminals but the root, then branched ones */
	uint32_t target_count;
	uint32_t terminal_target_count; /* how many of them are terminals */
};

static inline uint32_t cut_tail(const struct cut_problem *problem, uint32_t arc)
{
	return problem->instance->ends[arc];
}

static inline uint32_t cut_head(const struct cut_problem *problem, uint32_t arc)
{
	return problem->instance->ends[arc ^ 1];
}

/* The arc that leaves v by the row entry `a` of the instance. */
static inline uint32_t cut_arc_out(const struct cut_problem *problem, uint32_t v, uint32_t a)
{
	const uint32_t e = problem->instance->edge[a];
	return 2 * e + (problem->instance->ends[2 * e] != v);
}

#define CUT_MINUS 0x80000000u /* in a row: the arc counts negative */

/* Inequalities. Most are cuts, "the arcs that enter a set sum to one at least", each with the target that the set
 * holds; the others are of the flow: "what enters a vertex is at least …", and then the least sum is 0. */
struct cut_pool {
	uint32_t count, capacity;
	size_t *start;    /* [capacity + 1]; row i has the arcs arc[start[i]] … arc[start[i + 1] - 1] */
	uint8_t *least;   /* [capacity] what the arcs sum to at least: 1 or 0 */
	uint32_t *target; /* [capacity] vertex; the row holds wherever that is a target; the root: everywhere */
	uint32_t *number; /* [capacity] ascending; a row keeps its number */
	uint16_t *pins;   /* [capacity] how many remembered bases need the row */
	uint32_t *basic;  /* [capacity] arc of the row to start the program's basis with, INSTANCE_NONE for none */
	uint32_t *arc;    /* [arc_capacity] arcs, or arc | CUT_MINUS */
	size_t arc_capacity;
	uint32_t next_number;
};

/* Closes a row whose arcs were written from pool->start[pool->count] on, up to `end`. */
static inline void cut_pool_close(struct cut_pool *pool, size_t end, uint8_t least, uint32_t target)
{
	assert(pool->count < pool->capacity && end <= pool->arc_capacity);
	pool->least[pool->count] = least;
	pool->target[pool->count] = target;
	pool->number[pool->count] = pool->next_number++;
	pool->pins[pool->count] = 0;
	pool->basic[pool->count++] = INSTANCE_NONE;
	pool->start[pool->count] = end;
}

/* Adds the arcs that enter the vertices with inside[v] == mark, looking at `members` only. False when there is no room.
 */
static inline int cut_pool_add(struct cut_pool *pool, const struct cut_problem *problem, uint32_t target,
			       const uint32_t *members, uint32_t member_count, const uint32_t *inside, uint32_t mark)
{
	const struct instance *instance = problem->instance;
	size_t at = pool->start[pool->count];
	if (pool->count == pool->capacity || pool->next_number == UINT32_MAX)
		return 0;
	for (uint32_t i = 0; i < member_count; i++) {
		const uint32_t v = members[i];
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t arc = cut_arc_out(problem, v, a) ^ 1;
			if (inside[instance->head[a]] == mark || problem->gone[arc])
				continue;
			if (at == pool->arc_capacity)
				return 0;
			pool->arc[at++] = arc;
		}
	}
	cut_pool_close(pool, at, 1, target);
	return 1;
}

#endif
