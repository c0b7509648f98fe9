/* The loop that ties dual bound, deletion and dynamic program together by guessed upper bounds. */
#ifndef SOLVER_STEINER_GUESS_H
#define SOLVER_STEINER_GUESS_H

#include "solver/steiner/dual.h"
#include "solver/steiner/search.h"

/* Proves an optimum of search->instance, whose dual is `dual`, unless the search stops (TW_ERROR_CANCELLED) or the
 * program needs more labels than `label_limit` (TW_ERROR_LIMIT; 0: no limit). */
enum tw_status guess_solve(struct search *search, struct dual *dual, uint64_t label_limit) TW_NODISCARD;

#endif
