/* Purpose: choose between dynamic programming and branch and cut without knowing which is better.
 *
 * Dynamic programming over terminal sets is unbeatable where separators are small and terminals few; branch and cut
 * does not mind many terminals but solves large linear programs. Which one suits an instance shows only in the doing.
 * So they take turns with budgets of work that grow fourfold: the loss against the better one alone is a constant
 * factor. Before each turn the dual and the tree get better, with a budget in proportion, because that helps both.
 * Budgets are counted in work units, so that the answer is the same everywhere. */
#include "solver/steiner/prove.h"

#include "solver/steiner/cut.h"
#include "solver/steiner/fix.h"
#include "solver/steiner/guess.h"
#include "solver/steiner/primal.h"
#include "solver/steiner/reduce.h"

enum { FIRST_BUDGET_PER_EDGE = 1000, FIRST_BUDGET = 20000000, GROWTH = 4, PREPARATION_SHARE = 4 };

/* Branch and cut on what deletion and reductions leave of the instance. */
static enum tw_status delete_and_cut(struct search *search, const struct dual *dual)
{
	struct dual next;
	int empty = 0;
	enum tw_status status = fix_by_reduced_costs(search, dual, search_cutoff(search), &next, &empty);
	if (status == TW_OK && empty)
		search_bound(search, search_cutoff(search));
	if (status != TW_OK || empty)
		return status;
	status = reduce_instance(search);
	search->stats->vertices_left = search->instance.vertex_count;
	search->stats->edges_left = search->instance.edge_count;
	return status == TW_OK ? cut_solve(search) : status;
}

/* The same on a copy, so that the dual still belongs to the instance. */
static enum tw_status solve_by_cuts(struct search *search, const struct dual *dual)
{
	const struct arena_mark mark = arena_mark(search->arena);
	const struct instance whole = search->instance;
	enum tw_status status = instance_copy(&search->instance, &whole, search->arena);
	if (status == TW_OK)
		status = delete_and_cut(search, dual);
	search->instance = whole;
	arena_release(search->arena, mark);
	return status;
}

/* A better dual and a better tree. */
static enum tw_status prepare(struct search *search, struct dual *dual, uint64_t effort)
{
	enum tw_status status = TW_OK;
	search_enter(search, "dual ascent");
	if (search_uses(search, STEINER_REASCENT))
		status = dual_improve(dual, search, effort, search_cutoff(search));
	search_bound(search, dual_fine_bound(dual));
	if (status != TW_OK || search_is_proven(search))
		return status;
	search_enter(search, "primal heuristics");
	return primal_improve(search, dual, effort);
}

/* Out of budget is no reason to stop; out of memory is none for the other stage. */
static int may_go_on(const struct search *search, enum tw_status status)
{
	return !search->stop && (status == TW_ERROR_CANCELLED || status == TW_ERROR_MEMORY ||
				 status == TW_ERROR_LIMIT || status == TW_ERROR_UNSUPPORTED);
}

enum tw_status prove_optimum(struct search *search, struct dual *dual)
{
	const int use_program = search_uses(search, STEINER_DYNAMIC), use_cuts = search_uses(search, STEINER_CUTS);
	uint64_t budget = FIRST_BUDGET + (uint64_t)FIRST_BUDGET_PER_EDGE * search->instance.edge_count;
	for (;; budget = budget < UINT64_MAX / GROWTH ? budget * GROWTH : budget) {
		enum tw_status program = TW_ERROR_UNSUPPORTED, cuts = TW_ERROR_UNSUPPORTED;
		if (use_program || !use_cuts) {
			search_set_budget(search, use_cuts ? budget : 0);
			program = guess_solve(search, dual, 0);
			search_set_budget(search, 0);
			if (!may_go_on(search, program))
				return program;
		}
		if (use_cuts) {
			search_set_budget(search, use_program ? budget : 0);
			cuts = solve_by_cuts(search, dual);
			search_set_budget(search, 0);
			if (!may_go_on(search, cuts))
				return cuts;
		}
		/* Neither can go on with a larger budget. */
		if (program != TW_ERROR_CANCELLED && cuts != TW_ERROR_CANCELLED)
			return program == TW_ERROR_UNSUPPORTED ? cuts : program;
		const enum tw_status status = prepare(search, dual, budget / PREPARATION_SHARE);
		if (status != TW_OK || search_is_proven(search))
			return status;
	}
}
