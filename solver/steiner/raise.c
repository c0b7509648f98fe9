/* Purpose: raise the dual bound.
 *
 * A flow's bound is a few thousandths below the optimum after some dozen iterations and a few ten-thousandths after a
 * hundred, on all kinds of meshes; the dual's local search takes ten to a hundred times as long for that. The dynamic
 * program needs no more than it needs: so a round iterates until the bound gains little, and leaves the rest to the
 * program. What the bound and the best tree rule out is deleted at once, as every deletion makes the steps after it
 * cheaper. */
#include "solver/steiner/raise.h"

#include "solver/steiner/reduce/fix.h"

/* A split takes as long as five to ten iterations. Measured on meshes of 23,500 vertices with 36 and 40 terminals, to a
 * proof: 24, 32, 40 and 60 iterations did equally well within a tenth, but for one of eight that wanted 60; with a
 * bound that is still rising by a hundredth, the program is not worth trying. */
enum { ITERATIONS = 32, PARTS_MOST = 4, RISING_SHARE = 100 };

/* The flow is set up anew when so much of its edges is gone: a factor takes as long as five to ten iterations. */
enum { SHRUNK_PERCENT = 70 };

enum { SHRINKS = 2 };

/* Deletes for good what no tree as light as the best one uses. The best tree itself stays, because the heuristics start
 * from it. What is left is smaller, and where deleted edges were ways round, terminals can grow further. */
static enum tw_status shrink(struct search *search, struct dual *dual)
{
	struct dual next;
	int empty = 0;
	if (!search_uses(search, STEINER_FIXING) || search_is_proven(search))
		return TW_OK;
	const fine_t cutoff = search_cutoff(search) + ((fine_t)1 << search->instance.shift);
	enum tw_status status = fix_by_reduced_costs(search, dual, cutoff, &next, &empty);
	if (status != TW_OK || empty)
		return status;
	*dual = next;
	status = dual_extend(dual, search);
	search_bound(search, dual_fine_bound(dual));
	return status;
}

static enum tw_status raise_by_search(struct search *search, struct dual *dual, uint64_t effort)
{
	enum tw_status status = TW_OK;
	if (!search_uses(search, STEINER_REASCENT))
		return status;
	for (uint32_t i = 0; status == TW_OK && i < SHRINKS && !search_is_proven(search); i++) {
		status = dual_improve(dual, search, effort / SHRINKS, search_cutoff(search));
		search_bound(search, dual_fine_bound(dual));
		if (status == TW_OK)
			status = shrink(search, dual);
	}
	return status;
}

/* The dual becomes the flow's if that is better. */
static enum tw_status split(struct raise *raise, struct search *search, struct dual *dual)
{
	const struct arena_mark mark = arena_mark(search->arena);
	struct dual rival;
	enum tw_status status = dual_init_like(&rival, search, dual, flow_members(raise->flow));
	if (status == TW_OK)
		status = flow_split(raise->flow, search, &rival);
	/* What an interrupted split has found is a bound, too. */
	if ((status == TW_OK || status == TW_ERROR_CANCELLED) && rival.bound > dual->bound)
		*dual = rival;
	else
		arena_release(search->arena, mark);
	search_bound(search, dual_fine_bound(dual));
	return status;
}

/* Of a limit of work, as much is left as a split takes: without one, iterations are for nothing. */
static uint32_t affordable_iterations(const struct raise *raise, const struct search *search)
{
	const uint64_t limit = search->options->work_limit;
	if (!limit)
		return ITERATIONS;
	const uint64_t split = flow_split_work(raise->flow), left = limit > search->work ? limit - search->work : 0;
	const uint64_t most = left > split ? (left - split) / flow_work(raise->flow) : 0;
	return most < ITERATIONS ? (uint32_t)most : ITERATIONS;
}

static enum tw_status raise_by_flow(struct raise *raise, struct search *search, struct dual *dual)
{
	enum tw_status status = TW_OK;
	for (uint32_t part = 0; part < PARTS_MOST && status == TW_OK && !search_is_proven(search); part++) {
		const fine_t before = dual_fine_bound(dual);
		if ((uint64_t)flow_edges(raise->flow) * SHRUNK_PERCENT > (uint64_t)search->instance.edge_count * 100 &&
		    flow_shrink(&raise->flow, search, dual) == TW_ERROR_CANCELLED)
			return TW_ERROR_CANCELLED;
		const uint32_t iterations = affordable_iterations(raise, search);
		if (!iterations)
			break;
		status = flow_iterate(raise->flow, search, iterations);
		if (status == TW_OK)
			status = split(raise, search, dual);
		const fine_t gain = dual_fine_bound(dual) - before;
		if (status == TW_OK)
			status = shrink(search, dual);
		if (gain < dual_fine_bound(dual) / RISING_SHARE)
			break;
	}
	return status;
}

enum tw_status raise_bound(struct raise *raise, struct search *search, struct dual *dual, uint64_t effort)
{
	enum tw_status status = shrink(search, dual);
	if (status != TW_OK || search_is_proven(search))
		return status;
	if (!raise->flow && !raise->has_no_flow) {
		status =
			search_uses(search, STEINER_FLOW) ? flow_new(&raise->flow, search, dual) : TW_ERROR_UNSUPPORTED;
		if (status == TW_ERROR_CANCELLED)
			return status;
		raise->has_no_flow = !raise->flow;
	}
	if (raise->flow) {
		status = raise_by_flow(raise, search, dual);
		if (status != TW_ERROR_MEMORY)
			return status;
		/* Without memory for a split, the local search still works with what it has. */
		raise->flow = NULL;
		raise->has_no_flow = true;
	}
	return raise_by_search(search, dual, effort);
}
