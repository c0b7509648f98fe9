/* What `tightwire sample` writes is what the importers read: the suit without a warning, motions of its vertex count,
 * terminals as a layout request takes them; and it is the suit that is made in memory. */
#include "solver/garment/import.h"
#include "solver/layout/request.h"
#include "solver/motion/motion.h"
#include "solver/sample/sample.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#include <cmocka.h>

struct fixture {
	char folder[64];
	struct arena *arena;
};

static int run(const char *arguments)
{
	char line[512];
	snprintf(line, sizeof line, "\"$TIGHTWIRE\" sample %s >/dev/null 2>&1", arguments);
	int status = system(line);
	return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static int setup(void **state)
{
	struct fixture *f = calloc(1, sizeof *f);
	char arguments[256];
	strcpy(f->folder, "/tmp/tightwire-sample-XXXXXX");
	f->arena = arena_new(0);
	*state = f;
	if (!mkdtemp(f->folder))
		return -1;
	snprintf(arguments, sizeof arguments, "--out %s --vertices 3000 --size=XL", f->folder);
	return getenv("TIGHTWIRE") && run(arguments) != 0 ? -1 : 0;
}

static int teardown(void **state)
{
	struct fixture *f = *state;
	char line[128];
	snprintf(line, sizeof line, "rm -rf %s", f->folder);
	int status = system(line);
	arena_free(f->arena);
	free(f);
	return status;
}

static struct byte_memory contents(const struct fixture *f, const char *name)
{
	char path[256];
	snprintf(path, sizeof path, "%s/%s", f->folder, name);
	FILE *file = fopen(path, "rb");
	assert_non_null(file);
	fseek(file, 0, SEEK_END);
	struct byte_memory memory = {.size = (size_t)ftell(file)};
	char *bytes = arena_array(f->arena, memory.size, 1);
	rewind(file);
	assert_int_equal(fread(bytes, 1, memory.size, file), memory.size);
	fclose(file);
	memory.bytes = bytes;
	return memory;
}

static void the_suit_imports_without_a_warning(void **state)
{
	const struct fixture *f = *state;
	if (!getenv("TIGHTWIRE"))
		skip();
	struct byte_memory obj = contents(f, "suit.obj");
	struct garment_source worn = {.bytes = obj.bytes, .size = obj.size, .name = "suit.obj"};
	struct import_options options;
	struct garment read, made;
	struct garment_report report = {0};
	struct tw_error error;
	option_defaults(&import_option_table, &options);
	assert_int_equal(garment_import(&read, f->arena, &worn, NULL, &options, &report, &error), TW_OK);
	if (report.warnings.count)
		fail_msg("%s", report.warnings.warning[0].text);
	assert_int_equal(sample_garment(&made, f->arena, 3000, SAMPLE_XL, &error), TW_OK);
	assert_int_equal(read.vertex_count, made.vertex_count);
	assert_int_equal(read.coord_count, made.coord_count);
	assert_memory_equal(read.position, made.position, 3 * sizeof(double) * made.vertex_count);
	assert_memory_equal(read.pattern, made.pattern, 2 * sizeof(double) * made.coord_count);
	assert_memory_equal(read.face_vertex, made.face_vertex, 3 * sizeof(uint32_t) * made.face_count);
	assert_memory_equal(read.face_piece, made.face_piece, sizeof(uint32_t) * made.face_count);
	assert_int_equal(read.piece_count, 12);
	for (uint32_t i = 0; i < read.piece_count; i++)
		assert_string_equal(read.piece_name[i], made.piece_name[i]);
}

static void motions_fit_the_suit(void **state)
{
	const struct fixture *f = *state;
	if (!getenv("TIGHTWIRE"))
		skip();
	for (uint32_t m = 0; m < SAMPLE_MOTIONS; m++) {
		char name[64];
		snprintf(name, sizeof name, "motions/%s.pc2", sample_motion_at(m)->name);
		struct byte_memory pc2 = contents(f, name);
		struct byte_source source = byte_source_memory(&pc2);
		struct motion_reader *reader;
		struct tw_error error;
		assert_int_equal(motion_open(&reader, &source, MOTION_SNIFF, UNIT_MM, 0, &error), TW_OK);
		const struct motion_info *info = motion_info(reader);
		assert_int_equal(info->frame_count, sample_motion_at(m)->frame_count);
		float *frame = arena_array(f->arena, 3 * (size_t)info->vertex_count, sizeof *frame);
		uint32_t frames = 0;
		for (bool end = false; !end; frames += !end)
			assert_int_equal(motion_next(reader, frame, &end, &error), TW_OK);
		assert_int_equal(frames, info->frame_count);
		motion_close(reader);
	}
}

static void terminal_sets_are_layout_requests(void **state)
{
	const struct fixture *f = *state;
	const uint32_t counts[SAMPLE_TERMINAL_SETS] = {10, 17, 36, 80};
	if (!getenv("TIGHTWIRE"))
		skip();
	for (uint32_t set = 0; set < SAMPLE_TERMINAL_SETS; set++) {
		char name[64];
		snprintf(name, sizeof name, "terminals/%s.json", sample_terminal_set_name(set));
		struct byte_memory json = contents(f, name);
		struct layout_request request;
		struct tw_error error;
		assert_int_equal(layout_request_parse(&request, json.bytes, json.size, &error), TW_OK);
		assert_int_equal(request.terminal_count, counts[set]);
		layout_request_clear(&request);
	}
}

static void wrong_arguments_exit_with_2(void **state)
{
	(void)state;
	if (!getenv("TIGHTWIRE"))
		skip();
	assert_int_equal(run(""), 2);
	assert_int_equal(run("--out /tmp --vertices 12"), 2);
	assert_int_equal(run("--out /tmp --size huge"), 2);
	assert_int_equal(run("--help"), 0);
	assert_int_equal(run("--out /dev/null/below"), 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_suit_imports_without_a_warning),
		cmocka_unit_test(motions_fit_the_suit),
		cmocka_unit_test(terminal_sets_are_layout_requests),
		cmocka_unit_test(wrong_arguments_exit_with_2),
	};
	return cmocka_run_group_tests(tests, setup, teardown);
}
