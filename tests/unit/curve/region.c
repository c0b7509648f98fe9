/* Areas cut by one another, judged by GEOS: random polygons with everything that is awkward about them. */
#include "solver/curve/region.h"

#include "solver/curve/ribbon.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <geos_c.h>

#include "tests/oracle/geos_region.h"
#include "tests/oracle/meshes.h"

static uint64_t state;

static double random_in(double low, double high)
{
	return low + mesh_random(&state) * (high - low);
}

static void add_loop(struct region_builder *builder, const struct vec2 *point, uint32_t count)
{
	region_begin_loop(builder);
	for (uint32_t i = 0; i < count; i++)
		region_add_point(builder, point[i]);
}

/* A star-shaped loop to the left around a centre. */
static void add_star(struct region_builder *builder, struct vec2 centre, double size)
{
	struct vec2 point[40];
	uint32_t count = 5 + (uint32_t)random_in(0, 34);
	for (uint32_t i = 0; i < count; i++) {
		double angle = 2 * M_PI * (i + random_in(0, 0.5)) / count, radius = size * random_in(0.2, 1);
		point[i] = (struct vec2){centre.x + radius * cos(angle), centre.y + radius * sin(angle)};
	}
	add_loop(builder, point, count);
}

/* Rectangles and their halves on a coarse grid, which share corners and edges and lie on one another. */
static void add_block(struct region_builder *builder, double grid)
{
	double x = grid * floor(random_in(-6, 4)), y = grid * floor(random_in(-6, 4));
	double width = grid * floor(random_in(1, 6)), height = grid * floor(random_in(1, 6));
	struct vec2 point[4] = {{x, y}, {x + width, y}, {x + width, y + height}, {x, y + height}};
	uint32_t skipped = (uint32_t)random_in(0, 8);
	region_begin_loop(builder);
	for (uint32_t i = 0; i < 4; i++)
		if (i != skipped)
			region_add_point(builder, point[i]);
}

static void add_random(struct region_builder *builder, double grid)
{
	uint32_t loops = 1 + (uint32_t)random_in(0, 4);
	for (uint32_t l = 0; l < loops; l++) {
		struct vec2 centre = {random_in(-40, 40), random_in(-40, 40)};
		if (grid > 0)
			add_block(builder, grid);
		else
			add_star(builder, centre, random_in(5, 60));
	}
}

/* What differs between ours and GEOS' has no more area than edges that moved by a grid's width. */
static void assert_same_area(const struct region *ours, const GEOSGeometry *theirs)
{
	GEOSGeometry *mine = geos_region(ours);
	GEOSGeometry *difference = GEOSSymDifference(mine, theirs);
	double area, length, own_length;
	assert_non_null(difference);
	assert_true(GEOSArea(difference, &area) && GEOSLength(theirs, &length) && GEOSLength(mine, &own_length));
	double slack = 4 * REGION_GRID_MM * (length + own_length + 1);
	if (area > slack)
		fail_msg("off by %g mm2 of boundary %g mm", area, length);
	double whole;
	GEOSArea(mine, &whole);
	assert_true(fabs(whole - region_area(ours)) < 1e-6 * (1 + whole));
	GEOSGeom_destroy(difference);
	GEOSGeom_destroy(mine);
}

static void common_parts_and_differences_are_those_of_geos(void **ignored)
{
	(void)ignored;
	state = 7;
	for (int round = 0; round < 600; round++) {
		struct arena *arena = arena_new(0), *scratch = arena_new(0);
		struct region_builder a, b;
		struct region common, less;
		double grid = round % 3 ? 0 : 7;
		region_start(&a, arena);
		region_start(&b, arena);
		add_random(&a, grid);
		add_random(&b, grid);
		assert_int_equal(region_combine(&common, arena, scratch, &a.region, &b.region, REGION_COMMON, NULL),
				 TW_OK);
		assert_int_equal(region_combine(&less, arena, scratch, &a.region, &b.region, REGION_LESS, NULL), TW_OK);
		GEOSGeometry *p = geos_wound(&a.region), *q = geos_wound(&b.region);
		GEOSGeometry *both = GEOSIntersection(p, q), *rest = GEOSDifference(p, q);
		assert_same_area(&common, both);
		assert_same_area(&less, rest);
		GEOSGeom_destroy(p);
		GEOSGeom_destroy(q);
		GEOSGeom_destroy(both);
		GEOSGeom_destroy(rest);
		arena_free(arena);
		arena_free(scratch);
	}
}

static void holes_stay_holes(void **ignored)
{
	(void)ignored;
	struct arena *arena = arena_new(0), *scratch = arena_new(0);
	struct region_builder ring, bar;
	struct region common, less;
	region_start(&ring, arena);
	region_start(&bar, arena);
	add_loop(&ring, (struct vec2[]){{0, 0}, {30, 0}, {30, 30}, {0, 30}}, 4);
	add_loop(&ring, (struct vec2[]){{10, 10}, {10, 20}, {20, 20}, {20, 10}}, 4);
	add_loop(&bar, (struct vec2[]){{-5, 12}, {40, 12}, {40, 18}, {-5, 18}}, 4);
	assert_int_equal(region_combine(&common, arena, scratch, &bar.region, &ring.region, REGION_COMMON, NULL),
			 TW_OK);
	assert_int_equal(common.loop_count, 2);
	assert_true(fabs(region_area(&common) - 120) < 1e-6);
	assert_int_equal(region_combine(&less, arena, scratch, &bar.region, &ring.region, REGION_LESS, NULL), TW_OK);
	assert_int_equal(less.loop_count, 3);
	assert_true(fabs(region_area(&less) - (45 * 6 - 120)) < 1e-6);
	arena_free(arena);
	arena_free(scratch);
}

static void nothing_and_what_lies_far_apart_have_nothing_in_common(void **ignored)
{
	(void)ignored;
	struct arena *arena = arena_new(0), *scratch = arena_new(0);
	struct region_builder a, b, none;
	struct region result;
	region_start(&a, arena);
	region_start(&b, arena);
	region_start(&none, arena);
	add_loop(&a, (struct vec2[]){{0, 0}, {10, 0}, {0, 10}}, 3);
	add_loop(&b, (struct vec2[]){{9e8, 0}, {9e8 + 10, 0}, {9e8, 10}}, 3);
	const struct region *pairs[][2] = {{&a.region, &b.region},
					   {&a.region, &none.region},
					   {&none.region, &a.region},
					   {&none.region, &none.region}};
	for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
		assert_int_equal(region_combine(&result, arena, scratch, pairs[i][0], pairs[i][1], REGION_COMMON, NULL),
				 TW_OK);
		assert_int_equal(result.loop_count, 0);
	}
	assert_int_equal(region_combine(&result, arena, scratch, &a.region, &none.region, REGION_LESS, NULL), TW_OK);
	assert_true(fabs(region_area(&result) - 50) < 1e-6);
	arena_free(arena);
	arena_free(scratch);
}

/* A curve of lines and arcs that join smoothly, as GEOS' line of many points and as spans. */
static void strips_are_the_buffers_of_their_curves(void **ignored)
{
	(void)ignored;
	state = 11;
	for (int round = 0; round < 100; round++) {
		struct arena *arena = arena_new(0), *scratch = arena_new(0);
		struct span span[7];
		struct vec2 at = {0, 0}, direction = {1, 0};
		double width = random_in(2, 30), turned = 0;
		for (int i = 0; i < 7; i++) {
			span[i] = span_line(at, vec2_along(at, direction, random_in(20, 60)), 0);
			if (i % 2) {
				/* Never back over itself. */
				double radius = random_in(round % 2 ? 1 : width / 2, 60), turn = random_in(-1.5, 1.5);
				turn = fabs(turned + turn) > 1.5 ? -turn : turn;
				turned += turn;
				struct vec2 left = vec2_scale(vec2_left(direction), turn > 0 ? 1 : -1);
				span[i].centre = vec2_along(at, left, radius);
				span[i].radius = radius;
				span[i].turn = turn;
				struct vec2 spoke = vec2_rotate(vec2_sub(at, span[i].centre), vec2_of_angle(turn));
				span[i].to = vec2_add(span[i].centre, spoke);
				direction = vec2_rotate(direction, vec2_of_angle(turn));
			}
			at = span[i].to;
		}
		struct region_builder builder, none;
		struct region strip;
		region_start(&builder, arena);
		region_start(&none, arena);
		ribbon_add(&builder, span, 7, width);
		assert_int_equal(
			region_combine(&strip, arena, scratch, &builder.region, &none.region, REGION_LESS, NULL),
			TW_OK);
		GEOSGeometry *buffer = geos_strip_of(span, 7, width);
		GEOSGeometry *mine = geos_region(&strip), *difference = GEOSSymDifference(mine, buffer);
		double area, boundary;
		GEOSArea(difference, &area);
		GEOSLength(buffer, &boundary);
		/* Chords of both, and the square ends of GEOS, whose last chord is not the tangent. */
		if (area > RIBBON_CHORD_MM * boundary + 0.01 * width * width)
			fail_msg("round %d: %g mm2", round, area);
		GEOSGeom_destroy(difference);
		GEOSGeom_destroy(mine);
		GEOSGeom_destroy(buffer);
		arena_free(arena);
		arena_free(scratch);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(common_parts_and_differences_are_those_of_geos),
		cmocka_unit_test(holes_stay_holes),
		cmocka_unit_test(nothing_and_what_lies_far_apart_have_nothing_in_common),
		cmocka_unit_test(strips_are_the_buffers_of_their_curves),
	};
	initGEOS(geos_print, geos_print);
	int failed = cmocka_run_group_tests(tests, NULL, NULL);
	finishGEOS();
	return failed;
}
