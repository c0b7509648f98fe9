/* Whole layouts of small garments in closed form: straight wires, known deformations, seams that must not matter. */
#include "solver/layout/layout.h"

#include "solver/layout/result.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/unit/layout/sheet.h"

static void straight_wire_costs_what_its_rectangle_holds(void **state)
{
	(void)state;
	struct bench bench;
	set_up(&bench, 0, 0.2);
	/* Wide enough for a straight line between jittered vertices. */
	char request[160];
	snprintf(request, sizeof request,
		 "{\"options\":{\"tolerance_mm\":15},\"terminals\":[{\"vertex\":%u},{\"vertex\":%u}]}", at(5, 10),
		 at(30, 10));
	compute(&bench, request);
	const json_t *metrics = metrics_of(&bench);
	double length = member(metrics, "length_mm"), eta = bench.field.options.eta_mpa;
	/* Inner vertices are jittered by up to 2 mm, so the ends are not quite 250 mm apart. */
	const double *a = &bench.garment.pattern[2 * at(5, 10)], *b = &bench.garment.pattern[2 * at(30, 10)];
	double straight = sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]));
	assert_near(length, straight, 1e-3 * straight);
	assert_near(member(metrics, "energy_mpa_mm2"), length * 15 * (density + eta), 1e-3);
	assert_near(member(metrics, "energy_without_eta_mpa_mm2"), length * 15 * density, 1e-3);
	assert_near(member(metrics, "coverage"), 1, 1e-6);
	assert_string_equal(json_string_value(json_object_get(layout_of(&bench), "outcome")), "optimal");
	tear_down(&bench);
}

/* A tube of one piece: a wire over its seam jumps across the pattern, which is no part of it. */
static void a_piece_sewn_to_itself_has_the_wire_s_own_length(void **state)
{
	(void)state;
	enum { AROUND = 24, ALONG = 8 };
	const double cell = 9, radius = cell * AROUND / (2 * M_PI);
	struct bench bench = {.arena = arena_new(0)};
	mesh_tube(&bench.garment, bench.arena, AROUND, ALONG, cell);
	assert_int_equal(topology_build(&bench.topology, bench.arena, &bench.garment, NULL), TW_OK);
	double *mean = ARENA_ZEROED(bench.arena, bench.garment.face_count, double);
	struct field_options options;
	option_defaults(&field_option_table, &options);
	assert_int_equal(field_compute(&bench.field, bench.arena, &bench.garment, &bench.topology,
				       (const double *[]){mean}, 1, &options, 1, NULL),
			 TW_OK);
	set_frames(&bench, (double[9]){1.3, 0, 0, 0, 1, 0, 0, 0, 1.3}, (double[]){1}, 1);
	compute(&bench, two_vertices(4 * AROUND + 2, 4 * AROUND + 22));
	const json_t *metrics = metrics_of(&bench);
	assert_near(member(metrics, "length_mm"), 4 * cell, 1e-6);
	assert_near(member(metrics, "seam_crossings"), 1, 0);
	assert_near(member(json_object_get(metrics, "elongation"), "max"),
		    1.3 * 2 * radius * sin(M_PI / AROUND) / cell - 1, 1e-6);
	tear_down(&bench);
}

/* The sheet sewn from two pieces, the second turned by a right angle on the pattern, is the same fabric. */
static void a_seam_changes_nothing_but_the_piece(void **state)
{
	(void)state;
	static const char *const requests[] = {
		"{\"terminals\":[{\"vertex\":415},{\"vertex\":440}]}",
		"{\"terminals\":[{\"vertex\":168},{\"vertex\":690}]}",
		"{\"terminals\":[{\"vertex\":168},{\"vertex\":690},{\"vertex\":600},{\"vertex\":198}]}",
	};
	for (size_t i = 0; i < sizeof requests / sizeof *requests; i++) {
		struct bench whole, sewn;
		set_up(&whole, 0, 0);
		set_up(&sewn, 20, 0);
		compute(&whole, requests[i]);
		compute(&sewn, requests[i]);
		double length = member(metrics_of(&whole), "length_mm"),
		       cost = member(layout_of(&whole), "weight_mpa_mm2");
		assert_near(member(layout_of(&sewn), "weight_mpa_mm2"), cost, 1e-6 * cost);
		/* The curve must pass the seam at a vertex, so it may be a little longer. */
		assert_near(member(metrics_of(&sewn), "length_mm"), length, 0.02 * length);
		assert_true(member(metrics_of(&sewn), "seam_crossings") >= 1);
		tear_down(&whole);
		tear_down(&sewn);
	}
}

static struct vec2 point_of(const json_t *span, const char *key)
{
	const json_t *pair = json_object_get(span, key);
	return (struct vec2){json_number_value(json_array_get(pair, 0)), json_number_value(json_array_get(pair, 1))};
}

/* The direction of a span at its begin or end, in its piece's plane. */
static struct vec2 direction_of(const json_t *span, bool end)
{
	struct vec2 from = point_of(span, "from_mm"), to = point_of(span, "to_mm");
	if (strcmp(json_string_value(json_object_get(span, "type")), "arc") != 0)
		return vec2_unit(vec2_sub(to, from));
	struct vec2 spoke = vec2_unit(vec2_sub(end ? to : from, point_of(span, "centre_mm")));
	return vec2_scale(vec2_left(spoke), member(span, "turn_rad") > 0 ? 1 : -1);
}

/* From the pattern of the second piece, u = 2000 - y and v = x - 300, back to the sheet. */
static struct vec2 on_sheet(const json_t *span, struct vec2 p, bool direction)
{
	if (!strcmp(json_string_value(json_object_get(span, "piece")), "front"))
		return p;
	return direction ? (struct vec2){p.y, -p.x} : (struct vec2){p.y + 300, 2000 - p.x};
}

static void curves_are_smooth_across_seams_and_keep_the_radius(void **state)
{
	(void)state;
	struct bench bench;
	set_up(&bench, 20, 0.25);
	compute(&bench, "{\"terminals\":[{\"vertex\":168},{\"vertex\":690},{\"vertex\":600},{\"vertex\":198},"
			"{\"vertex\":440},{\"face\":700,\"barycentric\":[0.3,0.4,0.3]}]}");
	uint32_t crossings = 0;
	size_t b, s;
	json_t *branch, *span;
	json_array_foreach(json_object_get(layout_of(&bench), "branches"), b, branch)
	{
		const json_t *spans = json_object_get(branch, "spans");
		json_array_foreach(spans, s, span)
		{
			if (!strcmp(json_string_value(json_object_get(span, "type")), "arc"))
				assert_true(member(span, "radius_mm") >= 7.5 - 1e-3);
			if (s == 0)
				continue;
			const json_t *before = json_array_get(spans, s - 1);
			struct vec2 in = on_sheet(before, point_of(before, "to_mm"), false);
			struct vec2 out = on_sheet(span, point_of(span, "from_mm"), false);
			assert_near(vec2_distance(in, out), 0, 1e-3);
			struct vec2 d = on_sheet(before, direction_of(before, true), true);
			struct vec2 e = on_sheet(span, direction_of(span, false), true);
			assert_near(vec2_cross(d, e), 0, 2e-3);
			assert_true(vec2_dot(d, e) > 0);
			crossings += strcmp(json_string_value(json_object_get(before, "piece")),
					    json_string_value(json_object_get(span, "piece"))) != 0;
		}
	}
	assert_true(crossings >= 1);
	assert_int_equal(json_array_size(json_object_get(layout_of(&bench), "violations")), 0);
	tear_down(&bench);
}

static void equal_input_gives_equal_bytes(void **state)
{
	(void)state;
	struct bench first, second;
	const char *request = "{\"terminals\":[{\"vertex\":168},{\"vertex\":690},{\"vertex\":600},"
			      "{\"face\":700,\"barycentric\":[0.3,0.4,0.3]},{\"point_mm\":[222.2,111.1,3]}]}";
	set_up(&first, 20, 0.25);
	set_up(&second, 20, 0.25);
	assert_int_equal(try_compute(&first, request, 1, NULL), TW_OK);
	assert_int_equal(try_compute(&second, request, 2, NULL), TW_OK);
	assert_true(first.output.artifact_count >= 3);
	for (uint32_t i = 0; i < first.output.artifact_count; i++) {
		assert_int_equal(first.output.artifacts[i].size, second.output.artifacts[i].size);
		assert_memory_equal(first.output.artifacts[i].bytes, second.output.artifacts[i].bytes,
				    first.output.artifacts[i].size);
	}
	tear_down(&first);
	tear_down(&second);
}

/* Where the wearer stands, and which way he faces, is nothing to the layout. */
static void a_rigid_motion_of_the_suit_changes_no_figure(void **state)
{
	(void)state;
	struct bench first, second;
	set_up(&first, 20, 0.25);
	set_up(&second, 20, 0.25);
	for (uint32_t v = 0; v < second.garment.vertex_count; v++) {
		double *x = &second.garment.position[3 * (size_t)v];
		double moved[3] = {0.6 * x[0] - 0.8 * x[1] + 10, 77 - x[2], 0.8 * x[0] + 0.6 * x[1] - 5};
		memcpy(x, moved, sizeof moved);
	}
	const char *request = "{\"terminals\":[{\"vertex\":168},{\"vertex\":690},{\"vertex\":600},{\"vertex\":440}]}";
	compute(&first, request);
	compute(&second, request);
	assert_true(json_equal(metrics_of(&first), metrics_of(&second)));
	assert_true(json_equal(json_object_get(layout_of(&first), "weight"),
			       json_object_get(layout_of(&second), "weight")));
	tear_down(&first);
	tear_down(&second);
}

static void terminals_of_every_form_meet_where_they_are_the_same_place(void **state)
{
	(void)state;
	struct bench bench;
	set_up(&bench, 0, 0);
	/* Vertex 5 of row 10 three times over, as point, on the pattern and as a corner; and a place inside an edge. */
	compute(&bench, "{\"terminals\":[{\"name\":\"a\",\"vertex\":415},{\"point_mm\":[50,100,4]},"
			"{\"piece\":\"front\",\"uv_mm\":[50,100]},{\"piece\":\"front\",\"uv_mm\":[304,100]},"
			"{\"point_mm\":[304,100,-2]}]}");
	const json_t *terminals = json_object_get(bench.json, "terminals");
	assert_int_equal(json_array_size(terminals), 5);
	assert_int_equal((int)member(json_array_get(terminals, 0), "vertex"), 415);
	assert_null(json_object_get(json_array_get(terminals, 0), "merged_with"));
	assert_int_equal((int)member(json_array_get(terminals, 1), "merged_with"), 0);
	assert_near(member(json_array_get(terminals, 1), "snapped_mm"), 4, 1e-6);
	assert_int_equal((int)member(json_array_get(terminals, 2), "merged_with"), 0);
	assert_int_equal((int)member(json_array_get(terminals, 4), "merged_with"), 3);
	assert_int_equal(bench.output.summary.terminal_count, 2);
	assert_near(member(metrics_of(&bench), "length_mm"), 254, 1e-3);
	tear_down(&bench);
}

static void a_lone_terminal_needs_no_wire(void **state)
{
	(void)state;
	struct bench bench;
	set_up(&bench, 0, 0);
	compute(&bench, "{\"terminals\":[{\"vertex\":415},{\"vertex\":415}]}");
	assert_near(member(metrics_of(&bench), "length_mm"), 0, 0);
	assert_int_equal(json_array_size(json_object_get(layout_of(&bench), "branches")), 0);
	tear_down(&bench);
}

static void terminals_that_cannot_be_placed_are_named(void **state)
{
	(void)state;
	static const struct {
		const char *request, *type, *where, *words;
	} cases[] = {
		{"{\"terminals\":[{\"vertex\":0},{\"vertex\":861}]}", "terminal-out-of-range", "/terminals/1/vertex",
		 ""},
		{"{\"terminals\":[{\"face\":1600,\"barycentric\":[1,0,0]}]}", "terminal-out-of-range",
		 "/terminals/0/face", ""},
		{"{\"terminals\":[{\"point_mm\":[50,100,21]}]}", "terminal-off-fabric", "/terminals/0/point_mm",
		 "is 21.00 mm away"},
		{"{\"terminals\":[{\"point_mm\":[50,100,-99890]}]}", "terminal-off-fabric", "/terminals/0/point_mm",
		 "is 99890.00 mm away"},
		{"{\"terminals\":[{\"piece\":\"front\",\"uv_mm\":[-21,100]}]}", "terminal-off-fabric",
		 "/terminals/0/uv_mm", "is 21.00 mm off the piece"},
		{"{\"terminals\":[{\"piece\":\"front\",\"uv_mm\":[-54321,100]}]}", "terminal-off-fabric",
		 "/terminals/0/uv_mm", "is 54321.00 mm off the piece"},
		{"{\"terminals\":[{\"piece\":\"hood\",\"uv_mm\":[1,1]}]}", "terminal-unknown-piece",
		 "/terminals/0/piece", ""},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct bench bench;
		struct tw_error error = {0};
		set_up(&bench, 0, 0);
		assert_int_equal(try_compute(&bench, cases[i].request, 1, &error), TW_ERROR_INPUT);
		assert_string_equal(error.type, cases[i].type);
		assert_string_equal(error.where, cases[i].where);
		if (!strstr(error.text, cases[i].words))
			fail_msg("case %zu: %s", i, error.text);
		tear_down(&bench);
	}
}

/* Cutting the sheet in two along column 20 leaves two components. */
static void terminals_on_two_garments_are_apart(void **state)
{
	(void)state;
	struct bench bench;
	set_up(&bench, 0, 0);
	struct garment *g = &bench.garment;
	uint32_t kept = 0;
	for (uint32_t f = 0; f < g->face_count; f++) {
		if (f / 2 % 40 == 20)
			continue;
		memcpy(&g->face_vertex[3 * (size_t)kept], &g->face_vertex[3 * (size_t)f], 3 * sizeof(uint32_t));
		memcpy(&g->face_coord[3 * (size_t)kept++], &g->face_coord[3 * (size_t)f], 3 * sizeof(uint32_t));
	}
	g->face_count = kept;
	assert_int_equal(topology_build(&bench.topology, bench.arena, g, NULL), TW_OK);
	double *value = ARENA_ZEROED(bench.arena, kept, double);
	const double *means[1] = {value};
	struct field_options options;
	option_defaults(&field_option_table, &options);
	assert_int_equal(field_compute(&bench.field, bench.arena, g, &bench.topology, means, 1, &options, 1, NULL),
			 TW_OK);
	struct tw_error error = {0};
	assert_int_equal(try_compute(&bench, two_vertices(at(5, 10), at(30, 10)), 1, &error), TW_ERROR_INPUT);
	assert_string_equal(error.type, "terminals-apart");
	assert_string_equal(error.where, "/terminals/1");
	tear_down(&bench);
}

static double percent(const json_t *summary, const char *ours, const char *baseline)
{
	return 100 * (1 - member(summary, ours) / member(summary, baseline));
}

/* layout.json has a few decimals of each figure, the summary all. */
static void the_summary_and_the_file_tell_the_same(void **state)
{
	(void)state;
	struct bench bench;
	static const double stretch[9] = {1.2, 0.1, 0, 0, 1.1, 0, 0, 0, 1};
	set_up(&bench, 20, 0.2);
	set_motion(&bench, stretch);
	compute(&bench, "{\"terminals\":[{\"vertex\":168},{\"vertex\":690},{\"vertex\":600},{\"vertex\":198}]}");
	json_t *summary = layout_summary_show(&bench.output.summary);
	const json_t *ours = metrics_of(&bench), *elongation = json_object_get(ours, "elongation");
	const json_t *saved = json_object_get(bench.json, "reduction_percent");
	assert_non_null(summary);
	assert_string_equal(json_string_value(json_object_get(summary, "outcome")),
			    json_string_value(json_object_get(layout_of(&bench), "outcome")));
	assert_near(member(summary, "energy_mpa_mm2"), member(ours, "energy_mpa_mm2"), 1e-5);
	assert_near(member(summary, "energy_without_eta_mpa_mm2"), member(ours, "energy_without_eta_mpa_mm2"), 1e-5);
	assert_near(member(summary, "length_mm"), member(ours, "length_mm"), 1e-3);
	assert_near(member(summary, "elongation_max"), member(elongation, "max"), 1e-7);
	assert_near(member(summary, "elongation_mean"), member(elongation, "mean"), 1e-7);
	assert_near(member(saved, "energy"), percent(summary, "energy_mpa_mm2", "baseline_energy_mpa_mm2"), 1e-3);
	assert_near(member(saved, "elongation_max"), percent(summary, "elongation_max", "baseline_elongation_max"),
		    1e-3);
	json_decref(summary);
	tear_down(&bench);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(straight_wire_costs_what_its_rectangle_holds),
		cmocka_unit_test(a_piece_sewn_to_itself_has_the_wire_s_own_length),
		cmocka_unit_test(a_seam_changes_nothing_but_the_piece),
		cmocka_unit_test(curves_are_smooth_across_seams_and_keep_the_radius),
		cmocka_unit_test(equal_input_gives_equal_bytes),
		cmocka_unit_test(a_rigid_motion_of_the_suit_changes_no_figure),
		cmocka_unit_test(terminals_of_every_form_meet_where_they_are_the_same_place),
		cmocka_unit_test(a_lone_terminal_needs_no_wire),
		cmocka_unit_test(terminals_that_cannot_be_placed_are_named),
		cmocka_unit_test(terminals_on_two_garments_are_apart),
		cmocka_unit_test(the_summary_and_the_file_tell_the_same),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
