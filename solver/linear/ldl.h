/* Sparse Cholesky factorisation for matrices with an edge for every pair of entries: A = L D L' of a weighted graph's
 * Laplacian plus a diagonal, in a fill-reducing order, and solutions for many right-hand sides at once.
 *
 * Deterministic: no threads, no other library's arithmetic (AMD only orders), one order of additions. */
#ifndef SOLVER_LINEAR_LDL_H
#define SOLVER_LINEAR_LDL_H

#include "solver/arena.h"
#include "solver/linear/lanes.h"
#include "tightwire.h"

#include <stdbool.h>

/* All arrays are borrowed from the arena. */
struct ldl {
	uint32_t n;
	uint32_t *rank; /* [n] place of each vertex in the elimination order: row and column `rank` of L */
	size_t *first;  /* [n + 1] column j of L: first[j] <= i < first[j + 1], rows ascending; the diagonal is 1 */
	uint32_t *row;  /* [first[n]] */
	float *value;   /* [first[n]] */
	float *inverse; /* [n] of D */
	uint64_t operations; /* multiplications that a factorisation takes, about */
};

/* Told now and then how many operations were done since the last time; false: it is to stop. */
typedef bool ldl_goes_on(void *context, uint64_t operations);

/* A graph: edge e joins ends[2e] and ends[2e + 1], which differ. Parallel edges are allowed. */
struct ldl_graph {
	uint32_t vertex_count;
	uint32_t edge_count;
	const uint32_t *ends; /* [2 * edge_count] */
};

/* Orders the graph's vertices and finds where L is not 0. TW_ERROR_MEMORY, also where L would have more than
 * `entries_most` entries (then the work is not worth it). AMD takes some more memory from the heap while it orders. */
enum tw_status ldl_analyse(struct ldl *ldl, struct arena *arena, const struct ldl_graph *graph,
			   size_t entries_most) TW_NODISCARD;

/* Factorises the Laplacian with the edges' weights `weight` [edge_count] > 0, in which vertex `ground` is held at 0:
 * its row and column are those of the identity, so that the matrix is definite when the graph is connected. `scratch`
 * is released again. `goes_on` may be NULL. TW_ERROR_MEMORY; TW_ERROR_CANCELLED when goes_on said so. */
enum tw_status ldl_factorise(struct ldl *ldl, struct arena *scratch, const struct ldl_graph *graph,
			     const double *weight, uint32_t ground, ldl_goes_on *goes_on, void *context) TW_NODISCARD;

/* Solves for the right-hand sides first…end-1 (multiples of LANES_BLOCK) in place: x[rank * stride + column]. Reads
 * only what is shared, so that threads may solve for other columns at the same time. */
void ldl_solve(const struct ldl *ldl, float *x, uint32_t stride, uint32_t first, uint32_t end);

/* About how many multiplications a solve takes for each column. */
static inline uint64_t ldl_entries(const struct ldl *ldl)
{
	return ldl->first[ldl->n];
}

#endif
