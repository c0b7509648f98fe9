/* Purpose: what the commodities own, edge by edge for a split, which wants it commodity by commodity.
 *
 * A commodity's share of an edge is w = z - clamp(z, -mu-, mu+). Projection may leave the shares' sum above 1: then all
 * give up the same part of theirs. They are rounded to the nearest unit, so that what rounding adds and takes away
 * cancels. Vectors of four are what every machine has; no lane depends on another. */
#include "solver/steiner/flow/share.h"

#include <math.h>

typedef float floats __attribute__((vector_size(16), may_alias));
typedef int32_t integers __attribute__((vector_size(16), may_alias));

enum { WIDTH = 4, VECTORS = LANES_BLOCK / WIDTH };

static inline floats all_of(float x)
{
	return (floats){x, x, x, x};
}

static inline floats above_zero(floats x)
{
	const integers mask = x > all_of(0);
	return (floats)(mask & (integers)x);
}

/* Adds a row's w+ and w- to one sum for each lane of a block. */
static inline void add_row(const floats *z, uint32_t vectors, struct flow_price price, floats *forward,
			   floats *backward)
{
	const floats most = all_of(price.forward), least = all_of(-price.backward);
	for (uint32_t i = 0; i < vectors; i += VECTORS)
		for (uint32_t j = 0; j < VECTORS; j++) {
			forward[j] += above_zero(z[i + j] - most);
			backward[j] += above_zero(least - z[i + j]);
		}
}

/* One fixed order of additions. */
static inline float sum_of(const floats *x)
{
	float sum = 0;
	for (uint32_t j = 0; j < VECTORS; j++)
		sum += (x[j][0] + x[j][1]) + (x[j][2] + x[j][3]);
	return sum;
}

void flow_sum_shares(struct flow_split *split, const struct flow *flow)
{
	for (uint32_t i = 0; i < split->edge_count; i++) {
		const size_t slot = split->edge[i].slot;
		floats forward[VECTORS] = {0}, backward[VECTORS] = {0};
		add_row((const floats *)(flow->z + slot * flow->stride), flow->stride / WIDTH, flow->price[slot],
			forward, backward);
		const float sum[2] = {sum_of(forward), sum_of(backward)};
		for (uint32_t back = 0; back < 2; back++) {
			struct flow_side *side = &split->edge[i].side[back];
			side->scale = sum[back] > 1 ? 1 / sum[back] : 1;
			side->asked = sum[back] > 1 ? 1 : sum[back];
		}
	}
}

uint32_t flow_asked(float asked, uint32_t cost)
{
	const double units = ceil((double)asked * cost);
	return units < cost ? (uint32_t)units : cost;
}

void flow_own_shares(struct flow_split *split, const struct flow *flow, uint32_t first)
{
	const size_t m = split->edge_count;
	const floats half = all_of(0.5F);
	const uint32_t left = flow->stride - first, vectors = (left < SPLIT_BLOCK ? left : SPLIT_BLOCK) / WIDTH;
	for (uint32_t i = 0; i < m; i++) {
		const struct flow_split_edge *edge = &split->edge[i];
		const floats *const z = (const floats *)(flow->z + (size_t)edge->slot * flow->stride + first);
		const struct flow_price price = flow->price[edge->slot];
		const floats most = all_of(price.forward), least = all_of(-price.backward);
		const floats forward = all_of(edge->cost * edge->side[0].scale);
		const floats backward = all_of(edge->cost * edge->side[1].scale);
		for (uint32_t j = 0; j < vectors; j++) {
			const floats up = above_zero(z[j] - most) * forward + half;
			const floats down = above_zero(least - z[j]) * backward + half;
			const integers own =
				__builtin_convertvector(up, integers) - __builtin_convertvector(down, integers);
			for (uint32_t lane = 0; lane < WIDTH; lane++)
				split->own[(WIDTH * j + lane) * m + i] = own[lane];
		}
	}
}
