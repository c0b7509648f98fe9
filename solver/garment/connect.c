/* Edges of a draft, and what must hold of them. */
#include "solver/garment/correspondence.h"
#include "solver/garment/draft.h"

#include <math.h>
#include <stdlib.h>

/* A corner with the pattern position that it has. */
struct corner {
	uint32_t vertex;
	uint32_t coord;
	uint32_t corner;
};

static int compare_numbers(double a, double b)
{
	return (a > b) - (a < b);
}

struct axis_order {
	const double *pattern;
	size_t axis; /* that counts first */
};

/* By position, then by number; the corners are of one vertex. */
static int compare_corners(const void *a, const void *b, void *context)
{
	const struct axis_order *by = context;
	const struct corner *x = a, *y = b;
	for (size_t i = 0; i < 2; i++) {
		size_t axis = i ^ by->axis;
		int order = compare_numbers(by->pattern[2 * (size_t)x->coord + axis],
					    by->pattern[2 * (size_t)y->coord + axis]);
		if (order != 0)
			return order;
	}
	return (x->coord > y->coord) - (x->coord < y->coord);
}

/* How many of the sorted corners follow each other within the tolerance along an axis. */
static uint32_t run_length(const double *pattern, const struct corner *corners, uint32_t count, size_t axis,
			   double tolerance)
{
	uint32_t run = 1;
	while (run < count &&
	       pattern[2 * (size_t)corners[run].coord + axis] - pattern[2 * (size_t)corners[run - 1].coord + axis] <=
		       tolerance)
		run++;
	return run;
}

/* The corners' position becomes one of theirs, which their order in the file does not choose. */
static void take_as_one(struct draft *draft, struct corner *corners, uint32_t count)
{
	struct garment *garment = &draft->garment;
	struct axis_order by_x = {garment->pattern, 0};
	const struct corner *least = corners;
	for (uint32_t i = 1; i < count; i++)
		least = compare_corners(&corners[i], least, &by_x) < 0 ? &corners[i] : least;
	uint32_t coord = least->coord;
	for (uint32_t i = 0; i < count; i++) {
		if (corners[i].coord == coord)
			continue;
		warning_add(&draft->report->warnings, "pattern-positions-shared", "vertex",
			    garment_file_vertex(garment, corners[i].vertex),
			    "pattern positions that a vertex has more than once were taken as one: there is no seam "
			    "between them");
		garment->face_coord[corners[i].corner] = corners[i].coord = coord;
	}
}

static void unite(struct draft *draft, struct corner *corners, uint32_t count, double tolerance)
{
	const double *pattern = draft->garment.pattern;
	bool differ = false;
	for (uint32_t i = 1; i < count; i++)
		differ |= corners[i].coord != corners[0].coord;
	if (!differ)
		return;
	qsort_r(corners, count, sizeof *corners, compare_corners, &(struct axis_order){pattern, 0});
	for (uint32_t i = 0, column; i < count; i += column) {
		column = run_length(pattern, corners + i, count - i, 0, tolerance);
		qsort_r(corners + i, column, sizeof *corners, compare_corners, &(struct axis_order){pattern, 1});
		for (uint32_t j = i, run; j < i + column; j += run) {
			run = run_length(pattern, corners + j, i + column - j, 1, tolerance);
			take_as_one(draft, corners + j, run);
		}
	}
}

/* What rounding to a few digits may do to a position that is written several times: a unit of the fifth digit of a
 * coordinate of the pattern's size, or of the seventh of a metre. No two sides of a seam or a dart lie that close. */
static double coord_tolerance(const struct garment *garment)
{
	const double least_mm = 0.015, share = 1.5e-5;
	double largest = 0;
	for (size_t i = 0; i < 2 * (size_t)garment->coord_count; i++)
		largest = fmax(largest, fabs(garment->pattern[i]));
	return fmax(least_mm, share * largest);
}

/* Many tools write a position for every corner, so that equal numbers, but for their last digit, must count as the same
 * position. */
static enum tw_status share_coords(struct draft *draft)
{
	struct garment *garment = &draft->garment;
	const uint32_t corner_count = 3 * garment->face_count;
	const double tolerance = coord_tolerance(garment);
	struct arena_mark mark = arena_mark(draft->arena);
	uint32_t *start = ARENA_ZEROED(draft->arena, (size_t)garment->vertex_count + 2, uint32_t);
	struct corner *corners = ARENA_ARRAY(draft->arena, corner_count, struct corner);
	if (!start || !corners)
		return tw_fail_memory(draft->error);
	for (uint32_t i = 0; i < corner_count; i++)
		start[garment->face_vertex[i] + 2]++;
	for (uint32_t v = 0; v < garment->vertex_count; v++)
		start[v + 2] += start[v + 1];
	for (uint32_t i = 0; i < corner_count; i++) {
		uint32_t v = garment->face_vertex[i];
		corners[start[v + 1]++] = (struct corner){v, garment->face_coord[i], i};
	}
	for (uint32_t v = 0; v < garment->vertex_count; v++)
		unite(draft, corners + start[v], start[v + 1] - start[v], tolerance);
	arena_release(draft->arena, mark);
	return TW_OK;
}

/* Two faces on an edge run along it in opposite directions, or one of them has its wrong side up. */
static enum tw_status check_directions(const struct draft *draft)
{
	const struct topology *topology = &draft->topology;
	const struct garment *garment = &draft->garment;
	const uint32_t *face_vertex = garment->face_vertex;
	for (uint32_t e = 0; e < topology->edge_count; e++) {
		const uint32_t *face = topology->edge_face + 2 * (size_t)e;
		const uint8_t *side = topology->edge_side + 2 * (size_t)e;
		if (face[1] == GARMENT_NONE || face_vertex[3 * face[0] + side[0]] != face_vertex[3 * face[1] + side[1]])
			continue;
		return fail_at_face(
			draft, face[1], "mesh-flipped-face",
			"faces %u and %u run along the edge between vertices %u and %u in the same direction: one of "
			"them is flipped; make the faces' directions agree",
			garment_file_face(garment, face[0]), garment_file_face(garment, face[1]),
			garment_file_vertex(garment, topology->edge_vertex[2 * (size_t)e]),
			garment_file_vertex(garment, topology->edge_vertex[2 * (size_t)e + 1]));
	}
	return TW_OK;
}

static void warn_of_isolated(const struct draft *draft, uint8_t *used)
{
	const struct garment *garment = &draft->garment;
	for (size_t i = 0; i < 3 * (size_t)garment->face_count; i++)
		used[garment->face_vertex[i]] = 1;
	for (uint32_t v = 0; v < garment->vertex_count; v++) {
		if (!used[v])
			warning_add(&draft->report->warnings, "isolated-vertices", "vertex",
				    garment_file_vertex(garment, v),
				    "vertices without a face are kept, because motions count them, but no wire can "
				    "reach them");
	}
}

enum tw_status draft_connect(struct draft *draft)
{
	enum tw_status status = share_coords(draft);
	if (status == TW_OK)
		status = topology_build(&draft->topology, draft->arena, &draft->garment, draft->error);
	if (status == TW_OK)
		status = check_directions(draft);
	if (status != TW_OK)
		return status;
	struct arena_mark mark = arena_mark(draft->arena);
	uint8_t *used = ARENA_ZEROED(draft->arena, draft->garment.vertex_count, uint8_t);
	if (!used)
		return tw_fail_memory(draft->error);
	warn_of_isolated(draft, used);
	arena_release(draft->arena, mark);
	return TW_OK;
}
