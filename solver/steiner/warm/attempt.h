/* A search from a warm state. */
#ifndef SOLVER_STEINER_WARM_ATTEMPT_H
#define SOLVER_STEINER_WARM_ATTEMPT_H

#include "solver/steiner/search.h"
#include "solver/steiner/warm/warm.h"

/* Looks for the proven optimum of search->instance, which is the caller's graph, as it came. *solved: it is the
 * search's best tree, and proven. Otherwise there is only little lost: the state has nothing to say here, or has grown
 * old, and the search is of no more use. TW_ERROR_MEMORY, TW_ERROR_CANCELLED, TW_ERROR_INTERNAL. */
enum tw_status warm_attempt(struct steiner_warm *warm, struct search *search, bool *solved) TW_NODISCARD;

/* Tells the state of an answer that came from scratch: from a proven one, it could be prepared. */
void warm_missed(struct steiner_warm *warm, const struct steiner_tree *tree);

#endif
