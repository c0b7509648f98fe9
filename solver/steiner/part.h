/* Good trees out of a few edges: a part of the instance, solved as an instance of its own. */
#ifndef SOLVER_STEINER_PART_H
#define SOLVER_STEINER_PART_H

#include "solver/steiner/search.h"

/* Looks for the lightest tree of the edges with keep[edge] != 0, with about `effort` work units, and offers it.
 * *is_solved: the search has a tree at least as light as that. Edges that are apart from the terminals do not
 * count; `keep` is overwritten. TW_ERROR_MEMORY, TW_ERROR_CANCELLED when the search must stop. */
enum tw_status part_solve(struct search *search, uint8_t *keep, uint64_t effort, bool *is_solved) TW_NODISCARD;

#endif
