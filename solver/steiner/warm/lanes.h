/* A warm state's lanes, laid on the graph as it is: a dual of it, whose balls can be had where they are needed. */
#ifndef SOLVER_STEINER_WARM_LANES_H
#define SOLVER_STEINER_WARM_LANES_H

#include "solver/steiner/dual/dual.h"
#include "solver/steiner/warm/state.h"

struct warm_lanes {
	const struct steiner_warm *warm;
	uint32_t *vertex_of; /* [vertex_count of the instance] the caller's */
	int32_t **row;       /* [likewise] potentials, borrowed from the state or new; NULL: not known yet */
	uint32_t *lane_of;   /* [terminal_count] the lane of each terminal; INSTANCE_NONE: it has none */
	uint32_t *flow_of;   /* [terminal_count] the lane whose flow the terminal's begins with, its own or another's */
	int32_t *most;       /* [stride] a lane is cut off here; 0: it is given up */
};

/* Sets up a dual of search->instance, which is the caller's graph, without reductions: the lanes' values and what they
 * leave of the arcs' costs, but no balls. *fits: half of the terminals have lanes, and what these claim is true; else
 * the state is of no use here. TW_ERROR_MEMORY. */
enum tw_status warm_lanes_lay(struct warm_lanes *lanes, const struct steiner_warm *warm, struct search *search,
			      struct dual *dual, bool *fits) TW_NODISCARD;

/* Adds the lanes as balls to `left`, a dual without them of search->instance, which has lost vertices and edges by
 * deletion since. TW_ERROR_MEMORY. */
enum tw_status warm_lanes_make_balls(const struct warm_lanes *lanes, struct search *search,
				     struct dual *left) TW_NODISCARD;

#endif
