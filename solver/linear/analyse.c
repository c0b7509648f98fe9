/* Purpose: order the vertices, cut the elimination tree into parts, and find where L is not 0.
 *
 * The order is AMD's (P. R. Amestoy, T. A. Davis & I. S. Duff, An approximate minimum degree ordering algorithm, SIAM
 * J. Matrix Anal. Appl. 17, 1996), then postordered, so that each subtree of the elimination tree (J. W. H. Liu, The
 * role of elimination trees in sparse factorization, SIAM J. Matrix Anal. Appl. 11, 1990) is a range; then the subtrees
 * above a size, which are the top, are put behind the others. Row k of L has an entry in every column of the tree that
 * lies between an entry of A's row and k: that counts the columns' entries, and later lists the panels' rows, which
 * ascend by themselves. */
#include "solver/linear/ldl.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <suitesparse/amd.h>

#define NONE UINT32_MAX

/* The tree is cut into about this many parts, but none smaller than the other number. With 8 and 24 parts an iteration
 * at 23,729 vertices took 1.6 ms on two threads, with 16 1.5. */
enum { PARTS = 16, PART_LEAST = 64 };

/* What the analysis works with; numbers of vertices are the caller's, columns are numbered in elimination order. */
struct analysis {
	uint32_t n;
	const struct ldl_graph *graph;
	int32_t *first, *neighbour; /* [n + 1], [2 * edge_count] */
	uint32_t *vertex;           /* [n] of each column */
	uint32_t *column;           /* [n] of each vertex */
	uint32_t *parent;           /* [n] of columns in the elimination tree */
	uint32_t *count;            /* [n] entries of L's column below the diagonal */
	uint32_t *mark;             /* [n] scratch */
	uint32_t *other, *third;    /* [n] scratch */
	uint32_t *panel_of;         /* [n] */
	uint32_t top;               /* the top's first column */
	uint32_t *part_end;         /* [part_count] columns */
	uint32_t part_count;
};

static enum tw_status allocate(struct analysis *a, struct arena *arena, const struct ldl_graph *graph)
{
	const size_t n = graph->vertex_count, m = graph->edge_count;
	*a = (struct analysis){
		.n = graph->vertex_count,
		.graph = graph,
		.first = ARENA_ZEROED(arena, n + 2, int32_t),
		.neighbour = ARENA_ARRAY(arena, 2 * m, int32_t),
		.vertex = ARENA_ARRAY(arena, n, uint32_t),
		.column = ARENA_ARRAY(arena, n, uint32_t),
		.parent = ARENA_ARRAY(arena, n, uint32_t),
		.count = ARENA_ARRAY(arena, n, uint32_t),
		.mark = ARENA_ARRAY(arena, n, uint32_t),
		.other = ARENA_ARRAY(arena, n, uint32_t),
		.third = ARENA_ARRAY(arena, n, uint32_t),
		.panel_of = ARENA_ARRAY(arena, n, uint32_t),
		.part_end = ARENA_ARRAY(arena, n, uint32_t),
	};
	return a->first && a->neighbour && a->vertex && a->column && a->parent && a->count && a->mark && a->other &&
			       a->third && a->panel_of && a->part_end && 2 * m < INT32_MAX
		       ? TW_OK
		       : TW_ERROR_MEMORY;
}

static void list_neighbours(struct analysis *a)
{
	const uint32_t *const ends = a->graph->ends;
	int32_t *const next = a->first + 1;
	for (size_t i = 0; i < 2 * (size_t)a->graph->edge_count; i++)
		next[ends[i] + 1]++;
	for (size_t k = 0; k < a->n; k++)
		next[k + 1] += next[k];
	for (size_t i = 0; i < 2 * (size_t)a->graph->edge_count; i++)
		a->neighbour[next[ends[i]]++] = (int32_t)ends[i ^ 1];
}

/* AMD wants columns of the whole pattern; it sorts out what is there twice. */
static enum tw_status order(struct analysis *a)
{
	const int result = amd_order((int32_t)a->n, a->first, a->neighbour, (int32_t *)a->vertex, NULL, NULL);
	if (result != AMD_OK && result != AMD_OK_BUT_JUMBLED)
		return TW_ERROR_MEMORY;
	for (uint32_t k = 0; k < a->n; k++)
		a->column[a->vertex[k]] = k;
	return TW_OK;
}

/* Liu's algorithm: `ancestor` shortens the ways up. */
static void grow_tree(struct analysis *a)
{
	uint32_t *const ancestor = a->other;
	for (uint32_t k = 0; k < a->n; k++) {
		const uint32_t v = a->vertex[k];
		a->parent[k] = ancestor[k] = NONE;
		for (int32_t p = a->first[v]; p < a->first[v + 1]; p++)
			for (uint32_t i = a->column[a->neighbour[p]]; i != NONE && i < k;) {
				const uint32_t next = ancestor[i];
				ancestor[i] = k;
				if (next == NONE)
					a->parent[i] = k;
				i = next;
			}
	}
}

/* Lists the columns in postorder, children in the order of their numbers: AMD puts the child last that has most in
 * common with its parent. */
static void list_postorder(const struct analysis *a, uint32_t *post, uint32_t *child, uint32_t *sibling)
{
	uint32_t root = NONE, count = 0;
	memset(child, 0xff, a->n * sizeof *child);
	for (uint32_t k = a->n; k-- > 0;) {
		uint32_t *const list = a->parent[k] == NONE ? &root : &child[a->parent[k]];
		sibling[k] = *list;
		*list = k;
	}
	while (root != NONE) {
		uint32_t k = root;
		root = sibling[root];
		for (;;) {
			while (child[k] != NONE) {
				const uint32_t down = child[k];
				child[k] = sibling[down];
				k = down;
			}
			post[count++] = k;
			if (a->parent[k] == NONE)
				break;
			k = a->parent[k];
		}
	}
	assert(count == a->n);
}

/* Renumbers the columns: small subtrees one after the other, in parts of at most `most` columns; then all others. */
static void cut_into_parts(struct analysis *a, const uint32_t *post, uint32_t *size, uint32_t *number)
{
	const uint32_t most = a->n / PARTS > PART_LEAST ? a->n / PARTS : PART_LEAST;
	uint32_t next = 0, start = 0;
	for (uint32_t k = 0; k < a->n; k++)
		size[k] = 1;
	for (uint32_t k = 0; k < a->n; k++)
		if (a->parent[k] != NONE)
			size[a->parent[k]] += size[k];
	a->part_count = 0;
	for (uint32_t i = 0; i < a->n; i++) {
		const uint32_t k = post[i];
		if (size[k] > most || (a->parent[k] != NONE && size[a->parent[k]] <= most))
			continue;
		if (next > start && next - start + size[k] > most) {
			a->part_end[a->part_count++] = next;
			start = next;
		}
		for (uint32_t j = i + 1 - size[k]; j <= i; j++)
			number[post[j]] = next++;
	}
	if (next > start)
		a->part_end[a->part_count++] = next;
	a->top = next;
	for (uint32_t i = 0; i < a->n; i++)
		if (size[post[i]] > most)
			number[post[i]] = next++;
	assert(next == a->n);
}

static void renumber(struct analysis *a, const uint32_t *number)
{
	uint32_t *const parent = a->other;
	for (uint32_t k = 0; k < a->n; k++)
		parent[number[k]] = a->parent[k] == NONE ? NONE : number[a->parent[k]];
	memcpy(a->parent, parent, a->n * sizeof *parent);
	for (uint32_t v = 0; v < a->n; v++) {
		a->column[v] = number[a->column[v]];
		a->vertex[a->column[v]] = v;
	}
}

static void count_entries(struct analysis *a, size_t *entries)
{
	*entries = 0;
	memset(a->count, 0, a->n * sizeof *a->count);
	for (uint32_t k = 0; k < a->n; k++) {
		const uint32_t v = a->vertex[k];
		a->mark[k] = k;
		for (int32_t p = a->first[v]; p < a->first[v + 1]; p++) {
			const uint32_t start = a->column[a->neighbour[p]];
			for (uint32_t i = start; start < k && a->mark[i] != k; i = a->parent[i]) {
				a->mark[i] = k;
				a->count[i]++;
				(*entries)++;
			}
		}
	}
}

/* Whether a panel may take one more column, its parent in the tree, at the price of `zeros` zeros among `entries`. An
 * iteration at 23,729 vertices took 2.83, 2.76 and 2.72 ms with none, a quarter and two fifths of them. */
static bool is_worth_it(uint64_t zeros, uint64_t entries)
{
	return zeros * 4 <= entries;
}

static enum tw_status make_panels(struct ldl *ldl, struct arena *arena, struct analysis *a)
{
	struct ldl_panel *panel = NULL;
	uint64_t zeros = 0;
	ldl->panel = ARENA_ARRAY(arena, a->n, struct ldl_panel);
	if (!ldl->panel)
		return TW_ERROR_MEMORY;
	for (uint32_t k = 0; k < a->n; k++) {
		if (panel && panel->width < LDL_PANEL_WIDTH && a->parent[k - 1] == k && k != a->top) {
			const uint64_t more = zeros + (uint64_t)panel->width * (a->count[k] + 1 - a->count[k - 1]);
			if (is_worth_it(more, (uint64_t)(panel->width + 1) * a->count[k])) {
				zeros = more;
				panel->width++;
				panel->row_count = a->count[k];
				a->panel_of[k] = ldl->panel_count - 1;
				continue;
			}
		}
		a->panel_of[k] = ldl->panel_count;
		panel = &ldl->panel[ldl->panel_count++];
		*panel = (struct ldl_panel){.first = k, .width = 1, .row_count = a->count[k]};
		zeros = 0;
	}
	for (uint32_t p = 0; p < ldl->panel_count; p++) {
		panel = &ldl->panel[p];
		panel->row = ldl->row_count;
		panel->value = ldl->value_count;
		ldl->row_count += panel->row_count;
		ldl->value_count += (size_t)(panel->width + panel->row_count) * panel->width;
		ldl->operations += (uint64_t)panel->row_count * panel->row_count * panel->width;
	}
	return TW_OK;
}

/* In columns; places follow. */
static void list_rows(struct ldl *ldl, const struct analysis *a)
{
	uint32_t *const seen = a->mark, *const filled = a->other;
	memset(seen, 0xff, a->n * sizeof *seen);
	memset(filled, 0, a->n * sizeof *filled);
	for (uint32_t k = 0; k < a->n; k++) {
		const uint32_t v = a->vertex[k];
		seen[a->panel_of[k]] = k;
		for (int32_t p = a->first[v]; p < a->first[v + 1]; p++) {
			const uint32_t start = a->column[a->neighbour[p]];
			if (start > k)
				continue;
			for (uint32_t q = a->panel_of[start]; seen[q] != k;) {
				const struct ldl_panel *const panel = &ldl->panel[q];
				seen[q] = k;
				ldl->row[panel->row + filled[q]++] = k;
				q = a->panel_of[a->parent[panel->first + panel->width - 1]];
			}
		}
	}
	for (uint32_t q = 0; q < ldl->panel_count; q++)
		assert(filled[q] == ldl->panel[q].row_count);
}

static int compare_columns(const void *a, const void *b)
{
	const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
	return (x > y) - (x < y);
}

/* Lists the top's columns that a part's columns have rows in: copy[] of them, ascending. Those of a panel are also its
 * parent's, so that the subtrees' roots have them all. */
static uint32_t list_copies(const struct ldl *ldl, const struct analysis *a, uint32_t part, uint32_t end,
			    uint32_t *copy)
{
	const struct ldl_part *const it = &ldl->part[part];
	uint32_t count = 0;
	for (uint32_t q = it->panel; q < it->panel_end; q++) {
		const struct ldl_panel *const panel = &ldl->panel[q];
		const uint32_t parent = a->parent[panel->first + panel->width - 1];
		if (parent == NONE || parent < end)
			continue;
		for (uint32_t i = 0; i < panel->row_count; i++) {
			const uint32_t row = ldl->row[panel->row + i];
			if (a->mark[row] == part)
				continue;
			a->mark[row] = part;
			copy[count++] = row;
		}
	}
	qsort(copy, count, sizeof *copy, compare_columns);
	return count;
}

/* Gives every part its places: its columns, then the copies. copy[] has as much room as all parts' roots have rows. */
static void place_parts(struct ldl *ldl, const struct analysis *a, uint32_t *copy)
{
	uint32_t q = 0, place = 0, *copies = copy;
	memset(a->mark, 0xff, a->n * sizeof *a->mark);
	for (uint32_t part = 0; part <= ldl->part_count; part++) {
		struct ldl_part *const it = &ldl->part[part];
		const uint32_t start = part ? a->part_end[part - 1] : 0;
		const uint32_t end = part < ldl->part_count ? a->part_end[part] : a->n;
		*it = (struct ldl_part){.panel = q, .first = place, .end = place + end - start};
		while (q < ldl->panel_count && ldl->panel[q].first < end)
			q++;
		it->panel_end = q;
		const uint32_t count = list_copies(ldl, a, part, end, copies);
		copies += count;
		it->copies_end = place = it->end + count;
	}
	ldl->place_count = place;
}

/* Every column's place is its own, in the part; a row of the top is in a part the place of the copy. */
static void name_places(struct ldl *ldl, const struct analysis *a, const uint32_t *copy)
{
	const uint32_t top_place = ldl->part[ldl->part_count].first;
	uint32_t *const place = a->other;
	for (uint32_t part = 0, k = 0; part <= ldl->part_count; part++) {
		const struct ldl_part *const it = &ldl->part[part];
		for (uint32_t p = it->first; p < it->end; p++, k++) {
			place[k] = p;
			ldl->original[p] = p;
			ldl->rank[a->vertex[k]] = p;
		}
		for (uint32_t p = it->end; p < it->copies_end; p++) {
			place[*copy] = p;
			ldl->original[p] = top_place + (*copy++ - a->top);
		}
		for (uint32_t q = it->panel; q < it->panel_end; q++) {
			struct ldl_panel *const panel = &ldl->panel[q];
			panel->first = place[panel->first];
			for (uint32_t i = 0; i < panel->row_count; i++)
				ldl->row[panel->row + i] = place[ldl->row[panel->row + i]];
		}
	}
}

/* How many copies the parts can have, at most. */
static size_t copies_most(const struct ldl *ldl, const struct analysis *a)
{
	size_t sum = 0;
	for (uint32_t q = 0; q < ldl->panel_count && ldl->panel[q].first < a->top; q++) {
		const uint32_t parent = a->parent[ldl->panel[q].first + ldl->panel[q].width - 1];
		sum += parent != NONE && parent >= a->top ? ldl->panel[q].row_count : 0;
	}
	return sum;
}

static enum tw_status lay_out(struct ldl *ldl, struct arena *arena, struct arena *scratch, const struct analysis *a)
{
	const size_t most = copies_most(ldl, a);
	ldl->part_count = a->part_count;
	ldl->row = ARENA_ARRAY(arena, ldl->row_count, uint32_t);
	ldl->value = ARENA_ARRAY(arena, ldl->value_count, float);
	ldl->part = ARENA_ARRAY(arena, (size_t)a->part_count + 1, struct ldl_part);
	ldl->original = ARENA_ARRAY(arena, a->n + most, uint32_t);
	ldl->inverse = ARENA_ZEROED(arena, a->n + most, float);
	uint32_t *copy = ARENA_ARRAY(scratch, most, uint32_t);
	if (!ldl->row || !ldl->value || !ldl->part || !ldl->original || !ldl->inverse || !copy)
		return TW_ERROR_MEMORY;
	list_rows(ldl, a);
	place_parts(ldl, a, copy);
	name_places(ldl, a, copy);
	return TW_OK;
}

static enum tw_status analyse(struct ldl *ldl, struct arena *arena, struct arena *scratch,
			      const struct ldl_graph *graph, size_t entries_most)
{
	struct analysis a;
	size_t entries;
	enum tw_status status = allocate(&a, scratch, graph);
	if (status != TW_OK)
		return status;
	list_neighbours(&a);
	status = order(&a);
	if (status != TW_OK)
		return status;
	grow_tree(&a);
	list_postorder(&a, a.mark, a.other, a.third);
	cut_into_parts(&a, a.mark, a.count, a.third);
	renumber(&a, a.third);
	count_entries(&a, &entries);
	if (entries > entries_most)
		return TW_ERROR_MEMORY;
	status = make_panels(ldl, arena, &a);
	return status == TW_OK ? lay_out(ldl, arena, scratch, &a) : status;
}

/* The scratch has a life of its own, because what stays is allocated while it is there; it counts in the arena's
 * budget. */
enum tw_status ldl_analyse(struct ldl *ldl, struct arena *arena, const struct ldl_graph *graph, size_t entries_most)
{
	const size_t n = graph->vertex_count, m = graph->edge_count;
	const size_t bytes = (12 * n + 2 * m) * sizeof(uint32_t);
	*ldl = (struct ldl){
		.vertex_count = graph->vertex_count,
		.rank = ARENA_ARRAY(arena, n, uint32_t),
		.isa = isa_best(),
	};
	if (!ldl->rank || !arena_charge(arena, bytes))
		return TW_ERROR_MEMORY;
	struct arena *scratch = arena_new(0);
	const enum tw_status status = scratch ? analyse(ldl, arena, scratch, graph, entries_most) : TW_ERROR_MEMORY;
	arena_free(scratch);
	arena_discharge(arena, bytes);
	return status;
}

uint32_t ldl_part_of(const struct ldl *ldl, uint32_t place)
{
	uint32_t low = 0, high = ldl->part_count;
	while (low < high) {
		const uint32_t middle = low + (high - low) / 2;
		if (ldl->part[middle].copies_end <= place)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

uint32_t ldl_place_in(const struct ldl *ldl, uint32_t part, uint32_t place)
{
	const struct ldl_part *const it = &ldl->part[part];
	if (place >= it->first && place < it->end)
		return place;
	uint32_t low = it->end, high = it->copies_end;
	while (low < high) {
		const uint32_t middle = low + (high - low) / 2;
		if (ldl->original[middle] < place)
			low = middle + 1;
		else
			high = middle;
	}
	assert(low < it->copies_end && ldl->original[low] == place);
	return low;
}
