/* Where the dual loses: what keeps its bound below the guide's weight (complementary slackness, guide.h). A local
 * search that knows both losses sees at which terminals to try. */
#ifndef SOLVER_STEINER_DUAL_FAULT_H
#define SOLVER_STEINER_DUAL_FAULT_H

#include "solver/steiner/dual/dual.h"

/* Balls of the terminal that the guide enters more than once, above `level` of the terminal's value; or an arc of the
 * guide above the terminal with a cost that is left (level UINT64_MAX). */
struct dual_fault {
	uint64_t loss;
	uint64_t level;
	uint32_t terminal;
};

struct dual_faults {
	struct dual_fault *fault; /* [count] */
	uint32_t count, capacity;
	uint64_t sum; /* of the losses: what the bound is below the guide's weight, but for those that did not fit */
};

/* Room for the faults of a dual of search->instance, from search->arena. TW_ERROR_MEMORY. */
enum tw_status dual_faults_allocate(struct dual_faults **faults, struct search *search) TW_NODISCARD;

/* Fills dual->faults. */
void dual_find_faults(struct dual *dual, struct search *search);

#endif
