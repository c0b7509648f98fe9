/* Purpose: rounds of bounds, trees and exact stages, each with more effort than the one before.
 *
 * How long the dynamic program takes depends steeply on the gap of the dual bound, and how hard the instance is, is not
 * known before. So the first round gives it hardly more than the first ascent, which is enough for many instances; from
 * then on the efforts for dual, trees and exact stages double, until one of these comes to its end.
 *
 * Dynamic programming over terminal sets is unbeatable where separators are small and terminals few; branch and cut
 * does not mind many terminals but solves large linear programs. Which one suits an instance shows only in the doing.
 * So they take turns: the loss against the better one alone is a constant factor. Budgets are counted in work units, so
 * that the answer is the same everywhere. */
#include "solver/steiner/prove.h"

#include "solver/steiner/cut.h"
#include "solver/steiner/fix.h"
#include "solver/steiner/guess.h"
#include "solver/steiner/primal.h"
#include "solver/steiner/reduce.h"

/* Work units for each edge; from the second round on they double from round to round. */
enum { FIRST_PROGRAM_SHARE = 700, RACE_SHARE = 120, DUAL_SHARE = 400, PRIMAL_SHARE = 40, PROGRAM_SHARE = 200 };
enum { LEAST_BUDGET = 10000000, MOST_ROUNDS = 20, RACERS = 4 };
enum { CUT_TERMINALS = 64, CUT_EDGES = 4000, CUT_ROUND = 4 };

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

/* The dual's share of a round: at first roots compete, later the winner improves. */
static enum tw_status raise_bound(struct search *search, struct dual *dual, unsigned round, uint64_t edges)
{
	uint32_t stride = search->instance.terminal_count / RACERS + 1;
	if (!search_uses(search, STEINER_REASCENT))
		return TW_OK;
	search_enter(search, "dual ascent");
	enum tw_status status = TW_OK;
	if (round == 1) {
		struct dual best;
		status = dual_ascend_best(&best, search, RACERS, stride, RACE_SHARE * edges);
		if (status == TW_OK && best.bound > dual->bound)
			*dual = best;
	}
	if (status == TW_OK)
		status = dual_improve(dual, search, (DUAL_SHARE * edges) << round, search_cutoff(search));
	search_bound(search, dual_fine_bound(dual));
	return status;
}

/* Deletes for good what no tree as light as the best one uses. The best tree itself stays, because the heuristics start
 * from it. What is left is smaller, and where deleted edges were ways round, terminals can grow further. */
static enum tw_status shrink(struct search *search, struct dual *dual)
{
	struct dual next;
	int empty = 0;
	if (!search_uses(search, STEINER_FIXING))
		return TW_OK;
	uint64_t cutoff = search_cutoff(search) + ((uint64_t)1 << search->instance.shift);
	enum tw_status status = fix_by_reduced_costs(search, dual, cutoff, &next, &empty);
	if (status != TW_OK || empty)
		return status;
	*dual = next;
	status = dual_extend(dual, search);
	search_bound(search, dual_fine_bound(dual));
	return status;
}

/* A better dual and a better tree. */
static enum tw_status prepare(struct search *search, struct dual *dual, unsigned round, uint64_t edges)
{
	double started_s = search_clock_s();
	enum tw_status status = raise_bound(search, dual, round, edges);
	double raised_s = search_clock_s();
	search->stats->seconds_dual += raised_s - started_s;
	if (status == TW_OK && !search_is_proven(search)) {
		search_enter(search, "primal heuristics");
		status = primal_improve(search, dual, (PRIMAL_SHARE * edges) << round);
	}
	if (status == TW_OK && !search_is_proven(search))
		status = shrink(search, dual);
	search->stats->seconds_primal += search_clock_s() - raised_s;
	return status;
}

/* Out of budget is no reason to stop; out of memory is none for the other stage. */
static int may_go_on(const struct search *search, enum tw_status status)
{
	return !search->stop && (status == TW_ERROR_CANCELLED || status == TW_ERROR_MEMORY ||
				 status == TW_ERROR_LIMIT || status == TW_ERROR_UNSUPPORTED);
}

static enum tw_status run_program(struct search *search, const struct dual *dual, uint64_t budget)
{
	if (!search_uses(search, STEINER_DYNAMIC) && search_uses(search, STEINER_CUTS))
		return TW_ERROR_UNSUPPORTED;
	search_set_budget(search, search_uses(search, STEINER_CUTS) ? budget : 0);
	enum tw_status status = guess_solve(search, dual);
	search_set_budget(search, 0);
	return status;
}

/* Linear programs of a whole mesh are no match for dynamic programming while terminals are few: those wait some rounds.
 */
static int is_due_for_cuts(const struct search *search, unsigned round)
{
	const struct instance *instance = &search->instance;
	if (!search_uses(search, STEINER_DYNAMIC))
		return 1;
	return round >= (instance->terminal_count > CUT_TERMINALS || instance->edge_count < CUT_EDGES ? 1 : CUT_ROUND);
}

static enum tw_status run_cuts(struct search *search, const struct dual *dual, uint64_t budget)
{
	if (!search_uses(search, STEINER_CUTS))
		return TW_ERROR_UNSUPPORTED;
	search_set_budget(search, search_uses(search, STEINER_DYNAMIC) ? budget : 0);
	enum tw_status status = solve_by_cuts(search, dual);
	search_set_budget(search, 0);
	return status;
}

enum tw_status prove_optimum(struct search *search, struct dual *dual)
{
	uint64_t edges = search->instance.edge_count;
	for (unsigned round = 0;; round += round < MOST_ROUNDS) {
		enum tw_status status = round ? prepare(search, dual, round, edges) : TW_OK;
		if (status != TW_OK || search_is_proven(search))
			return status;
		double started_s = search_clock_s();
		uint64_t budget = round ? (LEAST_BUDGET / 2 + PROGRAM_SHARE * edges) << round
					: LEAST_BUDGET + FIRST_PROGRAM_SHARE * edges;
		enum tw_status program = run_program(search, dual, budget), cuts = TW_ERROR_UNSUPPORTED;
		if (may_go_on(search, program) && is_due_for_cuts(search, round))
			cuts = run_cuts(search, dual, budget);
		search->stats->seconds_exact += search_clock_s() - started_s;
		if (!may_go_on(search, program))
			return program;
		if (cuts != TW_ERROR_UNSUPPORTED && !may_go_on(search, cuts))
			return cuts;
		/* Neither can go on with a larger budget. */
		if (round >= CUT_ROUND && program != TW_ERROR_CANCELLED && cuts != TW_ERROR_CANCELLED)
			return program == TW_ERROR_UNSUPPORTED ? cuts : program;
	}
}
