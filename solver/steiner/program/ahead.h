/* Growing terminal sets ahead of their turn, on several threads. For dp.c only.
 *
 * Sets of one size do not depend on each other, so that the next of them can be grown at once; what came of them waits
 * for its turn. A set that was not grown ahead, for want of memory, say, is grown when its turn comes, and the outcome
 * is the same. So threads change nothing but speed: trees, bounds and work are those of a single thread. */
#ifndef SOLVER_STEINER_PROGRAM_AHEAD_H
#define SOLVER_STEINER_PROGRAM_AHEAD_H

#include "solver/steiner/program/grow.h"

/* What came of a set. */
struct dp_grown {
	uint64_t work;                 /* units that its growth took */
	const struct dp_label *labels; /* [useful] borrowed */
	const struct dp_trail *trails; /* [count] borrowed; NULL: it was not grown */
	uint32_t useful, count;
};

/* Starts `grower` on the set: dp_grow_start and its start labels. Called by several threads at once; `member` is room
 * for the set's terminals. */
typedef void dp_ahead_start(void *context, struct dp_grower *grower, uint32_t set, uint32_t *member);

struct dp_ahead;

/* Sets up at most `threads` - 1 helper threads for `grower`, whose thread works with them; *ahead becomes NULL where
 * none is wanted or fits. Their memory comes from malloc, no more than a quarter of `memory_limit` (0: none). */
void dp_ahead_new(struct dp_ahead **ahead, struct dp_grower *grower, unsigned threads, size_t memory_limit);
void dp_ahead_free(struct dp_ahead *ahead); /* NULL is allowed */

/* Grows some sets of the list that begins with `first`: next(context, set) is the one after it, INSTANCE_NONE at the
 * end. Forgets those that were grown before. */
typedef uint32_t dp_ahead_next(void *context, uint32_t set);
void dp_ahead_grow(struct dp_ahead *ahead, uint32_t first, dp_ahead_next *next, dp_ahead_start *start, void *context);

/* What came of the set whose turn it is, in the order of dp_ahead_grow; NULL when it was not grown ahead. */
const struct dp_grown *dp_ahead_take(struct dp_ahead *ahead, uint32_t set);

/* Whether all that were grown are taken, so that it is time for the next. */
int dp_ahead_is_empty(const struct dp_ahead *ahead);

#endif
