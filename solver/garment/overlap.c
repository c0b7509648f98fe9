/* Faces that lie on each other in the flat pattern.
 *
 * A uniform grid over the pattern, about one face a cell; every two faces that meet in a cell are compared once, in the
 * cell that holds the lower left corner of what their boxes share. Two triangles overlap unless a side of one has the
 * other wholly outside (separating axes). The work is counted: faces of very uneven size, which could make it
 * quadratic, end it with a warning. */
#include "solver/garment/correspondence.h"
#include "solver/garment/draft.h"

#include <math.h>
#include <string.h>

/* Faces may lie on each other by this much, which is what rounding in a file does. */
static const double touch_mm = 1e-3;

struct box {
	double low[2], high[2];
};

struct grid {
	const struct box *box; /* [face_count] */
	double origin[2];
	double cell;
	uint32_t width, height;
	uint64_t *start; /* [width * height + 1] */
	uint32_t *face;  /* [start[width * height]] */
};

static const double *corner_of(const struct garment *garment, uint32_t face, uint32_t k)
{
	return garment->pattern + 2 * (size_t)garment->face_coord[3 * (size_t)face + k % 3];
}

static double lower(double a, double b)
{
	return a < b ? a : b;
}

static double higher(double a, double b)
{
	return a > b ? a : b;
}

static void stretch(struct box *box, const double *low, const double *high)
{
	for (int axis = 0; axis < 2; axis++) {
		box->low[axis] = lower(box->low[axis], low[axis]);
		box->high[axis] = higher(box->high[axis], high[axis]);
	}
}

static const struct box nothing = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};

static enum tw_status find_boxes(struct draft *draft, struct grid *grid)
{
	const struct garment *garment = &draft->garment;
	struct box *boxes = ARENA_ARRAY(draft->arena, garment->face_count, struct box);
	if (!boxes)
		return tw_fail_memory(draft->error);
	for (uint32_t f = 0; f < garment->face_count; f++) {
		boxes[f] = nothing;
		for (uint32_t k = 0; k < 3; k++)
			stretch(&boxes[f], corner_of(garment, f, k), corner_of(garment, f, k));
	}
	grid->box = boxes;
	return TW_OK;
}

static uint32_t cell_of(const struct grid *grid, int axis, double place)
{
	double cell = (place - grid->origin[axis]) / grid->cell;
	uint32_t last = (axis == 0 ? grid->width : grid->height) - 1;
	return cell <= 0 ? 0 : cell >= last ? last : (uint32_t)cell;
}

/* Whether a side of `a` has all of `b` outside. Both are counter-clockwise. */
static bool is_parted(const struct garment *garment, uint32_t a, uint32_t b)
{
	for (uint32_t k = 0; k < 3; k++) {
		const double *p = corner_of(garment, a, k), *q = corner_of(garment, a, k + 1);
		double x = q[0] - p[0], y = q[1] - p[1], deepest = -INFINITY;
		for (uint32_t i = 0; i < 3; i++) {
			const double *r = corner_of(garment, b, i);
			deepest = higher(deepest, x * (r[1] - p[1]) - y * (r[0] - p[0]));
		}
		if (deepest <= touch_mm * sqrt(x * x + y * y))
			return true;
	}
	return false;
}

static void lay_out(struct grid *grid, const struct garment *garment, double area)
{
	struct box all = nothing;
	for (uint32_t f = 0; f < garment->face_count; f++)
		stretch(&all, grid->box[f].low, grid->box[f].high);
	double size[2] = {all.high[0] - all.low[0], all.high[1] - all.low[1]};
	grid->origin[0] = all.low[0];
	grid->origin[1] = all.low[1];
	/* A face's width, but no more than 4 cells a face. */
	grid->cell =
		fmax(1.5 * sqrt(area / garment->face_count), sqrt(size[0] * size[1] / (4.0 * garment->face_count)));
	grid->cell = fmax(grid->cell, fmax(size[0], size[1]) / 16384);
	grid->width = (uint32_t)(size[0] / grid->cell) + 1;
	grid->height = (uint32_t)(size[1] / grid->cell) + 1;
}

/* For each cell that the face's box touches: counts it (face == NULL), or writes the face there. */
static void enter(const struct grid *grid, uint32_t f, uint32_t *face)
{
	const struct box *box = &grid->box[f];
	uint32_t x0 = cell_of(grid, 0, box->low[0]), x1 = cell_of(grid, 0, box->high[0]);
	uint32_t y0 = cell_of(grid, 1, box->low[1]), y1 = cell_of(grid, 1, box->high[1]);
	for (uint32_t y = y0; y <= y1; y++) {
		for (uint32_t x = x0; x <= x1; x++) {
			uint64_t *start = &grid->start[(uint64_t)y * grid->width + x];
			if (face)
				face[start[1]++] = f;
			else
				start[2]++;
		}
	}
}

static uint64_t box_cells(const struct grid *grid, uint32_t f)
{
	const struct box *box = &grid->box[f];
	uint64_t x = cell_of(grid, 0, box->high[0]) - cell_of(grid, 0, box->low[0]) + 1;
	uint64_t y = cell_of(grid, 1, box->high[1]) - cell_of(grid, 1, box->low[1]) + 1;
	return x * y;
}

/* Sorts the faces into the cells; *filled is false where that would exceed the budget. */
static enum tw_status fill(struct draft *draft, struct grid *grid, bool *filled)
{
	const struct garment *garment = &draft->garment;
	uint64_t budget = 1000000 + 32 * (uint64_t)garment->face_count, entries = 0;
	for (uint32_t f = 0; f < garment->face_count && entries <= budget; f++)
		entries += box_cells(grid, f);
	*filled = entries <= budget;
	if (!*filled)
		return TW_OK;
	size_t cells = (size_t)grid->width * grid->height;
	grid->start = ARENA_ZEROED(draft->arena, cells + 2, uint64_t);
	grid->face = ARENA_ARRAY(draft->arena, entries, uint32_t);
	if (!grid->start || !grid->face)
		return tw_fail_memory(draft->error);
	for (uint32_t f = 0; f < garment->face_count; f++)
		enter(grid, f, NULL);
	for (size_t i = 1; i <= cells; i++)
		grid->start[i + 1] += grid->start[i];
	for (uint32_t f = 0; f < garment->face_count; f++)
		enter(grid, f, grid->face);
	return TW_OK;
}

/* Whether this cell is the one in which `a` and `b` are compared. */
static bool is_first_cell(const struct grid *grid, const struct box *a, const struct box *b, uint32_t x, uint32_t y)
{
	return cell_of(grid, 0, higher(a->low[0], b->low[0])) == x &&
	       cell_of(grid, 1, higher(a->low[1], b->low[1])) == y;
}

static bool boxes_part(const struct box *a, const struct box *b)
{
	return a->high[0] <= b->low[0] || b->high[0] <= a->low[0] || a->high[1] <= b->low[1] || b->high[1] <= a->low[1];
}

static enum tw_status compare_cell(struct draft *draft, const struct grid *grid, uint32_t x, uint32_t y)
{
	const struct garment *garment = &draft->garment;
	const uint64_t *start = &grid->start[(uint64_t)y * grid->width + x];
	for (uint64_t i = start[0]; i < start[1]; i++) {
		uint32_t a = grid->face[i];
		const struct box *box = &grid->box[a];
		for (uint64_t j = i + 1; j < start[1]; j++) {
			uint32_t b = grid->face[j];
			const struct box *other = &grid->box[b];
			if (boxes_part(box, other) || !is_first_cell(grid, box, other, x, y) ||
			    is_parted(garment, a, b) || is_parted(garment, b, a))
				continue;
			uint32_t piece = garment->face_piece[a], other_piece = garment->face_piece[b];
			const char *name = garment->piece_name[piece], *other_name = garment->piece_name[other_piece];
			if (piece == other_piece)
				return fail_at_face(draft, b, "pattern-overlaps-itself",
						    "faces %u and %u of piece %u (%.*s) lie on each other in the flat "
						    "pattern; a piece cannot be cut like that",
						    garment_file_face(garment, a), garment_file_face(garment, b), piece,
						    utf8_cut(name, 60), name);
			warning_add(&draft->report->warnings, "pieces-overlap", "face", garment_file_face(garment, a),
				    "pieces %.*s and %.*s lie on each other in the flat pattern", utf8_cut(name, 60),
				    name, utf8_cut(other_name, 60), other_name);
		}
	}
	return TW_OK;
}

static enum tw_status compare_all(struct draft *draft, const struct grid *grid)
{
	uint64_t budget = 10000000 + 400 * (uint64_t)draft->garment.face_count;
	for (uint32_t y = 0; y < grid->height; y++) {
		for (uint32_t x = 0; x < grid->width; x++) {
			const uint64_t *start = &grid->start[(uint64_t)y * grid->width + x];
			uint64_t faces = start[1] - start[0], pairs = faces * faces / 2;
			if (pairs > budget) {
				warning_add(&draft->report->warnings, "overlap-unchecked", "face",
					    garment_file_face(&draft->garment, grid->face[start[0]]),
					    "faces of very different size lie here, so that overlaps of the pattern "
					    "could not "
					    "be looked for everywhere");
				continue;
			}
			budget -= pairs;
			enum tw_status status = compare_cell(draft, grid, x, y);
			if (status != TW_OK)
				return status;
		}
	}
	return TW_OK;
}

enum tw_status draft_check_overlap(struct draft *draft)
{
	struct grid grid = {0};
	struct arena_mark mark = arena_mark(draft->arena);
	bool filled = false;
	enum tw_status status = find_boxes(draft, &grid);
	if (status != TW_OK)
		return status;
	lay_out(&grid, &draft->garment, draft->report->pattern_area_mm2);
	status = fill(draft, &grid, &filled);
	if (status == TW_OK && filled)
		status = compare_all(draft, &grid);
	else if (status == TW_OK)
		warning_add(&draft->report->warnings, "overlap-unchecked", "face", 0,
			    "faces are of very different size, so that overlaps of the pattern were not looked for");
	arena_release(draft->arena, mark);
	return status;
}
