/* The step of an iteration that looks at every edge. For the flow's own files. */
#ifndef SOLVER_STEINER_FLOW_SWEEP_H
#define SOLVER_STEINER_FLOW_SWEEP_H

#include "solver/steiner/flow/state.h"

/* From flow->potential: new z and prices, and the right-hand side of the next iteration in flow->next. `shrink`: what u
 * is multiplied by afterwards, because omega grows: 1 for not at all. The
 * number of threads never changes a bit. */
void flow_sweep(struct flow *flow, float shrink, unsigned threads);

/* The right-hand side alone, from z and prices as they are. */
void flow_restore(struct flow *flow);

#endif
