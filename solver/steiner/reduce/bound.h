/* Reductions by dual ascents: deletion by reduced costs, for graphs small enough to ascend from many roots. */
#ifndef SOLVER_STEINER_REDUCE_BOUND_H
#define SOLVER_STEINER_REDUCE_BOUND_H

#include "solver/steiner/search.h"

/* Ascends from several roots, offers the trees that the ascents lead to, and deletes from search->instance what no tree
 * below search_cutoff uses; then reduces, and all again, until little goes. Leaves large graphs alone. *empty: no such
 * tree is left (the instance is then of no use any more). Switched off with STEINER_FIXING. TW_ERROR_MEMORY,
 * TW_ERROR_CANCELLED. */
enum tw_status reduce_by_bounds(struct search *search, int *empty) TW_NODISCARD;

#endif
