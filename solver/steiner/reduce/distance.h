/* Reductions that compare edges with bottleneck distances. */
#ifndef SOLVER_STEINER_REDUCE_DISTANCE_H
#define SOLVER_STEINER_REDUCE_DISTANCE_H

#include "solver/steiner/search.h"

/* What is known of edges and vertices in every optimum. */
struct reduce_verdict {
	uint8_t *is_useless; /* [edge_count] no optimum has the edge */
	uint8_t *is_needed;  /* [edge_count] every optimum has it */
	uint8_t *is_passed;  /* [vertex_count] no optimum has the vertex with three edges or more; not a terminal */
	uint32_t count;      /* of verdicts */
};

/* Whether judging is likely to pay: true for small instances, for sparse ones, and where it does on a sample of the
 * vertices. A plain triangle mesh has next to nothing to judge. */
int reduce_distance_pays(struct search *search);

/* Fills the verdict's arrays, which the caller provides. The instance has no parallel edges. TW_ERROR_MEMORY,
 * TW_ERROR_CANCELLED when the search must stop. */
enum tw_status reduce_distance_judge(struct search *search, struct reduce_verdict *verdict) TW_NODISCARD;

#endif
