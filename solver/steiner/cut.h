/* The exact fallback for instances on which dynamic programming would blow up: branch and cut with a linear program. */
#ifndef SOLVER_STEINER_CUT_H
#define SOLVER_STEINER_CUT_H

#include "solver/steiner/search.h"

/* Solves search->instance to a proof, or until the search stops (TW_ERROR_CANCELLED); trees go to search_offer, bounds
 * to search_bound. TW_ERROR_MEMORY, TW_ERROR_UNSUPPORTED (the linear program is too large). */
enum tw_status cut_solve(struct search *search) TW_NODISCARD;

#endif
