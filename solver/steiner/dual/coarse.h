/* The dual's costs: *coarse*, fine weights shifted right by coarse_shift and rounded down to 32 bits. (x <<
 * coarse_shift) is the fine figure, still a lower bound. */
#ifndef SOLVER_STEINER_DUAL_COARSE_H
#define SOLVER_STEINER_DUAL_COARSE_H

#include "solver/steiner/fine.h"

/* More than any distance that matters: the best tree is lighter. */
#define DUAL_FAR (1u << 30)

/* What a fine weight is in coarse units. */
static inline uint32_t coarse_of(fine_t fine, unsigned coarse_shift)
{
	const fine_t cost = fine >> coarse_shift;
	return cost < DUAL_FAR ? (uint32_t)cost : DUAL_FAR;
}

#endif
