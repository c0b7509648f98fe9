/* One garment as tools of many kinds write it: line ends, marks, case, blanks, backslashes, slashes, positions written
 * per corner. All of them must give the garment of the plain file, bit by bit or within the last digit. */
#include "solver/garment/import.h"

#include <ctype.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 4, BYTES = 1 << 16 };

struct file {
	char bytes[BYTES];
	size_t size;
};

struct fixture {
	struct arena *arena;
	struct file worn, flat;
	struct garment garment;
	struct garment_report report;
	struct tw_error error;
};

static int setup(void **state)
{
	struct fixture *f = calloc(1, sizeof *f);
	f->arena = arena_new(0);
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

static void add(struct file *file, const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	file->size += (size_t)vsnprintf(file->bytes + file->size, BYTES - file->size, format, arguments);
	va_end(arguments);
	assert_true(file->size < BYTES);
}

/* Two panels of SIDE by SIDE vertices, 100 mm apart, sewn along a column: vertex numbers of the worn sheet, and
 * positions of the pattern, on which the right panel lies 50 mm further right. */
enum {
	COLUMNS = 2 * SIDE - 1,
	VERTICES = COLUMNS * SIDE,
	COORDS = 2 * SIDE * SIDE,
	FACES = 4 * (SIDE - 1) * (SIDE - 1)
};

static double worn_at(int v, int axis)
{
	double x = 100 * (v % COLUMNS), y = 100 * (v / COLUMNS);
	return axis == 0 ? x : axis == 1 ? y : 0.0005 * x * x + 0.125 * v;
}

/* The right panel turned over the left one at their seam. */
static bool mirrored;

static double flat_at(int coord, int axis)
{
	int panel = coord / (SIDE * SIDE), i = coord % (SIDE * SIDE);
	if (mirrored && panel == 1 && axis == 0)
		return 100.0 * (SIDE - 1) - 100.0 * (i % SIDE);
	return axis == 0 ? 100.0 * (i % SIDE + panel * (SIDE - 1)) + 50 * panel : axis == 1 ? 100.0 * (i / SIDE) : 0;
}

/* The corners of a face: vertices of the worn sheet, and positions of the pattern. */
static void face_at(int face, int vertex[3], int coord[3])
{
	int panel = face / (FACES / 2), i = face % (FACES / 2), square = i / 2;
	int column = square % (SIDE - 1), row = square / (SIDE - 1);
	static const int corners[2][3][2] = {{{0, 0}, {1, 0}, {1, 1}}, {{0, 0}, {1, 1}, {0, 1}}};
	for (int k = 0; k < 3; k++) {
		int x = column + corners[i % 2][k][0], y = row + corners[i % 2][k][1];
		coord[k] = panel * SIDE * SIDE + y * SIDE + x;
		vertex[k] = y * COLUMNS + x + panel * (SIDE - 1);
	}
}

static const char *panel_name(int face)
{
	return face < FACES / 2 ? "front" : "back";
}

/* `corner`: how a corner is written, from vertex and position, both from 1. */
static void write_obj(struct file *file, const char *corner, bool names)
{
	file->size = 0;
	add(file, "# by hand\n");
	for (int v = 0; v < VERTICES; v++)
		add(file, "v %.9g %.9g %.9g\n", worn_at(v, 0), worn_at(v, 1), worn_at(v, 2));
	for (int c = 0; c < COORDS; c++)
		add(file, "vt %.9g %.9g\n", flat_at(c, 0), flat_at(c, 1));
	for (int i = 0; i < FACES; i++) {
		int vertex[3], coord[3];
		face_at(i, vertex, coord);
		if (names && i % (FACES / 2) == 0)
			add(file, "g %s\n", panel_name(i));
		add(file, "f");
		for (int k = 0; k < 3; k++)
			add(file, corner, vertex[k] + 1, coord[k] + 1);
		add(file, "\n");
	}
}

static void write_flat_obj(struct file *file)
{
	file->size = 0;
	for (int c = 0; c < COORDS; c++)
		add(file, "v %.9g %.9g 0\n", flat_at(c, 0), flat_at(c, 1));
	for (int i = 0; i < FACES; i++) {
		int vertex[3], coord[3];
		face_at(i, vertex, coord);
		if (i % (FACES / 2) == 0)
			add(file, "g %s\n", panel_name(i));
		add(file, "f %d %d %d\n", coord[0] + 1, coord[1] + 1, coord[2] + 1);
	}
}

/* PLY and OFF of the worn sheet, or of the flat one. */
static void write_counted(struct file *file, bool ply, bool flat)
{
	int vertices = flat ? COORDS : VERTICES;
	file->size = 0;
	if (ply)
		add(file,
		    "ply\nformat ascii 1.0\ncomment by hand\nelement vertex %d\nproperty float x\nproperty float y\n"
		    "property float z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n",
		    vertices, FACES);
	else
		add(file, "OFF\n%d %d 0\n", vertices, FACES);
	for (int v = 0; v < vertices; v++)
		add(file, "%.9g %.9g %.9g\n", flat ? flat_at(v, 0) : worn_at(v, 0),
		    flat ? flat_at(v, 1) : worn_at(v, 1), flat ? 0 : worn_at(v, 2));
	for (int i = 0; i < FACES; i++) {
		int vertex[3], coord[3];
		face_at(i, vertex, coord);
		const int *corner = flat ? coord : vertex;
		add(file, "3 %d %d %d\n", corner[0], corner[1], corner[2]);
	}
}

static void write_stl(struct file *file, bool flat)
{
	file->size = 0;
	add(file, "solid sheet\n");
	for (int i = 0; i < FACES; i++) {
		int vertex[3], coord[3];
		face_at(i, vertex, coord);
		add(file, " facet normal 0 0 1\n  outer loop\n");
		for (int k = 0; k < 3; k++)
			add(file, "   vertex %.9g %.9g %.9g\n", flat ? flat_at(coord[k], 0) : worn_at(vertex[k], 0),
			    flat ? flat_at(coord[k], 1) : worn_at(vertex[k], 1), flat ? 0 : worn_at(vertex[k], 2));
		add(file, "  endloop\n endfacet\n");
	}
	add(file, "endsolid sheet\n");
}

/* --- what tools do to a text -------------------------------------------------------------------- */

enum change { PLAIN, MARK, CRLF, CARRIAGE, UPPER, BLANKS, NO_LAST_LINE_END, CHANGES };

static void change_text(struct file *file, enum change change, bool keywords_only)
{
	static struct file from;
	from = *file;
	file->size = 0;
	if (change == MARK)
		add(file, "\xef\xbb\xbf");
	bool first_word = true;
	for (size_t i = 0; i < from.size; i++) {
		char c = from.bytes[i];
		if (c == '\n' && change == NO_LAST_LINE_END && i + 1 == from.size)
			break;
		if (c == '\n')
			add(file, change == CRLF       ? "\r\n"
				  : change == CARRIAGE ? "\r"
				  : change == BLANKS   ? " \t\n\t"
						       : "\n");
		else if (c == ' ' && change == BLANKS)
			add(file, " \t ");
		else
			add(file, "%c", change == UPPER && (first_word || !keywords_only) ? toupper(c) : c);
		first_word = c == '\n' || (first_word && c != ' ');
	}
}

static void import(struct fixture *f, enum mesh_format format, bool two, const struct import_options *changed)
{
	struct import_options options;
	option_defaults(&import_option_table, &options);
	/* of just that size, so that a reader that goes beyond it is caught */
	char *worn = malloc(f->worn.size), *flat = malloc(f->flat.size + 1);
	memcpy(worn, f->worn.bytes, f->worn.size);
	memcpy(flat, f->flat.bytes, f->flat.size);
	struct garment_source source[2] = {{worn, f->worn.size, format, NULL}, {flat, f->flat.size, format, NULL}};
	enum tw_status status = garment_import(&f->garment, f->arena, &source[0], two ? &source[1] : NULL,
					       changed ? changed : &options, &f->report, &f->error);
	free(worn);
	free(flat);
	if (status != TW_OK)
		fail_msg("format %d: %s at \"%s\": %s", format, f->error.type, f->error.where, f->error.text);
}

/* The garment of the generator, whatever the numbers of positions. `slack` in mm. */
static void assert_is_the_garment(const struct fixture *f, bool own_vertices, double slack)
{
	const struct garment *g = &f->garment;
	assert_int_equal(g->face_count, FACES);
	assert_int_equal(g->piece_count, 2);
	assert_int_equal(f->report.seam_edges, SIDE - 1);
	if (!own_vertices)
		assert_int_equal(g->vertex_count, VERTICES);
	for (int i = 0; i < FACES; i++) {
		int vertex[3], coord[3];
		face_at(i, vertex, coord);
		for (size_t k = 0; k < 3; k++) {
			const double *x = g->position + 3 * (size_t)g->face_vertex[3 * (size_t)i + k];
			const double *u = g->pattern + 2 * (size_t)g->face_coord[3 * (size_t)i + k];
			if (!own_vertices)
				assert_int_equal(g->face_vertex[3 * (size_t)i + k], vertex[k]);
			for (int axis = 0; axis < 3; axis++)
				assert_true(fabs(x[axis] - worn_at(vertex[k], axis)) < 1e-4);
			for (int axis = 0; axis < 2; axis++)
				assert_true(fabs(u[axis] - flat_at(coord[k], axis)) <= slack);
		}
	}
}

static void assert_names(const struct fixture *f)
{
	assert_string_equal(f->garment.piece_name[0], "front");
	assert_string_equal(f->garment.piece_name[1], "back");
}

static void every_text_is_read_however_its_lines_are_written(void **state)
{
	struct fixture *f = *state;
	static const enum mesh_format formats[] = {MESH_OBJ, MESH_PLY, MESH_OFF, MESH_STL};
	for (size_t format = 0; format < 4; format++) {
		for (int change = 0; change < CHANGES; change++) {
			for (int sniff = 0; sniff < 2; sniff++) {
				if (formats[format] == MESH_OBJ) {
					write_obj(&f->worn, " %d", true);
					write_flat_obj(&f->flat);
				} else if (formats[format] == MESH_STL) {
					write_stl(&f->worn, false);
					write_stl(&f->flat, true);
				} else {
					write_counted(&f->worn, formats[format] == MESH_PLY, false);
					write_counted(&f->flat, formats[format] == MESH_PLY, true);
				}
				change_text(&f->worn, (enum change)change, formats[format] == MESH_OBJ);
				change_text(&f->flat, (enum change)change, formats[format] == MESH_OBJ);
				import(f, sniff ? MESH_SNIFF : formats[format], true, NULL);
				assert_int_equal(f->report.format, formats[format]);
				assert_is_the_garment(f, formats[format] == MESH_STL, 1e-4);
				if (formats[format] == MESH_OBJ)
					assert_names(f);
			}
		}
	}
}

static void corners_of_an_obj_may_have_slashes_with_nothing_behind_them(void **state)
{
	struct fixture *f = *state;
	static const char *const bare[] = {" %d", " %d/", " %d//", " %d//%d"};
	static const char *const whole[] = {" %d/%d", " %d/%d/", " %d/%d/7"};
	for (size_t i = 0; i < sizeof bare / sizeof *bare; i++) {
		write_obj(&f->worn, bare[i], true);
		write_flat_obj(&f->flat);
		import(f, MESH_OBJ, true, NULL);
		assert_is_the_garment(f, false, 1e-4);
	}
	for (size_t i = 0; i < sizeof whole / sizeof *whole; i++) {
		write_obj(&f->worn, whole[i], true);
		import(f, MESH_OBJ, false, NULL);
		assert_is_the_garment(f, false, 1e-4);
		assert_names(f);
	}
}

/* Inserts `line` before the first line that begins with `before`. */
static void insert(struct file *file, const char *line, const char *before)
{
	char *at = strstr(file->bytes, before);
	assert_non_null(at);
	size_t size = strlen(line);
	memmove(at + 1 + size, at + 1, file->size - (size_t)(at + 1 - file->bytes) + 1);
	memcpy(at + 1, line, size);
	file->size += size;
}

/* The byte 0x5c ends Japanese and Chinese names, and paths of folders. */
static void a_backslash_at_the_end_of_a_name_or_comment_joins_nothing(void **state)
{
	struct fixture *f = *state;
	static const char *const lines[] = {"usemtl lib\\Fabric\\\n", "usemtl \x83\x5c\n", "o C:\\suits\\\n",
					    "mtllib C:\\\n",          "# C:\\suits\\\n",   "usemtl a\\\r\n",
					    "g front\n# \\\n"};
	for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) {
		write_obj(&f->worn, " %d/%d", true);
		insert(&f->worn, lines[i], "\nf ");
		import(f, MESH_OBJ, false, NULL);
		assert_is_the_garment(f, false, 1e-4);
		assert_names(f);
	}
	write_counted(&f->worn, true, false);
	write_counted(&f->flat, true, true);
	insert(&f->worn, "comment C:\\suits\\\n", "\nelement vertex");
	insert(&f->flat, "obj_info C:\\suits\\\n", "\nelement face");
	import(f, MESH_PLY, true, NULL);
	assert_is_the_garment(f, false, 1e-4);
	write_stl(&f->worn, false);
	write_stl(&f->flat, true);
	memcpy(f->worn.bytes, "solid C:\\s\\", 11);
	import(f, MESH_STL, true, NULL);
	assert_is_the_garment(f, true, 1e-4);
	write_counted(&f->worn, false, false);
	write_counted(&f->flat, false, true);
	insert(&f->worn, "# C:\\suits\\\n", "\n28 36 0");
	import(f, MESH_OFF, true, NULL);
	assert_is_the_garment(f, false, 1e-4);
}

/* Data that is too long for a line still goes on in the next. */
static void a_backslash_joins_lines_of_data(void **state)
{
	struct fixture *f = *state;
	write_obj(&f->worn, " %d/%d", true);
	for (char *at = f->worn.bytes; (at = strstr(at, "\nf ")) && f->worn.size + 2 < BYTES; at += 3) {
		memmove(at + 4, at + 2, f->worn.size - (size_t)(at + 2 - f->worn.bytes) + 1);
		memcpy(at + 2, "\\\n", 2);
		f->worn.size += 2;
	}
	import(f, MESH_OBJ, false, NULL);
	assert_is_the_garment(f, false, 1e-4);
}

/* --- positions written per corner ----------------------------------------------------------------- */

static double off_by_a_digit(double value, double digit)
{
	return value + digit * (rand() % 3 - 1);
}

static void write_corner_obj(struct file *file, double digit)
{
	file->size = 0;
	for (int v = 0; v < VERTICES; v++)
		add(file, "v %.9g %.9g %.9g\n", worn_at(v, 0), worn_at(v, 1), worn_at(v, 2));
	for (int i = 0; i < FACES; i++) {
		int vertex[3], coord[3];
		face_at(i, vertex, coord);
		for (int k = 0; k < 3; k++)
			add(file, "vt %.9f %.9f\n", off_by_a_digit(flat_at(coord[k], 0), digit),
			    off_by_a_digit(flat_at(coord[k], 1), digit));
		add(file, "f %d/%d %d/%d %d/%d\n", vertex[0] + 1, 3 * i + 1, vertex[1] + 1, 3 * i + 2, vertex[2] + 1,
		    3 * i + 3);
	}
}

static void write_wedge_ply(struct file *file, double digit, bool binary)
{
	file->size = 0;
	add(file,
	    "ply\nformat %s 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
	    "element face %d\nproperty list uchar float texcoord\nproperty list uchar int vertex_indices\n"
	    "property list uchar short rest\nproperty int texnumber\nend_header\n",
	    binary ? "binary_little_endian" : "ascii", VERTICES, FACES);
	for (int v = 0; v < VERTICES; v++) {
		float x[3] = {(float)worn_at(v, 0), (float)worn_at(v, 1), (float)worn_at(v, 2)};
		if (!binary)
			add(file, "%.9g %.9g %.9g\n", (double)x[0], (double)x[1], (double)x[2]);
		else
			memcpy(file->bytes + file->size, x, sizeof x), file->size += sizeof x;
	}
	for (int i = 0; i < FACES; i++) {
		int vertex[3], coord[3];
		float uv[6];
		face_at(i, vertex, coord);
		for (int j = 0; j < 6; j++)
			uv[j] = (float)off_by_a_digit(flat_at(coord[j / 2], j % 2), digit);
		if (!binary) {
			add(file, "6 %.7g %.7g %.7g %.7g %.7g %.7g 3 %d %d %d 2 8 9 0\n", (double)uv[0], (double)uv[1],
			    (double)uv[2], (double)uv[3], (double)uv[4], (double)uv[5], vertex[0], vertex[1],
			    vertex[2]);
			continue;
		}
		char *at = file->bytes + file->size;
		*at++ = 6;
		at = (char *)memcpy(at, uv, sizeof uv) + sizeof uv;
		*at++ = 3;
		at = (char *)memcpy(at, vertex, sizeof vertex) + sizeof vertex;
		at = (char *)memcpy(at, "\1\2\3\0\0\0\0", 7) + 7;
		file->size = (size_t)(at - file->bytes);
	}
}

/* The flat pattern as a mesh of its own in which no face shares a vertex with another. */
static void write_corner_flat(struct file *file, bool ply, double digit)
{
	file->size = 0;
	if (ply)
		add(file,
		    "ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
		    "element face %d\nproperty list uchar int vertex_indices\nend_header\n",
		    3 * FACES, FACES);
	else
		add(file, "OFF\n%d %d 0\n", 3 * FACES, FACES);
	for (int i = 0; i < 3 * FACES; i++) {
		int vertex[3], coord[3];
		face_at(i / 3, vertex, coord);
		add(file, "%.7g %.7g 0\n", off_by_a_digit(flat_at(coord[i % 3], 0), digit),
		    off_by_a_digit(flat_at(coord[i % 3], 1), digit));
	}
	for (int i = 0; i < FACES; i++)
		add(file, "3 %d %d %d\n", 3 * i, 3 * i + 1, 3 * i + 2);
}

static void positions_per_corner_are_one_but_for_the_last_digit(void **state)
{
	struct fixture *f = *state;
	static const double digits[] = {0, 1e-6, 1e-4, 5e-3};
	srand(5);
	for (size_t i = 0; i < sizeof digits / sizeof *digits; i++) {
		write_corner_obj(&f->worn, digits[i]);
		import(f, MESH_OBJ, false, NULL);
		assert_is_the_garment(f, false, 3 * digits[i] + 1e-4);
		for (int binary = 0; binary < 2; binary++) {
			write_wedge_ply(&f->worn, digits[i], binary);
			import(f, MESH_PLY, false, NULL);
			assert_is_the_garment(f, false, 3 * digits[i] + 1e-3);
			write_counted(&f->worn, binary, false);
			write_corner_flat(&f->flat, binary, digits[i]);
			import(f, binary ? MESH_PLY : MESH_OFF, true, NULL);
			assert_is_the_garment(f, false, 3 * digits[i] + 1e-3);
		}
	}
}

/* In what order they stand does not choose the position that all take. */
static void shared_positions_do_not_depend_on_the_order_of_faces(void **state)
{
	struct fixture *f = *state;
	static double first[FACES][3][2];
	srand(6);
	write_corner_obj(&f->worn, 5e-3);
	import(f, MESH_OBJ, false, NULL);
	for (size_t i = 0; i < FACES * 3; i++)
		memcpy(first[i / 3][i % 3], f->garment.pattern + 2 * (size_t)f->garment.face_coord[i],
		       sizeof first[0][0]);
	/* each face is its three `vt` and its `f`: the last face first */
	static struct file turned;
	char *faces = strstr(f->worn.bytes, "vt ");
	turned.size = 0;
	add(&turned, "%.*s", (int)(faces - f->worn.bytes), f->worn.bytes);
	for (char *end = f->worn.bytes + f->worn.size; end > faces;) {
		char *at = end;
		for (int lines = 0; at > faces && lines <= 4; at--)
			lines += at[-1] == '\n' && at < end;
		at += at > faces ? 2 : 0;
		for (char *line = at; line < end; line = strchr(line, '\n') + 1) {
			int v[3], t[3];
			if (sscanf(line, "f %d/%d %d/%d %d/%d", &v[0], &t[0], &v[1], &t[1], &v[2], &t[2]) == 6)
				add(&turned, "f %d/-3 %d/-2 %d/-1\n", v[0], v[1], v[2]);
			else
				add(&turned, "%.*s\n", (int)strcspn(line, "\n"), line);
		}
		end = at;
	}
	f->worn = turned;
	import(f, MESH_OBJ, false, NULL);
	assert_int_equal(f->garment.face_count, FACES);
	for (size_t i = 0; i < FACES * 3; i++)
		assert_memory_equal(first[FACES - 1 - i / 3][i % 3],
				    f->garment.pattern + 2 * (size_t)f->garment.face_coord[i], sizeof first[0][0]);
}

static void wedges_that_do_not_fit_their_face_are_errors(void **state)
{
	struct fixture *f = *state;
	struct import_options options;
	static const char *const faces[][2] = {{"4 0 0 1 0 3 0 1 2", "mesh-mixed-coords"},
					       {"0 3 0 1 2", "mesh-mixed-coords"},
					       {"6 0 0 100 0 100 nan 3 0 1 2", "mesh-not-a-number"},
					       {"6 0 0 100 0 100 100", "mesh-truncated"}};
	option_defaults(&import_option_table, &options);
	for (size_t i = 0; i < sizeof faces / sizeof *faces; i++) {
		f->worn.size = 0;
		add(&f->worn,
		    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
		    "element face 1\nproperty list uchar float texcoord\nproperty list uchar int vertex_indices\n"
		    "end_header\n0 0 0\n100 0 0\n100 100 0\n%s\n",
		    faces[i][0]);
		struct garment_source source = {f->worn.bytes, f->worn.size, MESH_PLY, NULL};
		assert_int_equal(garment_import(&f->garment, f->arena, &source, NULL, &options, &f->report, &f->error),
				 TW_ERROR_INPUT);
		assert_string_equal(f->error.type, faces[i][1]);
	}
}

/* As game art lays its halves: the seam's positions are shared, and nothing but the directions tells two pieces. */
static void pieces_that_lie_mirrored_on_each_other_are_named(void **state)
{
	struct fixture *f = *state;
	struct import_options options;
	option_defaults(&import_option_table, &options);
	mirrored = true;
	for (int variant = 0; variant < 6; variant++) {
		bool two = variant >= 4, names = variant != 1 && variant != 5;
		options.mirrored_pieces = variant == 2 ? MIRRORED_TURN : MIRRORED_REFUSE;
		options.refinement = variant == 3 ? REFINE_MIDPOINT : REFINE_NONE;
		write_obj(&f->worn, two ? " %d" : " %d/%d", names);
		if (two && variant == 4)
			write_flat_obj(&f->flat);
		else if (two)
			write_counted(&f->flat, true, true);
		struct garment_source source[2] = {{f->worn.bytes, f->worn.size, MESH_SNIFF, NULL},
						   {f->flat.bytes, f->flat.size, MESH_SNIFF, NULL}};
		assert_int_equal(garment_import(&f->garment, f->arena, &source[0], two ? &source[1] : NULL, &options,
						&f->report, &f->error),
				 TW_ERROR_INPUT);
		assert_string_equal(f->error.type, "pieces-on-each-other");
		if (names && (!strstr(f->error.text, "front and back") || !strstr(f->error.text, "move one")))
			fail_msg("%s", f->error.text);
	}
	mirrored = false;
}

/* What is no mesh is told what meshes look like, or what it is. */
static void what_is_no_mesh_is_told_so(void **state)
{
	struct fixture *f = *state;
	static const struct {
		const char *bytes, *says;
		size_t size; /* 0: that of the string */
	} rows[] = {
		{"Dear team,\n\nplease find the suit attached.\n", "begin with v", 0},
		{"# Suit\n\nv for the vest,\nwe thought of sleeves\nand of collars\n", "begin with v", 0},
		{"name,x,y,z\na,1,2,3\n", "begin with v", 0},
		{"{\"vertices\": []}", "JSON", 0},
		{"<!DOCTYPE html><html></html>", "web page", 0},
		{"PK\3\4\24\0\0\0\10\0", "zip", 10},
		{"\x1f\x8b\10\0\0\0\0\0", "gzip", 8},
		{"glTF\2\0\0\0", "glTF", 8},
		{"Kaydara FBX Binary  \0", "FBX", 21},
		{"POINTCACHE2\0\1\0\0\0", "motion", 16},
		{"\xff\xfev\0 \0", "UTF-16", 6},
	};
	struct import_options options;
	option_defaults(&import_option_table, &options);
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		size_t size = rows[i].size ? rows[i].size : strlen(rows[i].bytes);
		char *bytes = malloc(size);
		memcpy(bytes, rows[i].bytes, size);
		struct garment_source source = {bytes, size, MESH_SNIFF, NULL};
		assert_int_equal(garment_import(&f->garment, f->arena, &source, NULL, &options, &f->report, &f->error),
				 TW_ERROR_INPUT);
		free(bytes);
		if (strcmp(f->error.type, "mesh-unknown-format") != 0 || !strstr(f->error.text, rows[i].says))
			fail_msg("row %zu: %s: %s", i, f->error.type, f->error.text);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(every_text_is_read_however_its_lines_are_written, setup, teardown),
		cmocka_unit_test_setup_teardown(corners_of_an_obj_may_have_slashes_with_nothing_behind_them, setup,
						teardown),
		cmocka_unit_test_setup_teardown(a_backslash_at_the_end_of_a_name_or_comment_joins_nothing, setup,
						teardown),
		cmocka_unit_test_setup_teardown(a_backslash_joins_lines_of_data, setup, teardown),
		cmocka_unit_test_setup_teardown(positions_per_corner_are_one_but_for_the_last_digit, setup, teardown),
		cmocka_unit_test_setup_teardown(shared_positions_do_not_depend_on_the_order_of_faces, setup, teardown),
		cmocka_unit_test_setup_teardown(pieces_that_lie_mirrored_on_each_other_are_named, setup, teardown),
		cmocka_unit_test_setup_teardown(what_is_no_mesh_is_told_so, setup, teardown),
		cmocka_unit_test_setup_teardown(wedges_that_do_not_fit_their_face_are_errors, setup, teardown),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
