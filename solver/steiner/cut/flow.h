/* Separation: finds cuts that a fractional solution violates. */
#ifndef SOLVER_STEINER_CUT_FLOW_H
#define SOLVER_STEINER_CUT_FLOW_H

#include "solver/steiner/cut/problem.h"

/* Adds violated cuts of the solution x [arc_count] to the pool, from maximum flows from the root to every target. Adds
 * none only if no cut is violated by more than a small tolerance (or the pool is full: *full). TW_ERROR_MEMORY,
 * TW_ERROR_CANCELLED. */
enum tw_status cut_separate(const struct cut_problem *problem, const double *x, struct cut_pool *pool,
			    int *full) TW_NODISCARD;

#endif
