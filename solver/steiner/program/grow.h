/* One terminal set of the dynamic program: from start labels to the labels that an optimum could use. For dp.c and
 * ahead.c only. */
#ifndef SOLVER_STEINER_PROGRAM_GROW_H
#define SOLVER_STEINER_PROGRAM_GROW_H

#include "solver/steiner/dual/dual.h"
#include "solver/steiner/heap.h"
#include "solver/steiner/search.h"

#define DP_MERGED 0x80000000u /* in `from`: a merge, the rest is the number of one of the two sets; else an edge */

/* A label that an optimum could use. `reduced`: what its tree weighs beyond its share of the bound, coarse; the sum
 * over the two parts of a merge is that of the whole. */
struct dp_label {
	fine_t cost; /* fine weight of the tree that spans the set and the vertex */
	uint32_t vertex;
	uint32_t reduced;
};

/* How a label came to be. */
struct dp_trail {
	uint32_t vertex;
	uint32_t from;
};

/* An arc with all that relaxing it needs side by side; rows as in instance.first. */
struct dp_arc {
	uint32_t head;
	uint32_t edge;
	fine_t weight;
};

/* What the growth knows about a vertex. A stamp other than the current one means: nothing. */
struct dp_cell {
	fine_t cost;
	uint32_t from;
	uint32_t stamp; /* epoch << 2 | enum dp_state */
};

enum dp_state { DP_REACHED, DP_SETTLED, DP_OBSTACLE, DP_DEAD };

/* What the search of the outside knows about a vertex. */
struct dp_outside {
	uint32_t stamp;
	uint32_t component;
};

struct dp_component {
	uint32_t parent;
	uint32_t pending;   /* vertices of it that the search has yet to look at; 0: closed, it is known to its end */
	uint32_t terminals; /* outside terminals seen in it */
};

struct dp_grower {
	struct search *search;   /* borrowed */
	const struct dual *dual; /* borrowed; NULL: no future costs */
	fine_t cutoff;           /* fine */
	uint32_t room;           /* coarse: by less than this may a tree exceed the bound */
	uint32_t root;           /* index of the root terminal */
	uint32_t *depth;         /* [vertex_count * terminal_count] sum over t's balls of radius - distance */
	uint32_t *from_root;     /* [vertex_count] */

	const struct dp_arc *arc; /* [2 * edge_count] */
	struct dp_cell *cell;     /* [vertex_count] */
	uint32_t epoch;           /* counts sets */
	struct heap heap;         /* an entry for every start and every arc: each vertex is settled once */
	uint32_t *start;          /* [start_count] vertices with a start label, each once */
	uint32_t start_count;
	uint32_t *ball; /* [ball_count] settled vertices and obstacles in the order of their costs */
	uint32_t ball_count;
	uint32_t ball_terminals; /* outside terminals in the ball */
	uint8_t *needed;         /* [vertex_count] 0 between calls */

	struct dp_outside *outside;     /* [vertex_count] */
	uint32_t outside_epoch;         /* counts searches */
	struct dp_component *component; /* [vertex_count] */
	uint32_t component_count;
	uint32_t *frontier; /* [frontier_count] the vertices that the search has seen */
	uint32_t frontier_count;

	const uint32_t *member; /* [member_count] the terminals of the current set; borrowed */
	uint32_t member_count;
	const uint64_t *bits;       /* the same as a bit set; borrowed */
	uint64_t value;             /* coarse: sum of the dual values of the set's terminals */
	uint32_t outside_terminals; /* how many there are, the root among them */
};

enum tw_status dp_grower_init(struct dp_grower *grower, struct search *search, const struct dual *dual,
			      fine_t cutoff) TW_NODISCARD;

/* A second grower for the same sets, whose scratch is taken from `arena`: both can grow at once. `counters` is a copy
 * of from->search that counts the work; it must live as long. TW_ERROR_MEMORY. */
enum tw_status dp_grower_share(struct dp_grower *grower, struct arena *arena, const struct dp_grower *from,
			       struct search *counters) TW_NODISCARD;

/* Starts on a set: `members` are its terminals, `bits` the same. Then come the start labels, as many as there are, then
 * dp_grow. */
void dp_grow_start(struct dp_grower *grower, const uint32_t *members, uint32_t member_count, const uint64_t *bits);
void dp_grow_add(struct dp_grower *grower, uint32_t vertex, fine_t cost, uint32_t from);

/* Writes the labels that an optimum could use to `labels`, *useful of them, and to `trails` how these and those that
 * only lead to them came to be; returns the number of the latter. Room for vertex_count in both. */
uint32_t dp_grow(struct dp_grower *grower, struct dp_label *labels, uint32_t *useful, struct dp_trail *trails);

#endif
