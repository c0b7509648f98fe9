/* Purpose: deletion by reduced costs.
 *
 * Polzin & Vahdati Daneshmand, Improved algorithms for the Steiner problem in networks (Discrete Appl. Math. 112,
 * 2001). Directed away from the root, a tree weighs at least the dual bound plus the reduced costs of its arcs, as it
 * enters every cut at least once. If it uses the arc u -> v, it contains a path from the root to u, and one from v to a
 * terminal: every non-terminal of a tree without bare ends has a terminal below. An edge goes when both its directions
 * cost too much. All figures are rounded down, so that nothing goes that should not. */
#include "solver/steiner/reduce/fix.h"

#include <string.h>

uint32_t fix_room(const struct dual *dual, fine_t cutoff)
{
	const fine_t weight = (cutoff + ((fine_t)1 << dual->coarse_shift) - 1) >> dual->coarse_shift;
	const fine_t room = weight > dual->bound ? weight - dual->bound : 0;
	return room < DUAL_FAR ? (uint32_t)room : DUAL_FAR;
}

static uint32_t mark_edges(const struct dual *dual, const uint32_t *from_root, const uint32_t *to_terminal,
			   uint32_t room, uint8_t *keep)
{
	const struct instance *instance = dual->instance;
	uint32_t kept = 0;
	memset(keep, 0, instance->edge_count);
	for (uint32_t v = 0; v < instance->vertex_count; v++) {
		if (to_terminal[v] >= room)
			continue;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			uint64_t excess = (uint64_t)from_root[dual->arc[a].tail] + dual->arc[a].cost + to_terminal[v];
			kept += excess < room && !keep[instance->edge[a]];
			keep[instance->edge[a]] |= excess < room;
		}
	}
	return kept;
}

enum tw_status fix_by_reduced_costs(struct search *search, const struct dual *dual, fine_t cutoff, struct dual *next,
				    int *empty)
{
	return fix_if_worth(search, dual, cutoff, UINT32_MAX, next, empty);
}

enum tw_status fix_if_worth(struct search *search, const struct dual *dual, fine_t cutoff, uint32_t most,
			    struct dual *next, int *empty)
{
	struct instance *instance = &search->instance;
	struct arena *arena = search->arena;
	size_t n = instance->vertex_count;
	uint32_t *from_root = ARENA_ARRAY(arena, n, uint32_t);
	uint32_t *to_terminal = ARENA_ARRAY(arena, n, uint32_t);
	uint8_t *keep = ARENA_ARRAY(arena, instance->edge_count, uint8_t);
	if (!from_root || !to_terminal || !keep)
		return TW_ERROR_MEMORY;
	uint32_t room = fix_room(dual, cutoff);
	dual_from_root(dual, search, room, from_root);
	*empty = room == 0;
	for (uint32_t t = 0; t < instance->terminal_count; t++)
		*empty |= from_root[instance->terminal[t]] >= room;
	if (*empty)
		return TW_OK;
	dual_to_terminal(dual, search, room, to_terminal);
	if (mark_edges(dual, from_root, to_terminal, room, keep) > most)
		return TW_OK;
	uint32_t *number = from_root; /* not needed any more */
	enum tw_status status = instance_keep(instance, arena, keep, number);
	return status == TW_OK ? dual_transfer(next, search, dual, number) : status;
}
