/* Point caches: what is written comes back, frame by frame; every damaged header and body is an error that names its
 * place. */
#include "solver/motion/motion.h"
#include "solver/motion/fit.h"
#include "solver/motion/pack.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { VERTICES = 4, FRAMES = 3, FRAME_BYTES = 12 * VERTICES, PC2_BYTES = PC2_HEADER_BYTES + FRAMES * FRAME_BYTES };

struct stream {
	unsigned char bytes[32768];
	struct byte_memory memory;
	struct byte_source source;
	struct motion_reader *reader;
	struct tw_error error;
};

static int setup(void **state)
{
	*state = calloc(1, sizeof(struct stream));
	return 0;
}

static int teardown(void **state)
{
	struct stream *s = *state;
	motion_close(s->reader);
	free(s);
	return 0;
}

static float coordinate(int frame, int i)
{
	return (float)(100 * frame + i) + 0.25F;
}

static void make_pc2(struct stream *s)
{
	pc2_write_header(s->bytes, VERTICES, FRAMES);
	for (int f = 0; f < FRAMES; f++) {
		for (int i = 0; i < 3 * VERTICES; i++) {
			float value = coordinate(f, i);
			memcpy(s->bytes + PC2_HEADER_BYTES + f * FRAME_BYTES + 4 * i, &value, 4);
		}
	}
	s->memory = (struct byte_memory){s->bytes, PC2_BYTES, 0};
}

static void store_be(unsigned char *bytes, float value)
{
	uint32_t bits;
	memcpy(&bits, &value, 4);
	for (int i = 0; i < 4; i++)
		bytes[i] = (unsigned char)(bits >> (24 - 8 * i));
}

static void make_mdd(struct stream *s)
{
	memcpy(s->bytes, (const unsigned char[]){0, 0, 0, FRAMES, 0, 0, 0, VERTICES}, 8);
	for (int f = 0; f < FRAMES; f++)
		store_be(s->bytes + 8 + 4 * f, 0.04F * (float)f);
	for (int f = 0; f < FRAMES; f++) {
		for (int i = 0; i < 3 * VERTICES; i++)
			store_be(s->bytes + 8 + 4 * FRAMES + f * FRAME_BYTES + 4 * i, coordinate(f, i));
	}
	s->memory = (struct byte_memory){s->bytes, 8 + 4 * FRAMES + FRAMES * FRAME_BYTES, 0};
}

static enum tw_status open_as(struct stream *s, enum motion_format format, enum length_unit unit, uint32_t vertices)
{
	motion_close(s->reader);
	s->memory.at = 0;
	s->source = byte_source_memory(&s->memory);
	return motion_open(&s->reader, &s->source, format, unit, vertices, &s->error);
}

static void assert_frames(struct stream *s, int frames, float scale)
{
	float positions[3 * VERTICES];
	bool end = false;
	for (int f = 0; f < frames; f++) {
		assert_int_equal(motion_next(s->reader, positions, &end, &s->error), TW_OK);
		assert_false(end);
		for (int i = 0; i < 3 * VERTICES; i++)
			assert_true(positions[i] == scale * coordinate(f, i));
	}
	assert_int_equal(motion_next(s->reader, positions, &end, &s->error), TW_OK);
	assert_true(end);
}

static void assert_refused(struct stream *s, const char *type)
{
	assert_int_not_equal(open_as(s, MOTION_SNIFF, UNIT_MM, VERTICES), TW_OK);
	assert_string_equal(s->error.type, type);
	assert_null(s->reader);
}

static void pc2_frames_come_back_twice(void **state)
{
	struct stream *s = *state;
	make_pc2(s);
	assert_int_equal(open_as(s, MOTION_SNIFF, UNIT_MM, VERTICES), TW_OK);
	assert_int_equal(motion_info(s->reader)->format, MOTION_PC2);
	assert_int_equal(motion_info(s->reader)->frame_count, FRAMES);
	assert_frames(s, FRAMES, 1);
	assert_int_equal(motion_rewind(s->reader, &s->error), TW_OK);
	assert_frames(s, FRAMES, 1);
}

static void units_become_millimetres(void **state)
{
	struct stream *s = *state;
	make_pc2(s);
	assert_int_equal(open_as(s, MOTION_PC2, UNIT_CM, 0), TW_OK);
	assert_frames(s, FRAMES, 10);
	assert_int_equal(open_as(s, MOTION_PC2, UNIT_M, 0), TW_OK);
	assert_frames(s, FRAMES, 1000);
}

static void mdd_frames_come_back_with_their_rate(void **state)
{
	struct stream *s = *state;
	make_mdd(s);
	assert_int_equal(open_as(s, MOTION_SNIFF, UNIT_MM, VERTICES), TW_OK);
	assert_int_equal(motion_info(s->reader)->format, MOTION_MDD);
	assert_true(fabs(motion_info(s->reader)->frames_per_second - 25) < 1e-5);
	assert_frames(s, FRAMES, 1);
}

static void other_vertex_count_is_refused(void **state)
{
	struct stream *s = *state;
	make_pc2(s);
	assert_int_equal(open_as(s, MOTION_SNIFF, UNIT_MM, VERTICES + 1), TW_ERROR_INPUT);
	assert_string_equal(s->error.type, "motion-vertex-count");
	make_mdd(s);
	assert_int_equal(open_as(s, MOTION_MDD, UNIT_MM, VERTICES + 1), TW_ERROR_INPUT);
	assert_string_equal(s->error.type, "motion-vertex-count");
}

static void empty_and_strange_files_are_refused(void **state)
{
	struct stream *s = *state;
	s->memory = (struct byte_memory){s->bytes, 0, 0};
	assert_refused(s, "motion-empty");
	memcpy(s->bytes, "PK\3\4 a zip archive", 19);
	s->memory.size = 19;
	assert_refused(s, "motion-unknown-format");
	assert_int_equal(open_as(s, MOTION_PC2, UNIT_MM, VERTICES), TW_ERROR_INPUT);
	assert_string_equal(s->error.type, "motion-truncated");
}

/* Every cut of the file is noticed: at the start where the size is known, else in the frame where it happens. */
static void every_truncation_is_noticed(void **state)
{
	struct stream *s = *state;
	for (int mdd = 0; mdd < 2; mdd++) {
		if (mdd)
			make_mdd(s);
		else
			make_pc2(s);
		const size_t whole = s->memory.size;
		for (size_t size = 0; size < whole; size++) {
			s->memory.size = size;
			assert_int_equal(open_as(s, mdd ? MOTION_MDD : MOTION_PC2, UNIT_MM, 0), TW_ERROR_INPUT);
			assert_string_equal(s->error.type, "motion-truncated");

			s->memory.at = 0;
			s->source.size = UINT64_MAX;
			enum tw_status status = motion_open(&s->reader, &s->source, mdd ? MOTION_MDD : MOTION_PC2,
							    UNIT_MM, 0, &s->error);
			float positions[3 * VERTICES];
			bool end = false;
			while (status == TW_OK && !end)
				status = motion_next(s->reader, positions, &end, &s->error);
			assert_int_equal(status, TW_ERROR_INPUT);
			assert_string_equal(s->error.type, "motion-truncated");
		}
	}
}

static void bytes_behind_the_last_frame_are_refused(void **state)
{
	struct stream *s = *state;
	make_pc2(s);
	s->memory.size++;
	assert_refused(s, "motion-trailing-bytes");
	s->memory.at = 0;
	s->source.size = UINT64_MAX;
	assert_int_equal(motion_open(&s->reader, &s->source, MOTION_PC2, UNIT_MM, 0, &s->error), TW_OK);
	float positions[3 * VERTICES];
	bool end = false;
	for (int f = 0; f < FRAMES; f++)
		assert_int_equal(motion_next(s->reader, positions, &end, &s->error), TW_OK);
	assert_int_equal(motion_next(s->reader, positions, &end, &s->error), TW_ERROR_INPUT);
	assert_string_equal(s->error.type, "motion-trailing-bytes");
}

static void claims_of_gigabytes_are_refused_without_reading(void **state)
{
	struct stream *s = *state;
	make_pc2(s);
	pc2_write_header(s->bytes, VERTICES, 100000000);
	assert_refused(s, "motion-too-large");
	pc2_write_header(s->bytes, VERTICES, 1000000);
	assert_refused(s, "motion-truncated");
	pc2_write_header(s->bytes, 0x7fffffff, 0x7fffffff);
	assert_int_equal(open_as(s, MOTION_SNIFF, UNIT_MM, 0), TW_ERROR_LIMIT);
	pc2_write_header(s->bytes, 0xffffffff, FRAMES);
	assert_int_equal(open_as(s, MOTION_SNIFF, UNIT_MM, 0), TW_ERROR_INPUT);
	assert_string_equal(s->error.type, "motion-empty");
}

static void unknown_version_and_bad_rate_are_refused(void **state)
{
	struct stream *s = *state;
	make_pc2(s);
	s->bytes[12] = 2;
	assert_refused(s, "motion-bad-header");
	make_pc2(s);
	memcpy(s->bytes + 24, &(float){NAN}, 4);
	assert_refused(s, "motion-bad-header");
	make_mdd(s);
	store_be(s->bytes + 12, -1);
	assert_refused(s, "motion-bad-times");
}

static void what_is_no_number_is_named_by_frame_and_vertex(void **state)
{
	struct stream *s = *state;
	const struct {
		float value;
		const char *type;
	} bad[] = {{NAN, "motion-not-a-number"},
		   {INFINITY, "motion-not-a-number"},
		   {-INFINITY, "motion-not-a-number"},
		   {2e6F, "motion-too-far"}};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		make_pc2(s);
		memcpy(s->bytes + PC2_HEADER_BYTES + 1 * FRAME_BYTES + 12 * 2 + 4, &bad[i].value, 4);
		assert_int_equal(open_as(s, MOTION_SNIFF, UNIT_MM, VERTICES), TW_OK);
		float positions[3 * VERTICES];
		bool end = false;
		assert_int_equal(motion_next(s->reader, positions, &end, &s->error), TW_OK);
		assert_int_equal(motion_next(s->reader, positions, &end, &s->error), TW_ERROR_INPUT);
		assert_string_equal(s->error.type, bad[i].type);
		assert_string_equal(s->error.where, "frame 1 vertex 2");
	}
}

static void motion_in_another_unit_or_order_does_not_fit(void **state)
{
	struct stream *s = *state;
	double position[] = {0, 0, 0, 10, 0, 0, 0, 10, 0, 500, 500, 500};
	uint32_t face[] = {0, 1, 2};
	struct garment garment = {.vertex_count = 4, .face_count = 1, .position = position, .face_vertex = face};
	float frame[12];
	for (int i = 0; i < 12; i++)
		frame[i] = (float)position[i] * 1.5F + 3;
	assert_int_equal(motion_check_fit(&garment, frame, &s->error), TW_OK);
	for (int i = 0; i < 12; i++)
		frame[i] = (float)position[i] / 10;
	assert_int_equal(motion_check_fit(&garment, frame, &s->error), TW_ERROR_INPUT);
	assert_string_equal(s->error.type, "motion-does-not-fit");
	assert_non_null(strstr(s->error.text, "has 0.50 mm2, worn 50.00 mm2"));
	for (int i = 0; i < 12; i++)
		frame[i] = (float)position[(i + 3) % 12];
	assert_int_equal(motion_check_fit(&garment, frame, &s->error), TW_ERROR_INPUT);
}

static void another_size_shows_in_most_of_the_fabric(void **state)
{
	enum { FACES = 100 };
	static double position[9 * FACES];
	static float frame[9 * FACES];
	static uint32_t face[3 * FACES];
	(void)state;
	for (uint32_t i = 0; i < 9 * FACES; i++) {
		position[i] = 5 * sin(1.7 * i) + i / 9; /* faces of any shape */
		face[i / 3] = i / 3;
	}
	struct garment garment = {
		.vertex_count = 3 * FACES, .face_count = FACES, .position = position, .face_vertex = face};
	for (double size = 0.9; size < 1.11; size += 0.05) {
		for (int i = 0; i < 9 * FACES; i++) /* and some faces are stretched by half */
			frame[i] = (float)(position[i] * size * (i < 9 * FACES / 3 ? 1.5 : 1));
		assert_true(fabs(motion_size(&garment, frame) - size) <= 0.005);
	}
}

/* --- packed motions ---------------------------------------------------------------------------- */

/* Smooth paths through a few metres, with a jump, in `frames` frames of VERTICES points. */
static float smooth(int frame, int i)
{
	return (float)(900 * sin(0.11 * frame + i) + (frame == 5 ? 300 : 0)) / 3 - (float)i;
}

static enum tw_status take_bytes(void *context, const void *bytes, size_t size, struct tw_error *error)
{
	struct stream *s = context;
	(void)error;
	memcpy(s->bytes + s->memory.size, bytes, size);
	s->memory.size += size;
	return TW_OK;
}

static void make_packed(struct stream *s, int frames, uint32_t stated)
{
	struct motion_info info = {.vertex_count = VERTICES, .frame_count = stated, .frames_per_second = 25};
	struct motion_packer *packer = NULL;
	s->memory = (struct byte_memory){s->bytes, 0, 0};
	assert_int_equal(motion_packer_new(&packer, &info, take_bytes, s, &s->error), TW_OK);
	for (int f = 0; f < frames; f++) {
		float positions[3 * VERTICES];
		for (int i = 0; i < 3 * VERTICES; i++)
			positions[i] = smooth(f, i);
		assert_int_equal(motion_packer_add(packer, positions, &s->error), TW_OK);
	}
	motion_packer_free(packer);
}

static void packed_positions_are_within_the_stated_error(void **state)
{
	struct stream *s = *state;
	for (int known = 0; known < 2; known++) {
		make_packed(s, 50, known ? 50 : 0);
		assert_int_equal(open_as(s, MOTION_SNIFF, UNIT_M, VERTICES), TW_OK);
		assert_int_equal(motion_info(s->reader)->format, MOTION_PACKED);
		assert_true(motion_info(s->reader)->frames_per_second == 25);
		for (int round = 0; round < 2; round++) {
			float positions[3 * VERTICES];
			bool end = false;
			for (int f = 0; f < 50; f++) {
				assert_int_equal(motion_next(s->reader, positions, &end, &s->error), TW_OK);
				for (int i = 0; i < 3 * VERTICES; i++)
					assert_true(fabs((double)positions[i] - (double)smooth(f, i)) <=
						    MOTION_PACK_ERROR_MM);
			}
			assert_int_equal(motion_next(s->reader, positions, &end, &s->error), TW_OK);
			assert_true(end);
			assert_int_equal(motion_info(s->reader)->frame_count, 50);
			assert_int_equal(motion_rewind(s->reader, &s->error), TW_OK);
		}
	}
}

static void rounded_positions_are_those_that_packing_keeps(void **state)
{
	enum { FRAMES_MADE = 20, FLOATS = 3 * VERTICES };
	struct stream *s = *state;
	static unsigned char pc2[PC2_HEADER_BYTES + FRAMES_MADE * FLOATS * 4];
	pc2_write_header(pc2, VERTICES, FRAMES_MADE);
	for (int f = 0; f < FRAMES_MADE; f++)
		for (int i = 0; i < FLOATS; i++) {
			float value = smooth(f, i);
			memcpy(pc2 + PC2_HEADER_BYTES + 4 * (f * FLOATS + i), &value, 4);
		}
	make_packed(s, FRAMES_MADE, FRAMES_MADE);
	assert_int_equal(open_as(s, MOTION_PACKED, UNIT_MM, 0), TW_OK);
	struct byte_memory memory = {pc2, sizeof pc2, 0};
	struct byte_source source = byte_source_memory(&memory);
	struct motion_reader *reader = NULL;
	assert_int_equal(motion_open(&reader, &source, MOTION_PC2, UNIT_MM, 0, &s->error), TW_OK);
	motion_round(reader);
	for (bool end = false; !end;) {
		float kept[FLOATS] = {0}, rounded[FLOATS] = {0};
		assert_int_equal(motion_next(s->reader, kept, &end, &s->error), TW_OK);
		assert_int_equal(motion_next(reader, rounded, &end, &s->error), TW_OK);
		assert_memory_equal(kept, rounded, sizeof kept);
	}
	motion_close(reader);
}

static void packing_again_gives_the_same_bytes(void **state)
{
	struct stream *s = *state;
	make_packed(s, 20, 20);
	assert_int_equal(open_as(s, MOTION_PACKED, UNIT_MM, 0), TW_OK);
	struct stream *again = calloc(1, sizeof *again);
	again->memory.bytes = again->bytes;
	uint32_t frames = 0;
	assert_int_equal(motion_pack(s->reader, take_bytes, again, &frames, &s->error), TW_OK);
	assert_int_equal(frames, 20);
	assert_int_equal(again->memory.size, s->memory.size);
	assert_memory_equal(again->bytes, s->bytes, s->memory.size);
	free(again);
}

static void damaged_packed_motions_are_errors(void **state)
{
	struct stream *s = *state;
	make_packed(s, 4, 4);
	const size_t whole = s->memory.size;
	float positions[3 * VERTICES];
	for (size_t size = 0; size <= whole; size++) {
		s->memory.size = size + (size == whole);
		enum tw_status status = open_as(s, MOTION_PACKED, UNIT_MM, VERTICES);
		bool end = false;
		while (status == TW_OK && !end)
			status = motion_next(s->reader, positions, &end, &s->error);
		assert_int_equal(status, TW_ERROR_INPUT);
	}
	s->memory.size = whole;
	s->bytes[24 + 4] ^= 0xff; /* the mark of the first zstd frame */
	assert_int_equal(open_as(s, MOTION_PACKED, UNIT_MM, VERTICES), TW_OK);
	bool end = false;
	assert_int_equal(motion_next(s->reader, positions, &end, &s->error), TW_ERROR_INPUT);
	assert_string_equal(s->error.type, "motion-damaged");
	assert_string_equal(s->error.where, "frame 0");
}

/* --- OBJ sequences ----------------------------------------------------------------------------- */

static void add_tar_entry(struct stream *s, const char *name, char type, const char *data, size_t size)
{
	unsigned char *header = s->bytes + s->memory.size;
	memset(header, 0, 512);
	snprintf((char *)header, 100, "%s", name);
	snprintf((char *)header + 100, 8, "0000644");
	snprintf((char *)header + 124, 12, "%011zo", size);
	snprintf((char *)header + 136, 12, "00000000000");
	header[156] = (unsigned char)type;
	memcpy(header + 257, "ustar\00000", 8);
	memset(header + 148, ' ', 8);
	unsigned sum = 0;
	for (int i = 0; i < 512; i++)
		sum += header[i];
	snprintf((char *)header + 148, 8, "%06o", sum);
	memset(header + 512, 0, (size + 511) / 512 * 512);
	memcpy(header + 512, data, size);
	s->memory.size += 512 + (size + 511) / 512 * 512;
}

static void add_obj(struct stream *s, const char *name, int frame, const char *faces)
{
	char text[1024];
	size_t size = 0;
	for (int v = 0; v < VERTICES; v++)
		size += (size_t)snprintf(text + size, sizeof text - size, "v %.9g %.9g %.9g\n",
					 (double)coordinate(frame, 3 * v), (double)coordinate(frame, 3 * v + 1),
					 (double)coordinate(frame, 3 * v + 2));
	size += (size_t)snprintf(text + size, sizeof text - size, "%s", faces);
	add_tar_entry(s, name, '0', text, size);
}

static void end_tar(struct stream *s)
{
	memset(s->bytes + s->memory.size, 0, 1024);
	s->memory.size += 1024;
}

static const char faces[] = "f 1 2 3\nf 3 2 4\n";

static void start_tar(struct stream *s)
{
	s->memory = (struct byte_memory){s->bytes, 0, 0};
}

static void obj_sequence_comes_back_in_natural_order(void **state)
{
	struct stream *s = *state;
	start_tar(s);
	add_tar_entry(s, "walk/", '5', "", 0);
	add_obj(s, "walk/frame2.obj", 0, faces);
	add_tar_entry(s, "walk/readme.txt", '0', "hello", 5);
	add_obj(s, "walk/frame9.obj", 1, faces);
	add_obj(s, "walk/frame10.obj", 2, faces);
	end_tar(s);
	assert_int_equal(open_as(s, MOTION_SNIFF, UNIT_MM, VERTICES), TW_OK);
	assert_int_equal(motion_info(s->reader)->format, MOTION_OBJ_TAR);
	assert_frames(s, 3, 1);
	assert_int_equal(motion_info(s->reader)->frame_count, 3);
	assert_int_equal(motion_rewind(s->reader, &s->error), TW_OK);
	assert_frames(s, 3, 1);
}

static void long_names_are_read(void **state)
{
	struct stream *s = *state;
	char name[200], record[256];
	memset(name, 'a', sizeof name);
	strcpy(name + 190, "1.obj");
	start_tar(s);
	add_tar_entry(s, "././@LongLink", 'L', name, strlen(name) + 1);
	add_obj(s, "cut-off", 0, faces);
	name[190] = '2';
	/* the length of a record counts its own digits */
	int size = snprintf(record, sizeof record, "%zu path=%s\n", strlen(name) + 10, name);
	add_tar_entry(s, "PaxHeaders/x", 'x', record, (size_t)size);
	add_obj(s, "cut-off", 1, faces);
	end_tar(s);
	assert_int_equal(open_as(s, MOTION_SNIFF, UNIT_MM, VERTICES), TW_OK);
	assert_frames(s, 2, 1);
}

static void assert_sequence_fails(struct stream *s, const char *type)
{
	end_tar(s);
	enum tw_status status = open_as(s, MOTION_OBJ_TAR, UNIT_MM, VERTICES);
	float positions[3 * VERTICES];
	bool end = false;
	while (status == TW_OK && !end)
		status = motion_next(s->reader, positions, &end, &s->error);
	assert_int_equal(status, TW_ERROR_INPUT);
	assert_string_equal(s->error.type, type);
}

static void reordered_vertices_are_noticed(void **state)
{
	struct stream *s = *state;
	start_tar(s);
	add_obj(s, "1.obj", 0, faces);
	add_obj(s, "2.obj", 1, "f 1 3 2\nf 3 2 4\n");
	assert_sequence_fails(s, "motion-vertex-order");
	assert_string_equal(s->error.where, "frame 1");
}

/* As shells list them: cloth.10 before cloth.8. */
static void frames_are_read_in_the_order_of_their_numbers(void **state)
{
	struct stream *s = *state;
	start_tar(s);
	add_obj(s, "frames/cloth.10.obj", 2, faces);
	add_obj(s, "frames/cloth.0011.obj", 3, faces);
	add_obj(s, "frames/cloth.8.obj", 0, faces);
	add_obj(s, "frames/cloth.9.obj", 1, faces);
	end_tar(s);
	for (int unknown_size = 0; unknown_size < 2; unknown_size++) {
		assert_int_equal(open_as(s, MOTION_SNIFF, UNIT_MM, VERTICES), TW_OK);
		assert_int_equal(motion_info(s->reader)->frame_count, 4);
		assert_frames(s, 4, 1);
		assert_int_equal(motion_rewind(s->reader, &s->error), TW_OK);
		assert_frames(s, 4, 1);
	}
}

static void frames_of_the_same_number_are_refused(void **state)
{
	struct stream *s = *state;
	start_tar(s);
	add_obj(s, "8.obj", 0, faces);
	add_obj(s, "9.obj", 1, faces);
	add_obj(s, "08.obj", 2, faces);
	assert_sequence_fails(s, "motion-frame-order");
	assert_string_equal(s->error.where, "frame 1");
	start_tar(s);
	add_obj(s, "a.obj", 0, faces);
	add_obj(s, "a.obj", 1, faces);
	assert_sequence_fails(s, "motion-frame-order");
}

/* What bsdtar adds on macOS: extended attributes in a file beside each. */
static void companions_of_macos_are_no_frames(void **state)
{
	struct stream *s = *state;
	static const char attributes[] = "\0\5\26\7\0\2\0\0Mac OS X        \0\2";
	start_tar(s);
	add_tar_entry(s, "./._cloth_0.obj", '0', attributes, sizeof attributes);
	add_obj(s, "./cloth_0.obj", 0, faces);
	add_tar_entry(s, "./._cloth_1.obj", '0', attributes, sizeof attributes);
	add_obj(s, "./cloth_1.obj", 1, faces);
	add_tar_entry(s, "._x.obj", '0', attributes, sizeof attributes);
	end_tar(s);
	assert_int_equal(open_as(s, MOTION_SNIFF, UNIT_MM, VERTICES), TW_OK);
	assert_frames(s, 2, 1);
}

/* Each of the kinds of frames goes through the reader of OBJ as tools write it. */
static void frames_are_texts_as_tools_write_them(void **state)
{
	struct stream *s = *state;
	static const char *const changes[][2] = {
		{"", "\n"}, {"\xef\xbb\xbf", "\n"}, {"", "\r\n"}, {"", "\r"}, {"o C:\\\n", "\n"}};
	start_tar(s);
	for (int frame = 0; frame < 5; frame++) {
		char text[1024], name[16];
		int size = snprintf(text, sizeof text, "%s", changes[frame][0]);
		for (int v = 0; v < VERTICES; v++)
			size += snprintf(text + size, sizeof text - (size_t)size, "v %.9g %.9g %.9g%s",
					 (double)coordinate(frame, 3 * v), (double)coordinate(frame, 3 * v + 1),
					 (double)coordinate(frame, 3 * v + 2), changes[frame][1]);
		size += snprintf(text + size, sizeof text - (size_t)size, "f 1// 2// 3//%sf 3 2 4%s", changes[frame][1],
				 changes[frame][1]);
		snprintf(name, sizeof name, "%d.obj", frame);
		add_tar_entry(s, name, '0', text, (size_t)size);
	}
	end_tar(s);
	assert_int_equal(open_as(s, MOTION_SNIFF, UNIT_MM, VERTICES), TW_OK);
	assert_frames(s, 5, 1);
}

static void damaged_tars_are_errors(void **state)
{
	struct stream *s = *state;
	start_tar(s);
	add_obj(s, "1.obj", 0, faces);
	s->bytes[3] ^= 1;
	assert_sequence_fails(s, "motion-bad-tar");

	start_tar(s);
	add_tar_entry(s, "readme.txt", '0', "hello", 5);
	assert_sequence_fails(s, "motion-empty");

	start_tar(s);
	add_obj(s, "1.obj", 0, faces);
	add_obj(s, "2.obj", 1, "f 1 2 9\n");
	assert_sequence_fails(s, "mesh-bad-index");
	assert_string_equal(s->error.where, "frame 1, line 5");

	start_tar(s);
	add_obj(s, "1.obj", 0, faces);
	s->memory.size -= 300;
	s->source = byte_source_memory(&s->memory);
	assert_int_equal(open_as(s, MOTION_OBJ_TAR, UNIT_MM, VERTICES), TW_ERROR_INPUT);
	assert_string_equal(s->error.type, "motion-truncated");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(pc2_frames_come_back_twice, setup, teardown),
		cmocka_unit_test_setup_teardown(units_become_millimetres, setup, teardown),
		cmocka_unit_test_setup_teardown(mdd_frames_come_back_with_their_rate, setup, teardown),
		cmocka_unit_test_setup_teardown(other_vertex_count_is_refused, setup, teardown),
		cmocka_unit_test_setup_teardown(empty_and_strange_files_are_refused, setup, teardown),
		cmocka_unit_test_setup_teardown(every_truncation_is_noticed, setup, teardown),
		cmocka_unit_test_setup_teardown(bytes_behind_the_last_frame_are_refused, setup, teardown),
		cmocka_unit_test_setup_teardown(claims_of_gigabytes_are_refused_without_reading, setup, teardown),
		cmocka_unit_test_setup_teardown(unknown_version_and_bad_rate_are_refused, setup, teardown),
		cmocka_unit_test_setup_teardown(what_is_no_number_is_named_by_frame_and_vertex, setup, teardown),
		cmocka_unit_test_setup_teardown(motion_in_another_unit_or_order_does_not_fit, setup, teardown),
		cmocka_unit_test(another_size_shows_in_most_of_the_fabric),
		cmocka_unit_test_setup_teardown(packed_positions_are_within_the_stated_error, setup, teardown),
		cmocka_unit_test_setup_teardown(rounded_positions_are_those_that_packing_keeps, setup, teardown),
		cmocka_unit_test_setup_teardown(packing_again_gives_the_same_bytes, setup, teardown),
		cmocka_unit_test_setup_teardown(damaged_packed_motions_are_errors, setup, teardown),
		cmocka_unit_test_setup_teardown(obj_sequence_comes_back_in_natural_order, setup, teardown),
		cmocka_unit_test_setup_teardown(long_names_are_read, setup, teardown),
		cmocka_unit_test_setup_teardown(reordered_vertices_are_noticed, setup, teardown),
		cmocka_unit_test_setup_teardown(frames_are_read_in_the_order_of_their_numbers, setup, teardown),
		cmocka_unit_test_setup_teardown(frames_of_the_same_number_are_refused, setup, teardown),
		cmocka_unit_test_setup_teardown(companions_of_macos_are_no_frames, setup, teardown),
		cmocka_unit_test_setup_teardown(frames_are_texts_as_tools_write_them, setup, teardown),
		cmocka_unit_test_setup_teardown(damaged_tars_are_errors, setup, teardown),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
