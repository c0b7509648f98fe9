/* Faces under points against a search of all faces; outlines and seams of garments in closed form. */
#include "solver/pattern/locate.h"
#include "solver/pattern/outline.h"
#include "solver/pattern/view.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/oracle/meshes.h"

static void assert_near(double a, double b, double slack)
{
	if (!(fabs(a - b) <= slack))
		fail_msg("%.12g is not %.12g", a, b);
}

static struct vec2 corner(const struct garment *garment, uint32_t face, uint32_t k)
{
	const double *uv = &garment->pattern[2 * (size_t)garment->face_coord[3 * (size_t)face + k]];
	return (struct vec2){uv[0], uv[1]};
}

static double distance_to_face(const struct garment *garment, uint32_t face, struct vec2 p)
{
	double best = INFINITY;
	bool inside = true;
	for (uint32_t k = 0; k < 3; k++) {
		struct vec2 a = corner(garment, face, k), b = corner(garment, face, (k + 1) % 3);
		inside = inside && vec2_cross(vec2_sub(b, a), vec2_sub(p, a)) >= 0;
		best = fmin(best, vec2_distance(p, vec2_mix(a, b, vec2_nearest(a, b, p))));
	}
	return inside ? 0 : best;
}

static void finds_the_nearest_face_of_the_piece(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct garment garment;
	mesh_sheet(&garment, arena, 12, 7, 10, 0.3, 5);
	const struct locator *locator;
	assert_int_equal(locator_build(&locator, arena, &garment, NULL), TW_OK);
	uint64_t seed = 5;
	for (uint32_t round = 0; round < 4000; round++) {
		uint32_t piece = round % 2;
		double far = round % 5 == 0 ? 400 : 20;
		struct vec2 p = {mesh_random(&seed) * (120 + 2 * far) - far, mesh_random(&seed) * (70 + 2 * far) - far};
		if (piece == 1)
			p = (struct vec2){2000 - p.y, p.x - 300};
		double best = INFINITY;
		for (uint32_t f = 0; f < garment.face_count; f++)
			if (garment.face_piece[f] == piece)
				best = fmin(best, distance_to_face(&garment, f, p));
		struct place place;
		locator_find(locator, piece, p, &place);
		assert_int_equal(garment.face_piece[place.face], piece);
		assert_near(place.distance, best, 1e-9);
		assert_near(place.barycentric[0] + place.barycentric[1] + place.barycentric[2], 1, 1e-12);
		assert_near(vec2_distance(place_on_pattern(&garment, &place), p), best, 1e-9);
	}
	arena_free(arena);
}

/* Between two cuts the middle lies in a face, and both ends of the part lie in the same face or on its sides. */
static void cuts_a_segment_at_every_edge(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct garment garment;
	mesh_sheet(&garment, arena, 12, 7, 10, 0.3, 0);
	const struct locator *locator;
	assert_int_equal(locator_build(&locator, arena, &garment, NULL), TW_OK);
	uint64_t seed = 9;
	for (int round = 0; round < 1000; round++) {
		struct vec2 a = {mesh_random(&seed) * 120, mesh_random(&seed) * 70};
		struct vec2 b = {mesh_random(&seed) * 120, mesh_random(&seed) * 70};
		double t[256];
		uint32_t cuts = locator_cuts(locator, 0, a, b, t, 256);
		assert_true(cuts < 256);
		for (uint32_t i = 0; i <= cuts; i++) {
			double from = i ? t[i - 1] : 0, to = i < cuts ? t[i] : 1;
			struct place middle;
			locator_find(locator, 0, vec2_mix(a, b, (from + to) / 2), &middle);
			assert_near(distance_to_face(&garment, middle.face, vec2_mix(a, b, from)), 0, 1e-6);
			assert_near(distance_to_face(&garment, middle.face, vec2_mix(a, b, to)), 0, 1e-6);
		}
	}
	arena_free(arena);
}

static double loop_area(const struct outline *outline, const struct garment *garment, const struct outline_loop *loop)
{
	double area = 0;
	for (uint32_t i = 0; i < loop->count; i++) {
		struct vec2 from, to;
		outline_ends(outline, garment, loop->first + i, &from, &to);
		area += vec2_cross(from, to) / 2;
	}
	return area;
}

static void outlines_close_and_hold_the_area(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct garment garment;
	struct topology topology;
	struct outline outline;
	mesh_sheet(&garment, arena, 12, 7, 10, 0.3, 5);
	assert_int_equal(topology_build(&topology, arena, &garment, NULL), TW_OK);
	assert_int_equal(outline_build(&outline, arena, &garment, &topology, NULL), TW_OK);
	assert_int_equal(outline.loop_count, 2);
	assert_near(loop_area(&outline, &garment, &outline.loop[0]), 50 * 70, 1e-6);
	assert_near(loop_area(&outline, &garment, &outline.loop[1]), 70 * 70, 1e-6);
	for (uint32_t l = 0; l < outline.loop_count; l++) {
		const struct outline_loop *loop = &outline.loop[l];
		for (uint32_t i = 0; i < loop->count; i++)
			assert_int_equal(outline.segment[loop->first + i].to,
					 outline.segment[loop->first + (i + 1) % loop->count].from);
	}
	assert_int_equal(outline.seam_count, 1);
	assert_near(outline.seam[0].length_mm[0], 70, 1e-9);
	assert_near(outline.seam[0].length_mm[1], 70, 1e-9);
	uint32_t segment;
	assert_near(outline_distance(&outline, &garment, 0, (struct vec2){20, 30}, &segment), 20, 1e-9);
	arena_free(arena);
}

static void an_outline_contains_what_its_faces_do(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct garment garment;
	struct topology topology;
	struct outline outline;
	mesh_sheet(&garment, arena, 12, 7, 10, 0.3, 5);
	assert_int_equal(topology_build(&topology, arena, &garment, NULL), TW_OK);
	assert_int_equal(outline_build(&outline, arena, &garment, &topology, NULL), TW_OK);
	uint64_t seed = 7;
	for (uint32_t round = 0; round < 4000; round++) {
		struct vec2 p = {mesh_random(&seed) * 160 - 20, mesh_random(&seed) * 110 - 20};
		uint32_t piece = round % 2;
		if (piece == 1)
			p = (struct vec2){2000 - p.y, p.x - 300};
		bool inside = false;
		for (uint32_t f = 0; f < garment.face_count && !inside; f++)
			inside = garment.face_piece[f] == piece && distance_to_face(&garment, f, p) == 0;
		assert_int_equal(outline_contains(&outline, &garment, piece, p), inside);
	}
	arena_free(arena);
}

/* A tube of one piece is sewn to itself: one seam whose two sides lie on one outline. */
static void a_tube_is_sewn_to_itself(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct garment garment;
	struct topology topology;
	struct outline outline;
	mesh_tube(&garment, arena, 16, 9, 10);
	assert_int_equal(topology_build(&topology, arena, &garment, NULL), TW_OK);
	assert_int_equal(outline_build(&outline, arena, &garment, &topology, NULL), TW_OK);
	assert_int_equal(outline.loop_count, 1);
	assert_int_equal(outline.loop[0].count, 2 * (16 + 9));
	assert_int_equal(outline.seam_count, 1);
	assert_int_equal(outline.seam[0].piece[0], outline.seam[0].piece[1]);
	arena_free(arena);
}

/* The two middles of a seam whose sides are equally long are one place of the worn garment. */
static void assert_middles_meet(const struct garment *garment, struct arena *arena)
{
	struct topology topology;
	struct outline outline;
	const struct locator *locator;
	struct seam_middle(*middle)[2];
	assert_int_equal(topology_build(&topology, arena, garment, NULL), TW_OK);
	assert_int_equal(outline_build(&outline, arena, garment, &topology, NULL), TW_OK);
	assert_int_equal(locator_build(&locator, arena, garment, NULL), TW_OK);
	assert_int_equal(outline_seam_middles(&outline, garment, arena, &middle, NULL), TW_OK);
	for (uint32_t s = 0; s < outline.seam_count; s++) {
		double worn[2][3], apart = 0;
		assert_near(outline.seam[s].length_mm[0], outline.seam[s].length_mm[1], 1e-6);
		for (int side = 0; side < 2; side++) {
			const struct seam_middle *m = &middle[s][side];
			struct place place;
			assert_near(outline_distance(&outline, garment, m->piece, m->at, NULL), 0, 1e-9);
			assert_true(outline_contains(&outline, garment, m->piece, vec2_along(m->at, m->inward, 0.1)));
			locator_find(locator, m->piece, m->at, &place);
			place_on_worn(garment, &place, worn[side]);
		}
		for (int k = 0; k < 3; k++)
			apart += fabs(worn[0][k] - worn[1][k]);
		assert_near(apart, 0, 1e-6);
		/* On a tube the two are different places of one piece. */
		assert_true(middle[s][0].piece != middle[s][1].piece ||
			    vec2_distance(middle[s][0].at, middle[s][1].at) > 1);
	}
}

static void the_middles_of_a_seam_meet_when_it_is_sewn(void **state)
{
	(void)state;
	for (uint32_t n = 1; n < 12; n++) {
		struct arena *arena = arena_new(0);
		struct garment garment;
		mesh_sheet(&garment, arena, 12, 7, 10, 0.3, n);
		assert_middles_meet(&garment, arena);
		mesh_tube(&garment, arena, 4 + n, 20 - n, 10);
		assert_middles_meet(&garment, arena);
		arena_free(arena);
	}
}

/* Front and back of a tube: the near side hides the far one. */
static void a_view_sees_the_near_side(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct garment garment;
	mesh_tube(&garment, arena, 64, 20, 10);
	for (int back = 0; back < 2; back++) {
		struct view view;
		assert_int_equal(view_render(&view, arena, &garment, back == 1, 2, NULL), TW_OK);
		uint32_t seen = 0, hidden = 0;
		for (uint32_t v = 0; v < garment.vertex_count; v++) {
			const double *x = &garment.position[3 * (size_t)v];
			double towards = back ? -x[2] : x[2];
			/* The cells of the lowest hem have their middles below it. */
			if (x[1] == 0)
				continue;
			if (towards > 30) {
				assert_true(view_sees(&view, x, 8));
				seen++;
			} else if (towards < -30) {
				assert_false(view_sees(&view, x, 8));
				hidden++;
			}
		}
		assert_true(seen > 100 && hidden > 100);
	}
	arena_free(arena);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(finds_the_nearest_face_of_the_piece),
		cmocka_unit_test(cuts_a_segment_at_every_edge),
		cmocka_unit_test(outlines_close_and_hold_the_area),
		cmocka_unit_test(an_outline_contains_what_its_faces_do),
		cmocka_unit_test(a_tube_is_sewn_to_itself),
		cmocka_unit_test(the_middles_of_a_seam_meet_when_it_is_sewn),
		cmocka_unit_test(a_view_sees_the_near_side),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
