/* The exact core: dynamic programming over terminal sets. */
#ifndef SOLVER_STEINER_PROGRAM_DP_H
#define SOLVER_STEINER_PROGRAM_DP_H

#include "solver/steiner/dual/dual.h"
#include "solver/steiner/search.h"

/* Finds a minimum tree of search->instance among those with a fine weight below `cutoff`, and offers it. *found says
 * whether there is one; without, no tree of the instance is below the cutoff. `dual` (may be NULL) belongs to
 * the instance and prunes labels. TW_ERROR_MEMORY, TW_ERROR_CANCELLED when the search must stop. */
enum tw_status dp_solve(struct search *search, const struct dual *dual, fine_t cutoff, int *found) TW_NODISCARD;

#endif
