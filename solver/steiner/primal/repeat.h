/* Good trees of small and dense graphs: a path heuristic from many starts. */
#ifndef SOLVER_STEINER_PRIMAL_REPEAT_H
#define SOLVER_STEINER_PRIMAL_REPEAT_H

#include "solver/steiner/search.h"

/* Grows a tree from each of several vertices, terminals first, by the costs `cost` [edge_count], and offers the
 * lightest spanning trees of their vertices; in small dense graphs it improves them by exchanging vertices, and spends
 * half of the effort on wandering from the lightest. Ends after about `effort` work units, but not before the first
 * tree. `skip`: starts to leave out, so that repeated calls try others. TW_ERROR_MEMORY, TW_ERROR_CANCELLED. */
enum tw_status primal_repeat(struct search *search, const fine_t *cost, uint32_t skip, uint64_t effort) TW_NODISCARD;

/* Whether the graph is small, and each vertex sees so many others that vertices are exchanged: then more effort pays.
 */
bool primal_repeat_is_dense(const struct instance *instance);

#endif
