/* The current instance: the graph that the stages of the solver shrink and hand on, and the way back to the caller's.
 *
 * Weights are *fine*: the caller's shifted left by `shift`, plus a tie-break for every edge, so small that those of a
 * whole tree sum to less than one unit of the caller's. An optimum of the fine weights is therefore an optimum of the
 * caller's, and of least sum of tie-breaks among these. The tie-breaks are the caller's, 32 bits each; where the caller
 * has none, 10 bits of a hash of the ends' numbers, which only keep ties, of which subdivided meshes are full, from
 * slowing the search down. No stage needs uniqueness to be sound.
 *
 * An edge of the instance stands for a set of the caller's edges, its *origin*. Origins form a history: below
 * the caller's edge count an origin is that edge, from there on it is a pair of older origins. Origins that every
 * optimum takes (an only edge of a terminal, say) are `taken`: their ends are contracted and their weight is in `base`.
 */
#ifndef SOLVER_STEINER_INSTANCE_H
#define SOLVER_STEINER_INSTANCE_H

#include "solver/arena.h"
#include "solver/graph/graph.h"
#include "solver/steiner/fine.h"
#include "tightwire.h"

#include <stdbool.h>

#define INSTANCE_NONE UINT32_MAX

/* Arc a of vertex v: first[v] <= a < first[v + 1]; it leads to head[a] and is a side of edge[a]. All arrays are
 * allocated once, for the caller's sizes, and only ever shrink. */
struct instance {
	uint32_t vertex_count;
	uint32_t edge_count;
	uint32_t terminal_count;
	unsigned shift;        /* fine weight >> shift is the caller's */
	fine_t tie_limit;      /* a tree's tie-breaks sum to less; at most 1 << shift */
	const uint32_t *ties;  /* [origin_leaf_count] the caller's tie-breaks; borrowed; NULL: none */
	fine_t base;           /* fine weight of the taken origins */
	uint32_t *first;       /* [vertex_count + 1] */
	uint32_t *head;        /* [2 * edge_count] */
	uint32_t *edge;        /* [2 * edge_count] */
	uint32_t *ends;        /* [2 * edge_count] */
	fine_t *weight;        /* [edge_count] fine */
	uint32_t *origin;      /* [edge_count] */
	uint32_t *terminal;    /* [terminal_count] distinct vertices */
	uint32_t *terminal_at; /* [vertex_count] index of the terminal that lies there, INSTANCE_NONE for none */

	uint32_t origin_leaf_count; /* the caller's edge count: origins below are the caller's edges */
	uint32_t pair_count, pair_capacity;
	uint32_t (*pair)[2]; /* [pair_count] */
	uint32_t taken_count, taken_capacity;
	uint32_t *taken; /* [taken_count] origins */
};

/* Copies the component of `graph` that holds the terminals. `terminals` may repeat. `perturb`: break ties, by `ties`
 * (may be NULL) or else by the hash; otherwise fine weights are the caller's.
 * TW_ERROR_NOT_FOUND when they do not lie in one component: apart[0] and apart[1] are two that do not. Everything is
 * allocated from `arena`. */
enum tw_status instance_init(struct instance *instance, struct arena *arena, const struct graph *graph,
			     const uint32_t *terminals, uint32_t terminal_count, const uint32_t *ties, bool perturb,
			     uint32_t apart[2]) TW_NODISCARD;

/* The fine weight of an edge of the caller's graph. */
fine_t instance_fine(const struct instance *instance, const struct graph *graph, uint32_t edge);

/* The origin of an edge that replaces two in series, or INSTANCE_NONE when the history is full (then leave the edges).
 */
uint32_t instance_join(struct instance *instance, uint32_t origin_a, uint32_t origin_b);

/* Takes an origin into every tree from now on; the caller contracts its edge. */
void instance_take(struct instance *instance, uint32_t origin, fine_t weight);

/* The instance that a stage leaves behind. Vertices are named by their old numbers; the new instance has the vertices
 * that an edge or a terminal still uses, in the old order, so that neighbours in memory stay neighbours. */
struct instance_edit {
	uint32_t edge_count; /* at most the old one */
	uint32_t *ends;      /* [2 * edge_count] old vertices; no loops; may be parallel: the lightest of them stays */
	fine_t *weight;      /* [edge_count] */
	uint32_t *origin;    /* [edge_count] */
	uint32_t terminal_count; /* at most the old one */
	uint32_t *terminal;      /* [terminal_count] old vertices, distinct */
};

/* Replaces the instance's content; the arrays of `edit` are overwritten. `scratch` is released again. `number` (may be
 * NULL): [old vertex count], receives the new number of each old vertex, INSTANCE_NONE where it is gone. */
enum tw_status instance_replace(struct instance *instance, struct arena *scratch, struct instance_edit *edit,
				uint32_t *number) TW_NODISCARD;

/* Keeps the edges with keep[edge] != 0, and the vertices that they or a terminal use. `number` as above. */
enum tw_status instance_keep(struct instance *instance, struct arena *scratch, const uint8_t *keep,
			     uint32_t *number) TW_NODISCARD;

/* Copies what stages change: `to` can be shrunk, joined and taken from while `from` stays. */
enum tw_status instance_copy(struct instance *to, const struct instance *from, struct arena *arena) TW_NODISCARD;

/* Copies the edges with keep[edge] != 0, the vertices that they or a terminal use, and the history; `to` is allocated
 * for no more than that. */
enum tw_status instance_part(struct instance *to, const struct instance *from, struct arena *arena,
			     const uint8_t *keep) TW_NODISCARD;

/* The caller's edges behind the given edges of the instance and the taken origins, each once, unordered. `leaves`: a
 * buffer of origin_leaf_count entries. Returns how many there are. TW_ERROR_MEMORY only. */
enum tw_status instance_expand(const struct instance *instance, struct arena *scratch, const uint32_t *edges,
			       uint32_t edge_count, uint32_t *leaves, uint32_t *leaf_count) TW_NODISCARD;

#endif
