/* A sheet of fabric with its field, and the layouts that tests ask of it. Include cmocka.h first. */
#ifndef TESTS_UNIT_LAYOUT_SHEET_H
#define TESTS_UNIT_LAYOUT_SHEET_H

#include "solver/field/field.h"
#include "solver/layout/layout.h"
#include "solver/motion/motion.h"
#include "tests/oracle/meshes.h"

#include <string.h>

static const double density = 0.3; /* MPa, everywhere */

struct bench {
	struct arena *arena;
	struct garment garment;
	struct topology topology;
	struct field field;
	struct layout_request request;
	struct layout_output output;
	json_t *json; /* the parsed layout.json */
	char *motion; /* PC2 bytes */
	struct byte_memory memory;
};

/* The garment's topology, and a field of the same density everywhere. */
static inline void weigh(struct bench *bench)
{
	assert_int_equal(topology_build(&bench->topology, bench->arena, &bench->garment, NULL), TW_OK);
	double *mean = ARENA_ARRAY(bench->arena, bench->garment.face_count, double);
	assert_non_null(mean);
	for (uint32_t f = 0; f < bench->garment.face_count; f++)
		mean[f] = density;
	const double *means[1] = {mean};
	struct field_options options;
	option_defaults(&field_option_table, &options);
	assert_int_equal(field_compute(&bench->field, bench->arena, &bench->garment, &bench->topology, means, 1,
				       &options, 1, NULL),
			 TW_OK);
}

/* A sheet of 40 x 20 cells of 10 mm; with a seam at column `seam` > 0. */
static inline void set_up(struct bench *bench, uint32_t seam, double jitter)
{
	*bench = (struct bench){.arena = arena_new(0)};
	assert_non_null(bench->arena);
	mesh_sheet(&bench->garment, bench->arena, 40, 20, 10, jitter, seam);
	weigh(bench);
}

static inline void tear_down(struct bench *bench)
{
	json_decref(bench->json);
	free(bench->motion);
	layout_request_clear(&bench->request);
	arena_free(bench->arena);
}

static inline uint32_t at(uint32_t column, uint32_t row)
{
	return row * 41 + column;
}

/* Three frames: the matrix `m` (rows of x, y, z of the frame over x, y, z at rest) at a third, two thirds and all of
 * its way from the identity, or the identity three times where m is NULL. */
static inline void set_motion(struct bench *bench, const double m[9])
{
	enum { FRAMES = 3 };
	size_t points = 3 * (size_t)bench->garment.vertex_count;
	bench->motion = malloc(PC2_HEADER_BYTES + FRAMES * points * sizeof(float));
	assert_non_null(bench->motion);
	float *out =
		(float *)(void *)(bench->motion + pc2_write_header(bench->motion, bench->garment.vertex_count, FRAMES));
	for (int frame = 1; frame <= FRAMES; frame++) {
		for (size_t v = 0; v < bench->garment.vertex_count; v++) {
			const double *x = &bench->garment.position[3 * v];
			for (size_t i = 0; i < 3; i++) {
				double moved = m ? m[3 * i] * x[0] + m[3 * i + 1] * x[1] + m[3 * i + 2] * x[2] : x[i];
				*out++ = (float)(x[i] + (moved - x[i]) * frame / FRAMES);
			}
		}
	}
	bench->memory = (struct byte_memory){.bytes = bench->motion,
					     .size = PC2_HEADER_BYTES + FRAMES * points * sizeof(float)};
}

static inline enum tw_status open_motion(void *context, uint32_t motion, struct motion_reader **reader,
					 struct tw_error *error)
{
	struct bench *bench = context;
	(void)motion;
	bench->memory.at = 0;
	struct byte_source source = byte_source_memory(&bench->memory);
	return motion_open(reader, &source, MOTION_SNIFF, UNIT_MM, bench->garment.vertex_count, error);
}

/* How far a frame is from rest to the matrix, for motions made of several frames. */
static inline void set_frames(struct bench *bench, const double m[9], const double *shares, uint32_t frames)
{
	size_t points = 3 * (size_t)bench->garment.vertex_count;
	free(bench->motion);
	bench->motion = malloc(PC2_HEADER_BYTES + frames * points * sizeof(float));
	assert_non_null(bench->motion);
	float *out =
		(float *)(void *)(bench->motion + pc2_write_header(bench->motion, bench->garment.vertex_count, frames));
	for (uint32_t j = 0; j < frames; j++)
		for (size_t i = 0; i < points; i++) {
			const double *x = &bench->garment.position[i - i % 3], *row = m + 3 * (i % 3);
			double moved = row[0] * x[0] + row[1] * x[1] + row[2] * x[2];
			*out++ = (float)(x[i % 3] + (moved - x[i % 3]) * shares[j]);
		}
	bench->memory = (struct byte_memory){.bytes = bench->motion,
					     .size = PC2_HEADER_BYTES + frames * points * sizeof(float)};
}

static inline struct layout_input input_of(struct bench *bench, unsigned threads)
{
	static const char *const names[] = {"stretch"};
	return (struct layout_input){
		.garment = &bench->garment,
		.topology = &bench->topology,
		.field = &bench->field,
		.request = &bench->request,
		.motion_name = names,
		.motion_count = bench->motion ? 1 : 0,
		.threads = threads,
		.motion_open = open_motion,
		.context = bench,
	};
}

/* Every drawing is made once more, as one that nobody asked for at first: of the trees, without motions and without a
 * search; the trees have been kept meanwhile. */
static inline void check_later_drawings(struct bench *bench)
{
	const struct layout_output *first = &bench->output;
	struct layout_trees trees;
	struct tw_array kept;
	assert_int_equal(trees_to_array(&first->trees, bench->arena, &kept, NULL), TW_OK);
	assert_int_equal(trees_from_array(&trees, bench->arena, &kept, NULL), TW_OK);
	for (uint32_t i = 1; i < first->artifact_count; i++) {
		struct layout_output later;
		struct layout_input input = input_of(bench, 1);
		input.trees = &trees;
		input.file = first->artifacts[i].name;
		input.motion_count = 0;
		assert_int_equal(layout_compute(&input, bench->arena, &later, NULL), TW_OK);
		assert_int_equal(later.artifact_count, 1);
		assert_string_equal(later.artifacts[0].name, first->artifacts[i].name);
		assert_string_equal(later.artifacts[0].media_type, first->artifacts[i].media_type);
		assert_int_equal(later.artifacts[0].size, first->artifacts[i].size);
		assert_memory_equal(later.artifacts[0].bytes, first->artifacts[i].bytes, later.artifacts[0].size);
	}
}

static inline enum tw_status try_compute(struct bench *bench, const char *request, unsigned threads,
					 struct tw_error *error)
{
	layout_request_clear(&bench->request);
	enum tw_status status = layout_request_parse(&bench->request, request, strlen(request), error);
	if (status)
		return status;
	const struct layout_input input = input_of(bench, threads);
	status = layout_compute(&input, bench->arena, &bench->output, error);
	if (status == TW_OK)
		check_later_drawings(bench);
	return status;
}

static inline void compute(struct bench *bench, const char *request)
{
	struct tw_error error = {0};
	if (try_compute(bench, request, 1, &error))
		fail_msg("%s: %s: %s", error.type, error.where, error.text);
	json_decref(bench->json);
	bench->json = json_loads(bench->output.artifacts[0].bytes, 0, NULL);
	assert_non_null(bench->json);
}

static inline double member(const json_t *object, const char *key)
{
	const json_t *value = json_object_get(object, key);
	if (!json_is_number(value))
		fail_msg("no number \"%s\"", key);
	return json_number_value(value);
}

static inline const json_t *layout_of(const struct bench *bench)
{
	return json_object_get(bench->json, "layout");
}

static inline const json_t *metrics_of(const struct bench *bench)
{
	return json_object_get(layout_of(bench), "metrics");
}

static inline void assert_near(double a, double b, double slack)
{
	if (!(fabs(a - b) <= slack))
		fail_msg("%.12g is not %.12g", a, b);
}

/* A layout request for two vertices; good until the next call. */
static inline char *two_vertices(uint32_t a, uint32_t b)
{
	static char request[128];
	snprintf(request, sizeof request, "{\"terminals\":[{\"vertex\":%u},{\"vertex\":%u}]}", a, b);
	return request;
}

#endif
