/* Purpose: a search from a warm state.
 *
 * The state's bound is mostly a few ten-thousandths below the optimum, and its first guess at the optimum (guess.c) as
 * little above. Under that, all but the surroundings of the tree can be deleted from the whole graph at once, for the
 * price of a few passes over it, and what is left is small: there the lanes become balls, grow as far as they can, and
 * the dynamic program does the rest. No tree need be known before. A bound that is worse than expected asks for
 * guesses further up, and for a flow on what they leave; after these, the search from scratch does better. Either way
 * the state is due to be prepared anew. */
#include "solver/steiner/warm/attempt.h"

#include "solver/steiner/dual/ball.h"
#include "solver/steiner/flow/flow.h"
#include "solver/steiner/guess.h"
#include "solver/steiner/reduce/fix.h"
#include "solver/steiner/warm/lanes.h"
#include "solver/steiner/warm/memory.h"

#include <stdlib.h>

/* The first guess is above the bound by what the state's own bound lost, and 0.07 per cent, which most moves of up to
 * 60 mm lose on a suit; each further step is four times the one before. Chosen over 30 moves of one of 17 and 36
 * terminals, 23,700 vertices, among some ten settings that mostly differed within noise. */
enum { GUESSES = 3, STEP_PER_MILLION = 700, STEP_FACTOR = 4 };

/* Of a flow: from scratch; and from the one that the state remembers, where 8 left the bound 0.05 to 0.13 per cent
 * below the optimum. */
enum { ITERATIONS = 24, FURTHER_ITERATIONS = 12 };

/* So much work, and so much for each edge, an attempt may take before the search from scratch is thought to do better;
 * that takes some 600 for each edge. */
enum { WORK_SHARE = 450, WORK_LEAST = 1000000 };

static int compare_keys(const void *a, const void *b)
{
	const warm_key x = *(const warm_key *)a, y = *(const warm_key *)b;
	return (x > y) - (x < y);
}

/* Two vertices of one name would be one row: hashes that met. */
static enum tw_status look_for_doubles(struct search *search, bool *has_doubles)
{
	const uint32_t lasting = warm_lasting(search), extra = search->graph->vertex_count - lasting;
	const struct arena_mark mark = arena_mark(search->arena);
	warm_key *key = ARENA_ARRAY(search->arena, extra, warm_key);
	*has_doubles = false;
	if (!key)
		return TW_ERROR_MEMORY;
	for (uint32_t i = 0; i < extra; i++)
		key[i] = warm_key_of(search, lasting + i);
	qsort(key, extra, sizeof *key, compare_keys);
	for (uint32_t i = 1; i < extra; i++)
		*has_doubles |= key[i] == key[i - 1];
	arena_release(search->arena, mark);
	return TW_OK;
}

/* Balls for the terminals that have no lane, in what the lanes leave, before the others take it. */
static enum tw_status grow(struct search *search, struct dual *dual)
{
	for (uint32_t t = 0; t < search->instance.terminal_count; t++) {
		if (t == dual->root || dual->value[t])
			continue;
		if (!dual_make_room(dual))
			return TW_ERROR_MEMORY;
		(void)dual_grow(dual, search, t, DUAL_FAR, 0);
		if (!search_spend(search, 0))
			return TW_ERROR_CANCELLED;
	}
	return dual_extend(dual, search);
}

/* Guesses from the dual's bound on, but none above `most`. */
static enum tw_status guess_upwards(struct search *search, const struct dual *dual, fine_t step, fine_t most,
				    int *found)
{
	enum tw_status status = TW_OK;
	for (fine_t bound = dual_fine_bound(dual); bound < most && status == TW_OK && !*found; step *= 2) {
		bound = guess_round_up(&search->instance, bound + step + 1);
		if (bound + step > most)
			bound = most;
		status = guess_try(search, dual, bound, found);
	}
	return status;
}

/* The flow's dual, if it is the better one; where none fits, the bound stays as it is. */
static enum tw_status raise_bound(const struct warm_lanes *lanes, struct search *search, uint32_t round,
				  struct dual *dual)
{
	struct flow *flow;
	bool has_started = false;
	enum tw_status status = flow_new(&flow, search, dual);
	if (status == TW_OK)
		status = warm_memory_start(lanes, search, flow, &has_started);
	if (status == TW_OK)
		status = flow_iterate(flow, search, has_started ? round * FURTHER_ITERATIONS : ITERATIONS);
	if (status == TW_OK)
		status = flow_raise_dual(flow, search, dual, NULL);
	return status == TW_ERROR_CANCELLED ? status : TW_OK;
}

/* Deletes from the instance what no tree below the guess uses; the lanes become balls of what is left, and grow. */
static enum tw_status shrink(const struct warm_lanes *lanes, struct search *search, const struct dual *whole,
			     fine_t guess, struct dual *left, int *empty)
{
	enum tw_status status = fix_by_reduced_costs(search, whole, guess, left, empty);
	if (status != TW_OK || *empty)
		return status;
	status = warm_lanes_make_balls(lanes, search, left);
	return status == TW_OK ? dual_extend(left, search) : status;
}

/* *foreseen: where the flow thinks that the optimum is at least. It is no bound: where the guess is too low, too much
 * was deleted. Unchanged without a flow. */
static enum tw_status try_guess(const struct warm_lanes *lanes, struct search *search, const struct dual *whole,
				fine_t step, fine_t guess, uint32_t round, fine_t *foreseen, int *found)
{
	struct guess_saved saved;
	struct dual left;
	int empty = 0;
	*found = 0;
	enum tw_status status = guess_begin(search, guess, &saved);
	if (status == TW_OK)
		status = shrink(lanes, search, whole, guess, &left, &empty);
	if (status == TW_OK && !empty && round) {
		status = raise_bound(lanes, search, round, &left);
		*foreseen = dual_fine_bound(&left);
	}
	if (status == TW_OK && !empty)
		status = round ? guess_upwards(search, &left, step, guess, found)
			       : guess_solve_below(search, &left, guess, found);
	guess_end(search, &saved);
	return status;
}

static enum tw_status guess(struct steiner_warm *warm, const struct warm_lanes *lanes, struct search *search,
			    const struct dual *whole, bool *solved)
{
	enum tw_status status = TW_OK;
	fine_t bound = dual_fine_bound(whole);
	const fine_t first = warm->loss + bound / 1000000 * STEP_PER_MILLION;
	fine_t step = first, foreseen = 0;
	for (unsigned round = 0; round < GUESSES && status == TW_OK && !*solved; round++) {
		int found = 0;
		const fine_t next = bound + step > foreseen + first ? bound + step : foreseen + first;
		const fine_t most = guess_round_up(&search->instance, next + 1);
		/* The state's coarse costs are for trees about as heavy as its own: more room than they can tell would
		 * be cut short, and with it the tree. */
		if (fix_room(whole, most) == DUAL_FAR)
			break;
		status = try_guess(lanes, search, whole, first, most, round, &foreseen, &found);
		*solved = status == TW_OK && found;
		warm->is_due = round > 0;
		bound = most;
		step *= STEP_FACTOR;
	}
	if (*solved)
		search_close(search);
	return status;
}

static bool can_serve(const struct steiner_warm *warm, const struct search *search)
{
	return warm->arena && warm->lasting_count == warm_lasting(search) && search_breaks_ties(search) &&
	       search->instance.terminal_count > 1 && search_uses(search, STEINER_FIXING) &&
	       search_uses(search, STEINER_DYNAMIC);
}

enum tw_status warm_attempt(struct steiner_warm *warm, struct search *search, bool *solved)
{
	struct warm_lanes lanes;
	struct dual whole;
	bool has_doubles = false, fits = false;
	*solved = false;
	if (!can_serve(warm, search))
		return TW_OK;
	search_enter(search, "warm start");
	search_set_budget(search, WORK_LEAST + WORK_SHARE * (uint64_t)search->instance.edge_count);
	enum tw_status status = look_for_doubles(search, &has_doubles);
	if (status != TW_OK || has_doubles)
		return status;
	status = warm_lanes_lay(&lanes, warm, search, &whole, &fits);
	if (status != TW_OK || !fits)
		return status;
	status = grow(search, &whole);
	return status == TW_OK ? guess(warm, &lanes, search, &whole, solved) : status;
}

void warm_missed(struct steiner_warm *warm, const struct steiner_tree *tree)
{
	warm->is_due = tree->is_unique;
}
