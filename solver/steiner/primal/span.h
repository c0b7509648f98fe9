/* Local search for dense graphs, where a tree is known by its vertices: it is the lightest spanning tree of them. */
#ifndef SOLVER_STEINER_PRIMAL_SPAN_H
#define SOLVER_STEINER_PRIMAL_SPAN_H

#include "solver/steiner/search.h"

/* A set of vertices, the terminals among them, and its lightest spanning tree. All arrays are borrowed from the arena.
 */
struct primal_span {
	struct search *search; /* borrowed */
	/* The instance's rows with the lightest arcs first: row v is first[v] … first[v + 1] - 1 as there. */
	uint32_t *head, *edge; /* [2 * edge_count] */
	uint8_t *is_in;        /* [vertex_count] in the set */
	uint32_t *tree;        /* [tree_count] edges, the lightest first */
	uint32_t tree_count;
	fine_t weight; /* of the tree */

	/* Scratch: the tree that a move leads to. */
	uint32_t *next; /* [vertex_count] */
	uint32_t next_count;
	fine_t next_weight;
	uint32_t *parent; /* [vertex_count] union-find */
	uint32_t *degree; /* [vertex_count] */
	uint32_t *link;   /* [vertex_count] lightest arc out of a component */
	uint32_t *own;    /* [arcs of a vertex at most] arcs from the vertex that comes in */

	/* Detours. */
	uint8_t *is_frozen; /* [vertex_count] moves leave the vertex as it is */
	uint32_t *kept;     /* [kept_count] the tree before the detour */
	uint32_t kept_count;
	fine_t kept_weight;
	uint32_t *best; /* [best_count] the lightest one */
	uint32_t best_count;
	fine_t best_weight;
	uint64_t random; /* state of the generator */
};

/* Sorts the rows. The set is empty. TW_ERROR_MEMORY. */
enum tw_status primal_span_init(struct primal_span *span, struct arena *arena, struct search *search) TW_NODISCARD;

/* Takes the tree with these edges, which spans the terminals and has no bare ends. */
void primal_span_set(struct primal_span *span, const uint32_t *edges, uint32_t edge_count);

/* Takes vertices in and throws vertices out, one by one, as long as the tree gets lighter, the search's work is below
 * `work_end` and it need not stop. */
void primal_span_improve(struct primal_span *span, uint64_t work_end);

/* Goes on from a tree that does not get lighter: takes a few vertices in or throws them out at random, whatever it
 * costs, and improves; returns where that was in vain. Until the search's work reaches `work_end` or it must stop; the
 * tree is then the lightest that it met. */
void primal_span_wander(struct primal_span *span, uint64_t work_end);

#endif
