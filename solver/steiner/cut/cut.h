/* The exact fallback for instances on which dynamic programming would blow up: branch and cut with a linear program. */
#ifndef SOLVER_STEINER_CUT_CUT_H
#define SOLVER_STEINER_CUT_CUT_H

#include "solver/steiner/search.h"

struct cut_search;

/* Sets up a branch and cut for search->instance, which must have two terminals or more and stay as it is. Allocated
 * from search->arena; cut_close in any case. TW_ERROR_MEMORY, TW_ERROR_UNSUPPORTED (the linear program is too large).
 */
enum tw_status cut_open(struct cut_search **cut, struct search *search) TW_NODISCARD;

/* Goes on where it was interrupted, until there is a proof, or until the search stops (TW_ERROR_CANCELLED); trees go to
 * search_offer, bounds to search_bound. search->instance is as it was at cut_open. TW_ERROR_MEMORY. */
enum tw_status cut_run(struct cut_search *cut) TW_NODISCARD;

/* NULL is allowed. */
void cut_close(struct cut_search *cut);

#endif
