/* Purpose: raise the dual bound.
 *
 * A flow's bound is a few thousandths below the optimum after some dozen iterations and a few ten-thousandths after a
 * hundred, on all kinds of meshes; the dual's local search takes ten to a hundred times as long for that. The dynamic
 * program needs no more than it needs: so a round iterates until the bound gains little, and leaves the rest to the
 * program. What the bound and the best tree rule out is deleted at once, as every deletion makes the steps after it
 * cheaper. */
#include "solver/steiner/raise.h"

#include "solver/steiner/reduce/fix.h"

/* Iterations before the first bound, and the trees that follow it: 24, and one for every two terminals, but no more
 * than
 * 64. A bound takes as long as ten iterations, and a poor one is paid for by all stages after it. Measured to a proof:
 * nine suits and s23k with 36 and 40 terminals took 3.6 s in all with 24 iterations, 3.2 with 40; three of 60, two of
 * 80 and s23k_wa with 100 took 9.6 with 24, 7.9 with 48, 7.3 with 64 and 7.9 with 80; with 15 terminals 24 to 40 do
 * equally well. */
enum { FIRST_ITERATIONS = 24, TERMINALS_FOR_ONE = 2, FIRST_MOST = 64 };

/* And before each further bound, on the smaller graph: with 24, 32 and 48, the same took 10.4, 9.3 and 9.4 s. */
enum { ITERATIONS = 32, PARTS_MOST = 4 };

/* A part must close such a share of the gap, or there is no other before the dynamic program. */
enum { GAIN_SHARE = 4 };

/* Where iterations cost next to nothing beside what the other stages of a round may spend, a gain of the flow's own
 * bound by a ten-thousandth is worth them: PACE 2018's 199 (6,163 vertices, 130 terminals) is proven in 0.7 s instead
 * of 2.6, 197 in 0.8 instead of 1.8. On dense graphs a flow is the lower bound for some hundred iterations. */
enum { CHEAP_GAIN_SHARE = 10000 };

/* The dynamic program does not want a better bound where the gap is less than 1/20 of a terminal's part in the tree: on
 * meshes with 36 terminals it takes 0.05 s then, with 100 terminals 0.3 s, which is what another part takes. */
enum { ENOUGH_SHARE = 20 };

/* The flow is set up anew when so much of its edges is gone: a factor takes as long as five to ten iterations. */
enum { SHRUNK_PERCENT = 70 };

/* Deletion makes a new dual, which takes longer than the edges are worth that it does not look at any more, unless so
 * many go. */
enum { WORTH_PERCENT = 90 };

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
	const uint32_t before = search->instance.edge_count, worth = (uint32_t)((uint64_t)before * WORTH_PERCENT / 100);
	enum tw_status status = fix_if_worth(search, dual, cutoff, worth, &next, &empty);
	if (status != TW_OK || empty || search->instance.edge_count == before)
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
	fine_t bound;
	const enum tw_status status = flow_raise_dual(raise->flow, search, dual, &bound);
	raise->gain = bound > raise->reached ? bound - raise->reached : 0;
	raise->reached += raise->gain;
	search_bound(search, dual_fine_bound(dual));
	return status;
}

static uint32_t wanted_iterations(const struct raise *raise, const struct search *search)
{
	const uint32_t first = FIRST_ITERATIONS + search->instance.terminal_count / TERMINALS_FOR_ONE;
	if (raise->has_bound)
		return ITERATIONS;
	return first < FIRST_MOST ? first : FIRST_MOST;
}

/* Of a limit of work, as much is left as a split takes: without one, iterations are for nothing. */
static uint32_t affordable_iterations(const struct raise *raise, const struct search *search)
{
	const uint32_t wanted = wanted_iterations(raise, search);
	const uint64_t limit = search->options->work_limit;
	if (!limit)
		return wanted;
	const uint64_t split = flow_split_work(raise->flow), left = limit > search->work ? limit - search->work : 0;
	const uint64_t most = left > split ? (left - split) / flow_work(raise->flow) : 0;
	return most < wanted ? (uint32_t)most : wanted;
}

static fine_t gap_of(const struct search *search, const struct dual *dual)
{
	const fine_t cutoff = search_cutoff(search), bound = dual_fine_bound(dual);
	return cutoff > bound ? cutoff - bound : 0;
}

bool raise_is_close(const struct search *search, const struct dual *dual)
{
	const fine_t share = search_cutoff(search) / search->instance.terminal_count / ENOUGH_SHARE;
	return gap_of(search, dual) < share;
}

static bool is_rising(const struct raise *raise, const struct search *search, uint64_t cheap_end)
{
	return search->work < cheap_end && raise->gain >= raise->reached / CHEAP_GAIN_SHARE;
}

static enum tw_status run_part(struct raise *raise, struct search *search, struct dual *dual, bool *goes_on)
{
	*goes_on = false;
	if ((uint64_t)flow_edges(raise->flow) * SHRUNK_PERCENT > (uint64_t)search->instance.edge_count * 100 &&
	    flow_shrink(&raise->flow, search, dual) == TW_ERROR_CANCELLED)
		return TW_ERROR_CANCELLED;
	const uint32_t iterations = affordable_iterations(raise, search);
	const fine_t before = gap_of(search, dual);
	enum tw_status status = iterations ? flow_iterate(raise->flow, search, iterations) : TW_OK;
	if (status == TW_OK && iterations)
		status = split(raise, search, dual);
	*goes_on = iterations && before - gap_of(search, dual) > before / GAIN_SHARE;
	return status == TW_OK ? shrink(search, dual) : status;
}

/* The first part ends before there are trees that are worth a comparison. */
static enum tw_status raise_by_flow(struct raise *raise, struct search *search, struct dual *dual, uint64_t cheap)
{
	const uint64_t cheap_end = search->work + cheap;
	const bool is_first = !raise->has_bound;
	enum tw_status status = TW_OK;
	bool goes_on = true;
	for (uint32_t part = 0; (part < PARTS_MOST || search->work < cheap_end) && goes_on && status == TW_OK; part++) {
		if (search_is_proven(search) || (!is_first && raise_is_close(search, dual)))
			break;
		status = run_part(raise, search, dual, &goes_on);
		goes_on = (goes_on && !is_first) || is_rising(raise, search, cheap_end);
	}
	raise->has_bound = true;
	return status;
}

enum tw_status raise_bound(struct raise *raise, struct search *search, struct dual *dual, uint64_t effort,
			   uint64_t cheap)
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
		status = raise_by_flow(raise, search, dual, cheap);
		if (status != TW_ERROR_MEMORY)
			return status;
		/* Without memory for a split, the local search still works with what it has. */
		raise->flow = NULL;
		raise->has_no_flow = true;
	}
	return raise_by_search(search, dual, effort);
}
