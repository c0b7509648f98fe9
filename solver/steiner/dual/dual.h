/* Dual bound: a near-optimal solution of the dual of the directed cut relaxation (R. T. Wong, A dual ascent approach
 * for Steiner tree problems on a directed graph, Math. Program. 28, 1984), as a splitting of the arcs' costs.
 *
 * Direct every tree away from a root terminal. A *cut* is a vertex set without the root that holds a terminal; every
 * tree enters it. A dual gives cuts values y >= 0 such that on no arc the values of the cuts that it enters sum to more
 * than its cost: the sum of y is then a lower bound, and what is left of the cost of an arc is its reduced cost.
 *
 * The cuts come in *balls*: for a terminal t, the sets {v: distance(v, t) <= s} for 0 <= s < radius, distances by the
 * costs that are left. A ball takes min(D[u], radius) - D[v] from the arc u -> v and adds its radius, at most the
 * root's distance, to the bound. Because every ball is remembered, it can be taken out again and grown anew. */
#ifndef SOLVER_STEINER_DUAL_DUAL_H
#define SOLVER_STEINER_DUAL_DUAL_H

#include "solver/steiner/dual/coarse.h"
#include "solver/steiner/dual/guide.h"
#include "solver/steiner/dual/queue.h"
#include "solver/steiner/dual/survey.h"
#include "solver/steiner/search.h"

struct dual_faults;

/* All costs are coarse (coarse.h). */
struct dual_arc {
	uint32_t
		tail; /* the arc enters the vertex in whose row it stands: rows as in instance.first, tail == head[a] */
	uint32_t cost; /* reduced */
};

/* A vertex of a ball and its distance, below the ball's radius. */
struct dual_member {
	uint32_t vertex;
	uint32_t distance;
};

struct dual_ball {
	uint32_t terminal; /* index; INSTANCE_NONE: taken out for good */
	uint32_t radius;
	size_t start; /* members[start … start + count) */
	uint32_t count;
	bool is_new;  /* grown in the current step of the local search */
	bool applied; /* its costs are taken from the arcs */
};

struct dual {
	struct arena *arena;             /* borrowed: of the arrays below */
	const struct instance *instance; /* borrowed */
	unsigned coarse_shift;
	uint32_t root;        /* index of the root terminal */
	uint64_t bound;       /* sum of the radii */
	uint64_t *value;      /* [terminal_count] sum of the radii of the terminal's balls */
	struct dual_arc *arc; /* [2 * edge_count] */
	uint32_t *mate;       /* [2 * edge_count] the arc in the other direction */

	struct dual_ball *ball; /* [ball_count], in the order of their members */
	uint32_t ball_count, ball_capacity;
	struct dual_member *member;
	size_t member_count, member_capacity;

	const struct dual_survey *survey; /* borrowed: of the first dual's arena */
	struct dual_guide guide;          /* the tree that the growth is guided by */
	struct dual_faults *faults;       /* fault.h */
	uint64_t random;                  /* state of the generator that picks what to grow anew */

	/* Scratch. */
	uint32_t *distance;       /* [vertex_count] UINT32_MAX between calls */
	struct dual_queue *queue; /* empty between calls; room for 2 * edge_count + terminal_count */
	uint32_t *stack;          /* [2 * edge_count + terminal_count] vertices at the current distance */
	uint8_t *inside;          /* [vertex_count] the vertex is in the ball that grows; 0 between calls */
	uint64_t *inner;          /* [terminal_count] */
};

/* Sets up a dual without balls for search->instance and surveys its terminals. Everything is allocated from
 * search->arena and stays until the caller releases it. There must be a tree (its weight chooses coarse_shift),
 * and two terminals. */
enum tw_status dual_init(struct dual *dual, struct search *search) TW_NODISCARD;

/* Another one for the same instance, with root and survey of `from`, which it borrows, and room for about `members`
 * members of balls. */
enum tw_status dual_init_like(struct dual *dual, struct search *search, const struct dual *from,
			      size_t members) TW_NODISCARD;

/* Takes all balls away and chooses the root, the index of a terminal: then the dual may ascend. The search's best tree
 * becomes its guide (guide.h), and does so again with every dual_improve. */
enum tw_status dual_restart(struct dual *dual, struct search *search, uint32_t root) TW_NODISCARD;

/* Grows first balls around all terminals, in turns whose limit grows by this factor. */
enum tw_status dual_ascend(struct dual *dual, struct search *search, unsigned factor_percent) TW_NODISCARD;

/* Grows all terminals as far as they can go. */
enum tw_status dual_extend(struct dual *dual, struct search *search) TW_NODISCARD;

/* Sets up a dual and ascends from some roots in the middle and with some factors, as long as they take less than
 * `effort` work units and the bound is not far off (dual_is_far), and at least once: *dual becomes the best. The value
 * of the relaxation does not depend on the root, but what an ascent reaches depends on it and on the factor, by several
 * per cent. */
enum tw_status dual_ascend_best(struct dual *dual, struct search *search, uint64_t effort) TW_NODISCARD;

/* True when the gap to the best tree is so large for so many terminals that neither more ascents nor a dynamic program
 * are worth a try before a better kind of bound. */
bool dual_is_far(const struct dual *dual, const struct search *search);

/* Takes out the balls of a few neighbouring terminals, grows them anew in another order, and keeps what is no worse,
 * until about `effort` work units are spent or the bound reaches `target` (fine). */
enum tw_status dual_improve(struct dual *dual, struct search *search, uint64_t effort, fine_t target) TW_NODISCARD;

/* Distances by reduced costs: of every vertex from the root, and from every vertex to the nearest terminal but the
 * root; DUAL_FAR where it is `limit` or more. Arrays of vertex_count. */
void dual_from_root(const struct dual *dual, struct search *search, uint32_t limit, uint32_t *from_root);
void dual_to_terminal(const struct dual *dual, struct search *search, uint32_t limit, uint32_t *to_terminal);

/* Sets up `dual` for search->instance, which is `from`'s instance without some vertices and edges, with the balls of
 * `from`, whose survey it borrows. `number`: the new number of each old vertex, INSTANCE_NONE where it is gone. */
enum tw_status dual_transfer(struct dual *dual, struct search *search, const struct dual *from,
			     const uint32_t *number) TW_NODISCARD;

/* The fine weight that the bound proves. */
static inline fine_t dual_fine_bound(const struct dual *dual)
{
	return (fine_t)dual->bound << dual->coarse_shift;
}

#endif
