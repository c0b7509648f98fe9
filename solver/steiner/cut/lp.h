/* The linear program of the branch and cut, and the bound that it proves. */
#ifndef SOLVER_STEINER_CUT_LP_H
#define SOLVER_STEINER_CUT_LP_H

#include "solver/steiner/cut/problem.h"

struct cut_lp {
	void *model; /* Clp_Simplex, owned */
	const struct cut_problem *problem;
	struct cut_pool *pool; /* borrowed: the rows */
	uint32_t row_count;    /* rows of the pool that are in the program */
	uint8_t *idle;         /* [pool capacity] rounds that the row has been slack */
	int64_t *reduced;      /* [arc_count] reduced costs that belong to `bound` */
	int64_t bound;         /* proven: fraction_bits behind the point; 0 if none is */
	double *x;             /* [arc_count] the last solution */
	double *upper;         /* [arc_count] */
	int exponent;          /* the program's costs are problem->cost * 2^-exponent */
	size_t charged;        /* bytes that the program is reckoned to hold, counted in the search's arena */
	int is_solved;         /* x is an optimum of the program */
};

/* TW_ERROR_MEMORY. Close with cut_lp_free in any case. */
enum tw_status cut_lp_init(struct cut_lp *lp, const struct cut_problem *problem, struct cut_pool *pool) TW_NODISCARD;
void cut_lp_free(struct cut_lp *lp);

/* Brings rows and bounds up to date with pool and problem->allowed, solves, and proves a bound from the prices. It may
 * stop, with is_solved == 0, when the bound reaches `enough` (INT64_MAX: do not). TW_ERROR_CANCELLED, TW_ERROR_MEMORY.
 */
enum tw_status cut_lp_solve(struct cut_lp *lp, int64_t enough) TW_NODISCARD;

/* A basis to come back to. */
struct cut_basis {
	uint8_t *column; /* [arc_count] NULL: nothing is remembered */
	uint32_t *row;   /* [row_count] numbers of rows that are not basic, ascending */
	uint32_t row_count;
};

/* Remembers the program's basis and pins its rows; recalls it once, and lets the rows go. *basis keeps its arrays, zero
 * in the beginning, for the next time; without memory nothing is remembered. */
void cut_lp_remember(struct cut_lp *lp, struct cut_basis *basis);
void cut_lp_recall(struct cut_lp *lp, struct cut_basis *basis);

/* Drops rows of the pool: all with drop[row] != 0. */
enum tw_status cut_lp_drop(struct cut_lp *lp, const uint8_t *drop) TW_NODISCARD;

#endif
