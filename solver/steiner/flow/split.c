/* Purpose: the exact bound of a flow, and its prices.
 *
 * A commodity owns of every arc what its potentials ask for, in whole coarse units (share.c); what nobody asks for is
 * slack. One commodity after the other: a backward Dijkstra from its terminal on what it owns and the slack grows a
 * ball to the root. The ball takes what it needs, and what it does not need of its own becomes slack for those that
 * follow. In the end all terminals grow once more, by what rounding and balls left over. */
#include "solver/steiner/dual/ball.h"
#include "solver/steiner/flow/share.h"

#include <assert.h>
#include <string.h>

/* Which edges of the flow the instance still has, and where the dual keeps their arcs: in the row of the vertex that an
 * arc enters. */
static enum tw_status find_edges(struct flow *flow, struct search *search, const struct dual *dual)
{
	const struct instance *instance = dual->instance;
	struct flow_split *const split = &flow->split;
	const struct arena_mark mark = arena_mark(search->arena);
	uint32_t *at = ARENA_ARRAY(search->arena, flow->edge_count, uint32_t); /* by slot: the edge; then by edge */
	uint32_t *place = ARENA_ARRAY(search->arena, instance->edge_count, uint32_t);
	if (!at || !place) {
		arena_release(search->arena, mark);
		return TW_ERROR_MEMORY;
	}
	assert(instance->edge_count <= flow->edge_count);
	memset(at, 0xff, flow->edge_count * sizeof *at);
	for (uint32_t e = 0, i = 0; e < instance->edge_count; e++, i++) {
		while (flow->origin[i] != instance->origin[e])
			i++;
		assert(i < flow->edge_count);
		at[flow->slot[i]] = e;
	}
	split->edge_count = 0;
	for (uint32_t slot = 0; slot < flow->edge_count; slot++) {
		if (at[slot] == INSTANCE_NONE)
			continue;
		const uint32_t cost = coarse_of(instance->weight[at[slot]], dual->coarse_shift);
		place[at[slot]] = split->edge_count;
		split->edge[split->edge_count++] = (struct flow_split_edge){.slot = slot, .cost = (float)cost};
	}
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t e = instance->edge[a];
			split->edge[place[e]].side[instance->ends[2 * e] == v].arc = a;
		}
	arena_release(search->arena, mark);
	return TW_OK;
}

/* The dual's costs become the slack: what nobody asks for. */
static void leave_slack(struct flow_split *split, struct dual *dual)
{
	for (uint32_t i = 0; i < split->edge_count; i++)
		for (uint32_t back = 0; back < 2; back++) {
			struct flow_side *side = &split->edge[i].side[back];
			side->left = flow_asked(side->asked, dual->arc[side->arc].cost);
			dual->arc[side->arc].cost -= side->left;
		}
}

/* Puts what a commodity owns on top of the slack. */
static void add_own(struct flow_split *split, struct dual *dual, uint32_t commodity)
{
	const int32_t *own = split->own + commodity % SPLIT_BLOCK * (size_t)split->edge_count;
	for (uint32_t i = 0; i < split->edge_count; i++) {
		struct flow_side *side = &split->edge[i].side[own[i] < 0];
		const uint32_t wanted = own[i] < 0 ? 0 - (uint32_t)own[i] : (uint32_t)own[i];
		const uint32_t units = wanted < side->left ? wanted : side->left; /* whatever floats say */
		side->left -= units;
		dual->arc[side->arc].cost += units;
	}
}

/* What rounding left over. */
static void add_rest(const struct flow_split *split, struct dual *dual)
{
	for (uint32_t i = 0; i < split->edge_count; i++)
		for (uint32_t back = 0; back < 2; back++) {
			const struct flow_side *side = &split->edge[i].side[back];
			dual->arc[side->arc].cost += side->left;
		}
}

static enum tw_status grow_ball(struct flow *flow, struct search *search, struct dual *dual, uint32_t commodity)
{
	if (!dual_make_room(dual))
		return TW_ERROR_MEMORY;
	(void)dual_grow(dual, search, flow_terminal(flow, commodity), DUAL_FAR, 0);
	return search_spend(search, dual->instance->edge_count) ? TW_OK : TW_ERROR_CANCELLED;
}

enum tw_status flow_split(struct flow *flow, struct search *search, struct dual *dual)
{
	struct flow_split *const split = &flow->split;
	assert(dual->root == flow->root && dual->instance == &search->instance);
	enum tw_status status = dual_restart(dual, search, flow->root);
	if (status == TW_OK)
		status = find_edges(flow, search, dual);
	if (status != TW_OK)
		return status;
	flow_sum_shares(split, flow);
	leave_slack(split, dual);
	for (uint32_t k = 0; k < flow->commodity_count && status == TW_OK; k++) {
		if (k % SPLIT_BLOCK == 0)
			flow_own_shares(split, flow, k);
		add_own(split, dual, k);
		status = grow_ball(flow, search, dual, k);
	}
	/* Of an interrupted split, nobody gets what the others own. */
	add_rest(split, dual);
	return status == TW_OK ? dual_extend(dual, search) : status;
}

enum tw_status flow_raise_dual(struct flow *flow, struct search *search, struct dual *dual, fine_t *bound)
{
	const struct arena_mark mark = arena_mark(search->arena);
	struct dual rival;
	enum tw_status status = dual_init_like(&rival, search, dual, flow_members(flow));
	if (status == TW_OK)
		status = flow_split(flow, search, &rival);
	if (bound)
		*bound = status == TW_OK ? dual_fine_bound(&rival) : 0;
	if ((status == TW_OK || status == TW_ERROR_CANCELLED) && rival.bound > dual->bound)
		*dual = rival;
	else
		arena_release(search->arena, mark);
	return status;
}

void flow_mark_used(const struct flow *flow, const struct search *search, float least, uint8_t *keep)
{
	const struct instance *instance = &search->instance;
	for (uint32_t e = 0, i = 0; e < instance->edge_count; e++, i++) {
		while (flow->origin[i] != instance->origin[e])
			i++;
		const struct flow_price price = flow->price[flow->slot[i]];
		keep[e] |= flow->omega * (price.forward + price.backward) > least;
	}
}
