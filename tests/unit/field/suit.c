/* Strips and fields of whole suits: every strip of the sample suit and of a real one against method 3 done with GEOS,
 * and what motions of a real suit say about where it strains. */
#include "solver/field/field.h"
#include "solver/field/means.h"
#include "solver/field/strip.h"
#include "solver/garment/import.h"
#include "solver/motion/fit.h"
#include "solver/sample/sample.h"

#include "tests/oracle/geos_strip.h"
#include "tests/oracle/meshes.h"

#include <glob.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

struct suit {
	struct arena *arena;
	struct garment garment;
	struct topology topology;
	double *value;
};

static void suit_prepare(struct suit *suit)
{
	struct tw_error error = {0};
	if (topology_build(&suit->topology, suit->arena, &suit->garment, &error))
		fail_msg("%s: %s", error.where, error.text);
	suit->value = ARENA_ARRAY(suit->arena, suit->garment.face_count, double);
	uint64_t random = 9;
	for (uint32_t f = 0; f < suit->garment.face_count; f++)
		suit->value[f] = 0.05 + mesh_random(&random);
}

/* A file of DATA; NULL where it is not there. */
static char *read_data(const char *path, size_t *size)
{
	char name[512];
	const char *data = getenv("DATA");
	snprintf(name, sizeof name, "%s/%s", data ? data : "", path);
	FILE *file = data ? fopen(name, "rb") : NULL;
	if (!file)
		return NULL;
	assert_int_equal(fseek(file, 0, SEEK_END), 0);
	*size = (size_t)ftell(file);
	rewind(file);
	char *bytes = malloc(*size + 1);
	assert_non_null(bytes);
	assert_int_equal(fread(bytes, 1, *size, file), *size);
	fclose(file);
	return bytes;
}

static int suit_from_data(struct suit *suit, const char *path)
{
	size_t size;
	char *bytes = read_data(path, &size);
	if (!bytes)
		return 0;
	struct garment_source source = {bytes, size, MESH_OBJ, NULL};
	struct import_options options;
	struct garment_report report;
	struct tw_error error = {0};
	option_defaults(&import_option_table, &options);
	suit->arena = arena_new(0);
	if (garment_import(&suit->garment, suit->arena, &source, NULL, &options, &report, &error))
		fail_msg("%s: %s", error.where, error.text);
	free(bytes);
	suit_prepare(suit);
	return 1;
}

/* Every `step`-th edge, and every edge of a seam or a hem among `seam_step`. */
static void expect_strips(struct suit *suit, double width, uint32_t step, uint32_t seam_step)
{
	struct geos_walk *walk = calloc(1, sizeof *walk);
	assert_non_null(walk);
	*walk = (struct geos_walk){.garment = &suit->garment, .topology = &suit->topology, .value = suit->value};
	walk->entered = calloc(suit->garment.face_count, 1);
	struct strip_fabric fabric;
	struct strip_walker *walker;
	assert_int_equal(strip_fabric_build(&fabric, suit->arena, &suit->garment, &suit->topology, suit->value, NULL),
			 TW_OK);
	assert_int_equal(strip_walker_new(&walker, suit->arena, &fabric, NULL), TW_OK);
	for (uint32_t e = 0; e < suit->topology.edge_count; e++) {
		if (e % (suit->topology.edge_kind[e] == EDGE_INNER ? step : seam_step) != 0)
			continue;
		struct geos_strip want = walked_strip(walk, e, width);
		struct strip strip;
		strip_edge(walker, e, width, &strip);
		if (fabs(strip.cost - want.cost) > 1e-9 * want.cost ||
		    fabs(strip.covered_mm2 - want.covered_mm2) > 1e-9 * want.covered_mm2 ||
		    fabs(strip.area_mm2 - want.area_mm2) > 1e-9 * want.area_mm2 || strip.largest != want.largest)
			fail_msg("edge %u (kind %u): cost %.12g for %.12g, covered %.12g for %.12g", e,
				 suit->topology.edge_kind[e], strip.cost, want.cost, strip.covered_mm2,
				 want.covered_mm2);
	}
	free(walk->entered);
	free(walk);
}

static void every_strip_of_the_sample_suit_matches_geos(void **state)
{
	(void)state;
	struct suit suit = {.arena = arena_new(0)};
	assert_int_equal(sample_garment(&suit.garment, suit.arena, 3000, SAMPLE_L, NULL), TW_OK);
	suit_prepare(&suit);
	expect_strips(&suit, 15, 1, 1);
	expect_strips(&suit, 60, 37, 5);
	arena_free(suit.arena);
}

static void every_strip_of_a_real_suit_matches_geos(void **state)
{
	(void)state;
	struct suit suit;
	if (!suit_from_data(&suit, "suits/L_coarse/suit.obj"))
		skip();
	expect_strips(&suit, 15, 1, 1);
	expect_strips(&suit, 60, 37, 5);
	arena_free(suit.arena);
}

static void strips_of_a_fine_real_suit_match_geos(void **state)
{
	(void)state;
	struct suit suit;
	if (!suit_from_data(&suit, "suits/M/suit.obj"))
		skip();
	expect_strips(&suit, 15, 61, 7);
	arena_free(suit.arena);
}

static int compare_numbers(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

/* Every motion of every suit: nothing to warn of (solver/motion/cloth.h). */
static void no_real_motion_raises_an_alarm(void **state)
{
	(void)state;
	const char *data = getenv("DATA");
	char pattern[512];
	glob_t found = {0};
	snprintf(pattern, sizeof pattern, "%s/motions/*/*.pc2", data ? data : "");
	if (!data || glob(pattern, 0, NULL, &found) != 0)
		skip();
	for (size_t i = 0; i < found.gl_pathc; i++) {
		struct suit suit;
		struct tw_error error = {0};
		struct byte_memory memory = {0};
		struct means_report report;
		struct motion_reader *reader;
		struct field_options options;
		double *means[STRAIN_MODELS] = {0};
		char path[512];
		const char *name = found.gl_pathv[i] + strlen(data) + strlen("/motions/");
		option_defaults(&field_option_table, &options);
		snprintf(path, sizeof path, "suits/%.*s/suit.obj", (int)strcspn(name, "/"), name);
		assert_true(suit_from_data(&suit, path));
		memory.bytes = read_data(found.gl_pathv[i] + strlen(data) + 1, &memory.size);
		assert_non_null(memory.bytes);
		struct byte_source source = byte_source_memory(&memory);
		assert_int_equal(motion_open(&reader, &source, MOTION_PC2, UNIT_MM, 0, &error), TW_OK);
		if (means_of_motion(means, &report, suit.arena, &suit.garment, reader, &options, NULL, NULL, &error))
			fail_msg("%s: %s", name, error.text);
		for (uint32_t w = 0; w < report.warnings.count; w++)
			if (strcmp(report.warnings.warning[w].type, "motion-other-size") != 0)
				fail_msg("%s: %s", name, report.warnings.warning[w].text);
		motion_close(reader);
		free((void *)(uintptr_t)memory.bytes);
		arena_free(suit.arena);
	}
	globfree(&found);
}

/* method.md: "the median density of a moving suit is 0.16 MPa on the real one". */
static void a_real_suit_in_motion_has_the_known_median_density(void **state)
{
	(void)state;
	static const char *const names[] = {"back_squat", "hook", "cmu_walk", "jumping_jacks", "push_up", "cmu_punch"};
	struct suit suit;
	if (!suit_from_data(&suit, "suits/L_coarse/suit.obj"))
		skip();
	uint32_t faces = suit.garment.face_count;
	double *mean[6];
	struct field_options options;
	option_defaults(&field_option_table, &options);
	for (int m = 0; m < 6; m++) {
		char path[128];
		struct byte_memory memory = {0};
		struct motion_reader *reader;
		struct tw_error error = {0};
		struct means_report report;
		snprintf(path, sizeof path, "motions/L_coarse/%s.pc2", names[m]);
		memory.bytes = read_data(path, &memory.size);
		assert_non_null(memory.bytes);
		struct byte_source source = byte_source_memory(&memory);
		mean[m] = ARENA_ARRAY(suit.arena, faces, double);
		enum tw_status status =
			motion_open(&reader, &source, MOTION_PC2, UNIT_MM, suit.garment.vertex_count, &error);
		if (!status)
			status = means_of_motion((double *[]){mean[m], NULL, NULL}, &report, suit.arena, &suit.garment,
						 reader, &options, NULL, NULL, &error);
		if (status)
			fail_msg("%s: %s", error.where, error.text);
		assert_true(report.frame_count >= 30);
		assert_int_equal(report.warnings.count, 0);
		motion_close(reader);
		free((void *)(uintptr_t)memory.bytes);
	}
	struct field field;
	assert_int_equal(field_compute(&field, suit.arena, &suit.garment, &suit.topology, (const double *const *)mean,
				       6, &options, 2, NULL),
			 TW_OK);
	double *sorted = ARENA_ARRAY(suit.arena, faces, double);
	memcpy(sorted, field.density, faces * sizeof *sorted);
	qsort(sorted, faces, sizeof *sorted, compare_numbers);
	print_message("median %.4f MPa, 5 %% %.4f, 95 %% %.4f\n", sorted[faces / 2], sorted[faces / 20],
		      sorted[faces - faces / 20]);
	assert_true(sorted[faces / 2] > 0.08 && sorted[faces / 2] < 0.32);
	arena_free(suit.arena);
}

static int start_geos(void **state)
{
	(void)state;
	initGEOS(geos_print, geos_print);
	return 0;
}

static int stop_geos(void **state)
{
	(void)state;
	finishGEOS();
	return 0;
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_strip_of_the_sample_suit_matches_geos),
		cmocka_unit_test(every_strip_of_a_real_suit_matches_geos),
		cmocka_unit_test(strips_of_a_fine_real_suit_match_geos),
		cmocka_unit_test(no_real_motion_raises_an_alarm),
		cmocka_unit_test(a_real_suit_in_motion_has_the_known_median_density),
	};
	return cmocka_run_group_tests(tests, start_geos, stop_geos);
}
