/* Purpose: flow balance (T. Koch & A. Martin, Solving Steiner tree problems in graphs to optimality, Networks 32,
 * 1998).
 *
 * Two kinds of rows, which every arborescence without bare ends obeys:
 * - At a vertex that is no terminal, at least as much leaves as enters.
 * - If an arc leaves a vertex other than the root, one enters it that does not come from where the arc leads to.
 * The second kind follows from the cuts of all targets together, but takes very many of them to say. Both are added
 * only where a solution violates them: all of them in every program would make it degenerate beyond use. */
#include "solver/steiner/cut/balance.h"

static const double tolerance = 0.01;

/* Writes the arcs of v that enter it, or leave it, with a sign, but not `except`. */
static int add_arcs(const struct cut_problem *problem, uint32_t v, int entering, uint32_t sign, uint32_t except,
		    struct cut_pool *pool, size_t *at)
{
	const struct instance *instance = problem->instance;
	for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
		const uint32_t arc = cut_arc_out(problem, v, a) ^ (uint32_t)entering;
		if (problem->gone[arc] || arc == except)
			continue;
		if (*at == pool->arc_capacity)
			return 0;
		pool->arc[(*at)++] = arc | sign;
	}
	return 1;
}

static void add_balance(const struct cut_problem *problem, uint32_t v, struct cut_pool *pool)
{
	size_t at = pool->start[pool->count];
	if (pool->count < pool->capacity && add_arcs(problem, v, 0, 0, INSTANCE_NONE, pool, &at) &&
	    add_arcs(problem, v, 1, CUT_MINUS, INSTANCE_NONE, pool, &at))
		cut_pool_close(pool, at, 0, problem->root);
}

static void add_supply(const struct cut_problem *problem, uint32_t v, uint32_t leaving, struct cut_pool *pool)
{
	size_t at = pool->start[pool->count];
	if (pool->count == pool->capacity || at == pool->arc_capacity)
		return;
	pool->arc[at++] = leaving | CUT_MINUS;
	if (add_arcs(problem, v, 1, 0, leaving ^ 1, pool, &at))
		cut_pool_close(pool, at, 0, problem->root);
}

/* The worst row of v, and those of all its arcs to terminals: where these are many, each as good as the next, a program
 * without these rows would try one after the other. */
static void add_supplies(const struct cut_problem *problem, uint32_t v, uint32_t worst, struct cut_pool *pool)
{
	const struct instance *instance = problem->instance;
	add_supply(problem, v, worst, pool);
	for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
		const uint32_t arc = cut_arc_out(problem, v, a);
		if (arc != worst && problem->allowed[arc] && instance->terminal_at[instance->head[a]] != INSTANCE_NONE)
			add_supply(problem, v, arc, pool);
	}
}

enum tw_status cut_separate_flow(const struct cut_problem *problem, const double *x, struct cut_pool *pool)
{
	const struct instance *instance = problem->instance;
	for (uint32_t v = 0; v < instance->vertex_count; v++) {
		double enters = 0, leaves = 0, worst = tolerance;
		uint32_t worst_arc = INSTANCE_NONE;
		if (v == problem->root)
			continue;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t arc = cut_arc_out(problem, v, a);
			leaves += x[arc];
			enters += x[arc ^ 1];
		}
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t arc = cut_arc_out(problem, v, a);
			const double missing = x[arc] - (enters - x[arc ^ 1]);
			if (missing > worst) {
				worst = missing;
				worst_arc = arc;
			}
		}
		if (worst_arc != INSTANCE_NONE)
			add_supplies(problem, v, worst_arc, pool);
		if (instance->terminal_at[v] == INSTANCE_NONE && enters > leaves + tolerance)
			add_balance(problem, v, pool);
	}
	return search_spend(problem->search, problem->arc_count / 4) ? TW_OK : TW_ERROR_CANCELLED;
}
