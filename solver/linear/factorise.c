/* Purpose: factorise.
 *
 * Left-looking, a panel at a time: sums for the panel's columns start as A's entries; every panel before that has rows
 * among these columns subtracts its share; then the panel's square is eliminated. A panel waits in the list of the
 * panel that holds its next row. A Laplacian's factor has no cancellation to speak of, all entries outside of the
 * diagonal have one sign; so L is kept in single precision, sums run in double. */
#include "solver/linear/kernels.h"

#include <assert.h>
#include <string.h>

#define NONE UINT32_MAX

/* Some 5 ms. */
enum { POLL_OPERATIONS = 50000000 };

/* What a factorisation works with. Rows of the top have one place here, that in the top. */
struct factor {
	uint32_t *first;    /* [place_count + 2] the entries of A's column at a place, below the diagonal */
	uint32_t *row;      /* [edge_count] places */
	double *value;      /* [edge_count] weights: A's entries, negated */
	double *diagonal;   /* [place_count] */
	uint32_t *panel_of; /* [place_count] */
	uint32_t *waiting;  /* [panel_count] the first panel in each list */
	uint32_t *next;     /* [panel_count] in its list */
	uint32_t *position; /* [panel_count] how many of a panel's rows have been dealt with */
	uint32_t *at;       /* [place_count] the row of `sum` that stands for a place, for the current panel's rows */
	uint32_t *home;     /* [most rows of a panel] scratch */
	double *d;          /* [place_count] D */
	double *sum;        /* [most rows of a panel + LDL_PANEL_WIDTH][LDL_PANEL_WIDTH] */
};

static enum tw_status allocate(struct factor *f, struct arena *scratch, const struct ldl *ldl, size_t edge_count)
{
	const size_t n = ldl->place_count;
	size_t most = 0;
	for (uint32_t p = 0; p < ldl->panel_count; p++)
		most = ldl->panel[p].row_count > most ? ldl->panel[p].row_count : most;
	*f = (struct factor){
		.first = ARENA_ZEROED(scratch, n + 2, uint32_t),
		.row = ARENA_ARRAY(scratch, edge_count, uint32_t),
		.value = ARENA_ARRAY(scratch, edge_count, double),
		.diagonal = ARENA_ZEROED(scratch, n, double),
		.panel_of = ARENA_ARRAY(scratch, n, uint32_t),
		.waiting = ARENA_ARRAY(scratch, ldl->panel_count, uint32_t),
		.next = ARENA_ARRAY(scratch, ldl->panel_count, uint32_t),
		.position = ARENA_ZEROED(scratch, ldl->panel_count, uint32_t),
		.at = ARENA_ARRAY(scratch, n, uint32_t),
		.home = ARENA_ARRAY(scratch, most, uint32_t),
		.d = ARENA_ARRAY(scratch, n, double),
		.sum = ARENA_ARRAY(scratch, (most + LDL_PANEL_WIDTH) * LDL_PANEL_WIDTH, double),
	};
	return f->first && f->row && f->value && f->diagonal && f->panel_of && f->waiting && f->next && f->position &&
			       f->at && f->home && f->d && f->sum
		       ? TW_OK
		       : TW_ERROR_MEMORY;
}

/* A's columns; those of the held vertex are the identity's. */
static void build_matrix(struct factor *f, const struct ldl *ldl, const struct ldl_graph *graph, const double *weight,
			 uint32_t held)
{
	uint32_t *const next = f->first + 1; /* next[k] is where column k is written, and ends as its end */
	for (uint32_t pass = 0; pass < 2; pass++) {
		for (uint32_t e = 0; e < graph->edge_count; e++) {
			const uint32_t u = ldl->rank[graph->ends[2 * e]], v = ldl->rank[graph->ends[2 * e + 1]];
			if (u == held || v == held)
				continue;
			if (!pass) {
				next[(u < v ? u : v) + 1]++;
				continue;
			}
			const uint32_t to = next[u < v ? u : v]++;
			f->row[to] = ldl_place_in(ldl, ldl_part_of(ldl, u < v ? u : v), u < v ? v : u);
			f->value[to] = weight[e];
		}
		for (uint32_t k = 0; k < ldl->place_count && !pass; k++)
			next[k + 1] += next[k];
	}
	for (size_t i = 0; i < 2 * (size_t)graph->edge_count; i++)
		f->diagonal[ldl->rank[graph->ends[i]]] += weight[i / 2];
	f->diagonal[held] = 1;
}

/* The panel's sums as A has them. */
static void start_panel(struct factor *f, const struct ldl *ldl, const struct ldl_panel *panel)
{
	const uint32_t *const row = ldl->row + panel->row;
	const uint32_t width = panel->width;
	for (uint32_t c = 0; c < width; c++)
		f->at[panel->first + c] = c;
	for (uint32_t r = 0; r < panel->row_count; r++)
		f->at[row[r]] = width + r;
	memset(f->sum, 0, (size_t)(width + panel->row_count) * LDL_PANEL_WIDTH * sizeof *f->sum);
	for (uint32_t c = 0; c < width; c++) {
		const uint32_t k = panel->first + c;
		f->sum[c * LDL_PANEL_WIDTH + c] = f->diagonal[k];
		for (uint32_t a = f->first[k]; a < f->first[k + 1]; a++)
			f->sum[(size_t)f->at[f->row[a]] * LDL_PANEL_WIDTH + c] -= f->value[a];
	}
}

/* Puts a panel in the list of the one that holds its next row. */
static void wait_for_next(struct factor *f, const struct ldl *ldl, uint32_t p)
{
	const struct ldl_panel *const panel = &ldl->panel[p];
	if (f->position[p] == panel->row_count)
		return;
	const uint32_t to = f->panel_of[ldl->original[ldl->row[panel->row + f->position[p]]]];
	f->next[p] = f->waiting[to];
	f->waiting[to] = p;
}

/* The current panel loses what the panel q, which has rows among its columns, contributes. Where q is in a part and the
 * panel in the top, q's rows are copies of the panel's. */
static uint64_t subtract(struct factor *f, const struct ldl *ldl, const struct ldl_panel *panel, uint32_t q)
{
	const struct ldl_panel *const from = &ldl->panel[q];
	const uint32_t width = from->width, start = f->position[q], count = from->row_count - start;
	const float *const l = ldl->value + from->value + (size_t)(width + start) * width;
	const uint32_t *row = ldl->row + from->row + start;
	double share[LDL_PANEL_WIDTH * LDL_PANEL_WIDTH] = {0};
	uint32_t inside = 0;
	if (ldl->original[row[0]] != row[0] && panel->first >= ldl->part[ldl->part_count].first) {
		for (uint32_t i = 0; i < count; i++)
			f->home[i] = ldl->original[row[i]];
		row = f->home;
	}
	for (; inside < count && row[inside] - panel->first < panel->width; inside++)
		for (uint32_t c = 0; c < width; c++)
			share[c * LDL_PANEL_WIDTH + row[inside] - panel->first] =
				(double)l[inside * width + c] * f->d[from->first + c];
	ldl_kernels_of(ldl->isa)->subtract(f->sum, f->at, row, count, l, width, share);
	f->position[q] += inside;
	return (uint64_t)count * width * panel->width;
}

/* One row of the panel's sums becomes one of L: y = l D L' with the square's L; the columns before `count`. */
static void eliminate_row(const double *y, const float *inverse, const double *d, double (*square)[LDL_PANEL_WIDTH],
			  uint32_t count, double *l)
{
	for (uint32_t c = 0; c < count; c++) {
		double left = y[c];
		for (uint32_t b = 0; b < c; b++)
			left -= l[b] * d[b] * square[c][b];
		l[c] = left * (double)inverse[c];
	}
}

static void finish_panel(struct factor *f, struct ldl *ldl, const struct ldl_panel *panel)
{
	const uint32_t width = panel->width;
	float *const inverse = ldl->inverse + panel->first, *value = ldl->value + panel->value;
	double *const d = f->d + panel->first;
	double square[LDL_PANEL_WIDTH][LDL_PANEL_WIDTH] = {0};
	for (uint32_t c = 0; c < width; c++) {
		const double *const y = f->sum + (size_t)c * LDL_PANEL_WIDTH, own = f->diagonal[panel->first + c];
		double left = y[c];
		eliminate_row(y, inverse, d, square, c, square[c]);
		for (uint32_t b = 0; b < c; b++)
			left -= square[c][b] * square[c][b] * d[b];
		/* What is left of a vertex's own weight: too little means that nothing holds it. */
		if (!(left > 1e-12 * own))
			left = own > 0 ? 1e-12 * own : 1;
		inverse[c] = (float)(1 / left);
		d[c] = 1 / (double)inverse[c];
		for (uint32_t b = 0; b < width; b++)
			*value++ = (float)square[c][b];
	}
	for (uint32_t r = 0; r < panel->row_count; r++) {
		double l[LDL_PANEL_WIDTH];
		eliminate_row(f->sum + (size_t)(width + r) * LDL_PANEL_WIDTH, inverse, d, square, width, l);
		for (uint32_t b = 0; b < width; b++)
			*value++ = (float)l[b];
	}
}

static enum tw_status factorise(struct factor *f, struct ldl *ldl, ldl_goes_on *goes_on, void *context)
{
	uint64_t done = 0;
	for (uint32_t p = 0; p < ldl->panel_count; p++) {
		const struct ldl_panel *const panel = &ldl->panel[p];
		start_panel(f, ldl, panel);
		for (uint32_t q = f->waiting[p], next; q != NONE; q = next) {
			next = f->next[q];
			done += subtract(f, ldl, panel, q);
			wait_for_next(f, ldl, q);
		}
		finish_panel(f, ldl, panel);
		wait_for_next(f, ldl, p);
		done += (uint64_t)panel->row_count * panel->width;
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
	const struct arena_mark mark = arena_mark(scratch);
	struct factor f;
	enum tw_status status = allocate(&f, scratch, ldl, graph->edge_count);
	if (status == TW_OK) {
		build_matrix(&f, ldl, graph, weight, ldl->rank[ground]);
		for (uint32_t p = 0; p < ldl->panel_count; p++)
			for (uint32_t c = 0; c < ldl->panel[p].width; c++)
				f.panel_of[ldl->panel[p].first + c] = p;
		memset(f.waiting, 0xff, ldl->panel_count * sizeof *f.waiting);
		status = factorise(&f, ldl, goes_on, context);
	}
	arena_release(scratch, mark);
	return status;
}
