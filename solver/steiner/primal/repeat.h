/* Good trees of small and dense graphs: a path heuristic from many starts. */
#ifndef SOLVER_STEINER_PRIMAL_REPEAT_H
#define SOLVER_STEINER_PRIMAL_REPEAT_H

#include "solver/steiner/search.h"

/* Grows a tree from each of several vertices, terminals first, by the costs `cost` [edge_count], and offers the
 * lightest spanning trees of their vertices. Ends after about `effort` work units, but not before the first tree.
 * `skip`: starts to leave out, so that repeated calls try others. TW_ERROR_MEMORY, TW_ERROR_CANCELLED. */
enum tw_status primal_repeat(struct search *search, const fine_t *cost, uint32_t skip, uint64_t effort) TW_NODISCARD;

#endif
