/* The exact stages in turn, each with a budget, until one of them has the proof. */
#ifndef SOLVER_STEINER_PROVE_H
#define SOLVER_STEINER_PROVE_H

#include "solver/steiner/dual/dual.h"
#include "solver/steiner/search.h"

/* Solves search->instance to a proof. `dual` belongs to it and gets better on the way. TW_ERROR_MEMORY,
 * TW_ERROR_CANCELLED when the search must stop. */
enum tw_status prove_optimum(struct search *search, struct dual *dual) TW_NODISCARD;

#endif
