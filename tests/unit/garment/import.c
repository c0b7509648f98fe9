/* What an import makes of good files, and that bad ones are errors which name the place. */
#include "solver/garment/import.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct fixture {
	struct arena *arena;
	struct garment garment;
	struct garment_report report;
	struct import_options options;
	struct tw_error error;
};

static int setup(void **state)
{
	struct fixture *f = calloc(1, sizeof *f);
	f->arena = arena_new(0);
	option_defaults(&import_option_table, &f->options);
	*state = f;
	return 0;
}

static int teardown(void **state)
{
	struct fixture *f = *state;
	arena_free(f->arena);
	free(f);
	return 0;
}

static enum tw_status import_two(struct fixture *f, const char *worn, const char *pattern)
{
	struct garment_source worn_source = {.bytes = worn, .size = strlen(worn)};
	struct garment_source pattern_source = {.bytes = pattern, .size = pattern ? strlen(pattern) : 0};
	memset(&f->error, 0, sizeof f->error);
	return garment_import(&f->garment, f->arena, &worn_source, pattern ? &pattern_source : NULL, &f->options,
			      &f->report, &f->error);
}

static void assert_imports(struct fixture *f, const char *worn)
{
	enum tw_status status = import_two(f, worn, NULL);
	if (status != TW_OK)
		fail_msg("%s: %s: %s", f->error.type, f->error.where, f->error.text);
}

static const struct warning *warning(const struct fixture *f, const char *type)
{
	for (uint32_t i = 0; i < f->report.warnings.count; i++) {
		if (strcmp(f->report.warnings.warning[i].type, type) == 0)
			return &f->report.warnings.warning[i];
	}
	return NULL;
}

/* A square of 100 mm in two triangles, then its right neighbour, sewn on along x = 100 and lying apart in the pattern.
 */
#define SQUARE_V "v 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\n"
#define SQUARE_VT "vt 0 0\nvt 100 0\nvt 100 100\nvt 0 100\n"
#define SQUARE SQUARE_V SQUARE_VT
#define NEIGHBOUR "v 200 0 0\nv 200 100 0\nvt 300 0\nvt 400 0\nvt 400 100\nvt 300 100\n"
#define TWO_PIECES                                                                                                     \
	SQUARE NEIGHBOUR "g left\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"                                                      \
			 "g right\nf 2/5 5/6 6/7\nf 2/5 6/7 3/8\n"

static void two_pieces_meet_in_a_seam(void **state)
{
	struct fixture *f = *state;
	assert_imports(f, TWO_PIECES);
	assert_int_equal(f->garment.vertex_count, 6);
	assert_int_equal(f->garment.coord_count, 8);
	assert_int_equal(f->garment.face_count, 4);
	assert_int_equal(f->garment.piece_count, 2);
	assert_string_equal(f->garment.piece_name[0], "left");
	assert_string_equal(f->garment.piece_name[1], "right");
	assert_int_equal(f->report.inner_edges, 2);
	assert_int_equal(f->report.seam_edges, 1);
	assert_int_equal(f->report.hem_edges, 6);
	assert_int_equal(f->report.component_count, 1);
	assert_int_equal(f->report.warnings.count, 0);
	assert_true(f->garment.position[3 * 4] == 200);
	assert_true(f->garment.pattern[2 * 6 + 1] == 100);
	assert_int_equal(f->garment.face_vertex[3 * 2 + 1], 4);
	assert_int_equal(f->garment.face_coord[3 * 2 + 1], 5);
}

static void writings_of_the_same_file_give_the_same_garment(void **state)
{
	struct fixture *f = *state;
	static const char *const writings[] = {
		SQUARE "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n",
		"# by hand\r\nmtllib none.mtl\r\n" SQUARE
		"vn 0 0 1\r\ns off\r\nf 1/1/1 2/2/1 3/3/1\r\n\r\nf 1/1/1 3/3/1 4/4/1",
		SQUARE "f -4/-4 -3/-3 -2/-2\nf -4/-4 -2/-2 -1/-1\n",
		SQUARE "f 1/1 \\\n 2/2 3/3\nf 1/1 3/3 4/4\n",
		"v 0 0 0 1 1 1\nv 1e2 0 0\nv +100.000 .1e3 0\nv 0 100 0 1\nvt 0 0 0\nvt 100 0 0\nvt 100 100\nvt 0 100\n"
		"f 1/1 2/2 3/3\n  f\t1/1 3/3 4/4  \n",
		"f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n" SQUARE,
		"\xef\xbb\xbf# C:\\suits\\\n" SQUARE "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n",
		SQUARE "f 1/1 2/2 3/3 # 4/4\n\t# f 1/1 2/2\nf 1/1 3/3 4/4 #\n",
	};
	for (size_t i = 0; i < sizeof writings / sizeof *writings; i++) {
		assert_imports(f, writings[i]);
		assert_int_equal(f->garment.vertex_count, 4);
		assert_memory_equal(f->garment.position, ((const double[]){0, 0, 0, 100, 0, 0, 100, 100, 0, 0, 100, 0}),
				    12 * sizeof(double));
		assert_memory_equal(f->garment.pattern, ((const double[]){0, 0, 100, 0, 100, 100, 0, 100}),
				    8 * sizeof(double));
		assert_memory_equal(f->garment.face_vertex, ((const uint32_t[]){0, 1, 2, 0, 2, 3}),
				    6 * sizeof(uint32_t));
		assert_memory_equal(f->garment.face_coord, ((const uint32_t[]){0, 1, 2, 0, 2, 3}),
				    6 * sizeof(uint32_t));
	}
}

static void bad_obj_files_are_refused_with_their_line(void **state)
{
	struct fixture *f = *state;
	static const struct {
		const char *text, *type, *where;
	} bad[] = {
		{"", "mesh-empty", ""},
		{"\n\n# nothing\n", "mesh-empty", ""},
		{SQUARE, "mesh-empty", ""},
		{"v 0 0 0\nv 1 x 0\n", "mesh-not-a-number", "line 2"},
		{"v 0 0 0\nv 1 nan 0\n", "mesh-not-a-number", "line 2"},
		{"v 0 0 0\nv 1 -inf 0\n", "mesh-not-a-number", "line 2"},
		{"v 0 0 0\nv 1e999 0 0\n", "mesh-not-a-number", "line 2"},
		{"v 0 0 0\nv 0x10 0 0\n", "mesh-not-a-number", "line 2"},
		{"v 0 0 0\nv 1 0\n", "mesh-bad-line", "line 2"},
		{SQUARE "vt 1\n", "mesh-bad-line", "line 9"},
		{SQUARE "f 1/1 2/2 5/3\n", "mesh-bad-index", "line 9"},
		{SQUARE "f 1/1 2/2 3/9\n", "mesh-bad-index", "line 9"},
		{SQUARE "f 1/1 2/2 0/3\n", "mesh-bad-index", "line 9"},
		{SQUARE "f 1/1 2/2 -5/3\n", "mesh-bad-index", "line 9"},
		{SQUARE "f 1/1 2/2 99999999999999999999/3\n", "mesh-bad-line", "line 9"},
		{SQUARE "f 1/1 2/2 3/\n", "mesh-mixed-coords", "line 9"},
		{SQUARE "f 1/1 2/2 3//\n", "mesh-mixed-coords", "line 9"},
		{SQUARE "f 1/1 2/2 3/3/ /\n", "mesh-bad-line", "line 9"},
		{SQUARE "f 1/1 2/2 /3\n", "mesh-bad-line", "line 9"},
		{SQUARE "f 1/1 2/2 3/3/x\n", "mesh-bad-line", "line 9"},
		{SQUARE "f 1/1 2/2 3/3/1/1\n", "mesh-bad-line", "line 9"},
		{SQUARE "f 1/1 2/2\n", "mesh-bad-face", "line 9"},
		{SQUARE "f 1/1 2/2 2/2\n", "mesh-degenerate-face", "line 9"},
		{SQUARE "f 1/1 2/2 3/3\nf 1 3 4\n", "mesh-mixed-coords", "line 10"},
		{SQUARE_V "f 1 2 3\n", "pattern-missing", ""},
		{SQUARE_V "f 1//1 2//1 3//1\nvn 0 0 1\n", "pattern-missing", ""},
		{"v 2e9 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n", "coordinate-too-large",
		 "vertex 0"},
		{SQUARE "v 50 50 90\nvt 500 500\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 1/1 3/3 5/5\n",
		 "mesh-non-manifold-edge", "face 2"},
		{SQUARE "f 1/1 2/2 3/3\nf 1/1 4/4 3/3\n", "mesh-flipped-face", "face 1, line 10"},
		{SQUARE_V "vt 0 0\nvt 100 0\nvt 100 100\nvt 99 10\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n",
		 "pattern-flipped-face", "face 1, line 10"},
		{SQUARE_V "vt 0 0\nvt 0 100\nvt 100 100\nvt 100 0\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n",
		 "pattern-mirrored-piece", "face 0, line 9"},
		{SQUARE_V "vt 0 0\nvt 100 0\nvt 100 100\nvt 50 50\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n", "pattern-zero-area",
		 "face 1, line 10"},
		{SQUARE_V "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n", "pattern-scale",
		 "pattern_unit"},
	};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		assert_int_equal(import_two(f, bad[i].text, NULL), TW_ERROR_INPUT);
		if (strcmp(f->error.type, bad[i].type) != 0 || strcmp(f->error.where, bad[i].where) != 0)
			fail_msg("row %zu: %s at \"%s\": %s", i, f->error.type, f->error.where, f->error.text);
		assert_true(strlen(f->error.text) > 10);
	}
}

static void zero_bytes_are_refused(void **state)
{
	struct fixture *f = *state;
	static const char text[] = "v 0 0 0\nv 1\0 0 0\n";
	struct garment_source source = {.bytes = text, .size = sizeof text, .format = MESH_OBJ};
	assert_int_equal(garment_import(&f->garment, f->arena, &source, NULL, &f->options, &f->report, &f->error),
			 TW_ERROR_INPUT);
	assert_string_equal(f->error.type, "mesh-not-text");
	assert_string_equal(f->error.where, "line 2");
}

/* Whatever is cut off: an error or a garment, and where a line is cut in the middle of a number of corners, an error.
 */
static void every_truncation_is_an_error_or_a_garment(void **state)
{
	struct fixture *f = *state;
	static const char text[] = TWO_PIECES;
	for (size_t size = 0; size < sizeof text - 1; size++) {
		char cut[sizeof text];
		memcpy(cut, text, size);
		cut[size] = '\0';
		enum tw_status status = import_two(f, cut, NULL);
		assert_true(status == TW_OK || (status == TW_ERROR_INPUT && f->error.type && f->error.text[0]));
		if (status == TW_OK)
			assert_true(f->garment.face_count >= 1);
	}
}

static void piece_that_overlaps_itself_is_refused(void **state)
{
	struct fixture *f = *state;
	/* eight faces of 60 degrees around a vertex: more than a full turn */
	char fan[2048];
	size_t size = 0;
	size += (size_t)snprintf(fan + size, sizeof fan - size, "v 0 0 0\nvt 0 0\n");
	for (int i = 0; i <= 8; i++)
		size += (size_t)snprintf(fan + size, sizeof fan - size, "v %.6f %.6f %d\nvt %.6f %.6f\n",
					 50 * cos(i * M_PI / 3), 50 * sin(i * M_PI / 3), 10 * i, 50 * cos(i * M_PI / 3),
					 50 * sin(i * M_PI / 3));
	for (int i = 0; i < 8; i++)
		size += (size_t)snprintf(fan + size, sizeof fan - size, "f 1/1 %d/%d %d/%d\n", i + 2, i + 2, i + 3,
					 i + 3);
	assert_int_equal(import_two(f, fan, NULL), TW_ERROR_INPUT);
	assert_string_equal(f->error.type, "pattern-overlaps-itself");
	assert_true(strstr(f->error.text, "faces 0 and 6") || strstr(f->error.text, "faces 1 and 7"));
}

static void pieces_on_each_other_are_a_warning(void **state)
{
	struct fixture *f = *state;
	assert_imports(f, SQUARE "v 200 0 0\nv 200 100 0\nvt 50 0\nvt 150 0\nvt 150 100\nvt 50 100\n"
				 "g left\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\ng right\nf 2/5 5/6 6/7\nf 2/5 6/7 3/8\n");
	assert_non_null(warning(f, "pieces-overlap"));
}

static void mirrored_piece_is_turned_on_request(void **state)
{
	struct fixture *f = *state;
	static const char text[] =
		SQUARE "v 200 0 0\nv 200 100 0\nvt 400 0\nvt 300 0\nvt 300 100\nvt 400 100\n"
		       "g left\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\ng right\nf 2/5 5/6 6/7\nf 2/5 6/7 3/8\n";
	assert_int_equal(import_two(f, text, NULL), TW_ERROR_INPUT);
	assert_string_equal(f->error.type, "pattern-mirrored-piece");
	f->options.mirrored_pieces = MIRRORED_TURN;
	assert_imports(f, text);
	assert_int_equal(warning(f, "pieces-turned")->place[0], 1);
	assert_memory_equal(f->garment.pattern + 8, ((const double[]){300, 0, 400, 0, 400, 100, 300, 100}),
			    8 * sizeof(double));
}

static void isolated_vertices_are_kept_and_reported(void **state)
{
	struct fixture *f = *state;
	assert_imports(f, SQUARE "v 1 2 3\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n");
	assert_int_equal(f->garment.vertex_count, 5);
	assert_int_equal(warning(f, "isolated-vertices")->count, 1);
	assert_int_equal(warning(f, "isolated-vertices")->place[0], 4);
}

static void unknown_lines_are_reported(void **state)
{
	struct fixture *f = *state;
	assert_imports(f, SQUARE "hello world\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n");
	assert_int_equal(warning(f, "lines-ignored")->place[0], 9);
}

static void names_come_from_groups_materials_or_objects(void **state)
{
	struct fixture *f = *state;
	static const struct {
		const char *left, *right, *name_left, *name_right;
	} rows[] = {
		{"g a\n", "g b\n", "a", "b"},
		{"g suit\nusemtl front panel\n", "usemtl back panel\n", "front panel", "back panel"},
		{"o x\ng suit\n", "o y\n", "x", "y"},
		{"g suit\n", "", "suit", "suit-2"},
		{"", "", "piece-1", "piece-2"},
		{"g \xff\n", "g \xc3\xa4rmel\n", "piece-1", "\xc3\xa4rmel"},
	};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		char text[2048];
		snprintf(text, sizeof text, "%s%sf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n%sf 2/5 5/6 6/7\nf 2/5 6/7 3/8\n",
			 SQUARE NEIGHBOUR, rows[i].left, rows[i].right);
		assert_imports(f, text);
		assert_string_equal(f->garment.piece_name[0], rows[i].name_left);
		assert_string_equal(f->garment.piece_name[1], rows[i].name_right);
	}
}

static void separate_pattern_is_matched_face_by_face(void **state)
{
	struct fixture *f = *state;
	assert_int_equal(import_two(f, SQUARE_V "v 200 0 0\nv 200 100 0\nf 1 2 3\nf 1 3 4\nf 2 5 6\nf 2 6 3\n",
				    SQUARE_V "v 300 0 0\nv 400 0 0\nv 400 100 0\nv 300 100 0\n"
					     "f 1 2 3\nf 1 3 4\nf 5 6 7\nf 5 7 8\n"),
			 TW_OK);
	assert_int_equal(f->report.seam_edges, 1);
	assert_int_equal(f->garment.coord_count, 8);
	assert_int_equal(f->garment.piece_count, 2);

	assert_int_equal(import_two(f, SQUARE_V "f 1 2 3\nf 1 3 4\n", SQUARE_V "f 1 2 3\n"), TW_ERROR_INPUT);
	assert_string_equal(f->error.type, "pattern-face-count");
	assert_int_equal(import_two(f, SQUARE_V "f 1 2 3\nf 1 3 4\n", SQUARE_V "f 1 2 3\nf 1 2 3 4\n"), TW_ERROR_INPUT);
	assert_string_equal(f->error.type, "pattern-face-differs");
	assert_int_equal(import_two(f, SQUARE_V "f 1 2 3\n", "v 0 0 0\nv 1 0 9\nv 1 1 0\nf 1 2 3\n"), TW_ERROR_INPUT);
	assert_string_equal(f->error.type, "pattern-not-flat");
	assert_int_equal(import_two(f, SQUARE_V "f 1 2 3\n", "v 0 0 0\nv 1 0\n"), TW_ERROR_INPUT);
	assert_string_equal(f->error.where, "pattern, line 2");
}

static void units_and_sheets_become_millimetres(void **state)
{
	struct fixture *f = *state;
	f->options.unit = UNIT_M;
	f->options.pattern_unit = UNIT_SHEET;
	f->options.sheet_width_mm = 200;
	f->options.sheet_height_mm = 100;
	assert_imports(f, "v 0 0 0\nv .1 0 0\nv .1 .1 0\nvt 0 0\nvt .5 0\nvt .5 1\nf 1/1 2/2 3/3\n");
	assert_true(fabs(f->garment.position[3] - 100) < 1e-12);
	assert_true(f->garment.pattern[2] == 100 && f->garment.pattern[5] == 100);
}

/* A square sheet of `side`, worn, with its pattern of `flat`. */
static void make_square(char text[512], double side, double flat)
{
	int size = 0;
	for (int i = 0; i < 4; i++)
		size += snprintf(text + size, 512 - (size_t)size, "v %g %g 0\n", i % 3 ? side : 0, i / 2 ? side : 0);
	for (int i = 0; i < 4; i++)
		size += snprintf(text + size, 512 - (size_t)size, "vt %g %g\n", i % 3 ? flat : 0, i / 2 ? flat : 0);
	snprintf(text + size, 512 - (size_t)size, "f 1/1 2/2 3/3 4/4\n");
}

/* A unit that cannot be right is named, and the one that is: before anything else, such as a thickness or a face. */
static void a_wrong_unit_is_named_with_the_right_one(void **state)
{
	struct fixture *f = *state;
	static const struct {
		double worn, flat;
		int unit, pattern_unit;
		const char *type, *hint;
	} rows[] = {
		{1.7, 1.6, UNIT_MM, UNIT_MM, "mesh-unit", "unit = m and pattern_unit = m"},
		{0.3, 0.3, UNIT_MM, UNIT_MM, "mesh-unit", "unit = m and pattern_unit = m"},
		{0.3, 300, UNIT_MM, UNIT_MM, "mesh-unit", "unit = m"},
		{30, 28, UNIT_MM, UNIT_MM, "mesh-unit", "unit = cm and pattern_unit = cm"},
		{1700, 1600, UNIT_M, UNIT_M, "mesh-unit", "unit = mm and pattern_unit = mm"},
		{1700, 1600, UNIT_CM, UNIT_CM, "mesh-unit", "unit = mm and pattern_unit = mm"},
		{170, 160, UNIT_M, UNIT_M, "mesh-unit", "unit = cm and pattern_unit = cm"},
		{1.7, 1.6, UNIT_CM, UNIT_CM, "mesh-unit", "unit = m and pattern_unit = m"},
		{1.7, 1.6, UNIT_M, UNIT_MM, "pattern-scale", "pattern_unit = m"},
		{1700, 160, UNIT_MM, UNIT_MM, "pattern-scale", "pattern_unit = cm"},
		{1700, 1600, UNIT_MM, UNIT_CM, "pattern-scale", "pattern_unit = mm"},
		{170, 1600, UNIT_MM, UNIT_MM, "pattern-scale", "unit = cm"},
		{4000, 380, UNIT_CM, UNIT_MM, "mesh-unit", "unit = mm"},
		{1700, 0.2, UNIT_MM, UNIT_MM, "pattern-scale", "pattern_unit = sheet"},
	};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		char text[512];
		f->options.unit = rows[i].unit;
		f->options.pattern_unit = rows[i].pattern_unit;
		make_square(text, rows[i].worn, rows[i].flat);
		assert_int_equal(import_two(f, text, NULL), TW_ERROR_INPUT);
		size_t length = strlen(f->error.text), hint = strlen(rows[i].hint);
		if (strcmp(f->error.type, rows[i].type) != 0 || length < hint ||
		    strcmp(f->error.text + length - hint, rows[i].hint) != 0)
			fail_msg("row %zu: %s: %s", i, f->error.type, f->error.text);
		assert_null(strstr(f->error.text, "e+0")); /* 2890000 mm2 are no 2.89e+06 */
		/* The place is the unit that the hint ends with. */
		if (!strcmp(rows[i].type, "pattern-scale")) {
			size_t place = strcspn(rows[i].hint, " ");
			assert_int_equal(strlen(f->error.where), place);
			assert_memory_equal(f->error.where, rows[i].hint, place);
		}
	}
}

/* 14 cm could be a suit in centimetres, or a glove: said, not refused. */
static void an_unusual_size_is_said(void **state)
{
	struct fixture *f = *state;
	char text[512];
	for (int i = 0; i < 3; i++) {
		static const double sides[] = {140, 1500, 4000};
		make_square(text, sides[i], sides[i]);
		assert_int_equal(import_two(f, text, NULL), TW_OK);
		assert_int_equal(warning(f, "size-unusual") != NULL, i != 1);
	}
	assert_non_null(strstr(warning(f, "size-unusual")->text, "4000 mm"));
}

static void polygons_are_cut_into_triangles(void **state)
{
	struct fixture *f = *state;
	assert_imports(f, SQUARE "f 1/1 2/2 3/3 4/4\n");
	assert_int_equal(f->garment.face_count, 2);
	assert_int_equal(f->report.polygon_count, 1);
	assert_int_equal(warning(f, "polygons-cut")->count, 1);
	/* an L of six corners: its inner corner, where a fan from the first would leave the polygon */
	assert_imports(f,
		       "v 0 0 0\nv 200 0 0\nv 200 100 0\nv 100 100 0\nv 100 200 0\nv 0 200 0\n"
		       "vt 0 0\nvt 200 0\nvt 200 100\nvt 100 100\nvt 100 200\nvt 0 200\nf 2/2 3/3 4/4 5/5 6/6 1/1\n");
	assert_int_equal(f->garment.face_count, 4);
	assert_true(fabs(f->report.pattern_area_mm2 - 30000) < 1e-9);
}

static const char unwelded[] = "v 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\n"
			       "v 100.01 0 0\nv 200 0 0\nv 200 100 0\nv 100.01 100 0\n" SQUARE_VT
			       "vt 300 0\nvt 400 0\nvt 400 100\nvt 300 100\n"
			       "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 5/5 6/6 7/7\nf 5/5 7/7 8/8\n";

static void doubled_vertices_are_welded_within_the_tolerance(void **state)
{
	struct fixture *f = *state;
	assert_imports(f, unwelded);
	assert_int_equal(f->report.component_count, 2);
	f->options.weld_mm = 0.1;
	assert_imports(f, unwelded);
	assert_int_equal(f->report.component_count, 1);
	assert_int_equal(f->report.seam_edges, 1);
	assert_int_equal(f->garment.vertex_count, 6);
	assert_int_equal(warning(f, "vertices-welded")->count, 2);
	assert_int_equal(garment_source_count(&f->garment), 8);
	/* a frame of the file's eight vertices moves the six */
	float frame[24], moved[18];
	for (int i = 0; i < 24; i++)
		frame[i] = (float)i;
	assert_ptr_equal(garment_frame(&f->garment, frame, moved), moved);
	assert_true(moved[3 * 4] == 15 && moved[3 * 5] == 18);
	f->options.weld_mm = 10;
	assert_int_equal(import_two(f, "v 0 0 0\nv 5 0 0\nv 0 500 0\nvt 0 0\nvt 5 0\nvt 0 500\nf 1/1 2/2 3/3\n", NULL),
			 TW_ERROR_INPUT);
	assert_string_equal(f->error.type, "weld-collapses-face");
}

static void open_seams_are_reported(void **state)
{
	struct fixture *f = *state;
	assert_imports(f, SQUARE
		       "v 100 0 0\nv 200 0 0\nv 200 100 0\nv 100 100 0\nvt 300 0\nvt 400 0\nvt 400 100\nvt 300 100\n"
		       "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 5/5 6/6 7/7\nf 5/5 7/7 8/8\n");
	assert_int_equal(warning(f, "seams-open")->count, 2);
}

/* Two panels of 300 mm, bent around a cylinder, that meet along a curve of `left` and `right` chords. */
static void make_panels(char *text, size_t room, int left, int right, double radius)
{
	size_t size = 0;
	int chords[2] = {left, right}, first[2] = {1, 1 + 2 * (left + 1)};
	for (int panel = 0; panel < 2; panel++) {
		for (int i = 0; i <= chords[panel]; i++) {
			double y = 300.0 * i / chords[panel], turn = radius > 0 ? y / radius : 0;
			for (int side = 0; side < 2; side++)
				size += (size_t)snprintf(text + size, room - size, "v %.9f %.9f %.9f\nvt %d %.9f\n",
							 100.0 * (panel + side), radius > 0 ? radius * sin(turn) : y,
							 radius > 0 ? radius * (1 - cos(turn)) : 0.0,
							 100 * (panel + side) + 20 * panel, y);
		}
	}
	for (int panel = 0; panel < 2; panel++) {
		for (int i = 0; i < chords[panel]; i++) {
			int a = first[panel] + 2 * i;
			size += (size_t)snprintf(text + size, room - size, "f %d/%d %d/%d %d/%d\nf %d/%d %d/%d %d/%d\n",
						 a, a, a + 1, a + 1, a + 3, a + 3, a, a, a + 3, a + 3, a + 2, a + 2);
		}
	}
}

/* Where the two sides of a seam have other vertices, what stays open is said with its length; curves too. */
static void a_seam_that_stays_open_is_reported_with_its_length(void **state)
{
	struct fixture *f = *state;
	char text[8192];
	f->options.weld_mm = 0.01;
	for (int curved = 0; curved < 2; curved++) {
		double radius = curved ? 300 : 0;
		make_panels(text, sizeof text, 8, 9, radius);
		assert_imports(f, text);
		assert_int_equal(f->report.seam_edges, 0);
		const struct warning *open = warning(f, "seams-open");
		assert_non_null(open);
		assert_int_equal(open->count, 8 + 9);
		const char *length = strstr(open->text, "for ");
		assert_non_null(length);
		assert_true(fabs(strtod(length + 4, NULL) - 300) < 3);
		make_panels(text, sizeof text, 8, 8, radius);
		assert_imports(f, text);
		assert_int_equal(f->report.seam_edges, 8);
		assert_null(warning(f, "seams-open"));
		/* a half of the vertices in common: sewn where edges coincide, which is nowhere here */
		make_panels(text, sizeof text, 4, 8, radius);
		assert_imports(f, text);
		assert_non_null(warning(f, "seams-open"));
	}
}

static void positions_written_once_a_corner_are_shared(void **state)
{
	struct fixture *f = *state;
	assert_imports(f, SQUARE "vt 0 0\nvt 100 100\nvt 0 100\nf 1/1 2/2 3/3\nf 1/5 3/6 4/7\n");
	assert_int_equal(f->report.inner_edges, 1);
	assert_int_equal(f->report.seam_edges, 0);
	assert_non_null(warning(f, "pattern-positions-shared"));
}

/* A sheet of 5 by 5 vertices, 20 mm apart, and the same one 1 mm below, facing down. */
static void two_layers_are_refused_with_advice(void **state)
{
	struct fixture *f = *state;
	char text[8192];
	size_t size = 0;
	for (int layer = 0; layer < 2; layer++) {
		for (int i = 0; i < 25; i++)
			size += (size_t)snprintf(text + size, sizeof text - size, "v %d %d %d\nvt %d %d\n", i % 5 * 20,
						 i / 5 * 20, -layer, layer ? 400 - i % 5 * 20 : i % 5 * 20, i / 5 * 20);
	}
	for (int layer = 0; layer < 2; layer++) {
		for (int i = 0; i < 16; i++) {
			int a = 25 * layer + i / 4 * 5 + i % 4 + 1, b = a + 1, c = a + 6, d = a + 5;
			size += (size_t)snprintf(text + size, sizeof text - size, "f %d/%d %d/%d %d/%d %d/%d\n", a, a,
						 layer ? d : b, layer ? d : b, c, c, layer ? b : d, layer ? b : d);
		}
	}
	assert_int_equal(import_two(f, text, NULL), TW_ERROR_INPUT);
	assert_string_equal(f->error.type, "mesh-has-thickness");
}

static void refined_garment_has_the_same_area_and_moves_with_the_file(void **state)
{
	struct fixture *f = *state;
	assert_imports(f, TWO_PIECES);
	double area = f->report.pattern_area_mm2;
	static const struct {
		int refinement;
		uint32_t levels, vertices, faces, seams;
	} rows[] = {{REFINE_MIDPOINT, 1, 6 + 9, 16, 2},
		    {REFINE_MIDPOINT, 2, 45, 64, 4},
		    {REFINE_CENTROID, 1, 6 + 4, 12, 1},
		    {REFINE_CENTROID, 2, 22, 36, 1}};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		f->options.refinement = rows[i].refinement;
		f->options.refine_levels = rows[i].levels;
		assert_imports(f, TWO_PIECES);
		const struct garment *g = &f->garment;
		assert_int_equal(g->vertex_count, rows[i].vertices);
		assert_int_equal(g->face_count, rows[i].faces);
		assert_int_equal(f->report.seam_edges, rows[i].seams);
		assert_int_equal(g->piece_count, 2);
		double sum = 0;
		for (uint32_t face = 0; face < g->face_count; face++) {
			const uint32_t *c = g->face_coord + 3 * face;
			const double *p = g->pattern + 2 * c[0], *q = g->pattern + 2 * c[1], *r = g->pattern + 2 * c[2];
			double cross = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
			assert_true(cross > 0);
			sum += cross / 2;
		}
		assert_true(fabs(sum - area) < 1e-9 * area);
		/* the file's own positions as a frame give the refined positions */
		assert_int_equal(garment_source_count(g), 6);
		static const float frame[18] = {0, 0, 0, 100, 0, 0, 100, 100, 0, 0, 100, 0, 200, 0, 0, 200, 100, 0};
		float moved[3 * 64];
		garment_frame(g, frame, moved);
		for (uint32_t k = 0; k < 3 * g->vertex_count; k++)
			assert_true(fabs((double)moved[k] - g->position[k]) < 1e-4);
	}
}

static void refined_garment_survives_storage(void **state)
{
	struct fixture *f = *state;
	f->options.refinement = REFINE_MIDPOINT;
	assert_imports(f, TWO_PIECES);
	struct tw_array arrays[GARMENT_ARRAYS];
	struct topology topology;
	size_t count = 0;
	assert_int_equal(topology_build(&topology, f->arena, &f->garment, &f->error), TW_OK);
	assert_int_equal(garment_to_arrays(&f->garment, &topology, f->arena, arrays, &count, &f->error), TW_OK);
	assert_int_equal(count, GARMENT_ARRAYS);
	struct garment again;
	assert_int_equal(garment_from_arrays(&again, f->arena, arrays, count, &f->error), TW_OK);
	assert_int_equal(garment_source_count(&again), 6);
	assert_ptr_equal(again.source_share, f->garment.source_share);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(two_pieces_meet_in_a_seam, setup, teardown),
		cmocka_unit_test_setup_teardown(writings_of_the_same_file_give_the_same_garment, setup, teardown),
		cmocka_unit_test_setup_teardown(bad_obj_files_are_refused_with_their_line, setup, teardown),
		cmocka_unit_test_setup_teardown(zero_bytes_are_refused, setup, teardown),
		cmocka_unit_test_setup_teardown(every_truncation_is_an_error_or_a_garment, setup, teardown),
		cmocka_unit_test_setup_teardown(piece_that_overlaps_itself_is_refused, setup, teardown),
		cmocka_unit_test_setup_teardown(pieces_on_each_other_are_a_warning, setup, teardown),
		cmocka_unit_test_setup_teardown(mirrored_piece_is_turned_on_request, setup, teardown),
		cmocka_unit_test_setup_teardown(isolated_vertices_are_kept_and_reported, setup, teardown),
		cmocka_unit_test_setup_teardown(unknown_lines_are_reported, setup, teardown),
		cmocka_unit_test_setup_teardown(names_come_from_groups_materials_or_objects, setup, teardown),
		cmocka_unit_test_setup_teardown(separate_pattern_is_matched_face_by_face, setup, teardown),
		cmocka_unit_test_setup_teardown(units_and_sheets_become_millimetres, setup, teardown),
		cmocka_unit_test_setup_teardown(a_wrong_unit_is_named_with_the_right_one, setup, teardown),
		cmocka_unit_test_setup_teardown(an_unusual_size_is_said, setup, teardown),
		cmocka_unit_test_setup_teardown(polygons_are_cut_into_triangles, setup, teardown),
		cmocka_unit_test_setup_teardown(doubled_vertices_are_welded_within_the_tolerance, setup, teardown),
		cmocka_unit_test_setup_teardown(open_seams_are_reported, setup, teardown),
		cmocka_unit_test_setup_teardown(a_seam_that_stays_open_is_reported_with_its_length, setup, teardown),
		cmocka_unit_test_setup_teardown(positions_written_once_a_corner_are_shared, setup, teardown),
		cmocka_unit_test_setup_teardown(two_layers_are_refused_with_advice, setup, teardown),
		cmocka_unit_test_setup_teardown(refined_garment_has_the_same_area_and_moves_with_the_file, setup,
						teardown),
		cmocka_unit_test_setup_teardown(refined_garment_survives_storage, setup, teardown),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
