/* PLY, OFF and STL, text and binary, give the garment that the same OBJ gives; what is damaged is an error. */
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
	unsigned char bytes[4096];
	size_t size;
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

/* A square of 100 mm, bent along its diagonal; its flat pattern. */
static const float corners[4][3] = {{0, 0, 0}, {100, 0, 20}, {100, 100, 0}, {0, 100, 20}};
static const int triangles[2][3] = {{0, 1, 2}, {0, 2, 3}};
static const char flat[] = "v 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\nf 1 2 3\nf 1 3 4\n";

static void add(struct fixture *f, const void *bytes, size_t size)
{
	memcpy(f->bytes + f->size, bytes, size);
	f->size += size;
}

static void add_text(struct fixture *f, const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	f->size += (size_t)vsnprintf((char *)f->bytes + f->size, sizeof f->bytes - f->size, format, arguments);
	va_end(arguments);
}

static void add_number(struct fixture *f, const void *number, size_t size, bool big)
{
	for (size_t i = 0; i < size; i++)
		add(f, (const unsigned char *)number + (big ? size - 1 - i : i), 1);
}

enum { ASCII, LITTLE, BIG };

/* Floats and 32-bit indexes in the big-endian file, doubles and 16-bit ones in the little-endian one. */
static void add_ply_vertex(struct fixture *f, int encoding, const float *corner)
{
	if (encoding == ASCII)
		add_text(f, "%g %g %g 7\n", (double)corner[0], (double)corner[1], (double)corner[2]);
	for (int axis = 0; axis < 3 && encoding == BIG; axis++)
		add_number(f, &corner[axis], 4, true);
	for (int axis = 0; axis < 3 && encoding == LITTLE; axis++)
		add_number(f, &(double){(double)corner[axis]}, 8, false);
	if (encoding != ASCII)
		add(f, "\7", 1);
}

static void add_ply_face(struct fixture *f, int encoding, const int *triangle)
{
	if (encoding == ASCII)
		add_text(f, "3 %d %d %d\n", triangle[0], triangle[1], triangle[2]);
	else
		add(f, "\3", 1);
	for (int k = 0; k < 3 && encoding == BIG; k++)
		add_number(f, &triangle[k], 4, true);
	for (int k = 0; k < 3 && encoding == LITTLE; k++)
		add_number(f, &(uint16_t){(uint16_t)triangle[k]}, 2, false);
}

static void make_ply(struct fixture *f, int encoding)
{
	static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
	const char *type = encoding == LITTLE ? "double" : "float", *index = encoding == LITTLE ? "ushort" : "int";
	f->size = 0;
	add_text(f, "ply\nformat %s 1.0\ncomment by hand\nelement vertex 4\nproperty %s x\nproperty %s y\n",
		 names[encoding], type, type);
	add_text(f,
		 "property %s z\nproperty uchar quality\nelement face 2\nproperty list uchar %s "
		 "vertex_indices\nend_header\n",
		 type, index);
	for (int v = 0; v < 4; v++)
		add_ply_vertex(f, encoding, corners[v]);
	for (int t = 0; t < 2; t++)
		add_ply_face(f, encoding, triangles[t]);
}

static void make_off(struct fixture *f)
{
	f->size = 0;
	add_text(f, "OFF\n# by hand\n4 2 5\n\n");
	for (int v = 0; v < 4; v++)
		add_text(f, "%g %g %g\n", (double)corners[v][0], (double)corners[v][1], (double)corners[v][2]);
	add_text(f, "3 0 1 2\n# between\n3 0 2 3\n");
}

static void make_stl(struct fixture *f, int encoding)
{
	f->size = 0;
	if (encoding == ASCII)
		add_text(f, "solid suit\n");
	else
		f->size = 80;
	memset(f->bytes + f->size, 0, 80);
	if (encoding != ASCII)
		add_number(f, &(uint32_t){2}, 4, false);
	for (int t = 0; t < 2; t++) {
		if (encoding == ASCII)
			add_text(f, "facet normal 0 0 1\n outer loop\n");
		else
			add(f, (const float[]){0, 0, 1}, 12);
		for (int k = 0; k < 3; k++) {
			const float *p = corners[triangles[t][k]];
			if (encoding == ASCII)
				add_text(f, "  vertex %g %g %g\n", (double)p[0], (double)p[1], (double)p[2]);
			else
				add(f, p, 12);
		}
		if (encoding == ASCII)
			add_text(f, " endloop\nendfacet\n");
		else
			add(f, "\0\0", 2);
	}
	if (encoding == ASCII)
		add_text(f, "endsolid suit\n");
}

static enum tw_status import_bytes(struct fixture *f, enum mesh_format format)
{
	/* a copy of just that size, so that a reader that goes beyond it is caught */
	unsigned char *copy = malloc(f->size ? f->size : 1);
	memcpy(copy, f->bytes, f->size);
	struct garment_source worn = {.bytes = copy, .size = f->size, .format = format};
	struct garment_source pattern = {.bytes = flat, .size = sizeof flat - 1, .name = "flat.OBJ"};
	memset(&f->error, 0, sizeof f->error);
	enum tw_status status =
		garment_import(&f->garment, f->arena, &worn, &pattern, &f->options, &f->report, &f->error);
	free(copy);
	return status;
}

static void assert_bent_square(struct fixture *f, enum mesh_format format)
{
	if (import_bytes(f, MESH_SNIFF) != TW_OK)
		fail_msg("%s: %s: %s", f->error.type, f->error.where, f->error.text);
	assert_int_equal(f->report.format, format);
	assert_int_equal(f->garment.vertex_count, 4);
	for (int i = 0; i < 12; i++)
		assert_true(f->garment.position[i] == (double)corners[i / 3][i % 3]);
	assert_memory_equal(f->garment.face_vertex, ((const uint32_t[]){0, 1, 2, 0, 2, 3}), 6 * sizeof(uint32_t));
	assert_int_equal(f->report.inner_edges, 1);
}

static void every_format_gives_the_same_garment(void **state)
{
	struct fixture *f = *state;
	for (int encoding = ASCII; encoding <= BIG; encoding++) {
		make_ply(f, encoding);
		assert_bent_square(f, MESH_PLY);
	}
	make_off(f);
	assert_bent_square(f, MESH_OFF);
	make_stl(f, ASCII);
	assert_bent_square(f, MESH_STL);
	make_stl(f, LITTLE);
	assert_bent_square(f, MESH_STL);
}

static void every_truncation_of_the_body_is_refused(void **state)
{
	struct fixture *f = *state;
	for (int kind = 0; kind < 6; kind++) {
		enum mesh_format format = kind < 3 ? MESH_PLY : kind == 3 ? MESH_OFF : MESH_STL;
		if (kind < 3)
			make_ply(f, kind);
		else if (kind == 3)
			make_off(f);
		else
			make_stl(f, kind - 4);
		size_t whole = f->size;
		/* text may lose its last line end or STL its last line, and a last index its second digit, which none
		 * has */
		size_t least = kind == 4 ? 16 : kind == 0 || kind == 3 ? 2 : 0;
		for (size_t size = 0; size + least < whole; size++) {
			f->size = size;
			if (import_bytes(f, format) == TW_OK)
				fail_msg("format %d: the first %zu of %zu bytes were accepted", kind, size, whole);
			assert_non_null(f->error.type);
			assert_true(f->error.text[0]);
		}
	}
}

static void bad_files_are_refused_with_their_place(void **state)
{
	struct fixture *f = *state;
	static const struct {
		enum mesh_format format;
		const char *text, *type, *where;
	} bad[] = {
		{MESH_PLY,
		 "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
		 "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n",
		 "mesh-too-large", ""},
		{MESH_PLY,
		 "ply\nformat ascii 1.0\nelement vertex 3000000\nproperty float x\nproperty float y\n"
		 "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n1 2 3\n",
		 "mesh-truncated", ""},
		{MESH_PLY,
		 "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
		 "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
		 "1 nan 3\n3 0 0 0\n",
		 "mesh-not-a-number", "vertex 0"},
		{MESH_PLY,
		 "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
		 "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
		 "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
		 "mesh-bad-index", "face 0"},
		{MESH_PLY,
		 "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
		 "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
		 "0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n",
		 "mesh-bad-face", "face 0"},
		{MESH_PLY,
		 "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
		 "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
		 "0 0 0\n1 0 0\n0 1 0\n3 0 1 1\n",
		 "mesh-degenerate-face", "face 0"},
		{MESH_PLY, "ply\nformat xml 1.0\n", "mesh-bad-header", "line 2"},
		{MESH_PLY, "ply\nformat ascii 1.0\nelement face 1\n", "mesh-bad-header", "line 3"},
		{MESH_PLY, "ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar float x\n", "mesh-bad-header",
		 "line 4"},
		{MESH_OFF, "OFF\n4000000 1 0\n0 0 0\n", "mesh-truncated", ""},
		{MESH_OFF, "OFF\n3 1 0\n0 0 0\n1 0 0\n0.0000 1.0000 0.0000\n", "mesh-truncated", "line 5"},
		{MESH_OFF, "OFF\n4000001 1 0\n0 0 0\n", "mesh-too-large", ""},
		{MESH_OFF, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n\n3 0 2 1\n", "mesh-trailing-bytes", "line 8"},
		{MESH_PLY,
		 "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
		 "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
		 "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 2 1\n",
		 "mesh-trailing-bytes", ""},
		{MESH_OFF, "OFF BINARY\n", "mesh-bad-header", "line 1"},
		{MESH_OFF, "OFF\n3 1 0 0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "mesh-bad-header", "line 2"},
		{MESH_OFF, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0 1.0000000\n", "mesh-bad-line", "line 5"},
		{MESH_OFF, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 inf 0.000000\n", "mesh-not-a-number", "line 5"},
		{MESH_OFF, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -2\n", "mesh-bad-index", "line 6"},
		{MESH_STL, "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0\n",
		 "mesh-not-a-number", "line 6"},
		{MESH_STL,
		 "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 0 0\nendloop\n"
		 "endfacet\nendsolid\n",
		 "mesh-degenerate-face", "face 0"},
		{MESH_STL, "not an stl", "mesh-truncated", ""},
	};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		f->size = 0;
		add_text(f, "%s", bad[i].text);
		assert_int_not_equal(import_bytes(f, bad[i].format), TW_OK);
		if (strcmp(f->error.type, bad[i].type) != 0 || strcmp(f->error.where, bad[i].where) != 0)
			fail_msg("row %zu: %s at \"%s\": %s", i, f->error.type, f->error.where, f->error.text);
	}
}

static void binary_stl_with_nan_or_a_false_count_is_refused(void **state)
{
	struct fixture *f = *state;
	make_stl(f, LITTLE);
	memcpy(f->bytes + 84 + 12, &(float){NAN}, 4);
	assert_int_equal(import_bytes(f, MESH_STL), TW_ERROR_INPUT);
	assert_string_equal(f->error.type, "mesh-not-a-number");
	make_stl(f, LITTLE);
	f->bytes[83] = 6; /* a hundred million triangles, five gigabytes */
	assert_int_equal(import_bytes(f, MESH_STL), TW_ERROR_INPUT);
	assert_string_equal(f->error.type, "mesh-truncated");
}

/* Tools that cannot store a seam write its vertices twice; the texture coordinates are then those of vertices. */
static void ply_with_texture_coordinates_needs_no_pattern(void **state)
{
	struct fixture *f = *state;
	static const char text[] =
		"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
		"property float s\nproperty float t\nelement face 2\n"
		"property list uchar uint vertex_indices\nend_header\n"
		"0 0 0 0 0\n100 0 0 100 0\n100 100 0 100 100\n0 100 0 0 100\n3 0 1 2\n3 0 2 3\n";
	struct garment_source worn = {.bytes = text, .size = sizeof text - 1};
	enum tw_status status = garment_import(&f->garment, f->arena, &worn, NULL, &f->options, &f->report, &f->error);
	if (status != TW_OK)
		fail_msg("%s: %s", f->error.type, f->error.text);
	assert_memory_equal(f->garment.pattern, ((const double[]){0, 0, 100, 0, 100, 100, 0, 100}), 8 * sizeof(double));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(every_format_gives_the_same_garment, setup, teardown),
		cmocka_unit_test_setup_teardown(every_truncation_of_the_body_is_refused, setup, teardown),
		cmocka_unit_test_setup_teardown(bad_files_are_refused_with_their_place, setup, teardown),
		cmocka_unit_test_setup_teardown(binary_stl_with_nan_or_a_false_count_is_refused, setup, teardown),
		cmocka_unit_test_setup_teardown(ply_with_texture_coordinates_needs_no_pattern, setup, teardown),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
