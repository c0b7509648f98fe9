/* Strips against GEOS, against Monte Carlo and against themselves: a seam, a split face or another numbering must not
 * show in the integral. */
#include "solver/field/strip.h"

#include "tests/oracle/geos_strip.h"
#include "tests/oracle/meshes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

struct cloth {
	struct arena *arena;
	struct garment garment;
	struct topology topology;
	double *value;
	struct strip_fabric fabric;
	struct strip_walker *walker;
};

static void cloth_lay(struct cloth *cloth)
{
	assert_int_equal(
		strip_fabric_build(&cloth->fabric, cloth->arena, &cloth->garment, &cloth->topology, cloth->value, NULL),
		TW_OK);
	assert_int_equal(strip_walker_new(&cloth->walker, cloth->arena, &cloth->fabric, NULL), TW_OK);
}

/* Values that differ from face to face but belong to the place, not to the number of the face. */
static void cloth_prepare(struct cloth *cloth)
{
	assert_int_equal(topology_build(&cloth->topology, cloth->arena, &cloth->garment, NULL), TW_OK);
	cloth->value = ARENA_ARRAY(cloth->arena, cloth->garment.face_count, double);
	for (size_t f = 0; f < cloth->garment.face_count; f++) {
		double sum = 0;
		for (size_t k = 0; k < 3; k++) {
			const double *x = cloth->garment.position + 3 * (size_t)cloth->garment.face_vertex[3 * f + k];
			sum += sin(x[0] / 23) + cos(x[1] / 17) + x[2] / 100;
		}
		cloth->value[f] = 0.1 + sum * sum / 9;
	}
	cloth_lay(cloth);
}

static void cloth_sheet(struct cloth *cloth, uint32_t columns, uint32_t rows, double jitter, uint32_t seam)
{
	cloth->arena = arena_new(0);
	mesh_sheet(&cloth->garment, cloth->arena, columns, rows, 9, jitter, seam);
	cloth_prepare(cloth);
}

static void assert_close(double a, double b, double relative)
{
	if (fabs(a - b) > relative * fmax(fabs(a), fabs(b)) + 1e-12)
		fail_msg("%.17g is not %.17g", a, b);
}

static void expect_strip(const struct strip *strip, const struct geos_strip *want)
{
	assert_close(strip->area_mm2, want->area_mm2, 1e-12);
	assert_close(strip->covered_mm2, want->covered_mm2, 1e-10);
	assert_close(strip->cost, want->cost, 1e-10);
	assert_close(strip->largest, want->largest, 0);
}

/* Every edge of a sheet whose worn shape is one plane, as it lies there. */
static void expect_plane_strips(struct cloth *cloth, double width)
{
	const struct garment *g = &cloth->garment;
	double(*corner)[3][2] = malloc(g->face_count * sizeof *corner);
	assert_non_null(corner);
	for (size_t f = 0; f < g->face_count; f++)
		for (size_t k = 0; k < 3; k++)
			for (size_t d = 0; d < 2; d++)
				corner[f][k][d] = g->position[3 * (size_t)g->face_vertex[3 * f + k] + d];
	for (uint32_t e = 0; e < cloth->topology.edge_count; e++) {
		const uint32_t *end = cloth->topology.edge_vertex + 2 * (size_t)e;
		GEOSGeometry *rectangle = geos_rectangle(g->position + 3 * (size_t)end[0],
							 g->position + 3 * (size_t)end[1], -width / 2, width / 2);
		struct geos_strip want =
			plane_strip((const double(*)[3][2])corner, cloth->value, g->face_count, rectangle);
		GEOSGeom_destroy(rectangle);
		struct strip strip;
		strip_edge(cloth->walker, e, width, &strip);
		expect_strip(&strip, &want);
	}
	free(corner);
}

static void every_strip_of_a_sheet_matches_geos(void **state)
{
	(void)state;
	for (int k = 0; k < 3; k++) {
		struct cloth cloth;
		cloth_sheet(&cloth, 11, 8, 0.3, 0);
		expect_plane_strips(&cloth, (double[]){4, 15, 37.5}[k]);
		arena_free(cloth.arena);
	}
}

static void every_strip_of_a_sewn_sheet_matches_geos(void **state)
{
	(void)state;
	for (int k = 0; k < 3; k++) {
		struct cloth cloth;
		cloth_sheet(&cloth, 11, 8, 0.3, 4);
		expect_plane_strips(&cloth, (double[]){4, 15, 37.5}[k]);
		arena_free(cloth.arena);
	}
}

/* Left of a-b, on it, or right of it. */
static double turn(const double *a, const double *b, const double *c)
{
	return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* The chord across every edge of a sheet whose worn shape is one plane: the line between the corners that lie opposite
 * each other, where the two faces make a convex quadrilateral. */
static void expect_chords(struct cloth *cloth, double width)
{
	const struct garment *g = &cloth->garment;
	double(*corner)[3][2] = malloc(g->face_count * sizeof *corner);
	assert_non_null(corner);
	for (size_t f = 0; f < g->face_count; f++)
		for (size_t k = 0; k < 3; k++)
			for (size_t d = 0; d < 2; d++)
				corner[f][k][d] = g->position[3 * (size_t)g->face_vertex[3 * f + k] + d];
	uint32_t chords = 0, across_seam = 0, none = 0;
	for (uint32_t e = 0; e < cloth->topology.edge_count; e++) {
		const uint32_t *face = cloth->topology.edge_face + 2 * (size_t)e;
		const uint32_t *end = cloth->topology.edge_vertex + 2 * (size_t)e;
		const double *p = g->position + 3 * (size_t)end[0], *q = g->position + 3 * (size_t)end[1], *o[2];
		struct strip strip;
		struct strip_chord chord;
		bool found = strip_chord(cloth->walker, e, width, &strip);
		assert_int_equal(found, strip_find_chord(&cloth->fabric, e, &chord));
		if (face[1] == GARMENT_NONE) {
			assert_false(found);
			continue;
		}
		for (int i = 0; i < 2; i++) {
			uint32_t side = cloth->topology.edge_side[2 * (size_t)e + (size_t)i];
			o[i] = g->position + 3 * (size_t)g->face_vertex[3 * (size_t)face[i] + (side + 2) % 3];
		}
		bool convex = turn(o[0], o[1], p) * turn(o[0], o[1], q) < 0;
		assert_int_equal(found, convex);
		none += !convex;
		if (!convex)
			continue;
		GEOSGeometry *rectangle = geos_rectangle(o[0], o[1], -width / 2, width / 2);
		struct geos_strip want =
			plane_strip((const double(*)[3][2])corner, cloth->value, g->face_count, rectangle);
		GEOSGeom_destroy(rectangle);
		expect_strip(&strip, &want);
		assert_close(chord.length_mm, hypot(o[0][0] - o[1][0], o[0][1] - o[1][1]), 1e-12);
		double x = p[0] + chord.along * (q[0] - p[0]), y = p[1] + chord.along * (q[1] - p[1]);
		assert_true(fabs(turn(o[0], o[1], (double[]){x, y})) < 1e-9 * chord.length_mm);
		for (int i = 0; i < 2; i++)
			assert_true(g->position + 3 * (size_t)chord.vertex[i] == o[0] ||
				    g->position + 3 * (size_t)chord.vertex[i] == o[1]);
		chords++;
		across_seam += cloth->topology.edge_kind[e] == EDGE_SEAM;
	}
	assert_true(chords > 100 && none > 0);
	assert_int_equal(across_seam > 0, g->piece_count > 1);
	free(corner);
}

static void every_chord_of_a_sheet_matches_geos(void **state)
{
	(void)state;
	for (uint32_t seam = 0; seam < 5; seam += 4) {
		struct cloth cloth;
		cloth_sheet(&cloth, 14, 12, 0.33, seam);
		expect_chords(&cloth, 15);
		expect_chords(&cloth, 4);
		arena_free(cloth.arena);
	}
}

static void a_regular_grid_whose_edges_lie_on_strip_borders_matches_geos(void **state)
{
	(void)state;
	struct cloth cloth;
	cloth_sheet(&cloth, 9, 8, 0, 3);
	expect_plane_strips(&cloth, 18);
	expect_plane_strips(&cloth, 36);
	arena_free(cloth.arena);
}

static void a_strip_across_a_seam_is_the_strip_of_the_uncut_fabric(void **state)
{
	(void)state;
	struct cloth sewn, whole;
	cloth_sheet(&sewn, 30, 20, 0.3, 14);
	cloth_sheet(&whole, 30, 20, 0.3, 14);
	/* The same fabric in one piece: the pattern as it is worn. */
	for (size_t c = 0; c < 3 * (size_t)whole.garment.face_count; c++)
		whole.garment.face_coord[c] = whole.garment.face_vertex[c];
	for (size_t v = 0; v < whole.garment.vertex_count; v++)
		for (size_t d = 0; d < 2; d++)
			whole.garment.pattern[2 * v + d] = whole.garment.position[3 * v + d];
	cloth_prepare(&whole);
	uint32_t seams = 0;
	for (uint32_t e = 0; e < sewn.topology.edge_count; e++) {
		struct strip a, b;
		strip_edge(sewn.walker, e, 20, &a);
		strip_edge(whole.walker, e, 20, &b);
		assert_close(a.cost, b.cost, 1e-11);
		assert_close(a.covered_mm2, b.covered_mm2, 1e-11);
		assert_close(a.area_mm2, b.area_mm2, 1e-11);
		seams += sewn.topology.edge_kind[e] == EDGE_SEAM;
		assert_int_not_equal(whole.topology.edge_kind[e], EDGE_SEAM);
	}
	assert_int_equal(seams, 20);
	arena_free(sewn.arena);
	arena_free(whole.arena);
}

/* A tube unrolled three times over. */
static void a_tube_sewn_to_itself_matches_geos(void **state)
{
	(void)state;
	struct cloth cloth;
	cloth.arena = arena_new(0);
	mesh_tube(&cloth.garment, cloth.arena, 12, 6, 9);
	cloth_prepare(&cloth);
	const struct garment *g = &cloth.garment;
	size_t faces = g->face_count;
	double(*corner)[3][2] = malloc(3 * faces * sizeof *corner);
	double *value = malloc(3 * faces * sizeof *value);
	assert_true(corner && value);
	for (size_t i = 0; i < 3 * faces; i++) {
		value[i] = cloth.value[i % faces];
		for (size_t k = 0; k < 3; k++) {
			const double *u = g->pattern + 2 * (size_t)g->face_coord[3 * (i % faces) + k];
			corner[i][k][0] = u[0] + 12 * 9 * ((double)(i / faces) - 1);
			corner[i][k][1] = u[1];
		}
	}
	for (uint32_t e = 0; e < cloth.topology.edge_count; e++) {
		uint32_t f = cloth.topology.edge_face[2 * (size_t)e], k = cloth.topology.edge_side[2 * (size_t)e];
		GEOSGeometry *rectangle =
			geos_rectangle(corner[faces + f][k], corner[faces + f][(k + 1) % 3], -7.5, 7.5);
		struct geos_strip want =
			plane_strip((const double(*)[3][2])corner, value, (uint32_t)(3 * faces), rectangle);
		GEOSGeom_destroy(rectangle);
		struct strip strip;
		strip_edge(cloth.walker, e, 15, &strip);
		expect_strip(&strip, &want);
	}
	free(corner);
	free(value);
	arena_free(cloth.arena);
}

/* A second piece with ease and a seam that bends: nothing fits exactly any more, and method 3 decides. */
static void every_strip_at_a_bent_seam_matches_method_3_done_with_geos(void **state)
{
	(void)state;
	struct cloth cloth;
	cloth.arena = arena_new(0);
	mesh_sheet(&cloth.garment, cloth.arena, 12, 14, 9, 0.3, 5);
	struct garment *g = &cloth.garment;
	for (size_t f = 0; f < g->face_count; f++)
		for (size_t k = 0; k < 3 && g->face_piece[f]; k++) {
			size_t v = g->face_vertex[3 * f + k];
			const double *x = g->position + 3 * v;
			double *u = g->pattern + 2 * (size_t)g->face_coord[3 * f + k];
			u[0] = 2000 - 1.04 * x[1];
			u[1] = 1.04 * x[0] - 300 + x[1] * (126 - x[1]) / 700;
		}
	cloth_prepare(&cloth);
	struct geos_walk *walk = calloc(1, sizeof *walk);
	assert_non_null(walk);
	*walk = (struct geos_walk){.garment = g, .topology = &cloth.topology, .value = cloth.value};
	walk->entered = calloc(g->face_count, 1);
	assert_non_null(walk->entered);
	for (uint32_t e = 0; e < cloth.topology.edge_count; e++) {
		struct geos_strip want = walked_strip(walk, e, 25);
		struct strip strip;
		strip_edge(cloth.walker, e, 25, &strip);
		expect_strip(&strip, &want);
	}
	free(walk->entered);
	free(walk);
	arena_free(cloth.arena);
}

/* Two pieces whose seam bows into both of them: laid against its sides one after the other, the second piece would
 * count double. On cloth that is worth 1 everywhere a strip is worth its own area at most, and just that in a place
 * where nothing is missing. */
static void cloth_beside_a_bent_seam_counts_once(void **state)
{
	(void)state;
	struct cloth cloth;
	cloth.arena = arena_new(0);
	mesh_sheet(&cloth.garment, cloth.arena, 12, 14, 9, 0, 6);
	struct garment *g = &cloth.garment;
	for (size_t c = 0; c < g->coord_count; c++) {
		double *u = g->pattern + 2 * c; /* the first piece: x, y; the second: 2000 - y, x - 300 */
		double y = u[0] > 1000 ? 2000 - u[0] : u[1], bow = y * (126 - y) / 90;
		double x = u[0] > 1000 ? u[1] + 300 : u[0], share = u[0] > 1000 ? (108 - x) / 54 : x / 54;
		u[u[0] > 1000] += (u[0] > 1000 ? 1 : -1) * bow * share;
	}
	cloth_prepare(&cloth);
	for (uint32_t f = 0; f < g->face_count; f++)
		cloth.value[f] = 1;
	struct geos_walk *walk = calloc(1, sizeof *walk);
	assert_non_null(walk);
	*walk = (struct geos_walk){.garment = g, .topology = &cloth.topology, .value = cloth.value};
	walk->entered = calloc(g->face_count, 1);
	assert_non_null(walk->entered);
	uint32_t full = 0;
	for (uint32_t e = 0; e < cloth.topology.edge_count; e++) {
		struct strip strip;
		strip_edge(cloth.walker, e, 40, &strip);
		struct geos_strip want = walked_strip(walk, e, 40);
		expect_strip(&strip, &want);
		assert_true(strip.cost <= strip.area_mm2 * (1 + 1e-12));
		assert_close(strip_cost(&strip, FIELD_OVERHANG_CHARGE), strip.area_mm2, 1e-12);
		full += walk->doubled != 0;
	}
	assert_true(full > 20);
	free(walk->entered);
	free(walk);
	arena_free(cloth.arena);
}

/* Charged or forbidden beyond a share: what is missing costs the strip's own largest value. */
static void fabric_that_is_not_there_is_never_cheap(void **state)
{
	(void)state;
	struct cloth cloth;
	cloth_sheet(&cloth, 12, 10, 0.3, 0);
	for (uint32_t e = 0; e < cloth.topology.edge_count; e++) {
		struct strip strip;
		strip_edge(cloth.walker, e, 15, &strip);
		double missing = fmax(0, strip.area_mm2 - strip.covered_mm2);
		for (int overhang = FIELD_OVERHANG_CHARGE; overhang <= FIELD_OVERHANG_FORBID; overhang++)
			assert_close(strip_cost(&strip, overhang),
				     strip.cost + (overhang == FIELD_OVERHANG_IGNORE ? 0 : missing * strip.largest),
				     1e-12);
	}
	/* A strip that lies wholly beside the sheet costs as much as on the face that is nearest to it. */
	const double away[2][2] = {{-30, 20}, {-30, 45}};
	uint32_t face = 2 * 12 * 3; /* at the left hem */
	struct strip strip;
	strip_segment(cloth.walker, face, away[0], away[1], 15, &strip);
	assert_true(strip.covered_mm2 == 0 && strip.area_mm2 > 0);
	assert_close(strip_cost(&strip, FIELD_OVERHANG_CHARGE), strip.area_mm2 * cloth.value[face], 1e-12);
	assert_close(strip_cost(&strip, FIELD_OVERHANG_FORBID), strip.area_mm2 * cloth.value[face], 1e-12);
	arena_free(cloth.arena);
}

static void a_hem_edge_misses_half_of_its_strip(void **state)
{
	(void)state;
	struct cloth cloth;
	cloth_sheet(&cloth, 20, 20, 0, 0);
	uint32_t hems = 0;
	for (uint32_t e = 0; e < cloth.topology.edge_count; e++) {
		if (cloth.topology.edge_kind[e] != EDGE_HEM)
			continue;
		struct strip strip;
		strip_edge(cloth.walker, e, 15, &strip);
		assert_close(strip_coverage(&strip), 0.5, 1e-12);
		assert_close(strip_cost(&strip, FIELD_OVERHANG_IGNORE), strip.cost, 0);
		assert_close(strip_cost(&strip, FIELD_OVERHANG_CHARGE), strip.cost + 0.5 * 9 * 15 * strip.largest,
			     1e-12);
		hems++;
	}
	assert_int_equal(hems, 80);
	arena_free(cloth.arena);
}

static void splitting_faces_changes_no_strip(void **state)
{
	(void)state;
	struct cloth cloth, split;
	cloth_sheet(&cloth, 12, 10, 0.3, 5);
	const struct garment *g = &cloth.garment;
	split.arena = arena_new(0);
	struct garment *s = &split.garment;
	mesh_allocate(s, split.arena, g->vertex_count + g->face_count, g->coord_count + g->face_count,
		      3 * g->face_count, 2);
	memcpy(s->position, g->position, 3 * (size_t)g->vertex_count * sizeof(double));
	memcpy(s->pattern, g->pattern, 2 * (size_t)g->coord_count * sizeof(double));
	for (uint32_t f = 0; f < g->face_count; f++) {
		uint32_t middle = g->vertex_count + f, middle_coord = g->coord_count + f;
		const uint32_t *v = g->face_vertex + 3 * (size_t)f, *c = g->face_coord + 3 * (size_t)f;
		for (size_t k = 0; k < 3; k++) {
			for (size_t d = 0; d < 3; d++)
				s->position[3 * (size_t)middle + d] += g->position[3 * (size_t)v[k] + d] / 3;
			for (size_t d = 0; d < 2; d++)
				s->pattern[2 * (size_t)middle_coord + d] += g->pattern[2 * (size_t)c[k] + d] / 3;
			size_t l = (k + 1) % 3;
			mesh_set_face(s, 3 * f + (uint32_t)k, (uint32_t[]){v[k], v[l], middle},
				      (uint32_t[]){c[k], c[l], middle_coord}, g->face_piece[f]);
		}
	}
	cloth_prepare(&split);
	for (uint32_t f = 0; f < s->face_count; f++)
		split.value[f] = cloth.value[f / 3];
	for (uint32_t f = 0; f < g->face_count; f++)
		for (uint32_t k = 0; k < 3; k++) {
			struct strip a, b;
			strip_edge(cloth.walker, cloth.topology.face_edge[3 * (size_t)f + k], 15, &a);
			strip_edge(split.walker, split.topology.face_edge[3 * (size_t)(3 * f + k)], 15, &b);
			assert_close(a.cost, b.cost, 1e-11);
			assert_close(a.covered_mm2, b.covered_mm2, 1e-11);
		}
	arena_free(cloth.arena);
	arena_free(split.arena);
}

static void moving_the_pieces_on_the_pattern_changes_no_strip(void **state)
{
	(void)state;
	struct cloth cloth, moved;
	cloth_sheet(&cloth, 14, 10, 0.3, 5);
	cloth_sheet(&moved, 14, 10, 0.3, 5);
	for (size_t c = 0; c < moved.garment.coord_count; c++) {
		double *u = moved.garment.pattern + 2 * c, x = u[0], y = u[1];
		u[0] = 0.6 * x - 0.8 * y + 1234;
		u[1] = 0.8 * x + 0.6 * y - 777;
	}
	cloth_lay(&moved);
	for (uint32_t e = 0; e < cloth.topology.edge_count; e++) {
		struct strip a, b;
		strip_edge(cloth.walker, e, 21, &a);
		strip_edge(moved.walker, e, 21, &b);
		assert_close(a.cost, b.cost, 1e-10);
		assert_close(a.covered_mm2, b.covered_mm2, 1e-10);
	}
	arena_free(cloth.arena);
	arena_free(moved.arena);
}

/* To the last bit: weights are rounded to integers, and ties must stay ties. */
static void other_numbers_of_faces_change_no_strip(void **state)
{
	(void)state;
	struct cloth cloth, other;
	cloth_sheet(&cloth, 14, 10, 0.3, 5);
	cloth_sheet(&other, 14, 10, 0.3, 5);
	uint32_t faces = cloth.garment.face_count;
	for (uint32_t f = 0; f < faces; f++) {
		size_t to = (uint64_t)f * 97 % faces;
		for (size_t k = 0; k < 3; k++) { /* another first corner, too */
			size_t corner = 3 * to + (k + f) % 3;
			other.garment.face_vertex[corner] = cloth.garment.face_vertex[3 * (size_t)f + k];
			other.garment.face_coord[corner] = cloth.garment.face_coord[3 * (size_t)f + k];
		}
		other.garment.face_piece[to] = cloth.garment.face_piece[f];
	}
	cloth_prepare(&other);
	for (uint32_t f = 0; f < faces; f++)
		other.value[(uint64_t)f * 97 % faces] = cloth.value[f];
	for (uint32_t f = 0; f < faces; f++)
		for (uint32_t k = 0; k < 3; k++) {
			size_t to = (uint64_t)f * 97 % faces;
			struct strip a, b;
			strip_edge(cloth.walker, cloth.topology.face_edge[3 * (size_t)f + k], 21, &a);
			strip_edge(other.walker, other.topology.face_edge[3 * to + (k + f) % 3], 21, &b);
			assert_true(a.cost == b.cost && a.covered_mm2 == b.covered_mm2 && a.area_mm2 == b.area_mm2);
			assert_true(a.largest == b.largest && a.face_count == b.face_count);
			strip_chord(cloth.walker, cloth.topology.face_edge[3 * (size_t)f + k], 21, &a);
			strip_chord(other.walker, other.topology.face_edge[3 * to + (k + f) % 3], 21, &b);
			assert_true(a.cost == b.cost && a.covered_mm2 == b.covered_mm2 && a.area_mm2 == b.area_mm2);
		}
	arena_free(cloth.arena);
	arena_free(other.arena);
}

/* The face of a sheet that lies under a worn point, by trying all. */
static uint32_t face_under(const struct garment *g, double x, double y)
{
	for (uint32_t f = 0; f < g->face_count; f++) {
		const double *p[3];
		for (size_t k = 0; k < 3; k++)
			p[k] = g->position + 3 * (size_t)g->face_vertex[3 * (size_t)f + k];
		int inside = 1;
		for (int k = 0; k < 3; k++) {
			const double *a = p[k], *b = p[(k + 1) % 3];
			inside &= (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) >= 0;
		}
		if (inside)
			return f;
	}
	return GARMENT_NONE;
}

static void polygons_match_a_monte_carlo_integral(void **state)
{
	(void)state;
	struct cloth cloth;
	cloth_sheet(&cloth, 10, 8, 0.3, 5);
	uint64_t random = 11;
	for (int round = 0; round < 12; round++) {
		/* A hexagon in the plane of the first piece, where worn and pattern agree; it reaches over the seam or
		 * the hem. */
		double cx = 15 + 28 * mesh_random(&random), cy = 10 + 50 * mesh_random(&random);
		double corner[6][2], turn = mesh_random(&random), radius = 12 + 8 * mesh_random(&random);
		for (int i = 0; i < 6; i++) {
			int at = round % 2 ? 5 - i : i; /* either orientation */
			corner[at][0] = cx + radius * cos(turn + i * M_PI / 3);
			corner[at][1] = cy + radius * sin(turn + i * M_PI / 3) * 0.7;
		}
		struct strip strip;
		strip_polygon(cloth.walker, face_under(&cloth.garment, cx, cy), corner[0], 6, &strip);
		double cost = 0, covered = 0;
		int tries = 20000;
		for (int i = 0; i < tries; i++) {
			double r, phi, x, y;
			do { /* a point of the hexagon, in its own square */
				r = 2 * mesh_random(&random) - 1;
				phi = 2 * mesh_random(&random) - 1;
			} while (fabs(phi) > sqrt(3) / 2 || fabs(phi) > sqrt(3) * (1 - fabs(r)));
			x = cx + radius * (r * cos(turn) - phi * sin(turn));
			y = cy + radius * (r * sin(turn) + phi * cos(turn)) * 0.7;
			uint32_t f = face_under(&cloth.garment, x, y);
			covered += f != GARMENT_NONE;
			cost += f == GARMENT_NONE ? 0 : cloth.value[f];
		}
		double area = 1.5 * sqrt(3) * radius * radius * 0.7;
		assert_close(strip.area_mm2, area, 1e-12);
		assert_close(strip.covered_mm2, area * covered / tries, 0.02);
		assert_close(strip.cost, area * cost / tries, 0.02);
	}
	arena_free(cloth.arena);
}

static void a_segment_is_the_polygon_of_its_corners(void **state)
{
	(void)state;
	struct cloth cloth;
	cloth_sheet(&cloth, 20, 16, 0.3, 9);
	uint64_t random = 5;
	for (int round = 0; round < 200; round++) {
		double a[2] = {2 + 75 * mesh_random(&random), 140 * mesh_random(&random)};
		double angle = 7 * mesh_random(&random), length = 0.1 + 20 * mesh_random(&random);
		double t[2] = {cos(angle), sin(angle)}, b[2] = {a[0] + length * t[0], a[1] + length * t[1]};
		uint32_t face = face_under(&cloth.garment, a[0], a[1]);
		struct strip segment, polygon;
		strip_segment(cloth.walker, face, a, b, 15, &segment);
		double corner[4][2] = {{a[0] + 7.5 * t[1], a[1] - 7.5 * t[0]},
				       {b[0] + 7.5 * t[1], b[1] - 7.5 * t[0]},
				       {b[0] - 7.5 * t[1], b[1] + 7.5 * t[0]},
				       {a[0] - 7.5 * t[1], a[1] + 7.5 * t[0]}};
		strip_polygon(cloth.walker, face, corner[0], 4, &polygon);
		assert_close(segment.cost, polygon.cost, 1e-10);
		assert_close(segment.covered_mm2, polygon.covered_mm2, 1e-10);
		assert_close(segment.area_mm2, polygon.area_mm2, 1e-10);
	}
	double point[2] = {20, 20};
	struct strip none;
	strip_segment(cloth.walker, 0, point, point, 15, &none);
	assert_true(none.area_mm2 == 0 && strip_coverage(&none) == 0);
	const double nothing[3][8] = {
		{20, 20, 20, 20, 20, 20, 20, 20}, {10, 10, 20, 20, 30, 30, 40, 40}, {NAN, 1, 2, 3, INFINITY, 5, 6, 7}};
	for (int i = 0; i < 3; i++) {
		strip_polygon(cloth.walker, 0, nothing[i], 4, &none);
		assert_true(none.area_mm2 == 0 && none.covered_mm2 == 0 && none.face_count == 0);
	}
	arena_free(cloth.arena);
}

static int start_geos(void **state)
{
	(void)state;
	initGEOS(geos_print, geos_print);
	return 0;
}

static int stop_geos(void **state)
{
	(void)state;
	finishGEOS();
	return 0;
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_strip_of_a_sheet_matches_geos),
		cmocka_unit_test(every_strip_of_a_sewn_sheet_matches_geos),
		cmocka_unit_test(every_chord_of_a_sheet_matches_geos),
		cmocka_unit_test(a_regular_grid_whose_edges_lie_on_strip_borders_matches_geos),
		cmocka_unit_test(a_strip_across_a_seam_is_the_strip_of_the_uncut_fabric),
		cmocka_unit_test(a_tube_sewn_to_itself_matches_geos),
		cmocka_unit_test(every_strip_at_a_bent_seam_matches_method_3_done_with_geos),
		cmocka_unit_test(cloth_beside_a_bent_seam_counts_once),
		cmocka_unit_test(fabric_that_is_not_there_is_never_cheap),
		cmocka_unit_test(a_hem_edge_misses_half_of_its_strip),
		cmocka_unit_test(splitting_faces_changes_no_strip),
		cmocka_unit_test(moving_the_pieces_on_the_pattern_changes_no_strip),
		cmocka_unit_test(other_numbers_of_faces_change_no_strip),
		cmocka_unit_test(polygons_match_a_monte_carlo_integral),
		cmocka_unit_test(a_segment_is_the_polygon_of_its_corners),
	};
	return cmocka_run_group_tests(tests, start_geos, stop_geos);
}
