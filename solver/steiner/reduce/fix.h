/* Deletion by reduced costs. */
#ifndef SOLVER_STEINER_REDUCE_FIX_H
#define SOLVER_STEINER_REDUCE_FIX_H

#include "solver/steiner/dual/dual.h"
#include "solver/steiner/search.h"

/* By less than this, coarse, does a tree below `cutoff` exceed the dual bound. */
uint32_t fix_room(const struct dual *dual, fine_t cutoff);

/* Deletes from search->instance what no tree with a fine weight below `cutoff` uses, and sets up `next` with the balls
 * of `dual` for what is left (dual itself belongs to the old instance and must not be used any more). Every tree below
 * the cutoff survives. When the root and a terminal come apart, there is none: *empty. Then the instance is as it
 * was. After TW_ERROR_MEMORY neither dual may be used. */
enum tw_status fix_by_reduced_costs(struct search *search, const struct dual *dual, fine_t cutoff, struct dual *next,
				    int *empty) TW_NODISCARD;

/* The same, but if more than `most` edges would stay, all do: then `next` is not set up, and `dual` is as before. */
enum tw_status fix_if_worth(struct search *search, const struct dual *dual, fine_t cutoff, uint32_t most,
			    struct dual *next, int *empty) TW_NODISCARD;

#endif
