/* One uniform grid per piece, about as many cells as the piece has faces; a cell lists the faces whose boxes meet it,
 * in ascending order. A point is looked up in its own cell and then in rings of cells around it, until no farther ring
 * can hold anything nearer. */
#include "solver/pattern/locate.h"

#include <stdbool.h>
#include <string.h>

struct grid {
	struct vec2 origin;
	double cell; /* mm */
	uint32_t columns, rows;
	uint32_t first_cell; /* of the locator's cells */
};

struct locator {
	const struct garment *garment;
	struct grid *grid; /* [piece_count] */
	uint32_t *first;   /* [cells + 1] where a cell's faces begin */
	uint32_t *face;
};

static struct vec2 corner_of(const struct garment *garment, uint32_t face, uint32_t k)
{
	const double *uv = &garment->pattern[2 * (size_t)garment->face_coord[3 * (size_t)face + k]];
	return (struct vec2){uv[0], uv[1]};
}

struct box {
	struct vec2 low, high;
};

static void box_add(struct box *box, struct vec2 p)
{
	box->low = (struct vec2){p.x < box->low.x ? p.x : box->low.x, p.y < box->low.y ? p.y : box->low.y};
	box->high = (struct vec2){p.x > box->high.x ? p.x : box->high.x, p.y > box->high.y ? p.y : box->high.y};
}

static const struct box box_empty = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};

static struct box face_box(const struct garment *garment, uint32_t face)
{
	struct box box = box_empty;
	for (uint32_t k = 0; k < 3; k++)
		box_add(&box, corner_of(garment, face, k));
	return box;
}

static uint32_t clamp_cell(double at, uint32_t count)
{
	return at < 0 ? 0 : at >= count ? count - 1 : (uint32_t)at;
}

struct range {
	uint32_t column0, column1, row0, row1; /* inclusive */
};

static struct range cells_of(const struct grid *grid, const struct box *box)
{
	return (struct range){
		clamp_cell((box->low.x - grid->origin.x) / grid->cell, grid->columns),
		clamp_cell((box->high.x - grid->origin.x) / grid->cell, grid->columns),
		clamp_cell((box->low.y - grid->origin.y) / grid->cell, grid->rows),
		clamp_cell((box->high.y - grid->origin.y) / grid->cell, grid->rows),
	};
}

/* Sizes every piece's grid; returns the number of cells. */
static uint32_t size_grids(struct grid *grid, const struct garment *garment, struct box *box, uint32_t *faces)
{
	for (uint32_t p = 0; p < garment->piece_count; p++)
		box[p] = box_empty;
	for (uint32_t f = 0; f < garment->face_count; f++) {
		uint32_t p = garment->face_piece[f];
		faces[p]++;
		for (uint32_t k = 0; k < 3; k++)
			box_add(&box[p], corner_of(garment, f, k));
	}
	uint32_t cells = 0;
	for (uint32_t p = 0; p < garment->piece_count; p++) {
		double width = box[p].high.x - box[p].low.x, height = box[p].high.y - box[p].low.y;
		double count = faces[p] > 0 ? faces[p] : 1;
		/* A long thin piece gets cells along its length, never more than about two per face. */
		double cell = sqrt(width * height / count), least = (width > height ? width : height) / count;
		cell = cell > least ? cell : least;
		if (!(cell > 0))
			cell = 1;
		grid[p] = (struct grid){.origin = box[p].low, .cell = cell, .first_cell = cells};
		grid[p].columns = faces[p] ? (uint32_t)(width / cell) + 1 : 1;
		grid[p].rows = faces[p] ? (uint32_t)(height / cell) + 1 : 1;
		cells += grid[p].columns * grid[p].rows;
	}
	return cells;
}

/* Visits the cells of every face; in the first pass they are counted, in the second filled. */
static void visit(struct locator *locator, const struct garment *garment, bool fill)
{
	for (uint32_t f = 0; f < garment->face_count; f++) {
		const struct grid *grid = &locator->grid[garment->face_piece[f]];
		struct box box = face_box(garment, f);
		struct range range = cells_of(grid, &box);
		for (uint32_t row = range.row0; row <= range.row1; row++) {
			for (uint32_t column = range.column0; column <= range.column1; column++) {
				uint32_t cell = grid->first_cell + row * grid->columns + column;
				if (fill)
					locator->face[locator->first[cell]++] = f;
				else
					locator->first[cell + 1]++;
			}
		}
	}
}

enum tw_status locator_build(const struct locator **result, struct arena *arena, const struct garment *garment,
			     struct tw_error *error)
{
	struct locator *locator = ARENA_ZEROED(arena, 1, struct locator);
	struct box *box = ARENA_ARRAY(arena, garment->piece_count, struct box);
	uint32_t *faces = ARENA_ZEROED(arena, garment->piece_count, uint32_t);
	if (!locator || !box || !faces)
		return tw_fail_memory(error);
	locator->garment = garment;
	locator->grid = ARENA_ARRAY(arena, garment->piece_count, struct grid);
	if (!locator->grid)
		return tw_fail_memory(error);
	uint32_t cells = size_grids(locator->grid, garment, box, faces);
	locator->first = ARENA_ZEROED(arena, (size_t)cells + 1, uint32_t);
	if (!locator->first)
		return tw_fail_memory(error);
	visit(locator, garment, false);
	for (uint32_t c = 0; c < cells; c++)
		locator->first[c + 1] += locator->first[c];
	locator->face = ARENA_ARRAY(arena, locator->first[cells], uint32_t);
	if (!locator->face)
		return tw_fail_memory(error);
	visit(locator, garment, true);
	/* Filling moved every cell's begin to its end, which is the next one's begin. */
	memmove(locator->first + 1, locator->first, cells * sizeof *locator->first);
	locator->first[0] = 0;
	*result = locator;
	return TW_OK;
}

/* The nearest point of a face: inside by its barycentric weights, else on the nearest side. */
static void nearest_in_face(const struct garment *garment, uint32_t face, struct vec2 point, struct place *place)
{
	struct vec2 corner[3];
	for (uint32_t k = 0; k < 3; k++)
		corner[k] = corner_of(garment, face, k);
	double area = vec2_cross(vec2_sub(corner[1], corner[0]), vec2_sub(corner[2], corner[0]));
	double weight[3];
	for (uint32_t k = 0; k < 3; k++)
		weight[k] =
			vec2_cross(vec2_sub(corner[(k + 1) % 3], point), vec2_sub(corner[(k + 2) % 3], point)) / area;
	place->face = face;
	place->distance = 0;
	if (weight[0] >= 0 && weight[1] >= 0 && weight[2] >= 0) {
		memcpy(place->barycentric, weight, sizeof weight);
		return;
	}
	place->distance = INFINITY;
	for (uint32_t k = 0; k < 3; k++) {
		uint32_t next = (k + 1) % 3;
		double t = vec2_nearest(corner[k], corner[next], point);
		double distance = vec2_distance(point, vec2_mix(corner[k], corner[next], t));
		if (distance >= place->distance)
			continue;
		place->distance = distance;
		place->barycentric[k] = 1 - t;
		place->barycentric[next] = t;
		place->barycentric[(k + 2) % 3] = 0;
	}
	if (place->distance < 1e-9)
		place->distance = 0;
}

static void search_cell(const struct locator *locator, uint32_t cell, struct vec2 point, struct place *best)
{
	for (uint32_t i = locator->first[cell]; i < locator->first[cell + 1]; i++) {
		struct place place;
		nearest_in_face(locator->garment, locator->face[i], point, &place);
		if (place.distance < best->distance || (place.distance == best->distance && place.face < best->face))
			*best = place;
	}
}

/* The cells whose larger offset from (column, row) is `ring`. */
static void search_ring(const struct locator *locator, const struct grid *grid, int64_t column, int64_t row,
			int64_t ring, struct vec2 point, struct place *best)
{
	for (int64_t y = row - ring; y <= row + ring; y++) {
		if (y < 0 || y >= grid->rows)
			continue;
		bool edge = y == row - ring || y == row + ring;
		int64_t step = edge || ring == 0 ? 1 : 2 * ring;
		for (int64_t x = column - ring; x <= column + ring; x += step)
			if (x >= 0 && x < grid->columns)
				search_cell(locator, grid->first_cell + (uint32_t)(y * grid->columns + x), point, best);
	}
}

void locator_find(const struct locator *locator, uint32_t piece, struct vec2 point, struct place *place)
{
	const struct grid *grid = &locator->grid[piece];
	int64_t column = clamp_cell((point.x - grid->origin.x) / grid->cell, grid->columns);
	int64_t row = clamp_cell((point.y - grid->origin.y) / grid->cell, grid->rows);
	*place = (struct place){.face = GARMENT_NONE, .distance = INFINITY};
	int64_t last = grid->columns > grid->rows ? grid->columns : grid->rows;
	/* What lies in ring r is at least r - 1 cells away. */
	for (int64_t ring = 0; ring <= last; ring++) {
		if (place->distance < (double)(ring - 1) * grid->cell || (ring > 0 && place->distance == 0))
			break;
		search_ring(locator, grid, column, row, ring, point, place);
	}
}

/* Keeps t[0…count) ascending and without near doubles. */
static uint32_t insert(double *t, uint32_t count, uint32_t limit, double value)
{
	uint32_t at = 0;
	while (at < count && t[at] < value - 1e-9)
		at++;
	if (at < count && t[at] <= value + 1e-9)
		return count;
	if (count < limit) {
		memmove(&t[at + 1], &t[at], (count - at) * sizeof *t);
		t[at] = value;
	}
	return count + 1;
}

static uint32_t cut_by_face(const struct garment *garment, uint32_t face, struct vec2 a, struct vec2 b, double *t,
			    uint32_t count, uint32_t limit)
{
	struct vec2 d = vec2_sub(b, a);
	for (uint32_t k = 0; k < 3; k++) {
		struct vec2 p = corner_of(garment, face, k), q = corner_of(garment, face, (k + 1) % 3);
		double side_p = vec2_cross(d, vec2_sub(p, a)), side_q = vec2_cross(d, vec2_sub(q, a));
		if ((side_p > 0 && side_q > 0) || (side_p < 0 && side_q < 0) || side_p == side_q)
			continue;
		struct vec2 hit = vec2_mix(p, q, side_p / (side_p - side_q));
		double at = vec2_dot(vec2_sub(hit, a), d) / vec2_dot(d, d);
		if (at > 1e-9 && at < 1 - 1e-9 && count < limit)
			count = insert(t, count, limit, at);
	}
	return count;
}

uint32_t locator_cuts(const struct locator *locator, uint32_t piece, struct vec2 a, struct vec2 b, double *t,
		      uint32_t limit)
{
	const struct grid *grid = &locator->grid[piece];
	struct box box = box_empty;
	box_add(&box, a);
	box_add(&box, b);
	struct range range = cells_of(grid, &box);
	uint32_t count = 0;
	for (uint32_t row = range.row0; row <= range.row1; row++) {
		for (uint32_t column = range.column0; column <= range.column1; column++) {
			uint32_t cell = grid->first_cell + row * grid->columns + column;
			for (uint32_t i = locator->first[cell]; i < locator->first[cell + 1]; i++)
				count = cut_by_face(locator->garment, locator->face[i], a, b, t, count, limit);
		}
	}
	return count;
}

struct vec2 place_on_pattern(const struct garment *garment, const struct place *place)
{
	struct vec2 sum = {0, 0};
	for (uint32_t k = 0; k < 3; k++)
		sum = vec2_along(sum, corner_of(garment, place->face, k), place->barycentric[k]);
	return sum;
}

void place_on_worn(const struct garment *garment, const struct place *place, double point[3])
{
	point[0] = point[1] = point[2] = 0;
	for (uint32_t k = 0; k < 3; k++) {
		const double *x = &garment->position[3 * (size_t)garment->face_vertex[3 * (size_t)place->face + k]];
		for (int i = 0; i < 3; i++)
			point[i] += place->barycentric[k] * x[i];
	}
}

void place_in_frame(const struct garment *garment, const struct place *place, const float *positions, double point[3])
{
	point[0] = point[1] = point[2] = 0;
	for (uint32_t k = 0; k < 3; k++) {
		const float *x = &positions[3 * (size_t)garment->face_vertex[3 * (size_t)place->face + k]];
		for (int i = 0; i < 3; i++)
			point[i] += place->barycentric[k] * (double)x[i];
	}
}
