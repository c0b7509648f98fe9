/* Whole layouts of small garments in closed form: straight wires, known deformations, seams that must not matter. */
#include "solver/layout/layout.h"

#include "solver/layout/result.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/unit/layout/sheet.h"

static char *two_vertices(uint32_t a, uint32_t b)
{
	static char request[128];
	snprintf(request, sizeof request, "{\"terminals\":[{\"vertex\":%u},{\"vertex\":%u}]}", a, b);
	return request;
}

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

static void elongation_of_known_deformations(void **state)
{
	(void)state;
	static const struct {
		double matrix[9], along_x, along_y;
	} cases[] = {
		{{1.2, 0, 0, 0, 1, 0, 0, 0, 1}, 0.2, 0},     /* stretched along x */
		{{1.1, 0, 0, 0, 1.3, 0, 0, 0, 1}, 0.1, 0.3}, /* both ways */
		{{0.8, 0, 0, 0, 1, 0, 0, 0, 1}, 0, 0},       /* shortening counts as none */
		{{1, 0.75, 0, 0, 1, 0, 0, 0, 1}, 0, 0.25},   /* shear: y goes to (0.75, 1), length 1.25 */
		{{1, 0, 0, 0, 1, 0, 0.75, 0, 1}, 0.25, 0},   /* out of the plane */
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		for (int y = 0; y < 2; y++) {
			struct bench bench;
			set_up(&bench, 0, 0);
			set_motion(&bench, cases[i].matrix);
			compute(&bench, y ? two_vertices(at(20, 4), at(20, 16)) : two_vertices(at(5, 10), at(30, 10)));
			const json_t *elongation = json_object_get(metrics_of(&bench), "elongation");
			double most = y ? cases[i].along_y : cases[i].along_x, mean = 0;
			for (int frame = 1; frame <= 3; frame++) {
				/* The ends move in straight lines; so does the whole wire, and its length with them. */
				const double *m = cases[i].matrix;
				double d[3] = {y ? m[1] : m[0], y ? m[4] : m[3], y ? m[7] : m[6]}, square = 0;
				for (int k = 0; k < 3; k++) {
					double rest = k == y ? 1 : 0, now = rest + (d[k] - rest) * frame / 3;
					square += now * now;
				}
				mean += fmax(0, sqrt(square) - 1) / 3;
			}
			assert_near(member(elongation, "max"), most, 1e-6);
			assert_near(member(elongation, "mean"), mean, 1e-6);
			tear_down(&bench);
		}
	}
}

/* The length of a layout's wires on the sheet, whose pattern is its worn shape, under a matrix: by sampling the spans
 * that layout.json tells. */
static double sampled_length(const json_t *layout, const double m[9])
{
	enum { SAMPLES = 400 };
	double length = 0;
	size_t b, s;
	json_t *branch, *span;
	json_array_foreach(json_object_get(layout, "branches"), b, branch)
		json_array_foreach(json_object_get(branch, "spans"), s, span)
	{
		const json_t *from = json_object_get(span, "from_mm"), *to = json_object_get(span, "to_mm");
		const json_t *centre = json_object_get(span, "centre_mm");
		double a[2], last[3] = {0};
		for (size_t k = 0; k < 2; k++)
			a[k] = json_number_value(json_array_get(from, k));
		for (int i = 0; i <= SAMPLES; i++) {
			double p[2], t = (double)i / SAMPLES, here[3], square = 0;
			for (size_t k = 0; k < 2; k++)
				p[k] = a[k] + t * (json_number_value(json_array_get(to, k)) - a[k]);
			if (centre) {
				double c[2], turn = member(span, "turn_rad") * t;
				for (size_t k = 0; k < 2; k++)
					c[k] = json_number_value(json_array_get(centre, k));
				p[0] = c[0] + cos(turn) * (a[0] - c[0]) - sin(turn) * (a[1] - c[1]);
				p[1] = c[1] + sin(turn) * (a[0] - c[0]) + cos(turn) * (a[1] - c[1]);
			}
			for (size_t k = 0; k < 3; k++) {
				here[k] = m[3 * k] * p[0] + m[3 * k + 1] * p[1];
				square += (here[k] - last[k]) * (here[k] - last[k]);
				last[k] = here[k];
			}
			length += i ? sqrt(square) : 0;
		}
	}
	return length;
}

static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/* A share of the way from rest to a matrix. */
static void towards(const double m[9], double share, double between[9])
{
	for (int i = 0; i < 9; i++)
		between[i] = identity[i] + share * (m[i] - identity[i]);
}

/* A stub that stretches by a half, on a wire of which the rest shrinks, is no headline: the branches are one wire. */
static void elongation_is_that_of_all_branches_together(void **state)
{
	(void)state;
	static const double matrices[][9] = {{1.3, 0, 0, 0, 1.1, 0, 0, 0, 1},
					     {1.4, 0, 0, 0, 0.8, 0, 0, 0, 1},
					     {0.7, 0.2, 0, 0, 1.5, 0, 0, 0, 1},
					     {0.9, 0, 0, 0, 0.9, 0, 0, 0, 1}};
	for (size_t i = 0; i < sizeof matrices / sizeof *matrices; i++) {
		struct bench bench;
		set_up(&bench, 0, 0.2);
		set_frames(&bench, matrices[i], (double[]){0.25, 1, 0.5, -0.3}, 4);
		compute(&bench,
			"{\"terminals\":[{\"vertex\":168},{\"vertex\":690},{\"vertex\":600},{\"vertex\":198}]}");
		double rest = sampled_length(layout_of(&bench), identity), max = 0, mean = 0;
		for (int j = 0; j < 4; j++) {
			double m[9];
			towards(matrices[i], (double[]){0.25, 1, 0.5, -0.3}[j], m);
			double stretch = fmax(0, sampled_length(layout_of(&bench), m) / rest - 1);
			max = fmax(max, stretch);
			mean += stretch / 4;
		}
		const json_t *elongation = json_object_get(metrics_of(&bench), "elongation");
		assert_near(member(elongation, "max"), max, 1e-4);
		assert_near(member(elongation, "mean"), mean, 1e-4);
		assert_true(json_array_size(json_object_get(layout_of(&bench), "branches")) >= 3);
		tear_down(&bench);
	}
}

/* Two motions, one of them four times as long: its frames count no more than the other's. */
struct two_motions {
	struct bench *bench, *other;
	bool has_frames[3];
};

static enum tw_status open_one_of_two(void *context, uint32_t motion, struct motion_reader **reader,
				      struct tw_error *error)
{
	struct two_motions *two = context;
	return open_motion(motion ? two->other : two->bench, 0, reader, error);
}

static enum tw_status mean_of_one(void *context, uint32_t motion, double *mean, struct tw_error *error)
{
	const struct two_motions *two = context;
	(void)error;
	for (uint32_t f = 0; f < two->bench->garment.face_count; f++)
		mean[f] = (double[]){0.3, 0.05, 0.11}[motion];
	return TW_OK;
}

static void motions_count_alike_and_each_has_its_figures(void **state)
{
	(void)state;
	static const char *const names[] = {"long", "short", "frameless"};
	static const char *const json =
		"{\"terminals\":[{\"vertex\":168},{\"vertex\":690},{\"vertex\":600},{\"vertex\":198}]}";
	const double both[9] = {1.3, 0, 0, 0, 1.1, 0, 0, 0, 1};
	struct bench bench, other;
	set_up(&bench, 0, 0.2);
	set_up(&other, 0, 0.2);
	set_frames(&bench, both, (double[]){0.25, 0.25, 0.25, 0.25}, 4);
	set_frames(&other, both, (double[]){1}, 1);
	struct two_motions two = {&bench, &other, {true, true, false}};
	assert_int_equal(layout_request_parse(&bench.request, json, strlen(json), NULL), TW_OK);
	struct layout_input input = {.garment = &bench.garment,
				     .topology = &bench.topology,
				     .field = &bench.field,
				     .request = &bench.request,
				     .motion_name = names,
				     .motion_count = 3,
				     .motion_has_frames = two.has_frames,
				     .motion_open = open_one_of_two,
				     .motion_mean = mean_of_one,
				     .context = &two};
	assert_int_equal(layout_compute(&input, bench.arena, &bench.output, NULL), TW_OK);
	bench.json = json_loads(bench.output.artifacts[0].bytes, 0, NULL);
	const json_t *metrics = metrics_of(&bench), *elongation = json_object_get(metrics, "elongation");
	const json_t *rows = json_object_get(metrics, "elongation_by_motion");
	double mean[2];
	for (size_t m = 0; m < 2; m++)
		mean[m] = member(json_array_get(rows, m), "mean");
	assert_true(mean[1] > 3 * mean[0] && mean[0] > 0.03);
	assert_near(member(elongation, "mean"), (mean[0] + mean[1]) / 2, 1e-7);
	assert_near(member(elongation, "max"), mean[1], 1e-7);
	assert_true(json_is_null(json_array_get(rows, 2)));
	double length = member(metrics, "length_mm"), energy = member(metrics, "energy_mpa_mm2");
	double without_eta = member(metrics, "energy_without_eta_mpa_mm2");
	const json_t *reductions = json_object_get(bench.json, "reduction_percent_by_motion");
	for (size_t m = 0; m < 3; m++) {
		const json_t *row = json_array_get(json_object_get(metrics, "energy_by_motion"), m);
		double share = (double[]){0.3, 0.05, 0.11}[m] / density;
		assert_near(member(row, "energy_without_eta_mpa_mm2"), share * without_eta, 1e-4);
		assert_near(member(row, "energy_mpa_mm2"), energy - (1 - share) * without_eta, 1e-4);
		const json_t *other_row = json_array_get(
			json_object_get(json_object_get(json_object_get(bench.json, "baseline"), "metrics"),
					"energy_by_motion"),
			m);
		assert_near(member(json_array_get(reductions, m), "energy"),
			    100 * (1 - member(row, "energy_mpa_mm2") / member(other_row, "energy_mpa_mm2")), 1e-3);
	}
	assert_true(length > 0);
	tear_down(&bench);
	tear_down(&other);
}

/* Worn a tenth larger than the pattern, and then moved: against each state the other lengths. */
static void elongation_is_over_what_is_asked_for(void **state)
{
	(void)state;
	static const struct {
		const char *over;
		double want;
	} cases[] = {
		{"pattern", 1.1 * 1.2 - 1}, {"worn", 0.2}, {"frame", 1.2 / 1.05 - 1}, {"reference", 1.1 * 1.2 - 1}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct bench bench;
		char request[160];
		set_up(&bench, 0, 0);
		bench.field.options.reference_frame = 1;
		for (size_t c = 0; c < 3 * (size_t)bench.garment.vertex_count; c++)
			bench.garment.position[c] *= 1.1;
		set_frames(&bench, (double[9]){1.2, 0, 0, 0, 1, 0, 0, 0, 1}, (double[]){0.5, 0.25, 1, 0}, 4);
		snprintf(request, sizeof request,
			 "{\"terminals\":[{\"vertex\":415},{\"vertex\":440}],\"options\":{\"elongation_over\":\"%s\"}}",
			 cases[i].over);
		compute(&bench, request);
		assert_near(member(json_object_get(metrics_of(&bench), "elongation"), "max"), cases[i].want, 1e-6);
		assert_string_equal(json_string_value(json_object_get(bench.json, "elongation_over")),
				    i == 3 ? "pattern" : cases[i].over);
		tear_down(&bench);
	}
	struct bench bench;
	struct tw_error error = {0};
	set_up(&bench, 0, 0);
	bench.field.options.reference_frame = 3;
	set_motion(&bench, NULL);
	assert_int_equal(try_compute(&bench,
				     "{\"terminals\":[{\"vertex\":415},{\"vertex\":440}],\"options\":{"
				     "\"elongation_over\":\"frame\"}}",
				     1, &error),
			 TW_ERROR_INPUT);
	assert_string_equal(error.type, "reference-frame");
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

/* A sleeve of one piece: the wire goes around it, over the piece's seam with itself. */
static void elongation_of_a_piece_that_is_sewn_to_itself(void **state)
{
	(void)state;
	double mean[2];
	for (uint32_t turned = 0; turned < 2; turned++) {
		struct bench bench = {.arena = arena_new(0)};
		assert_non_null(bench.arena);
		mesh_tube(&bench.garment, bench.arena, 40, 20, 10);
		weigh(&bench);
		set_motion(&bench, (const double[9]){1.5, 0, 0, 0, 1.5, 0, 0, 0, 1.5});
		compute(&bench, turned ? two_vertices(415, 425) : two_vertices(435, 405));
		assert_int_equal((int)member(metrics_of(&bench), "seam_crossings"), !turned);
		const json_t *elongation = json_object_get(metrics_of(&bench), "elongation");
		/* The tube of chords is a little shorter than its pattern. */
		assert_near(member(elongation, "max"), 0.5, 0.01);
		mean[turned] = member(elongation, "mean");
		tear_down(&bench);
	}
	assert_near(mean[0], mean[1], 1e-3);
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

/* `bench` first: it is what open_motion is handed. */
struct stopper {
	struct bench bench;
	const char *last_wanted; /* the stage from which on nobody wants it */
	bool stops;
};

static void stop_from_stage(void *context, const struct layout_progress *progress)
{
	struct stopper *stopper = context;
	stopper->stops |= !strcmp(progress->stage, stopper->last_wanted);
}

static bool has_stopped(void *context)
{
	const struct stopper *stopper = context;
	return stopper->stops;
}

static void a_cancelled_layout_says_so_at_every_stage(void **state)
{
	(void)state;
	static const char *const stages[] = {"terminals", "tree", "baseline", "curves", "elongation", "artifacts"};
	for (size_t i = 0; i < sizeof stages / sizeof *stages; i++) {
		struct stopper stopper = {.last_wanted = stages[i]};
		struct bench *bench = &stopper.bench;
		set_up(bench, 0, 0.2);
		set_motion(bench, NULL);
		const char *json =
			"{\"terminals\":[{\"vertex\":168},{\"vertex\":690},{\"vertex\":600},{\"vertex\":198}]}";
		assert_int_equal(layout_request_parse(&bench->request, json, strlen(json), NULL), TW_OK);
		static const char *const names[] = {"none"};
		struct layout_input input = {.garment = &bench->garment,
					     .topology = &bench->topology,
					     .field = &bench->field,
					     .request = &bench->request,
					     .motion_name = names,
					     .motion_count = 1,
					     .motion_open = open_motion,
					     .progress = stop_from_stage,
					     .cancelled = has_stopped,
					     .context = &stopper};
		struct tw_error error = {0};
		assert_int_equal(layout_compute(&input, bench->arena, &bench->output, &error), TW_ERROR_CANCELLED);
		assert_true(stopper.stops);
		tear_down(bench);
	}
}

struct watch {
	struct bench *bench;
	struct layout_progress last;
	uint32_t reports, eta_reports;
};

static void take_progress(void *context, const struct layout_progress *progress)
{
	struct watch *watch = context;
	assert_true(progress->share >= watch->last.share && progress->share <= 1);
	bool moved = !watch->last.stage || progress->share > watch->last.share;
	watch->eta_reports += !strcmp(progress->stage, "eta") && moved;
	watch->reports++;
	watch->last = *progress;
}

static enum tw_status open_watched_motion(void *context, uint32_t motion, struct motion_reader **reader,
					  struct tw_error *error)
{
	struct watch *watch = context;
	return open_motion(watch->bench, motion, reader, error);
}

static void progress_never_falls_and_ends_with_the_proven_tree(void **state)
{
	(void)state;
	struct bench bench;
	set_up(&bench, 0, 0.2);
	for (uint32_t f = 0; f < bench.garment.face_count; f++)
		((double *)bench.field.density)[f] *= 1 + f % 7;
	set_motion(&bench, NULL);
	struct watch watch = {.bench = &bench};
	const char *json = "{\"terminals\":[{\"vertex\":168},{\"vertex\":690},{\"vertex\":600},{\"vertex\":198}],"
			   "\"options\":{\"eta\":\"auto\"}}";
	assert_int_equal(layout_request_parse(&bench.request, json, strlen(json), NULL), TW_OK);
	static const char *const names[] = {"still"};
	struct layout_input input = {.garment = &bench.garment,
				     .topology = &bench.topology,
				     .field = &bench.field,
				     .request = &bench.request,
				     .motion_name = names,
				     .motion_count = 1,
				     .motion_open = open_watched_motion,
				     .progress = take_progress,
				     .context = &watch};
	assert_int_equal(layout_compute(&input, bench.arena, &bench.output, NULL), TW_OK);
	assert_true(watch.eta_reports >= 3);
	assert_int_equal(watch.last.weight, bench.output.summary.weight);
	assert_int_equal(watch.last.lower_bound, bench.output.summary.weight);
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
		cmocka_unit_test(elongation_of_known_deformations),
		cmocka_unit_test(elongation_is_that_of_all_branches_together),
		cmocka_unit_test(motions_count_alike_and_each_has_its_figures),
		cmocka_unit_test(elongation_is_over_what_is_asked_for),
		cmocka_unit_test(a_piece_sewn_to_itself_has_the_wire_s_own_length),
		cmocka_unit_test(a_seam_changes_nothing_but_the_piece),
		cmocka_unit_test(curves_are_smooth_across_seams_and_keep_the_radius),
		cmocka_unit_test(equal_input_gives_equal_bytes),
		cmocka_unit_test(a_rigid_motion_of_the_suit_changes_no_figure),
		cmocka_unit_test(terminals_of_every_form_meet_where_they_are_the_same_place),
		cmocka_unit_test(a_lone_terminal_needs_no_wire),
		cmocka_unit_test(terminals_that_cannot_be_placed_are_named),
		cmocka_unit_test(terminals_on_two_garments_are_apart),
		cmocka_unit_test(drawings_are_well_formed_and_of_true_scale),
		cmocka_unit_test(elongation_of_a_piece_that_is_sewn_to_itself),
		cmocka_unit_test(every_terminal_that_is_seen_has_its_wire_there),
		cmocka_unit_test(a_cancelled_layout_says_so_at_every_stage),
		cmocka_unit_test(progress_never_falls_and_ends_with_the_proven_tree),
		cmocka_unit_test(the_summary_and_the_file_tell_the_same),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
