/* What a warm state keeps of the flow that made its lanes: some iterations from there find a bound for which a flow
 * from scratch takes some dozen. */
#ifndef SOLVER_STEINER_WARM_MEMORY_H
#define SOLVER_STEINER_WARM_MEMORY_H

#include "solver/steiner/flow/flow.h"
#include "solver/steiner/warm/lanes.h"

/* Keeps the flow in warm->arena, behind what is there; it was set up for search->instance, whose vertices are the
 * caller's vertex_of. Where it does not fit the budget, the state goes without. */
void warm_memory_keep(struct steiner_warm *warm, const struct search *search, const struct flow *flow,
		      const uint32_t *vertex_of);

/* Starts a new flow of search->instance, to which `lanes` were laid. False where there is nothing to start from.
 * TW_ERROR_MEMORY. */
enum tw_status warm_memory_start(const struct warm_lanes *lanes, struct search *search, struct flow *flow,
				 bool *has_started) TW_NODISCARD;

#endif
