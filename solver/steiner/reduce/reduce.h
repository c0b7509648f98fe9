/* Reductions: the instance is replaced by a smaller one with the same optimum, without looking at duals. */
#ifndef SOLVER_STEINER_REDUCE_REDUCE_H
#define SOLVER_STEINER_REDUCE_REDUCE_H

#include "solver/steiner/search.h"

/* Applies the tests until they gain little, and replaces search->instance. With one terminal left the instance is
 * solved: the taken origins are the tree. Sound for any weights, ties and zeros included. May use the best tree's
 * weight (search_cutoff). TW_ERROR_MEMORY leaves the instance as it was; TW_ERROR_CANCELLED when the search must stop.
 */
enum tw_status reduce_instance(struct search *search) TW_NODISCARD;

#endif
