/* Growing and merging terminal sets ahead of their turn, on several threads. For dp.c only.
 *
 * Sets of one size do not depend on each other, so that the next of them can be grown at once, and then compared at
 * once with those that they could be merged with; what came of them waits for its turn. A set that was not grown or
 * compared ahead, for want of memory, say, is when its turn comes, and the outcome is the same. So threads change
 * nothing but speed: trees, bounds and work are those of a single thread. */
#ifndef SOLVER_STEINER_PROGRAM_AHEAD_H
#define SOLVER_STEINER_PROGRAM_AHEAD_H

#include "solver/steiner/program/grow.h"

/* Where a set and an earlier one can be merged, and for how much. */
struct dp_joint {
	fine_t cost;
	uint32_t vertex;
	uint32_t other; /* number of the earlier set */
};

/* What came of a set. */
struct dp_grown {
	uint64_t work;                 /* units that its growth took */
	uint64_t signature;            /* of its useful labels (dp.c) */
	const struct dp_label *labels; /* [useful] borrowed */
	const struct dp_trail *trails; /* [count] borrowed; NULL: it was not grown */
	uint32_t useful, count;
	uint32_t joint_count;
	const struct dp_joint *joints; /* [joint_count] borrowed; NULL: it was not compared */
	uint64_t merge_work;           /* units that comparing took */
};

/* Sets that are grown at once, in the order of their turns. */
struct dp_batch {
	const uint32_t *set;          /* [count] */
	const struct dp_grown *grown; /* [count] */
	uint32_t count;
};

/* Takes a joint; false when there is no room, which ends the comparison. */
typedef bool dp_take_joint(void *taker, const struct dp_joint *joint);

/* What there is to do for a set; all but `next` are called by several threads at once, and only read the context. */
struct dp_ahead_work {
	/* The set after this one, INSTANCE_NONE at the end. */
	uint32_t (*next)(const void *context, uint32_t set);
	/* Starts a grower on the set: dp_grow_start and its start labels; `member` is room for the set's terminals. */
	void (*start)(const void *context, struct dp_grower *grower, uint32_t set, uint32_t *member);
	uint64_t (*sign)(const void *context, const struct dp_label *labels, uint32_t useful);
	/* Hands the joints of the batch's set i with all finished sets, then with those before it in the batch, to
	 * `take`. `at` is scratch as in struct dp. Returns the work, 0 when `take` said no. */
	uint64_t (*merge)(const void *context, struct dp_label *at, const struct dp_batch *batch, uint32_t i,
			  dp_take_joint *take, void *taker);
};

struct dp_ahead;

/* Sets up at most `threads` - 1 helper threads for `grower`, whose thread works with them; *ahead becomes NULL where
 * none is wanted or fits. Their memory comes from malloc, no more than a quarter of `memory_limit` (0: none). `work`
 * and `context` are borrowed. */
void dp_ahead_new(struct dp_ahead **ahead, struct dp_grower *grower, unsigned threads, size_t memory_limit,
		  const struct dp_ahead_work *work, const void *context);
void dp_ahead_free(struct dp_ahead *ahead); /* NULL is allowed */

/* Grows some sets of the list that begins with `first`. Forgets those that were grown before. */
void dp_ahead_grow(struct dp_ahead *ahead, uint32_t first);

/* What came of the set whose turn it is, in the order of dp_ahead_grow; NULL when it was not grown ahead. */
const struct dp_grown *dp_ahead_take(struct dp_ahead *ahead, uint32_t set);

/* Whether all that were grown are taken, so that it is time for the next. */
int dp_ahead_is_empty(const struct dp_ahead *ahead);

#endif
