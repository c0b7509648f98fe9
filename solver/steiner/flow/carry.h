/* What a flow knows of its edges, for another flow to start from: on another instance, with other terminals. */
#ifndef SOLVER_STEINER_FLOW_CARRY_H
#define SOLVER_STEINER_FLOW_CARRY_H

#include "solver/steiner/flow/flow.h"

/* Of one edge, in the direction ends[0] -> ends[1]. Back, z changes its sign and the prices their places. */
struct flow_seed {
	const float *z;          /* a number for each commodity; borrowed */
	float forward, backward; /* prices; they hold for the penalty of flow_pace */
};

struct flow_pace {
	float omega; /* the penalty that the iterations have come to */
	uint32_t iteration;
};

/* `edge`: of the instance that the flow was set up for. */
struct flow_seed flow_seed_of(const struct flow *flow, uint32_t edge);
struct flow_pace flow_pace_of(const struct flow *flow);

/* Into a flow that has not iterated yet: edges without a seed begin with 0. flow_resume comes last. */
void flow_sow(struct flow *flow, uint32_t edge, const struct flow_seed *seed);
void flow_resume(struct flow *flow, struct flow_pace pace);

/* The commodity's terminal, of the instance's. */
uint32_t flow_terminal_of(const struct flow *flow, uint32_t commodity);

#endif
