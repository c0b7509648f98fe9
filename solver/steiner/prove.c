/* Purpose: rounds of bounds, trees and exact stages, each with more effort than the one before.
 *
 * How long the dynamic program takes depends steeply on the gap of the dual bound, and how hard the instance is, is not
 * known before. So the first round gives it a little more than the first ascents took, which is enough for many
 * instances; from then on the efforts for dual, trees and exact stages double, until one of these comes to its end.
 *
 * Dynamic programming over terminal sets is unbeatable where separators are small and terminals few; branch and cut
 * does not mind many terminals but solves large linear programs. Which one suits an instance shows only in the doing.
 * So they take turns: the loss against the better one alone is a constant factor. Budgets are counted in work units, so
 * that the answer is the same everywhere. */
#include "solver/steiner/prove.h"

#include "solver/steiner/cut/cut.h"
#include "solver/steiner/guess.h"
#include "solver/steiner/part.h"
#include "solver/steiner/primal/primal.h"
#include "solver/steiner/primal/repeat.h"
#include "solver/steiner/raise.h"
#include "solver/steiner/reduce/bound.h"
#include "solver/steiner/reduce/fix.h"
#include "solver/steiner/reduce/reduce.h"

/* Work units for each edge; from the second round on they double from round to round. */
enum {
	DUAL_SHARE = 2,
	PRIMAL_SHARE = 1,
	PART_SHARE = 8,
	MOST_TERMINALS = 100
}; /* also for each terminal, up to so many */
enum { PROGRAM_SHARE = 100, FEW_SHARE = 30000, MANY_SQUARE = 36 * 36, LEAST_BUDGET = 3000000, MOST_ROUNDS = 20 };
enum { FEW_TERMINALS = 14, CUT_ROUND = 6, MESH_CUT_ROUND = 10 };
enum { SMALL_EDGES = 60000, SMALL_BUDGET = 10000000, SMALL_SHARE = 700, REPEAT_SHARE = 50 };
enum { DENSE_LEAST = 4000000, DENSE_SHARE = 200 };

/* An edge counts as used by the flow with a price on more than this share of its cost. Measured with 60 to 100
 * terminals on 23,500 vertices: after 24 iterations 0.01, 0.02 and 0.04 left 9,000, 4,600 and 2,000 edges after
 * reductions, and trees that were 0.01, 0.1 and 0.4 per cent too heavy, where the bound was off by 0.2 to 1.1; after 60
 * iterations 0.01 left 4,700 edges, and trees at most 0.035 per cent too heavy. */
static const float used_first = 0.02f, used_later = 0.01f;
enum { PARTS_FAILED_MOST = 3 };

static int is_small(const struct search *search)
{
	return search->graph->edge_count < SMALL_EDGES || primal_repeat_is_dense(&search->instance);
}

/* The branch and cut, and the instance that it is about: what deletion and reductions left when it began. */
struct cutter {
	struct cut_search *cut; /* NULL: not begun */
	struct instance instance;
	uint32_t edges_before; /* of the instance before deletion and reductions */
};

/* What no tree better than the best one uses goes, then what reductions find. *done: there is nothing left to do. */
static enum tw_status delete_and_reduce(struct search *search, const struct dual *dual, int *done)
{
	const struct arena_mark mark = arena_mark(search->arena);
	struct dual next;
	int empty = 0;
	enum tw_status status = fix_by_reduced_costs(search, dual, search_cutoff(search), &next, &empty);
	if (status == TW_OK && !empty)
		status = reduce_instance(search);
	if (status == TW_OK && !empty)
		status = reduce_by_bounds(search, &empty);
	arena_release(search->arena, mark);
	*done = status == TW_OK && (empty || search->instance.terminal_count < 2);
	if (*done && !empty)
		status = search_offer(search, NULL, 0);
	if (*done && status == TW_OK)
		search_bound(search, search_cutoff(search));
	search->stats->vertices_left = search->instance.vertex_count;
	search->stats->edges_left = search->instance.edge_count;
	return status;
}

static enum tw_status begin_cuts(struct cutter *cutter, struct search *search, const struct dual *dual, int *done)
{
	const struct instance whole = search->instance;
	enum tw_status status = instance_copy(&search->instance, &whole, search->arena);
	cutter->edges_before = whole.edge_count;
	if (status == TW_OK)
		status = delete_and_reduce(search, dual, done);
	return status == TW_OK && !*done ? cut_open(&cutter->cut, search) : status;
}

static void end_cuts(struct cutter *cutter)
{
	cut_close(cutter->cut);
	cutter->cut = NULL;
}

/* A turn of branch and cut. It goes on where it was interrupted; on large instances its arrays would be in the way of
 * the other stages, and where the instance has been shrunk to half since, it is better to begin anew. */
static enum tw_status solve_by_cuts(struct cutter *cutter, struct search *search, const struct dual *dual)
{
	const struct instance whole = search->instance;
	enum tw_status status = TW_OK;
	int done = 0;
	if (cutter->cut && 2 * whole.edge_count < cutter->edges_before)
		end_cuts(cutter);
	const struct arena_mark mark = arena_mark(search->arena);
	if (cutter->cut)
		search->instance = cutter->instance;
	else
		status = begin_cuts(cutter, search, dual, &done);
	if (status == TW_OK && !done)
		status = cut_run(cutter->cut);
	cutter->instance = search->instance;
	search->instance = whole;
	if (!is_small(search))
		end_cuts(cutter);
	if (!cutter->cut)
		arena_release(search->arena, mark);
	return status;
}

/* Exchanges get stuck where a graph is dense: there, trees from many starts are better ones. */
static enum tw_status repeat_paths(struct search *search, unsigned round)
{
	const struct instance *instance = &search->instance;
	if (!search_uses(search, STEINER_PRIMAL))
		return TW_OK;
	const uint64_t effort = primal_repeat_is_dense(instance)
					? DENSE_LEAST + DENSE_SHARE * (uint64_t)instance->edge_count
					: REPEAT_SHARE * (uint64_t)instance->edge_count;
	return primal_repeat(search, instance->weight, round == 1 ? 0 : 1u << round, effort << round);
}

/* How much the stages of a round may spend. A step of dual or trees costs about as much as there are edges, and there
 * is one to take at every terminal. */
struct effort {
	uint64_t edges;     /* of the instance, before anything was deleted */
	uint64_t terminals; /* no more than MOST_TERMINALS of them */
	unsigned round;
	unsigned primal_round; /* counts only rounds in which the trees gained */
	unsigned parts_failed; /* parts that were too hard, as follow_flow counts them */
	bool has_part;         /* one was solved */
};

static uint64_t program_budget(const struct search *search, const struct effort *effort)
{
	if (is_small(search))
		return (SMALL_BUDGET + SMALL_SHARE * effort->edges) << effort->round;
	const uint64_t square = effort->terminals * effort->terminals;
	const uint64_t many = square < MANY_SQUARE ? PROGRAM_SHARE : PROGRAM_SHARE * MANY_SQUARE / square;
	return (LEAST_BUDGET + (FEW_SHARE / square + many) * effort->edges) << effort->round;
}

/* The edges that the flow has a price on, and those of the best tree, which connect the terminals in any case, as an
 * instance of their own. Where that took too much, the next time fewer edges and more effort. */
static enum tw_status follow_flow(struct search *search, const struct flow *flow, struct effort *effort,
				  bool *is_solved)
{
	const struct arena_mark mark = arena_mark(search->arena);
	const uint64_t share = PART_SHARE * effort->edges * effort->terminals;
	uint8_t *keep = ARENA_ARRAY(search->arena, search->instance.edge_count, uint8_t);
	enum tw_status status = keep ? search_mark_best(search, keep) : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		const float least = effort->has_part ? used_later : used_first;
		flow_mark_used(flow, search, least * (float)(1u << effort->parts_failed), keep);
		status = part_solve(search, keep, (effort->has_part ? share / 2 : share) << effort->parts_failed,
				    is_solved);
	}
	arena_release(search->arena, mark);
	effort->has_part |= *is_solved;
	effort->parts_failed += !*is_solved && effort->parts_failed < PARTS_FAILED_MOST;
	/* The other heuristics may do. */
	return status == TW_ERROR_MEMORY || status == TW_ERROR_UNSUPPORTED ? TW_OK : status;
}

static enum tw_status improve_tree(struct search *search, const struct dual *dual, const struct flow *flow,
				   struct effort *effort)
{
	const double started_s = search_clock_s();
	const uint64_t before = search->best_weight, share = PRIMAL_SHARE * effort->edges * effort->terminals;
	bool is_solved = false;
	search_enter(search, "primal heuristics");
	enum tw_status status = is_small(search) ? repeat_paths(search, effort->round) : TW_OK;
	if (status == TW_OK && flow && search_uses(search, STEINER_PARTS) && search_uses(search, STEINER_DYNAMIC))
		status = follow_flow(search, flow, effort, &is_solved);
	if (status == TW_OK && !effort->has_part)
		status = primal_improve(search, dual, share << effort->primal_round);
	effort->primal_round += search->best_weight < before;
	search->stats->seconds_primal += search_clock_s() - started_s;
	return status;
}

static enum tw_status improve_dual(struct search *search, struct dual *dual, struct raise *raise,
				   const struct effort *effort)
{
	const double started_s = search_clock_s();
	const uint64_t step = DUAL_SHARE * effort->edges * effort->terminals;
	const uint64_t share = (step > LEAST_BUDGET ? step : LEAST_BUDGET) << effort->round;
	const uint64_t cheap = is_small(search) ? program_budget(search, effort) : 0;
	search_enter(search, "dual bound");
	const enum tw_status status = raise_bound(raise, search, dual, share, cheap);
	search->stats->seconds_dual += search_clock_s() - started_s;
	return status;
}

/* A better tree and a better dual. A flow finds the tree's corridor; the tree deletes what the flow need not look at,
 * so that it goes on several times as fast. The dual's local search is blind without a tree, and begins with it. */
static enum tw_status prepare(struct search *search, struct dual *dual, struct raise *raise, struct effort *effort)
{
	const bool is_dual_first = !raise->has_no_flow;
	enum tw_status status =
		is_dual_first ? improve_dual(search, dual, raise, effort) : improve_tree(search, dual, NULL, effort);
	if (status != TW_OK || search_is_proven(search))
		return status;
	if (is_dual_first)
		status = improve_tree(search, dual, raise->flow, effort);
	return status == TW_OK && !search_is_proven(search) ? improve_dual(search, dual, raise, effort) : status;
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
	search_set_budget(search, search_uses(search, STEINER_CUTS) || search_is_lightest(search) ? budget : 0);
	enum tw_status status = guess_solve(search, dual);
	search_set_budget(search, 0);
	return status;
}

/* From this round on nothing waits. */
static unsigned last_wait(const struct search *search)
{
	return is_small(search) ? CUT_ROUND : MESH_CUT_ROUND;
}

/* Linear programs of a whole mesh are no match for flow and dynamic programming (they took 12 s and proved nothing
 * where two more rounds took 2), nor are those of any graph when terminals are very few: these wait some rounds. */
static int is_due_for_cuts(const struct search *search, unsigned round)
{
	const uint32_t terminals = search->instance.terminal_count;
	if (!search_uses(search, STEINER_DYNAMIC))
		return 1;
	return round >= (is_small(search) && terminals > FEW_TERMINALS ? 1 : last_wait(search));
}

static enum tw_status run_cuts(struct cutter *cutter, struct search *search, const struct dual *dual, uint64_t budget)
{
	if (!search_uses(search, STEINER_CUTS) || search_is_lightest(search))
		return TW_ERROR_UNSUPPORTED;
	search_set_budget(search, search_uses(search, STEINER_DYNAMIC) ? budget : 0);
	enum tw_status status = solve_by_cuts(cutter, search, dual);
	search_set_budget(search, 0);
	return status;
}

/* Where bound and tree have come close, the dynamic program is the one to end the search, and may take as long as all
 * before it; where a second round has not brought them close, half as long, since a third may not either. s23k_wb with
 * 100 terminals took 27 s without this, when its budget had doubled often enough. */
static uint64_t last_effort(const struct search *search, const struct dual *dual, const struct raise *raise,
			    const struct effort *effort, uint64_t share)
{
	if (!raise->has_bound)
		return share;
	const uint64_t most = raise_is_close(search, dual) ? search->work : effort->round > 1 ? search->work / 2 : 0;
	return most > share ? most : share;
}

/* How much more may be spent on trees that weigh the same: once it is proven that none is lighter, as much as that
 * took. No limit before. Branch and cut cannot tell them apart, and bounds by duals hardly can. */
static uint64_t work_for_ties(const struct search *search, uint64_t *lightest_at)
{
	if (!search_is_lightest(search))
		return UINT64_MAX;
	if (!*lightest_at)
		*lightest_at = search->work;
	const uint64_t most = *lightest_at > LEAST_BUDGET ? *lightest_at : LEAST_BUDGET;
	const uint64_t spent = search->work - *lightest_at;
	return search_uses(search, STEINER_DYNAMIC) && most > spent ? most - spent : 0;
}

static enum tw_status take_turns(struct cutter *cutter, struct search *search, struct dual *dual)
{
	const uint32_t terminals = search->instance.terminal_count;
	struct effort effort = {
		.edges = search->instance.edge_count,
		.terminals = terminals < MOST_TERMINALS ? terminals : MOST_TERMINALS,
	};
	uint64_t lightest_at = 0;
	struct raise raise = {0};
	for (unsigned round = 0;; round += round < MOST_ROUNDS) {
		effort.round = round;
		/* Better bounds and trees do not help with ties. */
		const bool is_due = round && !search_is_lightest(search);
		const enum tw_status status = is_due ? prepare(search, dual, &raise, &effort) : TW_OK;
		const uint64_t left = work_for_ties(search, &lightest_at), share = program_budget(search, &effort);
		if (status != TW_OK || search_is_proven(search) || !left)
			return status;
		if (!round && (!search_uses(search, STEINER_EARLY) || dual_is_far(dual, search)))
			continue;
		const double started_s = search_clock_s();
		const uint64_t budget = share < left ? share : left,
			       most = last_effort(search, dual, &raise, &effort, share);
		enum tw_status program = run_program(search, dual, most < left ? most : left);
		enum tw_status cuts = TW_ERROR_UNSUPPORTED;
		if (may_go_on(search, program) && is_due_for_cuts(search, round))
			cuts = run_cuts(cutter, search, dual, budget);
		search->stats->seconds_exact += search_clock_s() - started_s;
		if (!may_go_on(search, program))
			return program;
		if (cuts != TW_ERROR_UNSUPPORTED && !may_go_on(search, cuts))
			return cuts;
		/* Neither can go on with a larger budget. */
		if (round >= last_wait(search) && program != TW_ERROR_CANCELLED && cuts != TW_ERROR_CANCELLED)
			return program == TW_ERROR_UNSUPPORTED ? cuts : program;
	}
}

enum tw_status prove_optimum(struct search *search, struct dual *dual)
{
	struct cutter cutter = {.cut = NULL};
	const enum tw_status status = take_turns(&cutter, search, dual);
	end_cuts(&cutter);
	return status;
}
