/* Every real suit and motion of DATA, against the figures of its manifest. */
#include "solver/garment/import.h"
#include "solver/motion/motion.h"

#include <jansson.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct file {
	char *bytes;
	size_t size;
};

static struct file read_file(const char *directory, const char *name)
{
	char path[4096];
	snprintf(path, sizeof path, "%s/%s", directory, name);
	FILE *stream = fopen(path, "rb");
	struct file file = {0};
	if (!stream)
		return file;
	fseek(stream, 0, SEEK_END);
	file.size = (size_t)ftell(stream);
	rewind(stream);
	file.bytes = malloc(file.size + 1);
	assert_int_equal(fread(file.bytes, 1, file.size, stream), file.size);
	fclose(stream);
	return file;
}

static json_t *manifest(const char *data)
{
	struct file file = data ? read_file(data, "manifest.json") : (struct file){0};
	json_t *root = file.bytes ? json_loadb(file.bytes, file.size, 0, NULL) : NULL;
	free(file.bytes);
	return root;
}

static json_int_t integer(const json_t *object, const char *name)
{
	return json_integer_value(json_object_get(object, name));
}

static void check_suit(const char *data, const json_t *suit)
{
	struct file file = read_file(data, json_string_value(json_object_get(suit, "obj")));
	const char *pattern_name = json_string_value(json_object_get(suit, "pattern_obj"));
	struct arena *arena = arena_new(0);
	struct import_options options;
	option_defaults(&import_option_table, &options);
	struct garment_source source = {.bytes = file.bytes, .size = file.size, .format = MESH_OBJ};
	struct garment garment, flat;
	struct garment_report report;
	struct tw_error error = {0};
	if (garment_import(&garment, arena, &source, NULL, &options, &report, &error) != TW_OK)
		fail_msg("%s: %s: %s", error.type, error.where, error.text);
	assert_int_equal(garment.vertex_count, integer(suit, "vertices"));
	assert_int_equal(garment.face_count, integer(suit, "faces"));
	assert_int_equal(report.inner_edges + report.seam_edges + report.hem_edges, integer(suit, "edges"));
	assert_int_equal(report.component_count, integer(suit, "components"));
	assert_int_equal(garment.piece_count, 12);
	assert_int_equal(report.warnings.count, 0);
	if (pattern_name) {
		/* the pattern as a mesh of its own gives the same garment */
		assert_int_equal(garment.coord_count, integer(suit, "pattern_vertices"));
		struct file pattern = read_file(data, pattern_name);
		struct garment_source second = {.bytes = pattern.bytes, .size = pattern.size, .format = MESH_OBJ};
		assert_int_equal(garment_import(&flat, arena, &source, &second, &options, &report, &error), TW_OK);
		assert_memory_equal(flat.face_coord, garment.face_coord, 12 * (size_t)garment.face_count);
		assert_memory_equal(flat.pattern, garment.pattern, 16 * (size_t)garment.coord_count);
		free(pattern.bytes);
	}
	arena_free(arena);
	free(file.bytes);
}

static void real_suits_have_the_counts_of_their_manifest(void **state)
{
	(void)state;
	const char *data = getenv("DATA"), *name;
	json_t *root = manifest(data), *suit;
	if (!root)
		skip();
	json_object_foreach(json_object_get(root, "suits"), name, suit) check_suit(data, suit);
	json_decref(root);
}

static void check_motion(const char *data, uint32_t vertices, const json_t *motion)
{
	struct file file = read_file(data, json_string_value(json_object_get(motion, "file")));
	struct byte_memory memory = {file.bytes, file.size, 0};
	struct byte_source source = byte_source_memory(&memory);
	struct motion_reader *reader = NULL;
	struct tw_error error = {0};
	if (motion_open(&reader, &source, MOTION_SNIFF, UNIT_MM, vertices, &error) != TW_OK)
		fail_msg("%s: %s", error.type, error.text);
	assert_int_equal(motion_info(reader)->frame_count, integer(motion, "frames"));
	assert_true(motion_info(reader)->frames_per_second == json_number_value(json_object_get(motion, "fps")));
	float *positions = malloc(12 * (size_t)vertices);
	double box[2][3] = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
	json_int_t frames = 0;
	for (bool end = false;; frames++) {
		assert_int_equal(motion_next(reader, positions, &end, &error), TW_OK);
		if (end)
			break;
		for (size_t i = 0; i < 3 * (size_t)vertices; i++) {
			box[0][i % 3] = fmin(box[0][i % 3], (double)positions[i]);
			box[1][i % 3] = fmax(box[1][i % 3], (double)positions[i]);
		}
	}
	assert_int_equal(frames, integer(motion, "frames"));
	const json_t *stated = json_object_get(motion, "bbox");
	for (size_t i = 0; i < 6 && stated; i++)
		assert_true(fabs(box[i / 3][i % 3] -
				 json_number_value(json_array_get(json_array_get(stated, i / 3), i % 3))) < 0.01);
	free(positions);
	motion_close(reader);
	free(file.bytes);
}

static void real_motions_have_the_frames_and_boxes_of_their_manifest(void **state)
{
	(void)state;
	const char *data = getenv("DATA"), *suit, *name;
	json_t *root = manifest(data), *motions, *motion;
	if (!root)
		skip();
	json_object_foreach(json_object_get(root, "motions"), suit, motions)
	{
		const json_t *worn = json_object_get(json_object_get(root, "suits"), suit);
		json_object_foreach(motions, name, motion)
			check_motion(data, (uint32_t)integer(worn, "vertices"), motion);
	}
	json_decref(root);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(real_suits_have_the_counts_of_their_manifest),
		cmocka_unit_test(real_motions_have_the_frames_and_boxes_of_their_manifest),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
