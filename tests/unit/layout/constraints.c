/* What a request asks beyond the field: keep-outs, multipliers, the price of seams, edges that are free, and the
 * balance of eta. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/unit/layout/sheet.h"

/* Calls `look` with many points of every wire, in the pattern. */
static void each_point(const struct bench *bench, void (*look)(const char *piece, double u, double v))
{
	size_t b, s;
	json_t *branch, *span;
	json_array_foreach(json_object_get(layout_of(bench), "branches"), b, branch)
	{
		json_array_foreach(json_object_get(branch, "spans"), s, span)
		{
			const json_t *from = json_object_get(span, "from_mm"), *to = json_object_get(span, "to_mm");
			for (int i = 0; i <= 20; i++) {
				double t = i / 20.0;
				double u = (1 - t) * json_number_value(json_array_get(from, 0)) +
					   t * json_number_value(json_array_get(to, 0));
				double v = (1 - t) * json_number_value(json_array_get(from, 1)) +
					   t * json_number_value(json_array_get(to, 1));
				look(json_string_value(json_object_get(span, "piece")), u, v);
			}
		}
	}
}

static void outside_the_box(const char *piece, double u, double v)
{
	(void)piece;
	if (u > 150 && u < 250 && v > 40 && v < 160)
		fail_msg("(%g, %g) lies in the keep-out", u, v);
}

static void wires_go_around_a_keep_out(void **state)
{
	(void)state;
	struct bench bench;
	set_up(&bench, 0, 0.2);
	compute(&bench, "{\"terminals\":[{\"vertex\":415},{\"vertex\":445}],\"constraints\":{\"keep_out\":["
			"{\"piece\":\"front\",\"polygon_mm\":[[150,40],[250,40],[250,160],[150,160]]}]}}");
	each_point(&bench, outside_the_box);
	/* Around the box: from (50,100) over its corners with half a strip to spare. */
	double length = member(metrics_of(&bench), "length_mm");
	assert_true(length > 2 * sqrt(100 * 100 + 60 * 60) + 100 && length < 400);
	assert_int_equal(json_array_size(json_object_get(layout_of(&bench), "violations")), 0);
	tear_down(&bench);
}

static void a_keep_out_that_leaves_no_way_is_an_error(void **state)
{
	(void)state;
	struct bench bench;
	struct tw_error error = {0};
	set_up(&bench, 0, 0);
	assert_int_equal(try_compute(&bench,
				     "{\"terminals\":[{\"vertex\":415},{\"vertex\":445}],\"constraints\":{\"keep_out\":"
				     "[{\"piece\":\"front\",\"polygon_mm\":[[150,-9],[250,-9],[250,999],[150,999]]}]}}",
				     1, &error),
			 TW_ERROR_INPUT);
	assert_string_equal(error.type, "terminals-apart");
	tear_down(&bench);
}

static void a_terminal_that_a_keep_out_shuts_in_is_told_so(void **state)
{
	(void)state;
	struct bench bench;
	struct tw_error error = {0};
	set_up(&bench, 0, 0);
	/* 3 mm beside vertex (35, 10): less than half a strip. */
	assert_int_equal(try_compute(&bench,
				     "{\"terminals\":[{\"vertex\":415},{\"vertex\":445}],\"constraints\":{\"keep_out\":"
				     "[{\"piece\":\"front\",\"polygon_mm\":[[353,80],[390,80],[390,120],[353,120]]},"
				     "{\"piece\":\"front\",\"polygon_mm\":[[320,80],[347,80],[347,120],[320,120]]}]}}",
				     1, &error),
			 TW_ERROR_INPUT);
	assert_string_equal(error.type, "terminals-apart");
	assert_string_equal(error.where, "/terminals/1");
	assert_non_null(strstr(error.text, "half a strip"));
	tear_down(&bench);
}

static uint32_t above, below;

static void count_side(const char *piece, double u, double v)
{
	(void)piece;
	if (u > 150 && u < 250) {
		above += v > 115;
		below += v < 85;
	}
}

/* Dear fabric across the straight way, with a gap on one side. */
static void wires_leave_out_dear_fabric(void **state)
{
	(void)state;
	struct bench bench;
	set_up(&bench, 0, 0.2);
	compute(&bench, "{\"terminals\":[{\"vertex\":415},{\"vertex\":445}],\"constraints\":{\"face_multipliers\":["
			"{\"piece\":\"front\",\"polygon_mm\":[[180,0],[220,0],[220,130],[180,130]],\"factor\":50}]}}");
	above = below = 0;
	each_point(&bench, count_side);
	assert_true(above > 0 && below == 0);
	/* A multiplier is a price; the energy that is reported is the fabric's own. */
	double length = member(metrics_of(&bench), "length_mm");
	assert_near(member(metrics_of(&bench), "energy_without_eta_mpa_mm2"), length * 15 * density, 1);
	tear_down(&bench);
}

static void free_edges_draw_the_wire(void **state)
{
	(void)state;
	struct bench bench;
	set_up(&bench, 0, 0);
	/* Row 15 carries a wire from column 5 to 35; the terminals lie on row 10. */
	char request[2048] = "{\"terminals\":[{\"vertex\":415},{\"vertex\":445}],\"constraints\":{\"free_edges\":[";
	for (uint32_t i = 5; i < 35; i++)
		snprintf(request + strlen(request), sizeof request - strlen(request), "%s[%u,%u]", i > 5 ? "," : "",
			 at(i + i % 2, 15), at(i + 1 - i % 2, 15));
	strcat(request, "]}}");
	compute(&bench, request);
	above = below = 0;
	each_point(&bench, count_side);
	assert_true(above > 0 && below == 0);
	tear_down(&bench);
}

/* Both terminals on the left of the seam, with cheap fabric on its right. */
static void a_price_keeps_wires_from_crossing_seams(void **state)
{
	(void)state;
	static const char *const request =
		"{\"terminals\":[{\"vertex\":100},{\"vertex\":756}],\"constraints\":{\"face_multipliers\":["
		"{\"piece\":\"back\",\"polygon_mm\":[[0,-999],[3000,-999],[3000,999],[0,999]],\"factor\":0.01}]%s}}";
	char text[512];
	struct bench bench;
	set_up(&bench, 20, 0);
	snprintf(text, sizeof text, request, "");
	compute(&bench, text);
	assert_int_equal((int)member(metrics_of(&bench), "seam_crossings"), 2);
	snprintf(text, sizeof text, request, ",\"seam_price_mpa_mm2\":5000");
	compute(&bench, text);
	assert_int_equal((int)member(metrics_of(&bench), "seam_crossings"), 0);
	tear_down(&bench);
}

static void constraints_that_mean_nothing_are_named(void **state)
{
	(void)state;
	static const struct {
		const char *constraints, *type, *where;
	} cases[] = {
		{"{\"keep_out\":[{\"faces\":[1600]}]}", "face-out-of-range", "/constraints/keep_out/0/faces/0"},
		{"{\"keep_out\":[{\"piece\":\"hood\",\"polygon_mm\":[[0,0],[1,0],[0,1]]}]}", "unknown-piece",
		 "/constraints/keep_out/0"},
		{"{\"free_edges\":[[0,1],[0,2]]}", "unknown-edge", "/constraints/free_edges/1"},
		{"{\"keep_out\":[]}", "json-type", "/constraints/keep_out"},
		{"{\"keep_out\":[{}]}", "json-missing-field", "/constraints/keep_out/0"},
		{"{\"keep_out\":[{\"piece\":\"front\",\"polygon_mm\":[[0,0],[1,0]]}]}", "json-value",
		 "/constraints/keep_out/0/polygon_mm"},
		{"{\"keep_out\":[{\"faces\":[1],\"factor\":2}]}", "json-unknown-field",
		 "/constraints/keep_out/0/factor"},
		{"{\"face_multipliers\":[{\"faces\":[1]}]}", "json-missing-field", "/constraints/face_multipliers/0"},
		{"{\"face_multipliers\":[{\"faces\":[1],\"factor\":-1}]}", "json-value",
		 "/constraints/face_multipliers/0/factor"},
		{"{\"seam_price_mpa_mm2\":\"dear\"}", "json-value", "/constraints/seam_price_mpa_mm2"},
		{"{\"free_edges\":[[0]]}", "json-type", "/constraints/free_edges/0"},
		{"{\"colour\":1}", "json-unknown-field", "/constraints/colour"},
		{"7", "json-type", "/constraints"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct bench bench;
		struct tw_error error = {0};
		char request[256];
		set_up(&bench, 0, 0);
		snprintf(request, sizeof request, "{\"terminals\":[{\"vertex\":0}],\"constraints\":%s}",
			 cases[i].constraints);
		assert_int_equal(try_compute(&bench, request, 1, &error), TW_ERROR_INPUT);
		if (strcmp(error.type, cases[i].type) != 0 || strcmp(error.where, cases[i].where) != 0)
			fail_msg("%s: %s at %s", cases[i].constraints, error.type, error.where);
		tear_down(&bench);
	}
}

/* Soft fabric in the upper half: eta decides between the straight way and the detour. */
static void eta_auto_lies_between_the_extremes_and_is_told(void **state)
{
	(void)state;
	struct bench bench;
	set_up(&bench, 0, 0.2);
	double *mean = ARENA_ARRAY(bench.arena, bench.garment.face_count, double);
	assert_non_null(mean);
	for (uint32_t f = 0; f < bench.garment.face_count; f++) {
		uint32_t row = f / 2 / 40;
		mean[f] = row < 12 ? 1 : 0.2 / (row - 10);
	}
	const double *means[1] = {mean};
	struct field_options options = bench.field.options;
	assert_int_equal(
		field_compute(&bench.field, bench.arena, &bench.garment, &bench.topology, means, 1, &options, 1, NULL),
		TW_OK);
	static const char *const terminals = "\"terminals\":[{\"vertex\":415},{\"vertex\":445}]";
	char request[256];
	snprintf(request, sizeof request, "{%s,\"options\":{\"eta\":\"auto\"}}", terminals);
	compute(&bench, request);
	double eta = member(json_object_get(bench.json, "field"), "eta_mpa");
	double length = member(metrics_of(&bench), "length_mm");
	double energy = member(metrics_of(&bench), "energy_without_eta_mpa_mm2");
	assert_true(eta > 0.001 && eta < 100);
	/* More balanced than either extreme: shorter than the softest wire, softer than the shortest. */
	double extreme_length = 0, extreme_energy = 0;
	for (int high = 0; high < 2; high++) {
		options.eta_mpa = high ? 1000 : 0.0001;
		assert_int_equal(field_weigh(&bench.field, bench.arena, &bench.garment, &bench.topology,
					     bench.field.density, &options, NULL, 1, NULL),
				 TW_OK);
		snprintf(request, sizeof request, "{%s}", terminals);
		compute(&bench, request);
		if (high)
			extreme_energy = member(metrics_of(&bench), "energy_without_eta_mpa_mm2");
		else
			extreme_length = member(metrics_of(&bench), "length_mm");
	}
	assert_true(length < extreme_length && energy < extreme_energy);
	/* The same as when that eta is given. */
	options.eta_mpa = eta;
	assert_int_equal(field_weigh(&bench.field, bench.arena, &bench.garment, &bench.topology, bench.field.density,
				     &options, NULL, 1, NULL),
			 TW_OK);
	compute(&bench, request);
	assert_near(member(metrics_of(&bench), "length_mm"), length, 0);
	tear_down(&bench);
}

/* The ways that a wire can take: the sheet's edges, or also its chords. */
struct ways {
	uint32_t count;
	uint32_t (*end)[2];
	double *a, *b; /* cost a + eta b */
	double *length, *none;
};

static void find_ways(struct bench *bench, struct ways *ways, const double *density_of, bool chords)
{
	const uint32_t edges = bench->topology.edge_count;
	struct field field[2];
	*ways = (struct ways){.end = arena_array(bench->arena, 2 * (size_t)edges, sizeof *ways->end),
			      .a = ARENA_ARRAY(bench->arena, 2 * (size_t)edges, double),
			      .b = ARENA_ARRAY(bench->arena, 2 * (size_t)edges, double),
			      .length = ARENA_ARRAY(bench->arena, 2 * (size_t)edges, double),
			      .none = ARENA_ZEROED(bench->arena, 2 * (size_t)edges, double)};
	struct field_options options = bench->field.options;
	for (int k = 0; k < 2; k++) {
		options.eta_mpa = k;
		assert_int_equal(field_weigh(&field[k], bench->arena, &bench->garment, &bench->topology, density_of,
					     &options, NULL, 1, NULL),
				 TW_OK);
		assert_int_equal(field_weigh_chords(&field[k], bench->arena, &bench->garment, &bench->topology, NULL, 1,
						    NULL, NULL),
				 TW_OK);
	}
	bench->field = field[0];
	for (uint32_t e = 0; e < (chords ? 2 : 1) * edges; e++) {
		bool chord = e >= edges;
		uint32_t at = e % edges, i = ways->count;
		const uint64_t *weight[2] = {chord ? field[0].chord_weight : field[0].weight,
					     chord ? field[1].chord_weight : field[1].weight};
		if (weight[0][at] == FIELD_FORBIDDEN)
			continue;
		for (size_t k = 0; k < 2; k++) {
			uint32_t face = bench->topology.edge_face[2 * (size_t)at + k];
			uint32_t side = bench->topology.edge_side[2 * (size_t)at + k];
			ways->end[i][k] = chord ? bench->garment.face_vertex[3 * (size_t)face + (side + 2) % 3]
						: bench->topology.edge_vertex[2 * (size_t)at + k];
		}
		const double *u = bench->garment.position + 3 * (size_t)ways->end[i][0];
		const double *v = bench->garment.position + 3 * (size_t)ways->end[i][1];
		ways->length[i] = hypot(u[0] - v[0], u[1] - v[1]);
		ways->a[i] = (double)weight[0][at] / field[0].scale;
		ways->b[i] = (double)weight[1][at] / field[1].scale - ways->a[i];
		ways->count++;
	}
}

/* The cheapest way between two vertices of the sheet with edges of a[e] + eta b[e], by Bellman and Ford: its length and
 * its deformation. */
static void best_way(const struct bench *bench, const struct ways *ways, const double *a, const double *b, double eta,
		     uint32_t from, uint32_t to, double sum[2])
{
	enum { VERTICES = 861 };
	static double best[VERTICES], sums[VERTICES][2];
	assert_int_equal(bench->garment.vertex_count, VERTICES);
	for (uint32_t v = 0; v < VERTICES; v++)
		best[v] = v == from ? 0 : INFINITY;
	sums[from][0] = sums[from][1] = 0;
	for (bool changed = true; changed;) {
		changed = false;
		for (uint32_t e = 0; e < 2 * ways->count; e++) {
			uint32_t u = ways->end[e / 2][e % 2], v = ways->end[e / 2][1 - e % 2];
			double weight = a[e / 2] + eta * b[e / 2];
			if (!(best[u] + weight < best[v] - 1e-12))
				continue;
			best[v] = best[u] + weight;
			sums[v][0] = sums[u][0] + ways->length[e / 2];
			sums[v][1] = sums[u][1] + ways->a[e / 2];
			changed = true;
		}
	}
	memcpy(sum, sums[to], sizeof sums[to]);
}

/* Both curves between their own two ends, the softest and the shortest way: where a fine sweep sees them change places,
 * there the eta is. */
static void eta_auto_is_where_the_normalised_curves_cross(void **state)
{
	(void)state;
	static const uint32_t pairs[][2] = {{415, 445}, {168, 690}, {90, 760}};
	for (size_t p = 0; p < 2 * sizeof pairs / sizeof *pairs; p++) {
		const uint32_t *pair = pairs[p / 2];
		struct bench bench;
		struct ways ways;
		set_up(&bench, 0, 0.2);
		double *density_of = ARENA_ARRAY(bench.arena, bench.garment.face_count, double);
		for (uint32_t f = 0; f < bench.garment.face_count; f++)
			density_of[f] = 0.05 + pow(sin(f / 97.0) * cos(f % 80 / 13.0), 2);
		find_ways(&bench, &ways, density_of, p % 2);
		double softest[2], shortest[2], here[2], before = 0, after = 0;
		best_way(&bench, &ways, ways.a, ways.b, 0, pair[0], pair[1], softest);
		best_way(&bench, &ways, ways.length, ways.none, 0, pair[0], pair[1], shortest);
		for (double eta = 1e-4; eta < 1e4 && after == 0; eta *= 1.02) {
			best_way(&bench, &ways, ways.a, ways.b, eta, pair[0], pair[1], here);
			double longer = (here[0] - shortest[0]) / (softest[0] - shortest[0]);
			double dearer = (here[1] - softest[1]) / (shortest[1] - softest[1]);
			*(longer > dearer ? &before : &after) = eta;
		}
		assert_true(before > 0 && after > before);
		char request[256];
		snprintf(request, sizeof request,
			 "{\"terminals\":[{\"vertex\":%u},{\"vertex\":%u}],\"options\":{\"eta\":\"auto\","
			 "\"relaxation\":\"%s\"}}",
			 pair[0], pair[1], p % 2 ? "chords" : "none");
		compute(&bench, request);
		double eta = member(json_object_get(bench.json, "field"), "eta_mpa");
		if (!(eta > before * 0.99 && eta < after * 1.01))
			fail_msg("eta %g is not between %g and %g", eta, before, after);
		tear_down(&bench);
	}
}

/* Three terminals: the best tree is three ways that meet somewhere, over all places to meet. */
static double best_star(const struct bench *bench, const struct ways *ways, double eta, const uint32_t terminal[3])
{
	enum { VERTICES = 861 };
	static double distance[3][VERTICES];
	for (int t = 0; t < 3; t++) {
		for (uint32_t v = 0; v < VERTICES; v++)
			distance[t][v] = v == terminal[t] ? 0 : INFINITY;
		for (bool changed = true; changed;) {
			changed = false;
			for (uint32_t e = 0; e < 2 * ways->count; e++) {
				uint32_t u = ways->end[e / 2][e % 2], v = ways->end[e / 2][1 - e % 2];
				double here = distance[t][u] + ways->a[e / 2] + eta * ways->b[e / 2];
				if (!(here < distance[t][v] - 1e-12))
					continue;
				distance[t][v] = here;
				changed = true;
			}
		}
	}
	double least = INFINITY;
	for (uint32_t v = 0; v < bench->garment.vertex_count; v++)
		least = fmin(least, distance[0][v] + distance[1][v] + distance[2][v]);
	return least;
}

/* With chords and without, by the request or by a preset; and a field that was stored without its chords gets them. */
static void trees_run_where_the_relaxation_lets_them(void **state)
{
	(void)state;
	static const struct {
		const char *options;
		int field_preset;
		bool chords, stored;
	} cases[] = {
		{"{}", FIELD_PRESET_NONE, true, true},
		{"{}", FIELD_PRESET_NONE, true, false},
		{"{\"relaxation\":\"none\"}", FIELD_PRESET_NONE, false, true},
		{"{\"preset\":\"paper\"}", FIELD_PRESET_NONE, false, true},
		{"{}", FIELD_PRESET_PAPER, false, true},
		{"{\"preset\":\"none\"}", FIELD_PRESET_PAPER, true, true},
		{"{\"preset\":\"paper\",\"relaxation\":\"chords\"}", FIELD_PRESET_NONE, true, true},
	};
	static const uint32_t terminal[3] = {90, 760, 445};
	double weight[2] = {0, 0};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		for (uint32_t seam = 0; seam <= 20; seam += 20) {
			struct bench bench;
			struct ways ways;
			char request[200];
			set_up(&bench, seam, 0.2);
			double *density_of = ARENA_ARRAY(bench.arena, bench.garment.face_count, double);
			for (uint32_t f = 0; f < bench.garment.face_count; f++)
				density_of[f] = 0.05 + pow(sin(f / 97.0) * cos(f % 80 / 13.0), 2);
			find_ways(&bench, &ways, density_of, cases[i].chords);
			struct field_options options = bench.field.options;
			options.eta_mpa = 0.1;
			options.preset = cases[i].field_preset;
			assert_int_equal(field_weigh(&bench.field, bench.arena, &bench.garment, &bench.topology,
						     density_of, &options, NULL, 1, NULL),
					 TW_OK);
			if (cases[i].stored)
				assert_int_equal(field_weigh_chords(&bench.field, bench.arena, &bench.garment,
								    &bench.topology, NULL, 1, NULL, NULL),
						 TW_OK);
			snprintf(request, sizeof request,
				 "{\"terminals\":[{\"vertex\":%u},{\"vertex\":%u},{\"vertex\":%u}],\"options\":%s}",
				 terminal[0], terminal[1], terminal[2], cases[i].options);
			compute(&bench, request);
			double want = best_star(&bench, &ways, 0.1, terminal);
			assert_near(member(layout_of(&bench), "weight_mpa_mm2"), want, 2e-6 * want);
			assert_string_equal(json_string_value(json_object_get(layout_of(&bench), "graph")),
					    cases[i].chords ? "chords" : "mesh");
			assert_true(json_is_true(json_object_get(layout_of(&bench), "unique")));
			assert_true(json_is_true(json_object_get(layout_of(&bench), "reproducible")));
			assert_string_equal(
				json_string_value(json_object_get(json_object_get(bench.json, "baseline"), "graph")),
				"mesh");
			weight[cases[i].chords] = want;
			tear_down(&bench);
		}
	}
	assert_true(weight[1] < 0.99 * weight[0]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(wires_go_around_a_keep_out),
		cmocka_unit_test(a_keep_out_that_leaves_no_way_is_an_error),
		cmocka_unit_test(a_terminal_that_a_keep_out_shuts_in_is_told_so),
		cmocka_unit_test(wires_leave_out_dear_fabric),
		cmocka_unit_test(free_edges_draw_the_wire),
		cmocka_unit_test(a_price_keeps_wires_from_crossing_seams),
		cmocka_unit_test(constraints_that_mean_nothing_are_named),
		cmocka_unit_test(eta_auto_lies_between_the_extremes_and_is_told),
		cmocka_unit_test(eta_auto_is_where_the_normalised_curves_cross),
		cmocka_unit_test(trees_run_where_the_relaxation_lets_them),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
