/* The field as a whole: maxima over motions, fixed point, overhang, constraints, baselines, storage. */
#include "solver/field/field.h"

#include "solver/field/strain.h"
#include "solver/field/strip.h"
#include "tests/oracle/meshes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

struct setting {
	struct arena *arena;
	struct garment garment;
	struct topology topology;
	struct field_options options;
	double *density;
	struct field field;
};

static void setting_open(struct setting *s)
{
	s->arena = arena_new(0);
	mesh_sheet(&s->garment, s->arena, 24, 18, 9, 0.3, 10);
	assert_int_equal(topology_build(&s->topology, s->arena, &s->garment, NULL), TW_OK);
	option_defaults(&field_option_table, &s->options);
	s->density = ARENA_ARRAY(s->arena, s->garment.face_count, double);
	uint64_t random = 1;
	for (uint32_t f = 0; f < s->garment.face_count; f++)
		s->density[f] = pow(mesh_random(&random), 6);
}

static void weigh(struct setting *s, const struct field_constraints *constraints)
{
	struct tw_error error = {0};
	if (field_weigh(&s->field, s->arena, &s->garment, &s->topology, s->density, &s->options, constraints, 2,
			&error))
		fail_msg("%s: %s", error.where, error.text);
}

static void defaults_are_the_documented_ones(void **state)
{
	(void)state;
	struct field_options options;
	option_defaults(&field_option_table, &options);
	assert_int_equal(options.energy, STRAIN_STVK);
	assert_int_equal(options.overhang, FIELD_OVERHANG_CHARGE);
	assert_int_equal(options.weight, FIELD_DEFORMATION);
	assert_int_equal(options.reference, FIELD_REFERENCE_PATTERN);
	assert_true(options.strip_width_mm == 15 && options.eta_mpa == 0.1);
}

static void the_paper_preset_leaves_what_the_caller_set(void **state)
{
	(void)state;
	static const struct {
		const char *json;
		int energy, overhang;
		const char *changes;
	} rows[] = {
		{"{'preset':'paper'}", STRAIN_PRINTED, FIELD_OVERHANG_IGNORE,
		 "{'energy':'printed','overhang':'ignore'}"},
		{"{'preset':'paper','energy':'stvk'}", STRAIN_STVK, FIELD_OVERHANG_IGNORE, "{'overhang':'ignore'}"},
		{"{'energy':'stvk','preset':'paper'}", STRAIN_STVK, FIELD_OVERHANG_IGNORE, "{'overhang':'ignore'}"},
		{"{'overhang':'charge','preset':'paper'}", STRAIN_PRINTED, FIELD_OVERHANG_CHARGE,
		 "{'energy':'printed'}"},
		{"{'overhang':'forbid','preset':'paper'}", STRAIN_PRINTED, FIELD_OVERHANG_FORBID,
		 "{'energy':'printed'}"},
		{"{'energy':'tension'}", STRAIN_TENSION, FIELD_OVERHANG_CHARGE, "{}"},
	};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		struct field_options options, again;
		char text[128], changes[128];
		snprintf(text, sizeof text, "%s", rows[i].json);
		snprintf(changes, sizeof changes, "%s", rows[i].changes);
		for (char *c = text; *c; c++)
			*c = *c == '\'' ? '"' : *c;
		for (char *c = changes; *c; c++)
			*c = *c == '\'' ? '"' : *c;
		json_t *object = json_loads(text, 0, NULL), *expected = json_loads(changes, 0, NULL);
		assert_int_equal(field_options_from_json(&options, object, "", NULL), TW_OK);
		assert_int_equal(options.energy, rows[i].energy);
		assert_int_equal(options.overhang, rows[i].overhang);
		json_t *changed = field_options_changes(&options),
		       *stored = option_to_json(&field_option_table, &options);
		assert_true(json_equal(changed, expected));
		/* as they are stored they say the same */
		option_defaults(&field_option_table, &again);
		assert_int_equal(option_from_json(&field_option_table, &again, stored, "", NULL, NULL), TW_OK);
		json_t *back = option_to_json(&field_option_table, &again);
		assert_true(json_equal(back, stored));
		json_decref(back);
		json_decref(object);
		json_decref(expected);
		json_decref(changed);
		json_decref(stored);
	}
}

static void weights_are_strip_costs_within_the_stated_accuracy(void **state)
{
	(void)state;
	struct setting s;
	setting_open(&s);
	weigh(&s, NULL);
	double *value = ARENA_ARRAY(s.arena, s.garment.face_count, double);
	struct strip_fabric fabric;
	struct strip_walker *walker;
	field_value(&s.field, NULL, value);
	assert_int_equal(strip_fabric_build(&fabric, s.arena, &s.garment, &s.topology, value, NULL), TW_OK);
	assert_int_equal(strip_walker_new(&walker, s.arena, &fabric, NULL), TW_OK);
	double total = 0, exact = 0;
	for (uint32_t e = 0; e < s.field.edge_count; e++) {
		struct strip strip;
		strip_edge(walker, e, 15, &strip);
		double cost = strip_cost(&strip, FIELD_OVERHANG_CHARGE);
		assert_true(fabs((double)s.field.weight[e] / s.field.scale - cost) <= 0.5e-6 * cost);
		assert_true(fabs((double)s.field.coverage[e] - strip_coverage(&strip)) < 1e-6);
		total += (double)s.field.weight[e];
		exact += cost;
	}
	assert_true(fabs(total / s.field.scale - exact) <= 1e-7 * exact);
	assert_true(total < 0x1p59);
	arena_free(s.arena);
}

static void costs_of_very_different_size_keep_their_accuracy(void **state)
{
	(void)state;
	struct setting s;
	setting_open(&s);
	s.options.eta_mpa = 0;
	s.options.overhang = FIELD_OVERHANG_IGNORE;
	for (uint32_t f = 0; f < s.garment.face_count; f++)
		s.density[f] = f % 24 < 12 ? 1e-5 : 1e3;
	weigh(&s, NULL);
	for (uint32_t e = 0; e < s.field.edge_count; e++)
		assert_true(s.field.weight[e] >= 1u << 20);
	arena_free(s.arena);
}

static void no_energy_and_no_eta_weigh_nothing(void **state)
{
	(void)state;
	struct setting s;
	setting_open(&s);
	s.options.eta_mpa = 0;
	memset(s.density, 0, s.garment.face_count * sizeof *s.density);
	weigh(&s, NULL);
	for (uint32_t e = 0; e < s.field.edge_count; e++)
		assert_true(s.field.weight[e] == 0);
	arena_free(s.arena);
}

static void threads_do_not_show(void **state)
{
	(void)state;
	struct setting s;
	struct field one;
	setting_open(&s);
	weigh(&s, NULL);
	for (unsigned threads = 1; threads < 6; threads++) {
		assert_int_equal(
			field_weigh(&one, s.arena, &s.garment, &s.topology, s.density, &s.options, NULL, threads, NULL),
			TW_OK);
		assert_true(one.scale == s.field.scale);
		assert_memory_equal(one.weight, s.field.weight, one.edge_count * sizeof *one.weight);
		assert_memory_equal(one.coverage, s.field.coverage, one.edge_count * sizeof *one.coverage);
	}
	arena_free(s.arena);
}

static void a_field_of_motions_takes_the_worst_of_each_face(void **state)
{
	(void)state;
	struct setting s;
	setting_open(&s);
	weigh(&s, NULL);
	uint32_t faces = s.garment.face_count;
	double *mean[2] = {ARENA_ARRAY(s.arena, faces, double), ARENA_ARRAY(s.arena, faces, double)};
	for (uint32_t f = 0; f < faces; f++) {
		mean[f % 2][f] = s.density[f];
		mean[1 - f % 2][f] = 0.7 * s.density[f];
	}
	struct field field;
	assert_int_equal(field_compute(&field, s.arena, &s.garment, &s.topology, (const double *const *)mean, 2,
				       &s.options, 1, NULL),
			 TW_OK);
	assert_memory_equal(field.density, s.density, faces * sizeof(double));
	assert_memory_equal(field.weight, s.field.weight, field.edge_count * sizeof *field.weight);
	arena_free(s.arena);
}

/* Beyond its share an edge goes; below it weighs what it does under `charge`. */
static void forbidden_overhang_removes_hem_edges_and_favours_none(void **state)
{
	(void)state;
	struct setting s;
	struct field charged;
	setting_open(&s);
	weigh(&s, NULL);
	charged = s.field;
	uint32_t partly = 0;
	s.options.overhang = FIELD_OVERHANG_FORBID;
	weigh(&s, NULL);
	for (uint32_t e = 0; e < s.field.edge_count; e++) {
		int removed = s.field.weight[e] == FIELD_FORBIDDEN;
		assert_int_equal(removed, 1 - s.field.coverage[e] > 0.25f);
		if (s.topology.edge_kind[e] == EDGE_HEM)
			assert_true(removed);
		if (!removed)
			assert_true(fabs((double)s.field.weight[e] / s.field.scale -
					 (double)charged.weight[e] / charged.scale) <=
				    1e-6 * (double)charged.weight[e] / charged.scale);
		partly += !removed && s.field.coverage[e] < 0.99f;
	}
	assert_true(partly > 5);
	arena_free(s.arena);
}

static void baselines_count_edges_or_their_length(void **state)
{
	(void)state;
	struct setting s;
	setting_open(&s);
	s.options.weight = FIELD_UNIT;
	weigh(&s, NULL);
	assert_true(s.field.scale == 1);
	for (uint32_t e = 0; e < s.field.edge_count; e++)
		assert_true(s.field.weight[e] == 1);
	s.options.weight = FIELD_LENGTH;
	weigh(&s, NULL);
	for (uint32_t e = 0; e < s.field.edge_count; e++) {
		const double *a = s.garment.position + 3 * (size_t)s.topology.edge_vertex[2 * (size_t)e];
		const double *b = s.garment.position + 3 * (size_t)s.topology.edge_vertex[2 * (size_t)e + 1];
		double length = hypot(a[0] - b[0], a[1] - b[1]);
		assert_true(fabs((double)s.field.weight[e] / s.field.scale - length) <= 1e-6 * length);
	}
	arena_free(s.arena);
}

/* Such a file is renumbered for the sake of the cache; strip by strip on the file's own numbers is the oracle. */
static void faces_in_random_order_have_the_weights_of_their_strips_to_the_last_bit(void **state)
{
	(void)state;
	struct setting s = {.arena = arena_new(0)};
	mesh_sheet(&s.garment, s.arena, 80, 60, 5, 0.3, 30);
	const uint32_t faces = s.garment.face_count;
	uint64_t random = 3;
	mesh_shuffle_faces(&s.garment, &random);
	assert_int_equal(topology_build(&s.topology, s.arena, &s.garment, NULL), TW_OK);
	option_defaults(&field_option_table, &s.options);
	s.density = ARENA_ARRAY(s.arena, faces, double);
	double *value = ARENA_ARRAY(s.arena, faces, double), *kept_out = ARENA_ARRAY(s.arena, faces, double);
	uint8_t *keep_out = ARENA_ZEROED(s.arena, faces, uint8_t);
	for (uint32_t f = 0; f < faces; f++) {
		s.density[f] = mesh_random(&random);
		keep_out[f] = mesh_random(&random) < 0.002;
		kept_out[f] = keep_out[f];
	}
	struct field_constraints constraints = {.face_keep_out = keep_out};
	weigh(&s, &constraints);
	field_value(&s.field, &constraints, value);
	struct strip_fabric fabric, marked;
	struct strip_walker *walker, *mark_walker;
	assert_int_equal(strip_fabric_build(&fabric, s.arena, &s.garment, &s.topology, value, NULL), TW_OK);
	marked = fabric;
	marked.value = kept_out;
	assert_int_equal(strip_walker_new(&walker, s.arena, &fabric, NULL), TW_OK);
	assert_int_equal(strip_walker_new(&mark_walker, s.arena, &marked, NULL), TW_OK);
	uint32_t forbidden = 0;
	for (uint32_t e = 0; e < s.field.edge_count; e++) {
		struct strip strip, mark;
		strip_edge(walker, e, s.options.strip_width_mm, &strip);
		strip_edge(mark_walker, e, s.options.strip_width_mm, &mark);
		assert_true(s.field.coverage[e] == (float)strip_coverage(&strip));
		if (mark.cost > 1e-6 * mark.area_mm2) {
			assert_true(s.field.weight[e] == FIELD_FORBIDDEN);
			forbidden++;
			continue;
		}
		assert_true(s.field.weight[e] == field_round(&s.field, strip_cost(&strip, s.options.overhang)));
	}
	assert_in_range(forbidden, 1, s.field.edge_count / 2);
	arena_free(s.arena);
}

static void keep_outs_multipliers_free_edges_and_seams_change_what_they_say(void **state)
{
	(void)state;
	struct setting s;
	struct field plain;
	setting_open(&s);
	s.options.overhang = FIELD_OVERHANG_IGNORE;
	weigh(&s, NULL);
	plain = s.field;
	uint32_t faces = s.garment.face_count;
	double *multiplier = ARENA_ARRAY(s.arena, faces, double);
	uint8_t *keep_out = ARENA_ZEROED(s.arena, faces, uint8_t);
	uint8_t *free_edge = ARENA_ZEROED(s.arena, plain.edge_count, uint8_t);
	for (uint32_t f = 0; f < faces; f++)
		multiplier[f] = 3;
	keep_out[400] = 1;
	free_edge[3] = 1;
	struct field_constraints constraints = {.face_multiplier = multiplier,
						.face_keep_out = keep_out,
						.edge_free = free_edge,
						.seam_price_mpa_mm2 = 100};
	weigh(&s, &constraints);
	uint32_t removed = 0;
	for (uint32_t e = 0; e < plain.edge_count; e++) {
		int seam_ends = 0;
		for (size_t k = 0; k < 2; k++)
			seam_ends += s.topology.edge_vertex[2 * (size_t)e + k] % 25 == 10;
		double want = 3 * (double)plain.weight[e] / plain.scale + 50 * seam_ends;
		if (s.field.weight[e] == FIELD_FORBIDDEN)
			removed++;
		else if (e == 3)
			assert_true(s.field.weight[e] == 0);
		else
			assert_true(fabs((double)s.field.weight[e] / s.field.scale - want) <= 2e-6 * want);
	}
	for (size_t k = 0; k < 3; k++)
		assert_true(s.field.weight[s.topology.face_edge[3 * 400 + k]] == FIELD_FORBIDDEN);
	assert_in_range(removed, 5, 60);
	arena_free(s.arena);
}

static void what_cannot_be_weighed_is_an_error_that_names_the_place(void **state)
{
	(void)state;
	struct setting s;
	struct tw_error error;
	setting_open(&s);
	s.options.eta_mpa = NAN;
	assert_int_equal(
		field_weigh(&s.field, s.arena, &s.garment, &s.topology, s.density, &s.options, NULL, 1, &error),
		TW_ERROR_INPUT);
	assert_string_equal(error.where, "/eta_mpa");
	s.options.eta_mpa = 0.1;
	s.density[17] = INFINITY;
	assert_int_equal(
		field_weigh(&s.field, s.arena, &s.garment, &s.topology, s.density, &s.options, NULL, 1, &error),
		TW_ERROR_INPUT);
	assert_string_equal(error.where, "face 17");
	s.density[17] = 1;
	s.garment.pattern[40] = 1e200;
	assert_int_equal(
		field_weigh(&s.field, s.arena, &s.garment, &s.topology, s.density, &s.options, NULL, 1, &error),
		TW_ERROR_INPUT);
	assert_non_null(strstr(error.where, "vertices "));
	arena_free(s.arena);
}

static int stop_halfway(void *context, double share)
{
	*(double *)context = share;
	return share >= 0.5;
}

static void weighing_tells_its_progress_and_can_be_cancelled(void **state)
{
	(void)state;
	struct setting s;
	double reached = 0;
	struct tw_error error;
	const struct field_watch watch = {stop_halfway, &reached};
	setting_open(&s);
	assert_int_equal(field_weigh_watched(&s.field, s.arena, &s.garment, &s.topology, s.density, &s.options, NULL, 1,
					     &watch, &error),
			 TW_ERROR_CANCELLED);
	assert_true(reached >= 0.5 && reached < 1);
	arena_free(s.arena);
}

static void a_small_budget_is_an_error_and_no_crash(void **state)
{
	(void)state;
	struct setting s;
	setting_open(&s);
	for (size_t budget = 1000; budget < 400000; budget += 20000) {
		struct arena *small = arena_new(budget);
		enum tw_status status =
			field_weigh(&s.field, small, &s.garment, &s.topology, s.density, &s.options, NULL, 2, NULL);
		assert_true(status == TW_OK || status == TW_ERROR_MEMORY);
		arena_free(small);
	}
	arena_free(s.arena);
}

/* In the scale of the edges, and under the same constraints. */
static void chords_are_weighed_like_edges(void **state)
{
	(void)state;
	struct setting s;
	setting_open(&s);
	uint8_t *keep_out = ARENA_ZEROED(s.arena, s.garment.face_count, uint8_t);
	keep_out[400] = 1;
	struct field_constraints constraints = {.face_keep_out = keep_out, .seam_price_mpa_mm2 = 100};
	weigh(&s, &constraints);
	assert_null(s.field.chord_weight);
	struct field one = s.field;
	assert_int_equal(field_weigh_chords(&s.field, s.arena, &s.garment, &s.topology, &constraints, 1, NULL, NULL),
			 TW_OK);
	assert_int_equal(field_weigh_chords(&one, s.arena, &s.garment, &s.topology, &constraints, 3, NULL, NULL),
			 TW_OK);
	assert_memory_equal(one.chord_weight, s.field.chord_weight, one.edge_count * sizeof *one.chord_weight);
	double *value = ARENA_ARRAY(s.arena, s.garment.face_count, double);
	double *out = ARENA_ARRAY(s.arena, s.garment.face_count, double);
	for (uint32_t f = 0; f < s.garment.face_count; f++)
		out[f] = keep_out[f];
	struct strip_fabric fabric, marked;
	struct strip_walker *walker, *mark_walker;
	field_value(&s.field, NULL, value);
	assert_int_equal(strip_fabric_build(&fabric, s.arena, &s.garment, &s.topology, value, NULL), TW_OK);
	marked = fabric;
	marked.value = out;
	assert_int_equal(strip_walker_new(&walker, s.arena, &fabric, NULL), TW_OK);
	assert_int_equal(strip_walker_new(&mark_walker, s.arena, &marked, NULL), TW_OK);
	uint32_t chords = 0, kept_out = 0, over_seam = 0;
	for (uint32_t e = 0; e < s.field.edge_count; e++) {
		struct strip strip, mark;
		struct strip_chord chord;
		if (!strip_chord(walker, e, 15, &strip)) {
			assert_true(s.field.chord_weight[e] == FIELD_FORBIDDEN);
			continue;
		}
		strip_chord(mark_walker, e, 15, &mark);
		if (mark.cost > 1e-6 * mark.area_mm2) {
			assert_true(s.field.chord_weight[e] == FIELD_FORBIDDEN);
			kept_out++;
			continue;
		}
		strip_find_chord(&fabric, e, &chord);
		double want = strip_cost(&strip, FIELD_OVERHANG_CHARGE);
		for (int i = 0; i < 2; i++) /* column 10 is the seam */
			want += chord.vertex[i] % 25 == 10 ? 50 : 0;
		want += s.topology.edge_kind[e] == EDGE_SEAM ? 100 : 0;
		over_seam += s.topology.edge_kind[e] == EDGE_SEAM;
		assert_true(fabs((double)s.field.chord_weight[e] / s.field.scale - want) <= 1e-6 * want);
		chords++;
	}
	assert_true(chords > 500 && kept_out > 2 && over_seam > 2);
	s.options.weight = FIELD_LENGTH;
	weigh(&s, NULL);
	assert_int_equal(field_weigh_chords(&s.field, s.arena, &s.garment, &s.topology, NULL, 1, NULL, NULL), TW_OK);
	assert_null(s.field.chord_weight);
	arena_free(s.arena);
}

static void a_field_survives_storage_and_damage_is_noticed(void **state)
{
	(void)state;
	struct setting s;
	struct field back;
	setting_open(&s);
	weigh(&s, NULL);
	struct tw_array arrays[FIELD_ARRAYS];
	assert_int_equal(field_to_arrays(&s.field, arrays), 4);
	assert_int_equal(field_from_arrays(&back, &s.garment, &s.topology, arrays, 4, &s.options, NULL), TW_OK);
	assert_null(back.chord_weight);
	assert_int_equal(field_weigh_chords(&s.field, s.arena, &s.garment, &s.topology, NULL, 1, NULL, NULL), TW_OK);
	assert_int_equal(field_to_arrays(&s.field, arrays), FIELD_ARRAYS);
	assert_int_equal(field_from_arrays(&back, &s.garment, &s.topology, arrays, FIELD_ARRAYS, &s.options, NULL),
			 TW_OK);
	assert_true(back.scale == s.field.scale && back.weight == s.field.weight);
	assert_true(back.chord_weight == s.field.chord_weight && back.chord_coverage == s.field.chord_coverage);
	for (size_t i = 0; i < FIELD_ARRAYS; i++) {
		struct tw_array kept = arrays[i];
		arrays[i].rows--;
		assert_int_not_equal(
			field_from_arrays(&back, &s.garment, &s.topology, arrays, FIELD_ARRAYS, &s.options, NULL),
			TW_OK);
		arrays[i] = kept;
		if (i == 4)
			continue; /* without the weights of chords it is a field without chords */
		arrays[i].name = "other";
		assert_int_not_equal(
			field_from_arrays(&back, &s.garment, &s.topology, arrays, FIELD_ARRAYS, &s.options, NULL),
			TW_OK);
		arrays[i] = kept;
	}
	uint64_t *weight = ARENA_ARRAY(s.arena, s.field.edge_count, uint64_t);
	memcpy(weight, s.field.weight, s.field.edge_count * sizeof *weight);
	weight[5] = UINT64_C(1) << 63;
	arrays[1].data = weight;
	assert_int_not_equal(field_from_arrays(&back, &s.garment, &s.topology, arrays, FIELD_ARRAYS, &s.options, NULL),
			     TW_OK);
	arena_free(s.arena);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(defaults_are_the_documented_ones),
		cmocka_unit_test(the_paper_preset_leaves_what_the_caller_set),
		cmocka_unit_test(weights_are_strip_costs_within_the_stated_accuracy),
		cmocka_unit_test(costs_of_very_different_size_keep_their_accuracy),
		cmocka_unit_test(no_energy_and_no_eta_weigh_nothing),
		cmocka_unit_test(threads_do_not_show),
		cmocka_unit_test(a_field_of_motions_takes_the_worst_of_each_face),
		cmocka_unit_test(forbidden_overhang_removes_hem_edges_and_favours_none),
		cmocka_unit_test(baselines_count_edges_or_their_length),
		cmocka_unit_test(faces_in_random_order_have_the_weights_of_their_strips_to_the_last_bit),
		cmocka_unit_test(keep_outs_multipliers_free_edges_and_seams_change_what_they_say),
		cmocka_unit_test(what_cannot_be_weighed_is_an_error_that_names_the_place),
		cmocka_unit_test(weighing_tells_its_progress_and_can_be_cancelled),
		cmocka_unit_test(a_small_budget_is_an_error_and_no_crash),
		cmocka_unit_test(chords_are_weighed_like_edges),
		cmocka_unit_test(a_field_survives_storage_and_damage_is_noticed),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
