/* Sparse Cholesky factorisation for matrices with an edge for every pair of entries: A = L D L' of a weighted graph's
 * Laplacian plus a diagonal, in a fill-reducing order, and solutions for many right-hand sides at once.
 *
 * Deterministic: no other library's arithmetic (AMD only orders), one order of additions, which neither the machine nor
 * the number of threads changes.
 *
 * Shape: consecutive columns of L with nearly the same rows are a *panel*, which is dense. The elimination tree is cut
 * into *parts*, subtrees of about equal size that do not depend on one another, and the *top* above them. What a part
 * adds to rows of the top it adds to *copies* of them of its own, so that threads may work on parts at the same time,
 * and each part is a dense piece of memory. A solve is: forward in each part, the top, backward in each part. */
#ifndef SOLVER_LINEAR_LDL_H
#define SOLVER_LINEAR_LDL_H

#include "solver/arena.h"
#include "solver/linear/isa.h"
#include "solver/linear/lanes.h"
#include "tightwire.h"

#include <stdbool.h>

enum { LDL_PANEL_WIDTH = 4 }; /* columns at most */

/* Columns first…first + width - 1 of L. Their values stand row by row, `width` to a row: first the panel's own rows, a
 * square of which the part below the diagonal counts, then those of its list. */
struct ldl_panel {
	uint32_t first;
	uint32_t width;
	uint32_t row_count;
	size_t row;   /* the list is ldl.row[row … row + row_count), ascending */
	size_t value; /* of ldl.value */
};

/* Its own places are first…end-1, then come copies up to copies_end-1. The last part is the top, without copies. */
struct ldl_part {
	uint32_t panel, panel_end;
	uint32_t first, end, copies_end;
};

/* All arrays are borrowed from the arena. A *place* is a row of the right-hand sides: of a vertex, or a copy. */
struct ldl {
	uint32_t vertex_count;
	uint32_t place_count;
	uint32_t *rank;        /* [vertex_count] place of each vertex; parts come one after the other, then the top */
	uint32_t *original;    /* [place_count] of a copy: the place in the top; of others: they themselves */
	struct ldl_part *part; /* [part_count + 1], the top at the end */
	uint32_t part_count;
	struct ldl_panel *panel; /* [panel_count] */
	uint32_t panel_count;
	uint32_t *row; /* [row_count] places */
	size_t row_count;
	float *value;        /* [value_count] */
	size_t value_count;  /* about what a solve multiplies for each column, twice */
	float *inverse;      /* [place_count] of D; 0 for copies */
	uint64_t operations; /* multiplications that a factorisation takes, about */
	enum isa isa;        /* which kernels work; isa_best() unless a test sets another */
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

/* The part of a place, and where the part keeps the row of `place`, which is one of its own or one of the top that it
 * shares an edge with. */
uint32_t ldl_part_of(const struct ldl *ldl, uint32_t place);
uint32_t ldl_place_in(const struct ldl *ldl, uint32_t part, uint32_t place);

/* The steps of a solve in place: x[place * stride + column], rows of whole LANES_BLOCKs.
 *   1. Forward in every part, in any order. Copies must be 0, or hold what is to be added to the top's right-hand side.
 *   2. The top, a chunk of columns at a time, in any order. It reads x and works in memory of its own, so that threads
 *      with different chunks do not write to the same lines.
 *   3. Backward in every part and in the top, which is part `part_count`, in any order: fills the part's rows, the
 *      copies' among them. */
struct ldl_top {
	float *value;   /* [ldl_top_size(ldl, stride)] chunk by chunk */
	uint32_t width; /* columns of a chunk, whole blocks; the last may have fewer */
};
void ldl_forward(const struct ldl *ldl, float *x, uint32_t stride, uint32_t part);
void ldl_solve_top(const struct ldl *ldl, const float *x, const struct ldl_top *top, uint32_t stride, uint32_t chunk);
void ldl_backward(const struct ldl *ldl, float *x, const struct ldl_top *top, uint32_t stride, uint32_t part);

static inline size_t ldl_top_size(const struct ldl *ldl, uint32_t stride)
{
	const struct ldl_part *const top = &ldl->part[ldl->part_count];
	return (size_t)(top->end - top->first) * stride;
}

/* All steps. */
void ldl_solve(const struct ldl *ldl, float *x, const struct ldl_top *top, uint32_t stride);

#endif
