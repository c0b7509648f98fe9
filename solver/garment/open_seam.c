/* Hems that lie along another hem: seams that were not sewn, because the vertices of their two sides do not coincide.
 *
 * An edge of a hem lies along another where its midpoint does, within a share of its length for curved seams that are
 * cut into other chords. Edges are sorted along the garment's longest axis and compared with those that can reach. */
#include "solver/garment/correspondence.h"
#include "solver/garment/draft.h"

#include <math.h>
#include <stdlib.h>

static const double chord_share = 0.05;

struct hem_edge {
	double low; /* along the axis */
	uint32_t edge;
};

struct hems {
	const struct draft *draft;
	struct hem_edge *sorted;
	uint32_t count;
	size_t axis;
	double longest_mm; /* extent of an edge along the axis */
	double weld_mm;
};

static const double *end_of(const struct hems *hems, uint32_t edge, size_t end)
{
	return hems->draft->garment.position + 3 * (size_t)hems->draft->topology.edge_vertex[2 * (size_t)edge + end];
}

static int compare_edges(const void *a, const void *b)
{
	const struct hem_edge *x = a, *y = b;
	if (x->low != y->low)
		return x->low < y->low ? -1 : 1;
	return (x->edge > y->edge) - (x->edge < y->edge);
}

static size_t longest_axis(const struct garment *garment)
{
	double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
	for (size_t i = 0; i < 3 * (size_t)garment->vertex_count; i++) {
		low[i % 3] = fmin(low[i % 3], garment->position[i]);
		high[i % 3] = fmax(high[i % 3], garment->position[i]);
	}
	size_t axis = 0;
	for (size_t other = 1; other < 3; other++)
		axis = high[other] - low[other] > high[axis] - low[axis] ? other : axis;
	return axis;
}

static enum tw_status collect(struct hems *hems)
{
	const struct draft *draft = hems->draft;
	hems->axis = longest_axis(&draft->garment);
	hems->sorted = ARENA_ARRAY(draft->arena, draft->topology.edge_count, struct hem_edge);
	if (!hems->sorted)
		return tw_fail_memory(draft->error);
	for (uint32_t e = 0; e < draft->topology.edge_count; e++) {
		if (draft->topology.edge_kind[e] != EDGE_HEM)
			continue;
		double a = end_of(hems, e, 0)[hems->axis], b = end_of(hems, e, 1)[hems->axis];
		hems->sorted[hems->count++] = (struct hem_edge){fmin(a, b), e};
		hems->longest_mm = fmax(hems->longest_mm, fabs(a - b));
	}
	qsort(hems->sorted, hems->count, sizeof *hems->sorted, compare_edges);
	return TW_OK;
}

static double edge_length(const struct hems *hems, uint32_t edge)
{
	const double *a = end_of(hems, edge, 0), *b = end_of(hems, edge, 1);
	return sqrt((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]) + (b[2] - a[2]) * (b[2] - a[2]));
}

/* Square of the distance of a point from an edge. */
static double distance_square(const struct hems *hems, uint32_t edge, const double p[3])
{
	const double *a = end_of(hems, edge, 0), *b = end_of(hems, edge, 1);
	double along = 0, whole = 0, square = 0;
	for (int axis = 0; axis < 3; axis++) {
		along += (p[axis] - a[axis]) * (b[axis] - a[axis]);
		whole += (b[axis] - a[axis]) * (b[axis] - a[axis]);
	}
	double t = whole > 0 ? fmin(1, fmax(0, along / whole)) : 0;
	for (int axis = 0; axis < 3; axis++) {
		double d = p[axis] - a[axis] - t * (b[axis] - a[axis]);
		square += d * d;
	}
	return square;
}

/* The first of the sorted edges whose low end is at `from` or beyond. */
static uint32_t first_from(const struct hems *hems, double from)
{
	uint32_t low = 0, high = hems->count;
	while (low < high) {
		uint32_t middle = low + (high - low) / 2;
		if (hems->sorted[middle].low < from)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

static bool lies_along_another(const struct hems *hems, uint32_t edge, uint64_t *budget)
{
	const double *a = end_of(hems, edge, 0), *b = end_of(hems, edge, 1);
	double middle[3] = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
	double reach = hems->weld_mm + chord_share * edge_length(hems, edge), at = middle[hems->axis];
	uint32_t first = first_from(hems, at - reach - hems->longest_mm);
	for (uint32_t i = first; i < hems->count && hems->sorted[i].low <= at + reach && *budget > 0; i++, --*budget) {
		if (hems->sorted[i].edge != edge &&
		    distance_square(hems, hems->sorted[i].edge, middle) <= reach * reach)
			return true;
	}
	return false;
}

enum tw_status draft_warn_of_open_seams(struct draft *draft, double weld_mm)
{
	struct arena_mark mark = arena_mark(draft->arena);
	struct hems hems = {.draft = draft, .weld_mm = weld_mm};
	enum tw_status status = collect(&hems);
	if (status != TW_OK)
		return status;
	uint64_t budget = 10000000 + 1000 * (uint64_t)hems.count;
	uint8_t *is_open = ARENA_ZEROED(draft->arena, hems.count, uint8_t);
	double open_mm = 0;
	if (!is_open)
		return tw_fail_memory(draft->error);
	for (uint32_t i = 0; i < hems.count; i++) {
		is_open[i] = lies_along_another(&hems, hems.sorted[i].edge, &budget);
		open_mm += is_open[i] ? edge_length(&hems, hems.sorted[i].edge) / 2 : 0; /* of two sides */
	}
	for (uint32_t i = 0; i < hems.count && open_mm > 0; i++) {
		if (is_open[i])
			warning_add(&draft->report->warnings, "seams-open", "vertex",
				    garment_file_vertex(&draft->garment,
							draft->topology.edge_vertex[2 * (size_t)hems.sorted[i].edge]),
				    "hems lie along each other for %.4g mm and are not sewn, so that no wire can cross "
				    "there: "
				    "%s",
				    open_mm,
				    weld_mm > 0 ? "give the two sides the same vertices, or try a larger weld_mm"
						: "if they are seams, import again with weld_mm (try 0.01)");
	}
	arena_release(draft->arena, mark);
	return TW_OK;
}
