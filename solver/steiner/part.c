/* Purpose: find the lightest tree of a part of the instance.
 *
 * Where many terminals share few ways, local search gets stuck a few thousandths above the optimum, whatever tree it
 * starts from. But the edges that come into question are few: those that a flow has a price on (flow.h), or those of a
 * pool of good trees. As an instance of their own they are nearly a tree, general reductions leave a few hundred
 * edges of them, and all that proves optima proves theirs in a fraction of the time. The optimum of such a part is
 * within a few hundred-thousandths of the whole's. (Trees of a union of trees: C. C. Ribeiro, E. Uchoa & R. F. Werneck,
 * A hybrid GRASP with perturbations for the Steiner problem in graphs, INFORMS J. Comput. 14, 2002.)
 *
 * Bounds and the dynamic program take turns, and each may spend as much as the other has. */
#include "solver/steiner/part.h"

#include "solver/steiner/guess.h"
#include "solver/steiner/raise.h"
#include "solver/steiner/reduce/reduce.h"

/* Work units for each edge. */
enum { ASCENT_SHARE = 30, SEARCH_SHARE = 10 };

/* A bound that rises by less than this part of it in one go leaves the rest to the program. */
enum { RISING_PART = 20000 };

/* Drops the edges that are apart from the first terminal. False when another terminal is apart, too. */
static bool keep_component(const struct instance *instance, uint8_t *keep, uint32_t *queue, uint8_t *seen)
{
	uint32_t count = 0;
	queue[count++] = instance->terminal[0];
	seen[queue[0]] = 1;
	for (uint32_t i = 0; i < count; i++)
		for (uint32_t a = instance->first[queue[i]]; a < instance->first[queue[i] + 1]; a++)
			if (keep[instance->edge[a]] && !seen[instance->head[a]]) {
				seen[instance->head[a]] = 1;
				queue[count++] = instance->head[a];
			}
	for (uint32_t t = 0; t < instance->terminal_count; t++)
		if (!seen[instance->terminal[t]])
			return false;
	for (uint32_t e = 0; e < instance->edge_count; e++)
		keep[e] = keep[e] && seen[instance->ends[2 * e]];
	return true;
}

/* The same, with scratch of its own. */
static enum tw_status find_component(struct search *search, uint8_t *keep, bool *is_connected)
{
	const struct arena_mark mark = arena_mark(search->arena);
	const uint32_t n = search->instance.vertex_count;
	uint32_t *queue = ARENA_ARRAY(search->arena, n, uint32_t);
	uint8_t *seen = ARENA_ZEROED(search->arena, n, uint8_t);
	const enum tw_status status = queue && seen ? TW_OK : TW_ERROR_MEMORY;
	*is_connected = status == TW_OK && keep_component(&search->instance, keep, queue, seen);
	arena_release(search->arena, mark);
	search->work += search->instance.edge_count / 8 + 1;
	return status;
}

/* What is spent on a part. */
struct account {
	uint64_t began, end; /* search->work */
	uint64_t on_bounds, on_program;
};

/* Sets the budget to `most`, but no more than is left. */
static void allow(struct search *part, const struct account *account, uint64_t most)
{
	const uint64_t left = account->end > part->work ? account->end - part->work : 1;
	search_set_budget(part, most < left ? most : left);
}

/* Raises the bound until as much has been spent on bounds as on the program. */
static enum tw_status raise_some(struct search *part, struct raise *raise, struct dual *dual, struct account *account)
{
	enum tw_status status;
	fine_t gain, before;
	allow(part, account, UINT64_MAX);
	do {
		before = dual_fine_bound(dual);
		status = raise_bound(raise, part, dual, SEARCH_SHARE * (uint64_t)part->instance.edge_count, 0);
		gain = dual_fine_bound(dual) - before;
		account->on_bounds = part->work - account->began - account->on_program;
	} while (status == TW_OK && !search_is_proven(part) && account->on_bounds < account->on_program &&
		 gain > before / RISING_PART);
	return status;
}

static enum tw_status take_turns(struct search *part, uint64_t effort)
{
	struct account account = {.began = part->work, .end = part->work + effort};
	struct raise raise = {0};
	struct dual dual;
	allow(part, &account, UINT64_MAX);
	enum tw_status status = dual_ascend_best(&dual, part, ASCENT_SHARE * (uint64_t)part->instance.edge_count);
	while (status == TW_OK && !search_is_proven(part)) {
		status = raise_some(part, &raise, &dual, &account);
		if (status != TW_OK || search_is_proven(part))
			break;
		allow(part, &account, account.on_bounds);
		status = guess_solve(part, &dual);
		account.on_program = part->work - account.began - account.on_bounds;
		if (status == TW_ERROR_CANCELLED && !part->stop && part->work < account.end)
			status = TW_OK;
	}
	search_set_budget(part, 0);
	/* Out of effort. */
	return status == TW_ERROR_CANCELLED && !part->stop ? TW_OK : status;
}

static enum tw_status solve(struct search *part, uint64_t effort)
{
	enum tw_status status = reduce_instance(part);
	if (status == TW_OK && part->instance.terminal_count > 1)
		return take_turns(part, effort);
	if (status == TW_OK)
		status = search_offer(part, NULL, 0);
	if (status == TW_OK)
		search_close(part);
	return status;
}

enum tw_status part_solve(struct search *search, uint8_t *keep, uint64_t effort, bool *is_solved)
{
	const struct arena_mark mark = arena_mark(search->arena);
	struct steiner_stats stats = {0};
	struct search part;
	bool is_connected;
	*is_solved = false;
	enum tw_status status = find_component(search, keep, &is_connected);
	if (status == TW_OK && is_connected) {
		status = search_open_part(&part, search, keep, &stats);
		if (status == TW_OK)
			status = solve(&part, effort);
		*is_solved = status == TW_OK && search_is_proven(&part);
		const enum tw_status closed = search_close_part(&part, search);
		status = status == TW_OK ? closed : status;
	}
	arena_release(search->arena, mark);
	return status;
}
