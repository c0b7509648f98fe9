/* Purpose: the order in which balls are grown.
 *
 * The bound that an ascent ends with depends on the order: a ball that goes all the way to the root uses up what its
 * neighbours need. So all terminals grow in turns up to a common limit that rises geometrically, and as long as the
 * guide allows: a terminal whose ball would cut it in two waits for the others. When all that are left wait, the guide
 * is of no more use to them, and they grow without. */
#include "solver/steiner/dual/ball.h"

/* One turn: grows every terminal of the group up to the limit on its value. Drops those that reach the root; true when
 * nothing will change in the next turn. */
static enum tw_status take_turn(struct dual *dual, struct search *search, uint32_t *group, uint32_t *count,
				uint64_t limit, int guided, int *stuck)
{
	uint32_t left = 0;
	*stuck = 1;
	for (uint32_t i = 0; i < *count; i++) {
		const uint32_t t = group[i];
		const uint64_t room = limit - (dual->value[t] < limit ? dual->value[t] : limit),
			       before = dual->value[t];
		enum dual_stop stop = DUAL_AT_LIMIT;
		if (room) {
			if (!dual_make_room(dual))
				return TW_ERROR_MEMORY;
			stop = dual_grow(dual, search, t, room < DUAL_FAR ? (uint32_t)room : DUAL_FAR, guided);
		}
		*stuck &= stop == DUAL_AT_GUIDE && dual->value[t] == before;
		if (stop != DUAL_AT_ROOT)
			group[left++] = t;
	}
	*count = left;
	return search_spend(search, 0) ? TW_OK : TW_ERROR_CANCELLED;
}

static uint64_t least_value(const struct dual *dual, const uint32_t *group, uint32_t count)
{
	uint64_t least = UINT64_MAX;
	for (uint32_t i = 0; i < count; i++)
		least = dual->value[group[i]] < least ? dual->value[group[i]] : least;
	return least;
}

enum tw_status dual_ascend_group(struct dual *dual, struct search *search, uint32_t *group, uint32_t count,
				 uint64_t limit, unsigned factor_percent, int guided)
{
	enum tw_status status = TW_OK;
	guided &= dual->guide.count > 0;
	while (count && status == TW_OK) {
		int stuck;
		status = take_turn(dual, search, group, &count, limit, guided, &stuck);
		if (guided && stuck && count) {
			guided = 0;
			limit = least_value(dual, group, count);
		}
		limit += limit / 100 * (factor_percent - 100) + limit % 100 * (factor_percent - 100) / 100 + 1;
	}
	return status;
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
			if (dual->survey->near_distance[t] < least)
				least = dual->survey->near_distance[t];
		}
	return dual_ascend_group(dual, search, growing, count, least / 2 + 1, factor_percent, 1);
}

enum tw_status dual_extend(struct dual *dual, struct search *search)
{
	for (uint32_t t = 0; t < dual->instance->terminal_count; t++) {
		if (t == dual->root)
			continue;
		if (!dual_make_room(dual))
			return TW_ERROR_MEMORY;
		dual_grow(dual, search, t, DUAL_FAR, 0);
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
		if (comes_after(dual->survey->middle, t, last) &&
		    (best == INSTANCE_NONE || dual->survey->middle[t] < dual->survey->middle[best]))
			best = t;
	return best;
}

/* The gap that is too large, as a part of what the tree costs for each terminal. Of 27 meshes with 10 to 17 terminals,
 * the dynamic program solved all with up to 0.54 after the ascents at once, and one of five with 0.64 to 0.9 in vain;
 * 36 terminals and more have 1.3 to 4. */
enum { FAR_PERCENT = 60 };

bool dual_is_far(const struct dual *dual, const struct search *search)
{
	const fine_t cutoff = search_cutoff(search), bound = dual_fine_bound(dual);
	const fine_t part = cutoff / search->instance.terminal_count;
	return search_uses(search, STEINER_FLOW) && cutoff != FINE_MAX && cutoff > bound &&
	       cutoff - bound > part / 100 * FAR_PERCENT;
}

/* A way to ascend: from the terminal of this rank in the order from the middle outward, with this factor. */
struct attempt {
	uint32_t rank;
	unsigned factor_percent;
};

static const struct attempt attempts[] = {{0, 300}, {1, 300}, {0, 130}, {0, 1000}, {1, 130},
					  {2, 300}, {0, 110}, {2, 130}, {1, 110}};

static uint32_t terminal_of_rank(const struct dual *dual, uint32_t rank)
{
	uint32_t root = INSTANCE_NONE;
	for (uint32_t i = 0; i <= rank; i++)
		root = next_in_middle(dual, root);
	return root;
}

enum tw_status dual_ascend_best(struct dual *dual, struct search *search, uint64_t effort)
{
	const uint32_t terminals = search->instance.terminal_count;
	const uint64_t end = search->work + effort;
	struct dual rival;
	enum tw_status status = dual_init(dual, search);
	if (status == TW_OK)
		status = dual_init_like(&rival, search, dual, 0);
	for (uint32_t i = 0; status == TW_OK && i < sizeof attempts / sizeof *attempts; i++) {
		if (i && (search->work >= end || dual_is_far(dual, search)))
			break;
		if (attempts[i].rank >= terminals)
			continue;
		status = dual_restart(&rival, search, terminal_of_rank(dual, attempts[i].rank));
		if (status == TW_OK)
			status = dual_ascend(&rival, search, attempts[i].factor_percent);
		/* One that was interrupted has a bound, too. */
		if (rival.bound > dual->bound) {
			const struct dual loser = *dual;
			*dual = rival;
			rival = loser;
		}
	}
	search_bound(search, dual_fine_bound(dual));
	return status;
}
