/* Purpose: order, analyse, factorise, solve.
 *
 * The order is AMD's (P. R. Amestoy, T. A. Davis & I. S. Duff, An approximate minimum degree ordering algorithm, SIAM
 * J. Matrix Anal. Appl. 17, 1996). Row k of L is found from those before it (up-looking; T. A. Davis, Direct Methods
 * for Sparse Linear Systems, SIAM 2006): its pattern is the part of the elimination tree below k that is reached from
 * the entries of A's row, its values come from a sparse triangular solve over that pattern. Rows are appended to the
 * columns, so that the columns' rows ascend by themselves. A Laplacian's factor has no cancellation to speak of, all
 * entries outside of the diagonal have one sign; so L is kept in single precision, sums run in double. */
#include "solver/linear/ldl.h"

#include <assert.h>
#include <string.h>
#include <suitesparse/amd.h>

#define NONE UINT32_MAX

/* Some 5 ms. */
enum { POLL_OPERATIONS = 5000000 };

/* The upper triangle in elimination order: the entries (i, k), i < k, of column k. */
struct upper {
	uint32_t *first; /* [n + 1] */
	uint32_t *row;   /* [edge_count] */
	uint32_t *edge;  /* [edge_count] */
};

static enum tw_status build_upper(struct upper *upper, struct arena *arena, const struct ldl_graph *graph,
				  const uint32_t *rank)
{
	const size_t n = graph->vertex_count, m = graph->edge_count;
	upper->first = ARENA_ZEROED(arena, n + 2, uint32_t);
	upper->row = ARENA_ARRAY(arena, m, uint32_t);
	upper->edge = ARENA_ARRAY(arena, m, uint32_t);
	if (!upper->first || !upper->row || !upper->edge)
		return TW_ERROR_MEMORY;
	uint32_t *next = upper->first + 1; /* next[k] is where column k is written, and ends as its end */
	for (size_t e = 0; e < m; e++) {
		const uint32_t i = rank[graph->ends[2 * e]], k = rank[graph->ends[2 * e + 1]];
		next[(i > k ? i : k) + 1]++;
	}
	for (size_t k = 0; k < n; k++)
		next[k + 1] += next[k];
	for (size_t e = 0; e < m; e++) {
		const uint32_t i = rank[graph->ends[2 * e]], k = rank[graph->ends[2 * e + 1]];
		const uint32_t at = next[i > k ? i : k]++;
		upper->row[at] = i > k ? k : i;
		upper->edge[at] = (uint32_t)e;
	}
	return TW_OK;
}

/* AMD wants columns of the whole pattern; it sorts out what is there twice. */
static enum tw_status order(struct ldl *ldl, struct arena *scratch, const struct ldl_graph *graph)
{
	const size_t n = graph->vertex_count, m = graph->edge_count;
	const struct arena_mark mark = arena_mark(scratch);
	int32_t *first = ARENA_ZEROED(scratch, n + 2, int32_t), *row = ARENA_ARRAY(scratch, 2 * m, int32_t);
	int32_t *place = ARENA_ARRAY(scratch, n, int32_t);
	enum tw_status status = first && row && place && 2 * m < INT32_MAX ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		int32_t *next = first + 1;
		for (size_t i = 0; i < 2 * m; i++)
			next[graph->ends[i] + 1]++;
		for (size_t k = 0; k < n; k++)
			next[k + 1] += next[k];
		for (size_t i = 0; i < 2 * m; i++)
			row[next[graph->ends[i]]++] = (int32_t)graph->ends[i ^ 1];
		const int result = amd_order((int32_t)n, first, row, place, NULL, NULL);
		status = result == AMD_OK || result == AMD_OK_BUT_JUMBLED ? TW_OK : TW_ERROR_MEMORY;
	}
	for (size_t k = 0; k < n && status == TW_OK; k++)
		ldl->rank[place[k]] = (uint32_t)k;
	arena_release(scratch, mark);
	return status;
}

/* The pattern of row k of L, in an order in which each comes before its parent: pattern[top … n). Marks with k. */
static uint32_t list_row(const struct upper *upper, const uint32_t *parent, uint32_t k, uint32_t n, uint32_t *mark,
			 uint32_t *pattern)
{
	uint32_t top = n;
	mark[k] = k;
	for (uint32_t a = upper->first[k]; a < upper->first[k + 1]; a++) {
		uint32_t length = 0;
		for (uint32_t i = upper->row[a]; mark[i] != k; i = parent[i]) {
			mark[i] = k;
			pattern[length++] = i;
		}
		while (length)
			pattern[--top] = pattern[--length];
	}
	return top;
}

/* The elimination tree, and how many entries each column has: row k has one for every vertex of the tree that lies
 * between an entry of A's row and k. */
static void grow_tree(struct ldl *ldl, const struct upper *upper, uint32_t *parent, uint32_t *mark)
{
	memset(ldl->first, 0, ((size_t)ldl->n + 1) * sizeof *ldl->first);
	for (uint32_t k = 0; k < ldl->n; k++) {
		parent[k] = NONE;
		mark[k] = k;
		for (uint32_t a = upper->first[k]; a < upper->first[k + 1]; a++)
			for (uint32_t i = upper->row[a]; mark[i] != k; i = parent[i]) {
				if (parent[i] == NONE)
					parent[i] = k;
				ldl->first[i + 1]++;
				mark[i] = k;
			}
	}
	ldl->operations = 0;
	for (uint32_t k = 0; k < ldl->n; k++) {
		ldl->operations += (uint64_t)ldl->first[k + 1] * ldl->first[k + 1];
		ldl->first[k + 1] += ldl->first[k];
	}
}

enum tw_status ldl_analyse(struct ldl *ldl, struct arena *arena, const struct ldl_graph *graph, size_t entries_most)
{
	const size_t n = graph->vertex_count;
	*ldl = (struct ldl){
		.n = graph->vertex_count,
		.rank = ARENA_ARRAY(arena, n, uint32_t),
		.first = ARENA_ARRAY(arena, n + 1, size_t),
		.inverse = ARENA_ARRAY(arena, n, float),
	};
	if (!ldl->rank || !ldl->first || !ldl->inverse)
		return TW_ERROR_MEMORY;
	enum tw_status status = order(ldl, arena, graph);
	const struct arena_mark mark = arena_mark(arena);
	struct upper upper;
	uint32_t *parent = ARENA_ARRAY(arena, n, uint32_t), *seen = ARENA_ARRAY(arena, n, uint32_t);
	if (status == TW_OK)
		status = parent && seen ? build_upper(&upper, arena, graph, ldl->rank) : TW_ERROR_MEMORY;
	if (status == TW_OK)
		grow_tree(ldl, &upper, parent, seen);
	arena_release(arena, mark);
	if (status != TW_OK || ldl->first[n] > entries_most)
		return TW_ERROR_MEMORY;
	ldl->row = ARENA_ARRAY(arena, ldl->first[n], uint32_t);
	ldl->value = ARENA_ARRAY(arena, ldl->first[n], float);
	return ldl->row && ldl->value ? TW_OK : TW_ERROR_MEMORY;
}

/* What row k is found with. */
struct rows {
	uint32_t *parent;  /* [n] */
	uint32_t *mark;    /* [n] */
	uint32_t *pattern; /* [n] */
	size_t *end;       /* [n] of each column, so far */
	double *sum;       /* [n] 0 between rows */
	double *diagonal;  /* [n] of A, then D */
};

static enum tw_status allocate_rows(struct rows *rows, struct arena *scratch, size_t n)
{
	*rows = (struct rows){
		.parent = ARENA_ARRAY(scratch, n, uint32_t),
		.mark = ARENA_ARRAY(scratch, n, uint32_t),
		.pattern = ARENA_ARRAY(scratch, n, uint32_t),
		.end = ARENA_ARRAY(scratch, n, size_t),
		.sum = ARENA_ZEROED(scratch, n, double),
		.diagonal = ARENA_ZEROED(scratch, n, double),
	};
	return rows->parent && rows->mark && rows->pattern && rows->end && rows->sum && rows->diagonal
		       ? TW_OK
		       : TW_ERROR_MEMORY;
}

static void factorise_row(struct ldl *ldl, const struct rows *rows, uint32_t k, uint32_t top)
{
	double *const sum = rows->sum, d = rows->diagonal[k];
	double left = d;
	for (uint32_t t = top; t < ldl->n; t++) {
		const uint32_t i = rows->pattern[t];
		const double y = sum[i], l = y * ldl->inverse[i];
		const size_t end = rows->end[i];
		sum[i] = 0;
		for (size_t p = ldl->first[i]; p < end; p++)
			sum[ldl->row[p]] -= (double)ldl->value[p] * y;
		left -= l * y;
		assert(end < ldl->first[i + 1]);
		ldl->row[end] = k;
		ldl->value[end] = (float)l;
		rows->end[i]++;
	}
	/* What is left of a vertex's own weight: too little means that nothing holds it. */
	if (!(left > 1e-12 * d))
		left = d > 0 ? 1e-12 * d : 1;
	ldl->inverse[k] = (float)(1 / left);
	sum[k] = 0;
}

/* The rows in turn. */
static enum tw_status factorise_rows(struct ldl *ldl, const struct rows *rows, const struct upper *upper,
				     const double *weight, uint32_t held, ldl_goes_on *goes_on, void *context)
{
	uint64_t done = 0;
	for (uint32_t k = 0; k < ldl->n; k++) {
		const uint32_t top = list_row(upper, rows->parent, k, ldl->n, rows->mark, rows->pattern);
		for (uint32_t a = upper->first[k]; a < upper->first[k + 1]; a++)
			if (k != held && upper->row[a] != held)
				rows->sum[upper->row[a]] -= weight[upper->edge[a]];
		for (uint32_t t = top; t < ldl->n; t++)
			done += 1 + rows->end[rows->pattern[t]] - ldl->first[rows->pattern[t]];
		factorise_row(ldl, rows, k, top);
		if (!goes_on || done < POLL_OPERATIONS)
			continue;
		if (!goes_on(context, done))
			return TW_ERROR_CANCELLED;
		done = 0;
	}
	return TW_OK;
}

enum tw_status ldl_factorise(struct ldl *ldl, struct arena *scratch, const struct ldl_graph *graph,
			     const double *weight, uint32_t ground, ldl_goes_on *goes_on, void *context)
{
	const uint32_t n = ldl->n, held = ldl->rank[ground];
	const struct arena_mark mark = arena_mark(scratch);
	struct upper upper;
	struct rows rows;
	enum tw_status status = allocate_rows(&rows, scratch, n);
	if (status == TW_OK)
		status = build_upper(&upper, scratch, graph, ldl->rank);
	if (status == TW_OK) {
		grow_tree(ldl, &upper, rows.parent, rows.mark);
		memcpy(rows.end, ldl->first, n * sizeof *rows.end);
		for (size_t i = 0; i < 2 * (size_t)graph->edge_count; i++)
			rows.diagonal[ldl->rank[graph->ends[i]]] += weight[i / 2];
		rows.diagonal[held] = 1;
		memset(rows.mark, 0xff, n * sizeof *rows.mark);
		status = factorise_rows(ldl, &rows, &upper, weight, held, goes_on, context);
	}
	arena_release(scratch, mark);
	return status;
}

/* `count` vectors of every row, which lie `stride` floats apart. A constant where it is called, so that they stay in
 * registers. */
static inline __attribute__((always_inline)) void solve_columns(const struct ldl *ldl, float *x, size_t stride,
								const unsigned count)
{
	lanes y[8];
	for (uint32_t j = 0; j < ldl->n; j++) {
		memcpy(y, x + j * stride, count * sizeof *y);
		for (size_t p = ldl->first[j]; p < ldl->first[j + 1]; p++) {
			lanes *const to = (lanes *)(x + ldl->row[p] * stride);
			const lanes l = lanes_of(ldl->value[p]);
			for (unsigned i = 0; i < count; i++)
				to[i] -= l * y[i];
		}
	}
	for (uint32_t j = ldl->n; j-- > 0;) {
		lanes *const at = (lanes *)(x + j * stride);
		for (unsigned i = 0; i < count; i++)
			y[i] = at[i] * lanes_of(ldl->inverse[j]);
		for (size_t p = ldl->first[j]; p < ldl->first[j + 1]; p++) {
			const lanes *const from = (const lanes *)(x + ldl->row[p] * stride);
			const lanes l = lanes_of(ldl->value[p]);
			for (unsigned i = 0; i < count; i++)
				y[i] -= l * from[i];
		}
		memcpy(at, y, count * sizeof *y);
	}
}

void ldl_solve(const struct ldl *ldl, float *x, uint32_t stride, uint32_t first, uint32_t end)
{
	assert(first % LANES_BLOCK == 0 && end % LANES_BLOCK == 0 && end <= stride);
	while (first < end) {
		/* The wider, the less often L is read; a line of the cache holds 16 floats. */
		const uint32_t left = end - first, columns = left >= 32 ? 32 : left >= 16 ? 16 : 8;
		if (columns == 32)
			solve_columns(ldl, x + first, stride, 8);
		else if (columns == 16)
			solve_columns(ldl, x + first, stride, 4);
		else
			solve_columns(ldl, x + first, stride, 2);
		first += columns;
	}
}
