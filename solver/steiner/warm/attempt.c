/* Purpose: a search from a warm state.
 *
 * The state's bound is mostly a few ten-thousandths below the optimum, and its first guess at the optimum (guess.c) as
 * little above. Under that, all but the surroundings of the tree can be deleted from the whole graph at once, for the
 * price of a few passes over it, and what is left is small: there the lanes become balls, grow as far as they can, and
 * the dynamic program does the rest. No tree need be known before. A bound that is worse than expected asks for some
 * more guesses; after these, the search from scratch does better, and the state is due to be prepared anew. */
#include "solver/steiner/warm/attempt.h"

#include "solver/steiner/dual/ball.h"
#include "solver/steiner/program/dp.h"
#include "solver/steiner/reduce/fix.h"
#include "solver/steiner/warm/lanes.h"

#include <stdlib.h>

enum { GUESSES = 3 };

/* The first guess is so much above the bound. */
enum { LEAST_STEP_PER_MILLION = 300, STEP_OF_LOSS = 2 };

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

/* Balls for the terminals that have no lane, in what the lanes leave. */
static enum tw_status grow_others(struct search *search, struct dual *dual)
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
	return TW_OK;
}

/* Deletes what no tree below the guess uses, twice: the bound of what is left can rise. */
static enum tw_status shrink(const struct warm_lanes *lanes, struct search *search, const struct dual *whole,
			     fine_t guess, struct dual *left, int *empty)
{
	struct dual first;
	enum tw_status status = fix_by_reduced_costs(search, whole, guess, &first, empty);
	if (status != TW_OK || *empty)
		return status;
	status = warm_lanes_make_balls(lanes, search, &first);
	if (status == TW_OK)
		status = dual_extend(&first, search);
	return status == TW_OK ? fix_by_reduced_costs(search, &first, guess, left, empty) : status;
}

static enum tw_status solve_under_guess(const struct warm_lanes *lanes, struct search *search, const struct dual *whole,
					fine_t guess, int *found)
{
	struct dual left;
	int empty = 0;
	enum tw_status status = shrink(lanes, search, whole, guess, &left, &empty);
	if (status != TW_OK || empty)
		return status;
	search->stats->vertices_left = search->instance.vertex_count;
	search->stats->edges_left = search->instance.edge_count;
	return dp_solve(search, &left, guess, found);
}

/* On a copy, so that the instance is as before. */
static enum tw_status try_guess(const struct warm_lanes *lanes, struct search *search, const struct dual *whole,
				fine_t guess, int *found)
{
	const struct arena_mark mark = arena_mark(search->arena);
	const struct instance all = search->instance;
	*found = 0;
	enum tw_status status = instance_copy(&search->instance, &all, search->arena);
	search->assumed = guess;
	if (status == TW_OK)
		status = solve_under_guess(lanes, search, whole, guess, found);
	search->instance = all;
	search->assumed = FINE_MAX;
	arena_release(search->arena, mark);
	return status;
}

/* The next whole unit of the caller's at or above. */
static fine_t round_up(const struct instance *instance, fine_t fine)
{
	const fine_t below = ((fine_t)1 << instance->shift) - 1;
	return (fine + below) & ~below;
}

static enum tw_status guess(struct steiner_warm *warm, const struct warm_lanes *lanes, struct search *search,
			    const struct dual *whole, bool *solved)
{
	enum tw_status status = TW_OK;
	fine_t bound = dual_fine_bound(whole), step = bound / 1000000 * LEAST_STEP_PER_MILLION;
	if (step < STEP_OF_LOSS * warm->loss)
		step = STEP_OF_LOSS * warm->loss;
	for (unsigned round = 0; round < GUESSES && status == TW_OK && !*solved; round++) {
		int found = 0;
		const fine_t most = round_up(&search->instance, bound + step + 1);
		status = try_guess(lanes, search, whole, most, &found);
		*solved = status == TW_OK && found;
		warm->is_due = round > 0;
		bound = most;
		step *= 2;
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
	enum tw_status status = look_for_doubles(search, &has_doubles);
	if (status != TW_OK || has_doubles)
		return status;
	status = warm_lanes_lay(&lanes, warm, search, &whole, &fits);
	if (status != TW_OK || !fits)
		return status;
	status = grow_others(search, &whole);
	if (status == TW_OK)
		status = dual_extend(&whole, search);
	return status == TW_OK ? guess(warm, &lanes, search, &whole, solved) : status;
}

void warm_missed(struct steiner_warm *warm, const struct steiner_tree *tree)
{
	warm->is_due = tree->is_unique;
}
