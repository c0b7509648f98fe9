/* Certificates: a tree with a lower bound that anybody can check by adding up, without trust in the solver.
 *
 * The bound is a set of *potentials*, all on the caller's own graph (nothing reduced, fixed or perturbed). Let r be a
 * terminal, the root. A potential belongs to another terminal t and gives every vertex v a number 0 <= p(v) <= R, R its
 * radius, with p(t) = 0 and p(r) = R. It takes max(0, p(u) - p(v)) of the cost of the arc u -> v. The potentials are
 * feasible when from no arc, in neither direction, they take more than the edge weighs. Then every tree that spans the
 * terminals weighs at least the sum of the radii: direct it away from r; on its path from r to t the potential falls
 * from R to 0, so it takes R at least from the tree's arcs, and all potentials together take no more than the tree
 * weighs. (This is the dual of the directed cut relaxation; R. T. Wong, A dual ascent approach for Steiner tree
 * problems on a directed graph, Math. Program. 28, 1984.)
 *
 * The bound that the solver proves also rests on enumeration and on reductions, which leave no such witness; it is at
 * least as high, and stands in the certificate as a claim. */
#ifndef SOLVER_STEINER_CERTIFICATE_CERTIFICATE_H
#define SOLVER_STEINER_CERTIFICATE_CERTIFICATE_H

#include "solver/arena.h"
#include "solver/graph/graph.h"
#include "solver/steiner/steiner.h"
#include "tightwire.h"

/* A vertex at which a potential is below its radius. */
struct certificate_member {
	uint32_t vertex;
	uint64_t value; /* below the radius */
};

struct certificate_potential {
	uint32_t terminal; /* vertex; the potential is 0 there */
	uint64_t radius;   /* of all vertices that are no members */
	size_t start;      /* members[start … start + count) */
	uint32_t count;
};

struct certificate_edge {
	uint32_t ends[2]; /* vertices */
	uint64_t weight;  /* tells parallel edges apart */
};

/* Vertices are counted from 0 here and from 1 in files. All arrays are borrowed from the arena that made them. */
struct steiner_certificate {
	uint32_t vertex_count, edge_count, terminal_count; /* of the instance; terminals as listed */
	uint64_t weight;                                   /* of the tree */
	uint64_t bound;     /* what the solver claims to have proven: certified <= bound <= weight */
	uint64_t certified; /* what the potentials prove: total / scale, rounded up since weights are whole */

	uint32_t tree_count;
	struct certificate_edge *tree; /* [tree_count] */

	uint32_t root;  /* vertex */
	uint64_t scale; /* potentials are counted in units of 1 / scale of a weight; at least 1 */
	uint64_t total; /* sum of the radii */
	uint32_t potential_count;
	struct certificate_potential *potential; /* [potential_count], of different terminals */
	size_t member_count;
	struct certificate_member *member; /* [member_count], those of a potential side by side */
};

/* Makes a certificate of a tree that steiner_solve found for this graph and these terminals: grows and improves
 * potentials on the whole graph, a second or two for a suit. `memory_limit`: bytes of scratch memory, 0 for none.
 * Deterministic. TW_ERROR_INPUT where there is no tree (infeasible); TW_ERROR_MEMORY. */
enum tw_status steiner_certify(const struct graph *graph, const uint32_t *terminals, uint32_t terminal_count,
			       const struct steiner_tree *tree, size_t memory_limit, struct arena *arena,
			       struct steiner_certificate *certificate, struct tw_error *error) TW_NODISCARD;

/* Checks every claim of a certificate but `bound` (of which only the order of the three numbers is checked) against the
 * graph; shares nothing with the solver. TW_OK: the tree spans the terminals and weighs `weight`, and no tree weighs
 * less than `certified`. TW_ERROR_INPUT names what is wrong; TW_ERROR_MEMORY. */
enum tw_status certificate_check(const struct steiner_certificate *certificate, const struct graph *graph,
				 const uint32_t *terminals, uint32_t terminal_count,
				 struct tw_error *error) TW_NODISCARD;

#endif
