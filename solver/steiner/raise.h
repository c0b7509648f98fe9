/* A better dual bound, round by round, and a smaller instance with every gain. */
#ifndef SOLVER_STEINER_RAISE_H
#define SOLVER_STEINER_RAISE_H

#include "solver/steiner/dual/dual.h"
#include "solver/steiner/flow/flow.h"
#include "solver/steiner/search.h"

/* What lasts from round to round. Starts as zeros. */
struct raise {
	struct flow *flow;    /* borrowed from the arena; NULL: not begun, or impossible */
	fine_t reached, gain; /* the flow's own best bound, and what its last split gained */
	bool has_bound;       /* the flow has had iterations and a split */
	bool has_no_flow;     /* it is switched off, does not fit, or its factor would be too dense */
};

/* Raises the bound of `dual`, which belongs to search->instance, and deletes what it rules out; with a flow where one
 * fits, else by the dual's local search with about `effort` work units. For `cheap` units the flow goes on while it
 * gains a little. TW_ERROR_MEMORY, TW_ERROR_CANCELLED. */
enum tw_status raise_bound(struct raise *raise, struct search *search, struct dual *dual, uint64_t effort,
			   uint64_t cheap) TW_NODISCARD;

/* True when the gap is so small for so many terminals that the dynamic program should soon end. */
bool raise_is_close(const struct search *search, const struct dual *dual);

#endif
