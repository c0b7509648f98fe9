/* Purpose: the order in which balls are grown.
 *
 * The bound that an ascent ends with depends on the order: a ball that goes all the way to the root uses up what its
 * neighbours need. So all terminals grow in turns up to a common limit that rises geometrically. What is still lost is
 * recovered by local search: a few neighbouring terminals give back all they took, and grow anew in another order, in
 * coarser or finer turns; what is no worse is kept, so that the search can walk along plateaus. */
#include "solver/steiner/dual_ball.h"

#include <string.h>

enum { GROUP_LEAST = 2, GROUP_MOST = 7 };
enum { COARSE_FACTOR = 150, FINE_FACTOR = 110, MANY_TERMINALS = 24 }; /* factors in per cent */

static uint64_t draw(struct dual *dual, uint64_t below)
{
	dual->random += 0x9e3779b97f4a7c15u;
	uint64_t x = dual->random;
	x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
	x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
	return (x ^ (x >> 31)) % below;
}

/* Grows the terminals of `group` in turns, each turn up to a common limit on a terminal's value that rises by
 * `factor_percent` from turn to turn (0: no limit at all), until all have reached the root. */
static enum tw_status ascend(struct dual *dual, struct search *search, uint32_t *group, uint32_t count, uint64_t limit,
			     unsigned factor_percent)
{
	while (count) {
		uint32_t left = 0;
		for (uint32_t i = 0; i < count; i++) {
			uint32_t t = group[i];
			uint64_t room =
				factor_percent ? limit - (dual->value[t] < limit ? dual->value[t] : limit) : DUAL_FAR;
			if (room) {
				if (!dual_make_room(dual))
					return TW_ERROR_MEMORY;
				if (dual_grow(dual, search, t, room < DUAL_FAR ? (uint32_t)room : DUAL_FAR) < room)
					continue;
			}
			if (factor_percent)
				group[left++] = t;
		}
		count = left;
		limit += limit * (factor_percent - 100) / 100 + 1;
		if (!search_spend(search, 0))
			return TW_ERROR_CANCELLED;
	}
	return TW_OK;
}

static void shuffle(struct dual *dual, uint32_t *group, uint32_t count)
{
	for (uint32_t i = count; i > 1; i--) {
		uint32_t j = (uint32_t)draw(dual, i), t = group[i - 1];
		group[i - 1] = group[j];
		group[j] = t;
	}
}

enum tw_status dual_ascend(struct dual *dual, struct search *search, unsigned factor_percent)
{
	uint32_t count = 0, *growing = ARENA_ARRAY(dual->arena, dual->instance->terminal_count, uint32_t);
	if (!growing)
		return TW_ERROR_MEMORY;
	uint64_t least = UINT32_MAX;
	for (uint32_t t = 0; t < dual->instance->terminal_count; t++)
		if (t != dual->root) {
			growing[count++] = t;
			if (dual->near_distance[t] < least)
				least = dual->near_distance[t];
		}
	return ascend(dual, search, growing, count, least / 2 + 1, factor_percent);
}

enum tw_status dual_extend(struct dual *dual, struct search *search)
{
	for (uint32_t t = 0; t < dual->instance->terminal_count; t++) {
		if (t == dual->root)
			continue;
		if (!dual_make_room(dual))
			return TW_ERROR_MEMORY;
		dual_grow(dual, search, t, DUAL_FAR);
		if (!search_spend(search, 0))
			return TW_ERROR_CANCELLED;
	}
	return TW_OK;
}

static int comes_after(const uint64_t *middle, uint32_t t, uint32_t last)
{
	if (last == INSTANCE_NONE)
		return 1;
	return middle[t] > middle[last] || (t > last && middle[t] == middle[last]);
}

/* The terminal closest to the middle of those that come after `last` in the order of middle. */
static uint32_t next_in_middle(const struct dual *dual, uint32_t last)
{
	uint32_t best = INSTANCE_NONE;
	for (uint32_t t = 0; t < dual->instance->terminal_count; t++)
		if (comes_after(dual->middle, t, last) &&
		    (best == INSTANCE_NONE || dual->middle[t] < dual->middle[best]))
			best = t;
	return best;
}

/* Picks a terminal and some of its nearest neighbours; the root stays out. */
static uint32_t pick_group(struct dual *dual, uint32_t group[GROUP_MOST])
{
	uint32_t centre = (uint32_t)draw(dual, dual->instance->terminal_count), count = 0;
	uint32_t size = GROUP_LEAST + (uint32_t)draw(dual, GROUP_MOST - GROUP_LEAST + 1);
	const uint32_t *near = dual->near + (size_t)centre * dual->near_count;
	if (centre != dual->root)
		group[count++] = centre;
	for (uint32_t i = 0; i < dual->near_count && count < size; i++)
		if (near[i] != dual->root)
			group[count++] = near[i];
	return count;
}

static int belongs(const struct dual_ball *ball, const uint32_t *group, uint32_t count)
{
	for (uint32_t i = 0; i < count; i++)
		if (ball->terminal == group[i])
			return 1;
	return 0;
}

/* The value of one of the terminal's balls together with those inside it, but the last: a level at which to cut it
 * back. */
static uint64_t pick_level(struct dual *dual, uint32_t terminal)
{
	uint32_t balls = 0;
	uint64_t level = 0;
	for (uint32_t b = 0; b < dual->ball_count; b++)
		balls += dual->ball[b].applied && dual->ball[b].terminal == terminal;
	uint64_t kept = balls > 1 ? draw(dual, balls) : 0;
	for (uint32_t b = 0; b < dual->ball_count && kept; b++)
		if (dual->ball[b].applied && dual->ball[b].terminal == terminal) {
			level += dual->ball[b].radius;
			kept--;
		}
	return level;
}

/* Takes out the group's balls beyond the level; they stay remembered. Balls share no cost, so that any of them may
 * stay. */
static void cut_back(struct dual *dual, struct search *search, const uint32_t *group, uint32_t count, uint64_t level)
{
	for (uint32_t i = 0; i < count; i++)
		dual->inner[group[i]] = 0;
	for (uint32_t b = 0; b < dual->ball_count; b++) {
		struct dual_ball *ball = &dual->ball[b];
		if (!ball->applied || !belongs(ball, group, count))
			continue;
		dual->inner[ball->terminal] += ball->radius;
		if (dual->inner[ball->terminal] > level)
			dual_take_out(dual, search, ball);
	}
}

/* Chooses between the balls that were taken out and those of this step. */
static void settle_on(struct dual *dual, struct search *search, int new)
{
	for (uint32_t b = 0; b < dual->ball_count && !new; b++)
		if (dual->ball[b].applied && dual->ball[b].epoch == dual->epoch) {
			dual_take_out(dual, search, &dual->ball[b]);
			dual->ball[b].terminal = INSTANCE_NONE;
		}
	for (uint32_t b = 0; b < dual->ball_count; b++)
		if (!dual->ball[b].applied && dual->ball[b].terminal != INSTANCE_NONE) {
			if (new)
				dual->ball[b].terminal = INSTANCE_NONE;
			else
				dual_put_back(dual, search, &dual->ball[b]);
		}
}

enum tw_status dual_improve(struct dual *dual, struct search *search, uint64_t effort, uint64_t target)
{
	static const unsigned factors[] = {150, 300, 1000, 0};
	uint64_t end = search->work + effort;
	enum tw_status status = TW_OK;
	while (status == TW_OK && search->work < end && dual_fine_bound(dual) < target) {
		uint32_t group[GROUP_MOST], growing[GROUP_MOST], count = pick_group(dual, group);
		if (!count)
			break;
		uint64_t before = dual->bound, least = UINT32_MAX;
		for (uint32_t i = 0; i < count; i++)
			if (dual->near_distance[group[i]] < least)
				least = dual->near_distance[group[i]];
		uint64_t level = draw(dual, 2) ? pick_level(dual, group[draw(dual, count)]) : 0;
		cut_back(dual, search, group, count, level);
		if (level)
			least = 2 * level;
		dual->epoch++;
		shuffle(dual, group, count);
		memcpy(growing, group, sizeof growing);
		status = ascend(dual, search, growing, count, least / 2 + 1, factors[draw(dual, 4)]);
		settle_on(dual, search, dual->bound >= before);
		search->work += dual->ball_count / 4 + 1;
	}
	return status;
}

/* A dual with this root, improved a little. */
static enum tw_status ascend_from(struct dual *dual, struct search *search, uint32_t root, unsigned factor_percent,
				  uint64_t effort)
{
	enum tw_status status = dual_init(dual, search, root);
	if (status == TW_OK)
		status = dual_ascend(dual, search, factor_percent);
	if (status == TW_OK && effort)
		status = dual_improve(dual, search, effort, search_cutoff(search));
	search_bound(search, dual_fine_bound(dual));
	return status;
}

enum tw_status dual_ascend_best(struct dual *dual, struct search *search, uint32_t candidates, uint32_t stride,
				uint64_t effort)
{
	enum tw_status status = dual_init(dual, search, 0);
	if (status != TW_OK)
		return status;
	struct dual order = *dual;
	uint32_t best = next_in_middle(&order, INSTANCE_NONE), root = best;
	unsigned factor = COARSE_FACTOR;
	uint64_t best_bound = 0;
	/* With many terminals the finer turns are worth a last try. */
	uint32_t tries = candidates + (order.instance->terminal_count >= MANY_TERMINALS);
	for (uint32_t i = 0; tries > 1 && i < tries && root != INSTANCE_NONE && status == TW_OK; i++) {
		struct arena_mark mark = arena_mark(search->arena);
		int last = i >= candidates;
		status = ascend_from(dual, search, last ? best : root, last ? FINE_FACTOR : COARSE_FACTOR, effort);
		if (status == TW_OK && dual->bound > best_bound) {
			best = last ? best : root;
			factor = last ? FINE_FACTOR : COARSE_FACTOR;
			best_bound = dual->bound;
		}
		arena_release(search->arena, mark);
		for (uint32_t j = 0; j < stride && root != INSTANCE_NONE; j++)
			root = next_in_middle(&order, root);
	}
	return status == TW_OK ? ascend_from(dual, search, best, factor, effort) : status;
}
