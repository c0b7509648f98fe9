/* Purpose: carry what a flow found to another flow, edge by edge. */
#include "solver/steiner/flow/carry.h"

#include "solver/steiner/flow/state.h"
#include "solver/steiner/flow/sweep.h"

struct flow_seed flow_seed_of(const struct flow *flow, uint32_t edge)
{
	const uint32_t slot = flow->slot[edge];
	return (struct flow_seed){
		.z = flow->z + (size_t)slot * flow->stride,
		.forward = flow->price[slot].forward,
		.backward = flow->price[slot].backward,
	};
}

void flow_sow(struct flow *flow, uint32_t edge, const struct flow_seed *seed)
{
	const uint32_t slot = flow->slot[edge];
	float *z = flow->z + (size_t)slot * flow->stride;
	for (uint32_t i = 0; i < flow->commodity_count; i++)
		z[i] = seed->z[i];
	flow->price[slot] = (struct flow_price){seed->forward, seed->backward};
}

struct flow_pace flow_pace_of(const struct flow *flow)
{
	return (struct flow_pace){flow->omega, flow->iteration};
}

void flow_resume(struct flow *flow, struct flow_pace pace)
{
	flow->omega = pace.omega;
	flow->iteration = pace.iteration;
	flow_restore(flow);
}

uint32_t flow_terminal_of(const struct flow *flow, uint32_t commodity)
{
	return flow_terminal(flow, commodity);
}
