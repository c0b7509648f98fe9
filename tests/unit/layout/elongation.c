/* How far wires stretch, against deformations and motions whose elongation is known. */
#include "solver/layout/layout.h"

#include "solver/layout/result.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/unit/layout/sheet.h"

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

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(elongation_of_known_deformations),
		cmocka_unit_test(elongation_is_that_of_all_branches_together),
		cmocka_unit_test(motions_count_alike_and_each_has_its_figures),
		cmocka_unit_test(elongation_is_over_what_is_asked_for),
		cmocka_unit_test(elongation_of_a_piece_that_is_sewn_to_itself),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
