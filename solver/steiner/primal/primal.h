/* Primal heuristics: good trees soon. Each tree goes to search_offer. */
#ifndef SOLVER_STEINER_PRIMAL_PRIMAL_H
#define SOLVER_STEINER_PRIMAL_PRIMAL_H

#include "solver/steiner/dual/dual.h"
#include "solver/steiner/search.h"

/* A first tree, by a shortest-path heuristic: some milliseconds at 23,500 vertices. */
enum tw_status primal_first(struct search *search) TW_NODISCARD;

/* Better trees: starts from the best one and from shortest-path heuristics guided by the reduced costs of `dual` (may
 * be NULL; it belongs to the present instance), then exchanges and recombines. `effort`: work units to spend,
 * about. */
enum tw_status primal_improve(struct search *search, const struct dual *dual, uint64_t effort) TW_NODISCARD;

#endif
