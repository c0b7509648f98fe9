/* The loop that ties deletion and dynamic program together by guessed upper bounds. */
#ifndef SOLVER_STEINER_GUESS_H
#define SOLVER_STEINER_GUESS_H

#include "solver/steiner/dual/dual.h"
#include "solver/steiner/search.h"

/* Proves an optimum of search->instance, whose dual is `dual`. TW_ERROR_CANCELLED when the search, or its budget, ends;
 * what was proven until then stays. TW_ERROR_MEMORY. */
enum tw_status guess_solve(struct search *search, const struct dual *dual) TW_NODISCARD;

#endif
