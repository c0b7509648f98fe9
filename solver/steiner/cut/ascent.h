/* Dual ascent on whatever costs are left: a bound in exact integers, and cuts to begin with. */
#ifndef SOLVER_STEINER_CUT_ASCENT_H
#define SOLVER_STEINER_CUT_ASCENT_H

#include "solver/steiner/cut/problem.h"

/* Raises cuts until every target is reached from the root by arcs of cost 0. `cost` [arc_count], not negative, becomes
 * the reduced costs; *gain is what every arborescence of allowed arcs costs at least; INT64_MAX when there is none.
 * `pool` (may be NULL) receives the cuts, as long as there is room. TW_ERROR_MEMORY; TW_ERROR_CANCELLED. */
enum tw_status cut_ascend(const struct cut_problem *problem, int64_t *cost, struct cut_pool *pool,
			  int64_t *gain) TW_NODISCARD;

#endif
