/* Curves: angles against libm, rounded polygons against what "smooth" means, straightened paths against their promises
 * and against a search of all polygons. */
#include "solver/curve/curve.h"
#include "solver/curve/corridor.h"
#include "solver/curve/fillet.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static uint64_t seed = 7;

static double random_between(double low, double high)
{
	seed = seed * 6364136223846793005u + 1442695040888963407u;
	return low + (high - low) * ((double)(seed >> 11) / 9007199254740992.0);
}

static void assert_near(double a, double b, double slack)
{
	if (!(fabs(a - b) <= slack))
		fail_msg("%.17g is not %.17g", a, b);
}

static void angles_agree_with_libm(void **state)
{
	(void)state;
	for (int i = 0; i < 20000; i++) {
		double angle = random_between(-M_PI, M_PI);
		struct vec2 turn = vec2_of_angle(angle);
		assert_near(turn.x, cos(angle), 4e-15);
		assert_near(turn.y, sin(angle), 4e-15);
		struct vec2 a = {random_between(-9, 9), random_between(-9, 9)};
		struct vec2 b = {random_between(-9, 9), random_between(-9, 9)};
		double expected = atan2(a.x * b.y - a.y * b.x, a.x * b.x + a.y * b.y);
		assert_near(vec2_angle(a, b), expected, 1e-13);
	}
	assert_near(vec2_angle((struct vec2){1, 0}, (struct vec2){-1, 0}), M_PI, 1e-13);
	assert_near(vec2_angle((struct vec2){1, 0}, (struct vec2){2, 0}), 0, 0);
	assert_near(vec2_angle((struct vec2){1, 0}, (struct vec2){1, -1e-9}), -1e-9, 1e-22);
}

static double distance_to_polygon(const struct corner *corner, uint32_t count, struct vec2 p)
{
	double best = INFINITY;
	for (uint32_t i = 0; i + 1 < count; i++) {
		struct vec2 a = corner[i].at, b = corner[i + 1].at;
		best = fmin(best, vec2_distance(p, vec2_mix(a, b, vec2_nearest(a, b, p))));
	}
	return best;
}

/* A random polygon with turns of up to `most` radians. */
static uint32_t make_polygon(struct corner *corner, double shortest, double longest, double most, double reach)
{
	uint32_t count = 2 + (uint32_t)random_between(0, 9);
	double heading = random_between(0, 6);
	corner[0] = (struct corner){.at = {random_between(-50, 50), random_between(-50, 50)}, .reach = reach};
	for (uint32_t i = 1; i < count; i++) {
		double length = random_between(shortest, longest);
		corner[i] = corner[0];
		corner[i].at = vec2_along(corner[i - 1].at, (struct vec2){cos(heading), sin(heading)}, length);
		heading += random_between(-most, most);
	}
	return count;
}

static void rounded_polygons_are_smooth(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	for (int round = 0; round < 3000; round++) {
		struct corner corner[16];
		uint32_t count = make_polygon(corner, 1, 60, 3.0, random_between(0.5, 9)), spans;
		struct span *span;
		struct tw_error error;
		assert_int_equal(curve_fillet(corner, count, 7.5, arena, &span, &spans, &error), TW_OK);
		assert_true(spans >= 1);
		assert_near(vec2_distance(span[0].from, corner[0].at), 0, 1e-9);
		assert_near(vec2_distance(span[spans - 1].to, corner[count - 1].at), 0, 1e-9);
		for (uint32_t s = 0; s < spans; s++) {
			assert_near(vec2_distance(span_point(&span[s], 0.999999999), span[s].to), 0, 1e-6);
			if (span_is_arc(&span[s])) {
				assert_near(vec2_distance(span[s].to, span[s].centre), span[s].radius,
					    1e-9 * (1 + span[s].radius));
				assert_true(fabs(span[s].turn) < M_PI);
			}
			if (s == 0)
				continue;
			assert_near(vec2_distance(span[s - 1].to, span[s].from), 0, 1e-9);
			struct vec2 before = span_direction(&span[s - 1], 1), after = span_direction(&span[s], 0);
			assert_near(vec2_cross(before, after), 0, 1e-6);
			assert_true(vec2_dot(before, after) > 0);
		}
	}
	arena_free(arena);
}

/* Legs of 40 mm with turns of up to 100 degrees have room for arcs of 7.5 mm: 2 * 7.5 * tan(50) = 17.9 < 40. */
static void arcs_keep_the_smallest_radius_and_the_reach(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	for (int round = 0; round < 2000; round++) {
		struct corner corner[16];
		uint32_t count = make_polygon(corner, 40, 200, 1.74, 8), spans;
		struct span *span;
		struct tw_error error;
		assert_int_equal(curve_fillet(corner, count, 7.5, arena, &span, &spans, &error), TW_OK);
		for (uint32_t s = 0; s < spans; s++) {
			assert_true(!span_is_arc(&span[s]) || span[s].radius >= 7.5 * (1 - 1e-9));
			for (int i = 0; i <= 10; i++)
				assert_true(distance_to_polygon(corner, count, span_point(&span[s], i / 10.0)) <
					    8 + 1e-9);
		}
	}
	arena_free(arena);
}

static void nearest_point_of_a_span_is_the_nearest(void **state)
{
	(void)state;
	for (int round = 0; round < 2000; round++) {
		double radius = random_between(5, 40), turn = random_between(-3, 3), start = random_between(0, 6);
		struct span arc = {.radius = radius, .turn = turn, .centre = {3, -2}};
		arc.from = (struct vec2){3 + radius * cos(start), -2 + radius * sin(start)};
		arc.to = (struct vec2){3 + radius * cos(start + turn), -2 + radius * sin(start + turn)};
		struct vec2 p = {random_between(-50, 50), random_between(-50, 50)};
		double found = vec2_distance(p, span_point(&arc, span_nearest(&arc, p)));
		for (int i = 0; i <= 100; i++)
			assert_true(found <= vec2_distance(p, span_point(&arc, i / 100.0)) + 1e-9);
		assert_near(span_length(&arc), radius * fabs(turn), 1e-12);
	}
}

/* Strips of all parts of an arc: inscribed trapezoids fill the annulus up to the sagitta. */
static void strips_of_an_arc_fill_its_annulus(void **state)
{
	(void)state;
	struct span arc = {.radius = 20, .turn = 2, .centre = {0, 0}, .from = {20, 0}};
	arc.to = (struct vec2){20 * cos(2.0), 20 * sin(2.0)};
	uint32_t parts = span_cuts(&arc, 0.01);
	double area = 0;
	for (uint32_t i = 0; i < parts; i++) {
		struct vec2 quad[4];
		span_strip(&arc, (double)i / parts, (double)(i + 1) / parts, 15, quad);
		for (int k = 0; k < 4; k++)
			area += vec2_cross(quad[k], quad[(k + 1) % 4]) / 2;
	}
	assert_near(area, 2 * 20 * 15, 0.02);
}

static double polygon_cost(const struct corridor *corridor, const uint32_t *kept, uint32_t count)
{
	double cost = 0;
	for (uint32_t k = 1; k < count; k++) {
		cost += vec2_distance(corridor->point[kept[k - 1]], corridor->point[kept[k]]);
		if (k + 1 == count)
			break;
		struct vec2 in = vec2_sub(corridor->point[kept[k]], corridor->point[kept[k - 1]]);
		struct vec2 out = vec2_sub(corridor->point[kept[k + 1]], corridor->point[kept[k]]);
		double turn = fabs(atan2(vec2_cross(in, out), vec2_dot(in, out)));
		double room = fmin(vec2_length(in), vec2_length(out)) / 2;
		double lack = fmax(0, corridor->minimum_radius * fmin(tan(turn / 2), 1e3) - room);
		cost += corridor->bend_price * (1 + 4 * (1 - cos(turn))) + 50 * lack;
	}
	return cost;
}

static bool polygon_fits(const struct corridor *corridor, const uint32_t *kept, uint32_t count)
{
	for (uint32_t k = 1; k < count; k++) {
		struct vec2 a = corridor->point[kept[k - 1]], b = corridor->point[kept[k]];
		for (uint32_t m = kept[k - 1] + 1; m < kept[k]; m++) {
			struct vec2 p = corridor->point[m];
			if (corridor->stop[m] ||
			    vec2_distance(p, vec2_mix(a, b, vec2_nearest(a, b, p))) > corridor->tolerance)
				return false;
		}
	}
	return true;
}

/* All 2^(n-2) polygons of short random paths. */
static void straightening_finds_the_cheapest_polygon(void **state)
{
	(void)state;
	enum { N = 11 };
	struct arena *arena = arena_new(0);
	for (int round = 0; round < 150; round++) {
		struct vec2 point[N];
		double rate[N];
		bool stop[N];
		for (int i = 0; i < N; i++) {
			point[i] = (struct vec2){10.0 * i + random_between(-4, 4), random_between(-12, 12)};
			rate[i] = 1;
			stop[i] = i == 0 || i == N - 1 || random_between(0, 1) < 0.1;
		}
		struct corridor corridor = {.point = point,
					    .rate = rate,
					    .stop = stop,
					    .count = N,
					    .tolerance = 9,
					    .minimum_radius = 7.5,
					    .bend_price = 5};
		uint32_t kept[N], kept_count;
		struct tw_error error;
		assert_int_equal(corridor_straighten(&corridor, arena, kept, &kept_count, &error), TW_OK);
		assert_true(polygon_fits(&corridor, kept, kept_count));
		double found = polygon_cost(&corridor, kept, kept_count), best = INFINITY;
		for (uint32_t set = 0; set < 1u << (N - 2); set++) {
			uint32_t all[N], count = 0;
			for (uint32_t i = 0; i < N; i++)
				if (i == 0 || i == N - 1 || (set >> (i - 1) & 1))
					all[count++] = i;
			if (polygon_fits(&corridor, all, count))
				best = fmin(best, polygon_cost(&corridor, all, count));
		}
		assert_near(found, best, 1e-6 * best);
	}
	arena_free(arena);
}

static double never(void *context, uint32_t i, uint32_t j)
{
	(void)context, (void)i, (void)j;
	return INFINITY;
}

static void straightening_heeds_what_is_forbidden(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	const struct vec2 point[4] = {{0, 0}, {10, 1}, {20, 0}, {30, 1}};
	const double rate[4] = {1, 1, 1, 1};
	const bool stop[4] = {true, false, false, true};
	struct corridor corridor = {.point = point,
				    .rate = rate,
				    .stop = stop,
				    .count = 4,
				    .tolerance = 9,
				    .minimum_radius = 7.5,
				    .bend_price = 5};
	uint32_t kept[4], count;
	assert_int_equal(corridor_straighten(&corridor, arena, kept, &count, NULL), TW_OK);
	assert_int_equal(count, 2);
	corridor.leg_cost = never;
	assert_int_equal(corridor_straighten(&corridor, arena, kept, &count, NULL), TW_OK);
	assert_int_equal(count, 4);
	arena_free(arena);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(angles_agree_with_libm),
		cmocka_unit_test(rounded_polygons_are_smooth),
		cmocka_unit_test(arcs_keep_the_smallest_radius_and_the_reach),
		cmocka_unit_test(nearest_point_of_a_span_is_the_nearest),
		cmocka_unit_test(strips_of_an_arc_fill_its_annulus),
		cmocka_unit_test(straightening_finds_the_cheapest_polygon),
		cmocka_unit_test(straightening_heeds_what_is_forbidden),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
