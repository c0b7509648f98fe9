/* Purpose: find the optimum by guessing how heavy it is.
 *
 * Deletion and label pruning need an upper bound, and the closer the better. A guess does as well as a tree: assume
 * that the optimum weighs less than bound + 0.15 %, delete and prune by that, and solve what is left. A tree below the
 * guess is then a minimum of everything; no tree proves that the optimum is not below the guess, which becomes the
 * bound, and the next guess is farther above. Failed guesses are cheap, because they are tight.
 *
 * The weights of trees are whole units of the caller's, and so is every guess: one between two units would tell no
 * more than the lower of them, and where weights are small numbers, 0.15 % is far less than a unit. Where the heaviest
 * part of a tree is a matter of course, heavy edges that every terminal hangs by, 0.15 % may be more than all that is
 * open: then the step is a part of the gap. */
#include "solver/steiner/guess.h"

#include "solver/steiner/program/dp.h"
#include "solver/steiner/reduce/fix.h"

/* What the next guess will take, from what the last two took: their growth goes on, and is fourfold at first. */
static uint64_t foresee(uint64_t last, uint64_t before)
{
	if (!before)
		return 4 * last;
	return last > 2 * before ? last * (last / before) : 2 * last;
}

enum tw_status guess_solve_below(struct search *search, const struct dual *dual, fine_t guess, int *found)
{
	struct dual next;
	int empty = 0;
	if (!search_uses(search, STEINER_FIXING))
		return dp_solve(search, dual, guess, found);
	enum tw_status status = fix_by_reduced_costs(search, dual, guess, &next, &empty);
	if (status != TW_OK || empty)
		return status;
	search->stats->vertices_left = search->instance.vertex_count;
	search->stats->edges_left = search->instance.edge_count;
	return dp_solve(search, &next, guess, found);
}

enum tw_status guess_begin(struct search *search, fine_t guess, struct guess_saved *saved)
{
	*saved = (struct guess_saved){arena_mark(search->arena), search->instance, search->assumed};
	search->assumed = guess + search->instance.base;
	return instance_copy(&search->instance, &saved->instance, search->arena);
}

void guess_end(struct search *search, const struct guess_saved *saved)
{
	search->instance = saved->instance;
	search->assumed = saved->assumed;
	arena_release(search->arena, saved->mark);
}

enum tw_status guess_try(struct search *search, const struct dual *dual, fine_t guess, int *found)
{
	struct guess_saved saved;
	*found = 0;
	enum tw_status status = guess_begin(search, guess, &saved);
	if (status == TW_OK)
		status = guess_solve_below(search, dual, guess, found);
	guess_end(search, &saved);
	return status;
}

fine_t guess_round_up(const struct instance *instance, fine_t fine)
{
	const fine_t below = ((fine_t)1 << instance->shift) - 1;
	return ((fine + instance->base + below) & ~below) - instance->base;
}

/* 0.15 % is what few terminals bear. The program's work grows with about the square of the gap, from a level that rises
 * steeply with the terminals: with 100 of them, gaps of 0.02, 0.04 and 0.06 % took 2, 7 and 25 million units on a part
 * of 2,200 vertices, and one of 0.15 % was not to be had for 100. */
enum { FEW_TERMINALS = 24 };

static fine_t first_step(fine_t bound, fine_t gap, uint32_t terminals)
{
	fine_t step = bound / 1000 * 3 / 2;
	if (terminals > FEW_TERMINALS)
		step = step * (FEW_TERMINALS * FEW_TERMINALS) / ((fine_t)terminals * terminals);
	return gap < step / 8 ? gap / 4 + 1 : step + 1;
}

/* How much farther above the dual's bound the next guess is, in eighths: so much that it takes about three times the
 * work. */
enum { GROWTH_FIRST = 8, GROWTH_OF_FEW = 16, GROWTH_MOST = 32 };

static uint32_t next_growth(uint32_t growth, uint64_t last, uint64_t before)
{
	if (before && last > 4 * before)
		return growth > 1 ? growth / 2 : 1;
	return before && last < 2 * before && growth < GROWTH_MOST ? 2 * growth : growth;
}

enum tw_status guess_solve(struct search *search, const struct dual *dual)
{
	const fine_t dual_bound = dual_fine_bound(dual), proven = search_proven(search);
	const uint32_t terminals = search->instance.terminal_count;
	fine_t bound = proven > dual_bound ? proven : dual_bound;
	uint64_t spent = 0, spent_before = 0;
	uint32_t growth = terminals > FEW_TERMINALS ? GROWTH_FIRST : GROWTH_OF_FEW;
	fine_t step = bound < search_cutoff(search) ? first_step(bound, search_cutoff(search) - bound, terminals) : 0;
	while (bound < search_cutoff(search)) {
		const fine_t cutoff = search_cutoff(search), gap = cutoff - bound;
		/* A guess close to the cutoff would have to be followed by the cutoff. */
		fine_t guess = gap < step + step / 2 || !search_uses(search, STEINER_GUESSING)
				       ? cutoff
				       : guess_round_up(&search->instance, bound + step);
		if (guess > cutoff)
			guess = cutoff;
		int found;
		if (search->budget_end && search->work + foresee(spent, spent_before) > search->budget_end)
			return TW_ERROR_CANCELLED;
		const uint64_t before = search->work;
		search_enter(search, "dynamic program");
		enum tw_status status = guess_try(search, dual, guess, &found);
		if (status != TW_OK)
			return status;
		if (found)
			break;
		spent_before = spent;
		spent = search->work - before;
		growth = next_growth(growth, spent, spent_before);
		bound = guess;
		search_bound(search, bound);
		step = (bound - dual_bound) / 8 * growth + 1;
	}
	search_close(search);
	return TW_OK;
}
