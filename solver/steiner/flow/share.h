/* What the commodities own of the arcs' costs, in whole coarse units. For the flow's own files. */
#ifndef SOLVER_STEINER_FLOW_SHARE_H
#define SOLVER_STEINER_FLOW_SHARE_H

#include "solver/steiner/flow/state.h"

/* Fills in, for all edges that the split is about, what share of the cost the commodities ask for together, and by what
 * theirs are to be scaled so that it is no more than all. */
void flow_sum_shares(struct flow_split *split, const struct flow *flow);

/* Fills split->own with what the next SPLIT_BLOCK commodities from `first` on, a multiple of it, own of each edge. Over
 * all commodities that sums to about flow_asked, for either arc. */
void flow_own_shares(struct flow_split *split, const struct flow *flow, uint32_t first);

/* What a share of the cost is in whole units, rounded up. */
uint32_t flow_asked(float asked, uint32_t cost);

#endif
