/* Separation of the inequalities of the flow, which need no maximum flows. */
#ifndef SOLVER_STEINER_CUT_BALANCE_H
#define SOLVER_STEINER_CUT_BALANCE_H

#include "solver/steiner/cut/problem.h"

/* Adds those that the solution x [arc_count] violates most, two for each vertex at most, as long as there is room.
 * TW_ERROR_CANCELLED. */
enum tw_status cut_separate_flow(const struct cut_problem *problem, const double *x,
				 struct cut_pool *pool) TW_NODISCARD;

#endif
