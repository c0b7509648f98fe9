/* Purpose: the exact bound of a flow, and its prices.
 *
 * A commodity owns of every arc what its potentials ask for, floor(w+ c) in whole coarse units, but in all no more than
 * the arc costs; the rest of the arc's cost is slack. One commodity after the other: a backward Dijkstra from its
 * terminal on what it owns and the slack grows a ball to the root. The ball takes what it needs, and what it does not
 * need of its own becomes slack for those that follow. */
#include "solver/steiner/dual/ball.h"
#include "solver/steiner/flow/state.h"

#include <assert.h>
#include <string.h>

/* Finds where each edge of the instance stands, and where the dual keeps its arcs: in the row of the vertex that an arc
 * enters. */
static void map_edges(struct flow *flow, const struct instance *instance)
{
	assert(instance->edge_count <= flow->edge_count);
	for (uint32_t e = 0, i = 0; e < instance->edge_count; e++, i++) {
		while (flow->origin[i] != instance->origin[e])
			i++;
		assert(i < flow->edge_count);
		flow->now[e] = flow->slot[i];
	}
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t e = instance->edge[a];
			flow->side[2 * e + (instance->ends[2 * e] == v)] = a;
		}
}

/* What the projection gives a commodity of the edge's cost: above zero of the arc ends[0] -> ends[1], below of the arc
 * back. */
static inline float share_of(const struct flow *flow, uint32_t slot, uint32_t commodity)
{
	const float z = flow->z[(size_t)slot * flow->stride + commodity];
	const struct flow_price price = flow->price[slot];
	return z > price.forward ? z - price.forward : z < -price.backward ? z + price.backward : 0;
}

static inline uint32_t whole_share(float share, uint32_t cost)
{
	const double whole = (double)share * cost;
	return whole < cost ? (uint32_t)whole : cost;
}

/* The dual's costs become the slack: what nobody asks for. */
static void leave_slack(struct flow *flow, struct dual *dual)
{
	for (uint32_t e = 0; e < dual->instance->edge_count; e++) {
		const uint32_t cost = dual->arc[flow->side[2 * e]].cost;
		uint64_t asked[2] = {0, 0};
		for (uint32_t k = 0; k < flow->commodity_count; k++) {
			const float share = share_of(flow, flow->now[e], k);
			asked[share < 0] += whole_share(share < 0 ? -share : share, cost);
		}
		for (uint32_t back = 0; back < 2; back++) {
			flow->left[2 * e + back] = cost;
			dual->arc[flow->side[2 * e + back]].cost =
				asked[back] < cost ? cost - (uint32_t)asked[back] : 0;
		}
	}
}

/* Puts what the commodity owns on top of the slack. */
static void add_own(struct flow *flow, struct dual *dual, uint32_t commodity)
{
	const struct instance *instance = dual->instance;
	for (uint32_t e = 0; e < instance->edge_count; e++) {
		const float share = share_of(flow, flow->now[e], commodity);
		if (share == 0)
			continue;
		const uint32_t arc = 2 * e + (share < 0);
		const uint32_t cost = coarse_of(instance->weight[e], dual->coarse_shift);
		uint32_t own = whole_share(share < 0 ? -share : share, cost);
		own = own < flow->left[arc] ? own : flow->left[arc];
		flow->left[arc] -= own;
		dual->arc[flow->side[arc]].cost += own;
		assert(dual->arc[flow->side[arc]].cost <= cost);
	}
}

enum tw_status flow_split(struct flow *flow, struct search *search, struct dual *dual)
{
	assert(dual->root == flow->root && dual->instance == &search->instance);
	const enum tw_status status = dual_restart(dual, search, flow->root);
	if (status != TW_OK)
		return status;
	map_edges(flow, dual->instance);
	leave_slack(flow, dual);
	for (uint32_t k = 0; k < flow->commodity_count; k++) {
		add_own(flow, dual, k);
		if (!dual_make_room(dual))
			return TW_ERROR_MEMORY;
		(void)dual_grow(dual, search, flow_terminal(flow, k), DUAL_FAR, 0);
		if (!search_spend(search, dual->instance->edge_count))
			return TW_ERROR_CANCELLED;
	}
	return TW_OK;
}

void flow_prices(const struct flow *flow, const struct search *search, fine_t *cost)
{
	const struct instance *instance = &search->instance;
	for (uint32_t e = 0, i = 0; e < instance->edge_count; e++, i++) {
		while (flow->origin[i] != instance->origin[e])
			i++;
		const struct flow_price price = flow->price[flow->slot[i]];
		const float used = flow->omega * (price.forward + price.backward);
		const uint32_t part = (uint32_t)(1004 * (used < 1 ? used : 1)); /* 98 per cent of 1024 */
		cost[e] = instance->weight[e] / 1024 * (1024 - part) + 1;
	}
}
