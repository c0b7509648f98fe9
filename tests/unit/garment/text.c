/* Numbers against strtod, bit by bit; lines and words; polygons cut against their area and against GEOS. */
#include "solver/garment/text.h"
#include "solver/garment/draft.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <geos_c.h>

static uint64_t seed = 1;

static uint32_t random_below(uint32_t limit)
{
	seed = seed * 6364136223846793005u + 1442695040888963407u;
	return (uint32_t)(seed >> 33) % limit;
}

static struct text text_of(const char *string)
{
	return (struct text){string, string + strlen(string)};
}

static void numbers_are_those_of_strtod(void **state)
{
	(void)state;
	for (int i = 0; i < 300000; i++) {
		char string[64];
		size_t size = 0;
		static const char *const signs[] = {"", "-", "+"};
		size += (size_t)snprintf(string, sizeof string, "%s", signs[random_below(3)]);
		for (uint32_t digits = random_below(14); digits > 0; digits--)
			string[size++] = (char)('0' + random_below(10));
		if (random_below(3) > 0)
			string[size++] = '.';
		for (uint32_t digits = random_below(14); digits > 0; digits--)
			string[size++] = (char)('0' + random_below(10));
		string[size] = '\0';
		if (random_below(4) == 0)
			snprintf(string + size, sizeof string - size, "e%d", (int)random_below(660) - 330);
		char *end = NULL;
		double wanted = strtod(string, &end), number = 0;
		bool is_number = *end == '\0' && end != string && isfinite(wanted);
		struct text word = text_of(string);
		if (text_to_number(&word, &number) != is_number)
			fail_msg("\"%s\"", string);
		if (is_number && memcmp(&number, &wanted, sizeof number) != 0)
			fail_msg("\"%s\" gives %a, not %a", string, number, wanted);
	}
}

static void what_is_no_number_is_refused(void **state)
{
	(void)state;
	static const char *const strings[] = {"",     "-",   ".",   "+.",  "nan",   "NaN",   "inf", "-Infinity",
					      "0x10", "1e",  "1e+", "1,5", "1.5.2", "1f",    "--1", "1e400",
					      "١",    "1 2", "e5",  "1d5", "0X1p3", "1_000", "१२",  "1e5x"};
	for (size_t i = 0; i < sizeof strings / sizeof *strings; i++) {
		struct text word = text_of(strings[i]);
		double number = 0;
		if (text_to_number(&word, &number))
			fail_msg("\"%s\" was taken as %g", strings[i], number);
	}
}

static void lines_end_as_every_system_ends_them(void **state)
{
	(void)state;
	struct text text = text_of("a b\\\n c\r\n\r\nd\\\r\ne\rf\r\rg\\"), line, word;
	static const char *const words[] = {"a", "b", "c", NULL, NULL, "d", "e", NULL, "f", NULL, NULL, "g\\", NULL};
	uint32_t lines = 0;
	size_t i = 0;
	while (text_next_line(&text, &line, &lines)) {
		while (text_join_line(&text, &line, &lines))
			;
		while (text_next_word(&line, &word)) {
			assert_non_null(words[i]);
			assert_true(text_equals(&word, words[i++]));
		}
		assert_null(words[i++]);
	}
	assert_int_equal(i, sizeof words / sizeof *words);
	assert_int_equal(lines, 8);
}

static void utf8_is_told_from_bytes(void **state)
{
	(void)state;
	static const char *const good[] = {
		"", "front", "\xc3\xa4rmel", "\xe2\x82\xac", "\xf0\x9f\x91\x95", "\xef\xbf\xbd"};
	static const char *const bad[] = {
		"\xff",  "\xc3", "\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xf0\x80\x80\x80",
		"a\x01", "\x7f", "\xc2\x85"};
	for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
		struct text text = text_of(good[i]);
		assert_true(text_is_utf8(&text));
	}
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		struct text text = text_of(bad[i]);
		assert_false(text_is_utf8(&text));
	}
}

static void cut_text_ends_with_a_whole_character(void **state)
{
	(void)state;
	static const char string[] = "a\xc3\xa4\xe2\x82\xac\xf0\x9f\x91\x95z"; /* 1, 2, 3, 4 and 1 bytes */
	static const int cuts[] = {0, 1, 1, 3, 3, 3, 6, 6, 6, 6, 10, 11, 11};
	for (int limit = 0; limit < (int)(sizeof cuts / sizeof *cuts); limit++)
		assert_int_equal(utf8_cut(string, limit), cuts[limit]);
}

/* A star-shaped polygon around the origin: simple, and concave as often as not. */
static uint32_t make_star(double *xy)
{
	uint32_t count = 4 + random_below(30);
	for (uint32_t i = 0; i < count; i++) {
		double radius = 1 + random_below(100), angle = 2 * M_PI * i / count;
		xy[2 * i] = radius * cos(angle);
		xy[2 * i + 1] = radius * sin(angle);
	}
	return count;
}

static GEOSGeometry *make_geos(const double *xy, const uint32_t *corners, uint32_t count)
{
	GEOSCoordSequence *sequence = GEOSCoordSeq_create(count + 1, 2);
	for (uint32_t i = 0; i <= count; i++) {
		uint32_t corner = corners ? corners[i % count] : i % count;
		GEOSCoordSeq_setXY(sequence, i, xy[2 * corner], xy[2 * corner + 1]);
	}
	return GEOSGeom_createPolygon(GEOSGeom_createLinearRing(sequence), NULL, 0);
}

static void polygons_are_cut_without_gap_or_overlap(void **state)
{
	(void)state;
	initGEOS(NULL, NULL);
	for (int round = 0; round < 500; round++) {
		double xy[2 * 40], area = 0;
		uint32_t triangles[3 * 40], count = make_star(xy);
		assert_true(polygon_cut(xy, count, triangles));
		GEOSGeometry *whole = make_geos(xy, NULL, count);
		for (uint32_t t = 0; t < count - 2; t++) {
			GEOSGeometry *triangle = make_geos(xy, triangles + 3 * t, 3);
			GEOSGeometry *outside = GEOSDifference(triangle, whole);
			double part = 0, out = 0;
			GEOSArea(triangle, &part);
			GEOSArea(outside, &out);
			assert_true(out < 1e-6);
			area += part;
			GEOSGeom_destroy(outside);
			GEOSGeom_destroy(triangle);
		}
		double wanted = 0;
		GEOSArea(whole, &wanted);
		assert_true(fabs(area - wanted) < 1e-9 * wanted);
		GEOSGeom_destroy(whole);
	}
	finishGEOS();
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(numbers_are_those_of_strtod),
		cmocka_unit_test(what_is_no_number_is_refused),
		cmocka_unit_test(lines_end_as_every_system_ends_them),
		cmocka_unit_test(utf8_is_told_from_bytes),
		cmocka_unit_test(cut_text_ends_with_a_whole_character),
		cmocka_unit_test(polygons_are_cut_without_gap_or_overlap),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
