/* Local search: takes connected parts out of a tree and puts the best there is in their place. */
#ifndef SOLVER_STEINER_PRIMAL_EXCHANGE_H
#define SOLVER_STEINER_PRIMAL_EXCHANGE_H

#include "solver/steiner/primal/connect.h"
#include "solver/steiner/primal/tree.h"

struct primal_exchange {
	struct primal_tree *tree;       /* borrowed */
	struct primal_connect *connect; /* borrowed */
	uint32_t clock;                 /* counts attempts */
	uint32_t *changed;              /* [vertex_count] the clock when the tree last changed at the vertex */
	uint32_t *tried;                /* [vertex_count] the clock when the vertex was last the seed, of this size */
	uint8_t *piece;                 /* [vertex_count] piece of a tree vertex, valid in one attempt */
	uint32_t *cut;                  /* [vertex_count] edges taken out */
	uint32_t cut_count;
	fine_t cut_weight;
	uint32_t cut_changed; /* the latest change among the vertices met */
	uint32_t *member;     /* [vertex_count] vertices that stay in the tree */
	uint8_t *member_piece;
	uint32_t *edges; /* [2 * vertex_count] the next tree */
	uint32_t *added; /* [vertex_count] */
};

enum tw_status primal_exchange_init(struct primal_exchange *exchange, struct arena *arena, struct primal_tree *tree,
				    struct primal_connect *connect) TW_NODISCARD;

/* Tries all seeds with parts that leave `pieces` (2 … PRIMAL_PIECES_MAX) pieces, again where the tree changed, until
 * none gains, the search's work reaches `work_end`, or it must stop. */
void primal_exchange_all(struct primal_exchange *exchange, uint32_t pieces, uint32_t region_max, uint64_t work_end);

#endif
