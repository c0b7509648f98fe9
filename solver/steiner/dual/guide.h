/* The tree that guides the dual. For the dual's own files. */
#ifndef SOLVER_STEINER_DUAL_GUIDE_H
#define SOLVER_STEINER_DUAL_GUIDE_H

#include "solver/steiner/dual/dual.h"

/* Something that keeps the bound below the guide's weight, by `loss`: balls of the terminal that the guide enters more
 * than once, above `level` of the terminal's value; or an arc of the guide above the terminal with a cost that is left
 * (level UINT64_MAX). */
struct dual_fault {
	uint64_t loss;
	uint64_t level;
	uint32_t terminal;
};

/* Room for the guide and its faults; for dual_init and dual_transfer. The dual has no guide yet. */
enum tw_status dual_guide_allocate(struct dual *dual, struct search *search) TW_NODISCARD;

/* Makes the best tree the guide; there is none when the instance does not hold all of the tree, or when guiding is
 * switched off. TW_ERROR_MEMORY only. */
enum tw_status dual_guide(struct dual *dual, struct search *search) TW_NODISCARD;

/* Fills dual->fault. The losses sum to what the bound is below the guide's weight, but for those that did not fit. */
void dual_find_faults(struct dual *dual, struct search *search);

/* Around the vertices of a ball, one by one as they are settled: in how many parts the ball cuts the guide. Each of
 * them is entered by one arc of the guide. `inside` is to be wiped by dual_guide_leave. */
static inline int32_t dual_guide_parts(const struct dual *dual, uint32_t v)
{
	int32_t parts = dual->guide_first[v + 1] > dual->guide_first[v];
	for (uint32_t i = dual->guide_first[v]; i < dual->guide_first[v + 1]; i++)
		parts -= dual->inside[dual->guide_next[i]];
	return parts;
}

#endif
