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

/* --- motions that are not cloth -------------------------------------------------------------------- */

static float *frame_at(struct motion *motion, int j)
{
	size_t floats = 3 * (size_t)motion->garment.vertex_count;
	return (float *)(void *)(motion->bytes + PC2_HEADER_BYTES + (size_t)j * floats * sizeof(float));
}

/* The longest an edge of the sheet gets in a frame, over what it is worn, pattern and worn being the same. */
static double longest_in(struct motion *motion, int j)
{
	const struct garment *g = &motion->garment;
	const float *x = frame_at(motion, j);
	double most = 0;
	for (size_t i = 0; i < 3 * (size_t)g->face_count; i++) {
		size_t a = g->face_vertex[i], b = g->face_vertex[i % 3 == 2 ? i - 2 : i + 1];
		double moved = 0, worn = 0;
		for (size_t axis = 0; axis < 3; axis++) {
			moved += pow((double)x[3 * b + axis] - (double)x[3 * a + axis], 2);
			worn += pow(g->position[3 * b + axis] - g->position[3 * a + axis], 2);
		}
		most = fmax(most, sqrt(moved / worn));
	}
	return most;
}

static enum tw_status read_warned(struct motion *motion, struct means_report *report)
{
	struct byte_memory memory = {motion->bytes, motion->size, 0};
	struct byte_source source = byte_source_memory(&memory);
	struct motion_reader *reader = NULL;
	double *means[STRAIN_MODELS] = {0};
	*report = (struct means_report){0};
	assert_int_equal(motion_open(&reader, &source, MOTION_SNIFF, UNIT_MM, 0, &motion->error), TW_OK);
	enum tw_status status = means_of_motion(means, report, motion->arena, &motion->garment, reader,
						&motion->options, NULL, NULL, &motion->error);
	motion_close(reader);
	return status;
}

static void assert_not_cloth(struct motion *motion, int frame, const char *vertex)
{
	char place[32];
	struct means_report report;
	assert_int_equal(read_warned(motion, &report), TW_ERROR_INPUT);
	assert_string_equal(motion->error.type, "motion-not-cloth");
	snprintf(place, sizeof place, "frame %d, vertices ", frame);
	if (strncmp(motion->error.where, place, strlen(place)) != 0 || (vertex && !strstr(motion->error.where, vertex)))
		fail_msg("%s: %s", motion->error.where, motion->error.text);
}

/* In any frame of a block, whole or not, and in the first and last. */
static const int tried[] = {0, 1, 7, 15, 16, 17, FRAMES - 1};
enum { TRIED = sizeof tried / sizeof *tried };

static void a_vertex_that_goes_astray_is_named_with_its_frame(void **state)
{
	(void)state;
	for (int i = 0; i < TRIED; i++) {
		struct motion motion;
		motion_make(&motion);
		frame_at(&motion, tried[i])[3 * 137 + 1] += 5000;
		assert_not_cloth(&motion, tried[i], "137");
		motion_free(&motion);
	}
}

static void vertices_in_another_order_are_no_cloth(void **state)
{
	(void)state;
	struct motion motion;
	motion_make(&motion);
	for (int j = 0; j < FRAMES; j++) {
		float *x = frame_at(&motion, j);
		for (size_t axis = 0; axis < 3; axis++) {
			float other = x[3 * 30 + axis];
			x[3 * 30 + axis] = x[3 * 250 + axis];
			x[3 * 250 + axis] = other;
		}
	}
	assert_not_cloth(&motion, 0, NULL);
	assert_true(strstr(motion.error.where, "30") || strstr(motion.error.where, "250"));
	assert_non_null(strstr(motion.error.text, "order"));
	motion_free(&motion);
}

static void a_collapsed_frame_is_no_cloth(void **state)
{
	(void)state;
	static const float scales[] = {0, 1e-6F, 0.1F};
	for (int i = 0; i < TRIED; i++) {
		for (size_t s = 0; s < 3; s++) {
			struct motion motion;
			if (tried[i] == 0)
				continue; /* its area is judged before */
			motion_make(&motion);
			for (size_t k = 0; k < 3 * (size_t)motion.garment.vertex_count; k++)
				frame_at(&motion, tried[i])[k] *= scales[s];
			assert_not_cloth(&motion, tried[i], NULL);
			assert_non_null(strstr(motion.error.text, "collapsed"));
			motion_free(&motion);
		}
	}
}

static void an_exploded_frame_is_no_cloth(void **state)
{
	(void)state;
	struct motion motion;
	motion_make(&motion);
	for (size_t k = 0; k < 3 * (size_t)motion.garment.vertex_count; k++)
		frame_at(&motion, FRAMES - 1)[k] *= 20;
	assert_not_cloth(&motion, FRAMES - 1, NULL);
	motion_free(&motion);
}

/* Between the two limits the motion is read, and said to be odd; below, nothing is said: no frame is missed or
 * invented. */
static void a_stretch_is_warned_of_beyond_its_limit_alone(void **state)
{
	(void)state;
	for (int step = 0; step < 40; step++) {
		struct motion motion;
		struct means_report report;
		motion_make(&motion);
		int frame = (step * 7) % FRAMES;
		frame_at(&motion, frame)[3 * 137 + 2] += (float)(1.5 * step);
		double longest = longest_in(&motion, frame);
		enum tw_status status = read_warned(&motion, &report);
		if (longest > 6.001) {
			assert_int_equal(status, TW_ERROR_INPUT);
		} else if (longest < 5.999) {
			bool warned = report.warnings.count > 0;
			assert_int_equal(status, TW_OK);
			if (fabs(longest - 3) > 0.001)
				assert_int_equal(warned, longest > 3);
			if (warned) {
				assert_string_equal(report.warnings.warning[0].type, "motion-stretched");
				assert_int_equal(report.warnings.warning[0].place[0], frame);
				assert_non_null(strstr(report.warnings.warning[0].text, "137"));
			}
		}
		motion_free(&motion);
	}
}

static void cloth_of_half_its_size_is_warned_of(void **state)
{
	(void)state;
	struct motion motion;
	struct means_report report;
	motion_make(&motion);
	for (size_t k = 0; k < 3 * (size_t)motion.garment.vertex_count; k++)
		frame_at(&motion, 5)[k] *= 0.4F;
	if (read_warned(&motion, &report) != TW_OK)
		fail_msg("%s", motion.error.text);
	assert_int_equal(report.warnings.count, 1);
	assert_string_equal(report.warnings.warning[0].type, "motion-crumpled");
	motion_free(&motion);
}

/* Vertices of the file that were sewn to another do not move the garment: they are judged all the same. */
static void a_sewn_vertex_that_goes_astray_is_named(void **state)
{
	(void)state;
	static const double steps[] = {0, 1.0, 30, 5000};
	for (size_t s = 0; s < 4; s++) {
		struct motion motion;
		struct means_report report;
		motion_make(&motion);
		/* the file has one vertex more, a copy of the 137th, which welding took away */
		struct garment *g = &motion.garment;
		const uint32_t vertices = g->vertex_count;
		g->source_count = vertices + 1;
		g->source_vertex = ARENA_ZEROED(motion.arena, 3 * (size_t)vertices, uint32_t);
		g->source_share = ARENA_ZEROED(motion.arena, 3 * (size_t)vertices, double);
		g->mesh_vertex = ARENA_ARRAY(motion.arena, (size_t)vertices + 1, uint32_t);
		for (uint32_t v = 0; v < vertices; v++) {
			g->source_vertex[3 * (size_t)v] = g->mesh_vertex[v] = v;
			g->source_share[3 * (size_t)v] = 1;
		}
		g->mesh_vertex[vertices] = 137;
		size_t floats = 3 * (size_t)vertices;
		char *sewn = malloc(PC2_HEADER_BYTES + FRAMES * (floats + 3) * sizeof(float));
		pc2_write_header(sewn, vertices + 1, FRAMES);
		for (int j = 0; j < FRAMES; j++) {
			float *to =
				(float *)(void *)(sewn + PC2_HEADER_BYTES + (size_t)j * (floats + 3) * sizeof(float));
			memcpy(to, frame_at(&motion, j), floats * sizeof(float));
			memcpy(to + floats, to + 3 * 137, 3 * sizeof(float));
			to[floats + 2] += j == 9 ? (float)steps[s] : 0;
		}
		free(motion.bytes);
		motion.bytes = sewn;
		motion.size = PC2_HEADER_BYTES + FRAMES * (floats + 3) * sizeof(float);
		enum tw_status status = read_warned(&motion, &report);
		if (steps[s] == 5000) {
			assert_int_equal(status, TW_ERROR_INPUT);
			char where[64];
			snprintf(where, sizeof where, "frame 9, vertices 137 and %u", vertices);
			assert_string_equal(motion.error.where, where);
		} else {
			assert_int_equal(status, TW_OK);
			assert_int_equal(report.warnings.count, steps[s] == 30);
			if (steps[s] == 30)
				assert_string_equal(report.warnings.warning[0].type, "motion-seam-opens");
		}
		motion_free(&motion);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_vertex_that_goes_astray_is_named_with_its_frame),
		cmocka_unit_test(a_sewn_vertex_that_goes_astray_is_named),
		cmocka_unit_test(vertices_in_another_order_are_no_cloth),
		cmocka_unit_test(a_collapsed_frame_is_no_cloth),
		cmocka_unit_test(an_exploded_frame_is_no_cloth),
		cmocka_unit_test(a_stretch_is_warned_of_beyond_its_limit_alone),
		cmocka_unit_test(cloth_of_half_its_size_is_warned_of),
		cmocka_unit_test(a_stream_has_the_means_of_its_frames),
		cmocka_unit_test(any_frame_can_be_the_reference),
		cmocka_unit_test(reading_can_be_cancelled),
		cmocka_unit_test(a_stream_cut_anywhere_is_an_error),
		cmocka_unit_test(no_memory_is_an_error_and_no_crash),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
