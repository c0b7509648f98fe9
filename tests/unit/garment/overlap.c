/* Self-overlap of a pattern piece against GEOS, which intersects every two faces: random ribbons that wind across
 * themselves or not. */
#include "solver/garment/import.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <geos_c.h>

enum { QUADS = 40 };

static uint64_t seed = 7;

static double random_unit(void)
{
	seed = seed * 6364136223846793005u + 1442695040888963407u;
	return (double)(seed >> 11) / 9007199254740992.0;
}

/* A ribbon 10 wide that turns by up to `bend` at every step of 12; points[2i], points[2i + 1] are its left and right
 * edge. */
static void wind(double points[2 * (QUADS + 1)][2], double bend)
{
	double x = 0, y = 0, angle = 0, turn = 0;
	for (int i = 0; i <= QUADS; i++) {
		points[2 * i][0] = x - 5 * sin(angle);
		points[2 * i][1] = y + 5 * cos(angle);
		points[2 * i + 1][0] = x + 5 * sin(angle);
		points[2 * i + 1][1] = y - 5 * cos(angle);
		turn = 0.7 * turn + 0.3 * bend * (2 * random_unit() - 1) * 3;
		turn = fmax(-bend, fmin(bend, turn));
		angle += turn;
		x += 12 * cos(angle);
		y += 12 * sin(angle);
	}
}

static void corners_of(int face, int corners[3])
{
	int left = face / 2 * 2, right = left + 1;
	corners[0] = face % 2 ? left : right;
	corners[1] = right + 2;
	corners[2] = face % 2 ? left + 2 : left;
}

static GEOSGeometry *triangle(double points[2 * (QUADS + 1)][2], int face)
{
	int corners[3];
	corners_of(face, corners);
	GEOSCoordSequence *sequence = GEOSCoordSeq_create(4, 2);
	for (unsigned i = 0; i < 4; i++)
		GEOSCoordSeq_setXY(sequence, i, points[corners[i % 3]][0], points[corners[i % 3]][1]);
	return GEOSGeom_createPolygon(GEOSGeom_createLinearRing(sequence), NULL, 0);
}

/* The largest area in which two faces lie on each other. */
static double largest_overlap(double points[2 * (QUADS + 1)][2])
{
	GEOSGeometry *faces[2 * QUADS];
	double largest = 0;
	for (int f = 0; f < 2 * QUADS; f++)
		faces[f] = triangle(points, f);
	for (int a = 0; a < 2 * QUADS; a++) {
		for (int b = 0; b < a; b++) {
			GEOSGeometry *common = GEOSIntersection(faces[a], faces[b]);
			double area = 0;
			GEOSArea(common, &area);
			largest = fmax(largest, area);
			GEOSGeom_destroy(common);
		}
	}
	for (int f = 0; f < 2 * QUADS; f++)
		GEOSGeom_destroy(faces[f]);
	return largest;
}

static void write_obj(char *text, size_t limit, double points[2 * (QUADS + 1)][2])
{
	size_t size = 0;
	for (int i = 0; i < 2 * (QUADS + 1); i++)
		size += (size_t)snprintf(text + size, limit - size, "v %d %d 0\nvt %.17g %.17g\n", i / 2 * 12,
					 i % 2 ? 0 : 10, points[i][0], points[i][1]);
	for (int f = 0; f < 2 * QUADS; f++) {
		int c[3];
		corners_of(f, c);
		size += (size_t)snprintf(text + size, limit - size, "f %d/%d %d/%d %d/%d\n", c[0] + 1, c[0] + 1,
					 c[1] + 1, c[1] + 1, c[2] + 1, c[2] + 1);
	}
}

static void ribbons_overlap_where_geos_says_so(void **state)
{
	(void)state;
	initGEOS(NULL, NULL);
	struct import_options options;
	option_defaults(&import_option_table, &options);
	int overlapping = 0, clear = 0;
	for (int round = 0; round < 200; round++) {
		double points[2 * (QUADS + 1)][2];
		char text[32768];
		wind(points, 0.15 + 0.5 * random_unit());
		write_obj(text, sizeof text, points);
		double area = largest_overlap(points);
		struct garment_source source = {.bytes = text, .size = strlen(text), .format = MESH_OBJ};
		struct arena *arena = arena_new(0);
		struct garment garment;
		struct garment_report report;
		struct tw_error error = {0};
		enum tw_status status = garment_import(&garment, arena, &source, NULL, &options, &report, &error);
		arena_free(arena);
		if (area > 0.01) {
			assert_int_equal(status, TW_ERROR_INPUT);
			assert_string_equal(error.type, "pattern-overlaps-itself");
			overlapping++;
		} else if (area < 1e-9) {
			assert_int_equal(status, TW_OK);
			clear++;
		}
	}
	assert_true(overlapping > 30);
	assert_true(clear > 30);
	finishGEOS();
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(ribbons_overlap_where_geos_says_so),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
