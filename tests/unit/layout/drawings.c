/* The drawings of layouts: well-formed, of true scale, with every wire that is seen. */
#include "solver/layout/layout.h"

#include "solver/layout/result.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/unit/layout/sheet.h"

/* A small reader of tags: they nest, attributes are quoted, text has no bare markup. */
static void assert_well_formed(const char *xml)
{
	const char *open[64];
	size_t depth = 0, lengths[64];
	for (const char *c = strchr(xml, '<'); c; c = strchr(c, '<')) {
		if (c[1] == '?') {
			c = strstr(c, "?>");
			assert_non_null(c);
			continue;
		}
		bool closing = c[1] == '/';
		const char *name = c + 1 + closing, *end = name;
		size_t length = strcspn(name, " />\n");
		while (*end != '>') {
			assert_true(*end && *end != '<');
			end += *end == '"' ? strcspn(end + 1, "\"") + 2 : 1;
		}
		if (closing) {
			assert_true(depth > 0 && lengths[depth - 1] == length);
			assert_memory_equal(open[--depth], name, length);
		} else if (end[-1] != '/') {
			assert_true(depth < 64);
			open[depth] = name;
			lengths[depth++] = length;
		}
		c = end;
	}
	assert_int_equal(depth, 0);
}

static void drawings_are_well_formed_and_of_true_scale(void **state)
{
	(void)state;
	struct bench bench;
	set_up(&bench, 0, 0);
	compute(&bench, "{\"terminals\":[{\"name\":\"a<&\\\"b'>\",\"vertex\":415},{\"vertex\":440}]}");
	for (uint32_t i = 1; i < bench.output.artifact_count; i++)
		assert_well_formed(bench.output.artifacts[i].bytes);
	const char *svg = bench.output.artifacts[1].bytes;
	double width, height, box[4];
	assert_int_equal(sscanf(strstr(svg, "width=\""), "width=\"%lfmm\" height=\"%lfmm\" viewBox=\"%lf %lf %lf %lf",
				&width, &height, &box[0], &box[1], &box[2], &box[3]),
			 6);
	assert_near(width, box[2], 0);
	assert_near(height, box[3], 0);
	/* The sheet's cut line spans 400 x 200 units, which are millimetres. */
	const char *cut = strstr(svg, "id=\"cut-line\"");
	assert_non_null(cut);
	double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
	const char *path = strstr(cut, " d=\"") + 4;
	while (*path != 'Z') {
		double p[2];
		int used;
		assert_int_equal(sscanf(path, "%*1[ML]%lf %lf%n", &p[0], &p[1], &used), 2);
		for (int k = 0; k < 2; k++) {
			low[k] = fmin(low[k], p[k]);
			high[k] = fmax(high[k], p[k]);
		}
		path += used;
	}
	assert_near(high[0] - low[0], 400, 1e-3);
	assert_near(high[1] - low[1], 200, 1e-3);
	tear_down(&bench);
}

/* Whether some corner of the layer's paths of a class lies within a millimetre of a place on the page. */
static bool path_comes_by(const char *layer, const char *end, const char *class, double x, double y)
{
	char group[64];
	snprintf(group, sizeof group, "<g class=\"%s\"", class);
	const char *from = strstr(layer, group), *to = from ? strstr(from, "</g>") : NULL;
	while (from && from < to && from < end) {
		double p[2];
		int used = 0;
		if (sscanf(from, "%*1[ML]%lf %lf%n", &p[0], &p[1], &used) == 2 && hypot(p[0] - x, p[1] - y) < 1)
			return true;
		from += used ? used : 1;
	}
	return false;
}

/* Wires around a tube, whose ends are seen from one side for a few millimetres only. */
static void every_terminal_that_is_seen_has_its_wire_there(void **state)
{
	(void)state;
	static const char *const sides[] = {"front", "back"};
	uint32_t seen = 0;
	for (uint32_t start = 0; start < 40; start++) {
		struct bench bench = {.arena = arena_new(0)};
		assert_non_null(bench.arena);
		mesh_tube(&bench.garment, bench.arena, 40, 20, 10);
		weigh(&bench);
		char request[160];
		snprintf(request, sizeof request, "{\"terminals\":[{\"vertex\":%u},{\"vertex\":%u}]}", 10 * 40 + start,
			 10 * 40 + (start + 12) % 40);
		compute(&bench, request);
		const char *svg = bench.output.artifacts[2].bytes;
		for (int side = 0; side < 2; side++) {
			char opening[32];
			snprintf(opening, sizeof opening, "<g id=\"%s\"", sides[side]);
			const char *layer = strstr(svg, opening), *end = strstr(layer + 1, "<g id=");
			for (const char *dot = strstr(layer, "<circle"); dot && dot < end;
			     dot = strstr(dot + 1, "<circle")) {
				double x, y;
				assert_int_equal(sscanf(dot, "<circle cx=\"%lf\" cy=\"%lf\"", &x, &y), 2);
				assert_true(path_comes_by(layer, end, "wire", x, y));
				assert_true(path_comes_by(layer, end, "strip", x, y));
				seen++;
			}
		}
		tear_down(&bench);
	}
	assert_true(seen >= 2 * 40);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(drawings_are_well_formed_and_of_true_scale),
		cmocka_unit_test(every_terminal_that_is_seen_has_its_wire_there),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
