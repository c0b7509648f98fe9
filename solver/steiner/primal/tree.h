/* A Steiner tree inside the instance, in a form that exchanges can take apart and put together. */
#ifndef SOLVER_STEINER_PRIMAL_TREE_H
#define SOLVER_STEINER_PRIMAL_TREE_H

#include "solver/steiner/instance.h"

struct primal_tree {
	const struct instance *instance; /* borrowed */
	uint32_t *edge;                  /* [edge_count] */
	uint32_t edge_count;
	fine_t weight;    /* fine */
	uint8_t *has;     /* [instance edge_count] the edge is in the tree */
	uint32_t *degree; /* [instance vertex_count] in the tree */
	uint32_t *parent; /* [instance vertex_count] scratch: union-find, then the sum of incident positions */
};

/* Allocates from `arena`; TW_ERROR_MEMORY. The tree is empty. */
enum tw_status primal_tree_init(struct primal_tree *tree, struct arena *arena,
				const struct instance *instance) TW_NODISCARD;

/* Replaces the tree by `edges`, which connect the terminals and may close cycles, have bare ends and repeat: a spanning
 * forest of them in their order (`sorted`: the lightest one) without the bare ends. `edges` is reordered and must not
 * be tree->edge. */
void primal_tree_set(struct primal_tree *tree, uint32_t *edges, uint32_t edge_count, int sorted);

/* A terminal, or a vertex where the tree branches. */
static inline int primal_tree_is_key(const struct primal_tree *tree, uint32_t v)
{
	return tree->instance->terminal_at[v] != INSTANCE_NONE || tree->degree[v] > 2;
}

#endif
