/* The step of an iteration that looks at every edge. For the flow's own files. */
#ifndef SOLVER_STEINER_FLOW_SWEEP_H
#define SOLVER_STEINER_FLOW_SWEEP_H

#include "solver/steiner/flow/state.h"

/* For the edges of one part (flow->part_edge), or of the top: from flow->potential new z and prices, and the part's
 * rows of flow->next, its copies' among them: the right-hand side of the next iteration. `shrink`: what u is multiplied
 * by afterwards, because omega grows: 1 for not at all. Calls for different parts do not depend on one another. */
void flow_sweep(struct flow *flow, uint32_t part, float shrink);

/* The right-hand side alone, of all parts, from z and prices as they are. */
void flow_restore(struct flow *flow);

/* The loops, a variant for each instruction set (solver/linear/isa.h). */
struct sweep_kernels {
	void (*sweep)(struct flow *flow, uint32_t first, uint32_t end, float shrink);
	void (*scatter)(struct flow *flow, uint32_t first, uint32_t end);
};
extern const struct sweep_kernels sweep_kernels_base, sweep_kernels_avx2, sweep_kernels_avx512;

#endif
