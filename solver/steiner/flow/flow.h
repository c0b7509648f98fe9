/* The flow dual: a multicommodity flow that splits the costs of arcs among the terminals, near the optimum of the
 * directed cut relaxation's dual after some dozen iterations.
 *
 * A commodity for each terminal but the root. Its potential p is 0 at the root; on an edge (u, v) of cost c it asks for
 * w = (p(u) - p(v)) / c of the cost: of the arc u -> v where positive, of v -> u where negative. All commodities
 * together may ask for no more than each arc costs: w in K = {sum of w+ <= 1, sum of w- <= 1}. To be maximised is the
 * sum of -p(t) over the commodities' own terminals t. (R. T. Wong 1984; in this form the dual of the multicommodity
 * flow formulation.) Any split of the costs is a valid bound, whoever found it: flow_split makes balls of it (dual.h),
 * in integers, so that errors of floats cost a little of the bound but never make it wrong.
 *
 * Found by ADMM (S. Boyd et al., Distributed optimization and statistical learning via the alternating direction method
 * of multipliers, Found. Trends Mach. Learn. 3, 2011) with the penalty omega / c, so that w is relative to the costs.
 * An iteration solves a Laplacian for all commodities at once, whose factor stays the same, and projects on K edge by
 * edge (sweep.c). */
#ifndef SOLVER_STEINER_FLOW_FLOW_H
#define SOLVER_STEINER_FLOW_FLOW_H

#include "solver/steiner/dual/dual.h"
#include "solver/steiner/search.h"

struct flow;

/* Sets up a flow for search->instance with the root and the costs of `dual`, which it does not keep. Everything is
 * allocated from search->arena. TW_ERROR_MEMORY: it does not fit, or its factor would be too dense to be worth it.
 * TW_ERROR_LIMIT: too little is left of a limit of work. TW_ERROR_CANCELLED: the search must stop. */
enum tw_status flow_new(struct flow **flow, struct search *search, const struct dual *dual) TW_NODISCARD;

/* Some iterations. TW_ERROR_CANCELLED between two of them when the search must stop. */
enum tw_status flow_iterate(struct flow *flow, struct search *search, uint32_t iterations) TW_NODISCARD;

/* Fills `dual`, which was set up for search->instance with the flow's root, with a ball for each commodity, as the
 * flow splits the costs, and another where a terminal can grow further. The instance may have fewer edges than the flow
 * knows. The bound is not monotone from one split to the next. TW_ERROR_MEMORY, TW_ERROR_CANCELLED. */
enum tw_status flow_split(struct flow *flow, struct search *search, struct dual *dual) TW_NODISCARD;

/* Splits into a dual like *dual, of search->instance and the flow's root, which *dual becomes if it is better: what an
 * interrupted split has found is a bound, too. *bound (may be NULL): the complete split's, fine; 0 without one. Errors
 * as flow_split. */
enum tw_status flow_raise_dual(struct flow *flow, struct search *search, struct dual *dual, fine_t *bound) TW_NODISCARD;

/* Carries the flow over to search->instance, which has lost edges by deletion (not by reductions) since it was set up.
 * After TW_ERROR_MEMORY, TW_ERROR_LIMIT and TW_ERROR_CANCELLED *flow is as before. */
enum tw_status flow_shrink(struct flow **flow, struct search *search, const struct dual *dual) TW_NODISCARD;

/* Edges that the flow was set up for; about how many members its balls will have; the work of an iteration,
 * and about that of a split. */
uint32_t flow_edges(const struct flow *flow);
size_t flow_members(const struct flow *flow);
uint64_t flow_work(const struct flow *flow);
uint64_t flow_split_work(const struct flow *flow);

/* The share of each edge's cost that the flow has a price on is 0 to 1: near 1 where trees of the optimum run, and 0 on
 * most edges. Marks the edges of search->instance of which it is above `least`: keep[edge] becomes 1, or stays. */
void flow_mark_used(const struct flow *flow, const struct search *search, float least, uint8_t *keep);

#endif
