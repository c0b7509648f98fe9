/* Motions as streams: means against densities computed frame by frame, the choice of a reference, cancelling, and
 * streams that are not what they say. */
#include "solver/field/means.h"

#include "tests/oracle/meshes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { FRAMES = 21 };

struct motion {
	struct arena *arena;
	struct garment garment;
	struct field_options options;
	char *bytes;
	size_t size;
	struct tw_error error;
};

/* Frame j: the sheet stretched by 1 + j / 50 along x, and waving. */
static void pose(const struct garment *garment, int j, float *position)
{
	for (size_t v = 0; v < garment->vertex_count; v++) {
		const double *x = garment->position + 3 * v;
		position[3 * v] = (float)(x[0] * (1 + j / 50.0));
		position[3 * v + 1] = (float)x[1];
		position[3 * v + 2] = (float)(j * sin(x[1] / 20));
	}
}

static void motion_make(struct motion *motion)
{
	*motion = (struct motion){.arena = arena_new(0)};
	mesh_sheet(&motion->garment, motion->arena, 20, 15, 8, 0.3, 9);
	option_defaults(&field_option_table, &motion->options);
	size_t floats = 3 * (size_t)motion->garment.vertex_count;
	motion->size = PC2_HEADER_BYTES + FRAMES * floats * sizeof(float);
	motion->bytes = malloc(motion->size);
	assert_non_null(motion->bytes);
	pc2_write_header(motion->bytes, motion->garment.vertex_count, FRAMES);
	for (int j = 0; j < FRAMES; j++)
		pose(&motion->garment, j,
		     (float *)(void *)(motion->bytes + PC2_HEADER_BYTES + (size_t)j * floats * sizeof(float)));
}

static void motion_free(struct motion *motion)
{
	free(motion->bytes);
	arena_free(motion->arena);
}

static enum tw_status read_means(struct motion *motion, double *const *means, means_progress *progress, void *context)
{
	struct byte_memory memory = {motion->bytes, motion->size, 0};
	struct byte_source source = byte_source_memory(&memory);
	struct motion_reader *reader = NULL;
	struct means_report report = {0};
	enum tw_status status =
		motion_open(&reader, &source, MOTION_SNIFF, UNIT_MM, motion->garment.vertex_count, &motion->error);
	if (!status)
		status = means_of_motion(means, &report, motion->arena, &motion->garment, reader, &motion->options,
					 progress, context, &motion->error);
	if (!status)
		assert_int_equal(report.frame_count, FRAMES);
	motion_close(reader);
	return status;
}

static void expect_means(struct motion *motion, const struct strain_rest *rest)
{
	size_t faces = motion->garment.face_count;
	float *position = ARENA_ARRAY(motion->arena, 3 * (size_t)motion->garment.vertex_count, float);
	double *density = ARENA_ARRAY(motion->arena, faces, double), *means[STRAIN_MODELS];
	for (int m = 0; m < STRAIN_MODELS; m++)
		means[m] = ARENA_ARRAY(motion->arena, faces, double);
	size_t held = arena_used(motion->arena);
	assert_int_equal(read_means(motion, means, NULL, NULL), TW_OK);
	assert_int_equal(arena_used(motion->arena), held);
	for (enum strain_model m = 0; m < STRAIN_MODELS; m++) {
		double *sum = ARENA_ZEROED(motion->arena, faces, double);
		for (int j = 0; j < FRAMES; j++) {
			pose(&motion->garment, j, position);
			strain_density(rest, m, position, density);
			for (size_t f = 0; f < faces; f++)
				sum[f] += density[f];
		}
		for (size_t f = 0; f < faces; f++)
			assert_true(fabs(means[m][f] - sum[f] / FRAMES) <= 1e-6 * sum[f] + 1e-12);
	}
}

static void a_stream_has_the_means_of_its_frames(void **state)
{
	(void)state;
	struct motion motion;
	struct strain_rest rest;
	motion_make(&motion);
	assert_int_equal(strain_rest_from_pattern(&rest, motion.arena, &motion.garment, NULL), TW_OK);
	expect_means(&motion, &rest);
	motion_free(&motion);
}

static void any_frame_can_be_the_reference(void **state)
{
	(void)state;
	struct motion motion;
	struct strain_rest rest;
	motion_make(&motion);
	motion.options.reference = FIELD_REFERENCE_FRAME;
	motion.options.reference_frame = 7;
	float *position = ARENA_ARRAY(motion.arena, 3 * (size_t)motion.garment.vertex_count, float);
	pose(&motion.garment, 7, position);
	assert_int_equal(strain_rest_from_frame(&rest, motion.arena, &motion.garment, position, NULL), TW_OK);
	expect_means(&motion, &rest);

	motion.options.reference = FIELD_REFERENCE_WORN;
	assert_int_equal(strain_rest_from_worn(&rest, motion.arena, &motion.garment, NULL), TW_OK);
	expect_means(&motion, &rest);

	motion.options.reference = FIELD_REFERENCE_FRAME;
	motion.options.reference_frame = FRAMES;
	assert_int_equal(read_means(&motion, (double *[STRAIN_MODELS]){0}, NULL, NULL), TW_ERROR_INPUT);
	assert_string_equal(motion.error.type, "reference-frame");
	motion_free(&motion);
}

static int stop_at_frame(void *context, uint32_t frames_done)
{
	return frames_done >= *(const uint32_t *)context;
}

static void reading_can_be_cancelled(void **state)
{
	(void)state;
	struct motion motion;
	motion_make(&motion);
	uint32_t frame = 5;
	assert_int_equal(read_means(&motion, (double *[STRAIN_MODELS]){0}, stop_at_frame, &frame), TW_ERROR_CANCELLED);
	motion_free(&motion);
}

static void a_stream_cut_anywhere_is_an_error(void **state)
{
	(void)state;
	struct motion motion;
	motion_make(&motion);
	size_t whole = motion.size;
	for (size_t size = 0; size < whole; size += size < 40 ? 1 : 7919) {
		motion.size = size;
		assert_int_equal(read_means(&motion, (double *[STRAIN_MODELS]){0}, NULL, NULL), TW_ERROR_INPUT);
	}
	motion_free(&motion);
}

static void no_memory_is_an_error_and_no_crash(void **state)
{
	(void)state;
	struct motion motion;
	motion_make(&motion);
	struct arena *all = motion.arena;
	for (size_t budget = 0; budget < 200000; budget += 9973) {
		motion.arena = arena_new(budget);
		enum tw_status status = read_means(&motion, (double *[STRAIN_MODELS]){0}, NULL, NULL);
		assert_true(status == TW_OK || status == TW_ERROR_MEMORY);
		assert_int_equal(arena_used(motion.arena), 0);
		arena_free(motion.arena);
	}
	motion.arena = all;
	motion_free(&motion);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_stream_has_the_means_of_its_frames),
		cmocka_unit_test(any_frame_can_be_the_reference),
		cmocka_unit_test(reading_can_be_cancelled),
		cmocka_unit_test(a_stream_cut_anywhere_is_an_error),
		cmocka_unit_test(no_memory_is_an_error_and_no_crash),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
