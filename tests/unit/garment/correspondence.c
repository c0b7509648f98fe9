/* Numbers of a file through welding, cutting of polygons and refinement. The oracle is the file's own text: where it
 * says that a vertex or a point of a face lies, the garment must have it. */
#include "solver/garment/correspondence.h"
#include "solver/garment/import.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Two strips of quads and triangles, sewn along x = 0 where every vertex is written twice, bent in space. */
enum { ROWS = 5, VERTICES = 4 * ROWS, FACES_MAX = 4 * ROWS };

struct file {
	double position[VERTICES][3], pattern[VERTICES][2];
	uint32_t face[FACES_MAX][4], corners[FACES_MAX], face_count;
	char text[8192];
};

struct fixture {
	struct arena *arena;
	struct file file;
	struct garment garment;
	struct topology topology;
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

static uint32_t vertex_at(uint32_t column, uint32_t row)
{
	/* the right strip first, so that the copy that goes is not always the later one */
	return column < 2 ? 2 * ROWS + 2 * row + column : 2 * row + column - 2;
}

static void add_face(struct file *file, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
	uint32_t *face = file->face[file->face_count];
	face[0] = a, face[1] = b, face[2] = c, face[3] = d;
	file->corners[file->face_count++] = d == UINT32_MAX ? 3 : 4;
}

/* `quads`: 0 none, 1 every other, 2 all. */
static void make_file(struct file *file, int quads)
{
	memset(file, 0, sizeof *file);
	for (uint32_t row = 0; row < ROWS; row++) {
		for (uint32_t column = 0; column < 4; column++) {
			uint32_t v = vertex_at(column, row);
			double x = column < 2 ? 40.0 * column - 40 : 40.0 * column - 80;
			file->position[v][0] = x;
			file->position[v][1] = 37.0 * row;
			file->position[v][2] = 0.01 * x * x + 3.0 * row;
			file->pattern[v][0] = x + (column < 2 ? 0 : 20);
			file->pattern[v][1] = 37.0 * row + (column < 2 ? 0 : 5);
		}
	}
	for (uint32_t row = 0; row + 1 < ROWS; row++) {
		for (uint32_t left = 0; left < 4; left += 2) {
			uint32_t a = vertex_at(left, row), b = vertex_at(left + 1, row);
			uint32_t c = vertex_at(left + 1, row + 1), d = vertex_at(left, row + 1);
			if (quads == 2 || (quads == 1 && (row + left / 2) % 2)) {
				add_face(file, a, b, c, d);
				continue;
			}
			add_face(file, a, b, c, UINT32_MAX);
			add_face(file, c, d, a, UINT32_MAX);
		}
	}
	size_t used = 0;
	for (uint32_t v = 0; v < VERTICES; v++)
		used += (size_t)snprintf(file->text + used, sizeof file->text - used, "v %.17g %.17g %.17g\n",
					 file->position[v][0], file->position[v][1], file->position[v][2]);
	for (uint32_t v = 0; v < VERTICES; v++)
		used += (size_t)snprintf(file->text + used, sizeof file->text - used, "vt %.17g %.17g\n",
					 file->pattern[v][0], file->pattern[v][1]);
	for (uint32_t i = 0; i < file->face_count; i++) {
		used += (size_t)snprintf(file->text + used, sizeof file->text - used, "f");
		for (uint32_t k = 0; k < file->corners[i]; k++)
			used += (size_t)snprintf(file->text + used, sizeof file->text - used, " %u/%u",
						 file->face[i][k] + 1, file->face[i][k] + 1);
		used += (size_t)snprintf(file->text + used, sizeof file->text - used, "\n");
	}
}

static enum tw_status import(struct fixture *f)
{
	struct garment_source source = {f->file.text, strlen(f->file.text), MESH_OBJ, NULL};
	enum tw_status status =
		garment_import(&f->garment, f->arena, &source, NULL, &f->options, &f->report, &f->error);
	return status == TW_OK ? topology_build(&f->topology, f->arena, &f->garment, &f->error) : status;
}

static void assert_point(const double *here, const double *there, int axes)
{
	for (int axis = 0; axis < axes; axis++)
		assert_true(fabs(here[axis] - there[axis]) < 1e-9);
}

static void point_of(const struct garment *g, uint32_t face, const double w[3], double worn[3], double flat[2])
{
	memset(worn, 0, 3 * sizeof *worn);
	memset(flat, 0, 2 * sizeof *flat);
	for (size_t k = 0; k < 3; k++) {
		for (size_t axis = 0; axis < 3; axis++)
			worn[axis] += w[k] * g->position[3 * (size_t)g->face_vertex[3 * (size_t)face + k] + axis];
		for (size_t axis = 0; axis < 2; axis++)
			flat[axis] += w[k] * g->pattern[2 * (size_t)g->face_coord[3 * (size_t)face + k] + axis];
	}
}

static double worn_area(const struct garment *g, uint32_t face)
{
	const uint32_t *v = g->face_vertex + 3 * (size_t)face;
	const double *a = g->position + 3 * (size_t)v[0], *b = g->position + 3 * (size_t)v[1],
		     *c = g->position + 3 * (size_t)v[2];
	double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, w[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
	double x = u[1] * w[2] - u[2] * w[1], y = u[2] * w[0] - u[0] * w[2], z = u[0] * w[1] - u[1] * w[0];
	return sqrt(x * x + y * y + z * z) / 2;
}

static double distance(const double *a, const double *b)
{
	return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

static void check_vertices(const struct fixture *f)
{
	const struct garment *g = &f->garment;
	assert_int_equal(garment_source_count(g), VERTICES);
	for (uint32_t v = 0; v < VERTICES; v++) {
		uint32_t mesh = garment_mesh_vertex(g, v), back = garment_file_vertex(g, mesh);
		assert_point(g->position + 3 * (size_t)mesh, f->file.position[v], 3);
		assert_true(back <= v);
		assert_point(f->file.position[back], f->file.position[v], 3);
	}
	for (uint32_t v = 0; v < g->vertex_count; v++) {
		uint32_t file = garment_file_vertex(g, v);
		if (file != GARMENT_NONE)
			assert_int_equal(garment_mesh_vertex(g, file), v);
	}
}

/* Corners, midpoints of sides, the centre and random weights. */
static void choose_weights(uint32_t which, double w[3])
{
	for (uint32_t k = 0; k < 3; k++)
		w[k] = which < 3    ? k == which
		       : which < 6  ? (k == which - 3 ? 0 : 0.5)
		       : which == 6 ? 1.0 / 3
				    : 0.05 + (double)(rand() % 1000) / 1000;
	double sum = w[0] + w[1] + w[2];
	for (uint32_t k = 0; k < 3; k++)
		w[k] /= sum;
}

static void check_point(const struct fixture *f, uint32_t file_face, const double w[3])
{
	double want[3] = {0}, want_flat[2] = {0}, inner[3], worn[3], flat[2], again[3];
	uint32_t face = GARMENT_NONE, back = GARMENT_NONE;
	for (uint32_t k = 0; k < 3; k++) {
		uint32_t v = f->file.face[file_face][k];
		for (uint32_t axis = 0; axis < 3; axis++)
			want[axis] += w[k] * f->file.position[v][axis];
		for (uint32_t axis = 0; axis < 2; axis++)
			want_flat[axis] += w[k] * f->file.pattern[v][axis];
	}
	assert_true(garment_place_from_file(&f->garment, file_face, w, &face, inner));
	assert_int_equal(garment_file_face(&f->garment, face), file_face);
	for (int k = 0; k < 3; k++)
		assert_true(inner[k] >= 0);
	point_of(&f->garment, face, inner, worn, flat);
	assert_point(worn, want, 3);
	assert_point(flat, want_flat, 2);
	assert_true(garment_place_to_file(&f->garment, face, inner, &back, again));
	assert_int_equal(back, file_face);
	assert_point(again, w, 3);
}

static void check_faces(struct fixture *f)
{
	const struct garment *g = &f->garment;
	uint32_t met = 0;
	assert_int_equal(garment_file_faces(g), f->file.face_count);
	for (uint32_t i = 0; i < f->file.face_count; i++) {
		uint32_t first = 0, parts = garment_face_parts(g, i, &first), corner[3];
		double area = 0, want = 0, w[3] = {1, 0, 0}, inner[3];
		assert_int_equal(first, met);
		met += parts;
		for (uint32_t part = first; part < first + parts; part++) {
			assert_int_equal(garment_file_face(g, part), i);
			area += worn_area(g, part);
		}
		if (f->file.corners[i] > 3) {
			assert_false(garment_file_corners(g, i, corner));
			assert_false(garment_place_from_file(g, i, w, &first, inner));
			continue;
		}
		struct garment whole = {.position = f->file.position[0], .face_vertex = f->file.face[i]};
		want = worn_area(&whole, 0);
		assert_true(fabs(area - want) < 1e-9 * want);
		assert_true(garment_file_corners(g, i, corner));
		for (uint32_t k = 0; k < 3; k++)
			assert_int_equal(corner[k], garment_mesh_vertex(g, f->file.face[i][k]));
		for (uint32_t which = 0; which < 20; which++) {
			choose_weights(which, w);
			check_point(f, i, w);
		}
	}
	assert_int_equal(met, g->face_count);
}

/* The parts of every edge of the file add up to it, and lie on it. */
static void check_edges(const struct fixture *f)
{
	const struct garment *g = &f->garment;
	for (uint32_t i = 0; i < f->file.face_count; i++) {
		for (uint32_t k = 0; k < f->file.corners[i]; k++) {
			uint32_t from = f->file.face[i][k], to = f->file.face[i][(k + 1) % f->file.corners[i]];
			uint32_t a = garment_mesh_vertex(g, from), b = garment_mesh_vertex(g, to);
			double length = 0;
			for (uint32_t e = 0; e < f->topology.edge_count; e++) {
				const uint32_t *ends = f->topology.edge_vertex + 2 * (size_t)e;
				uint32_t of[2];
				if (!garment_edge_to_file(g, ends, of) || of[0] != (a < b ? a : b) ||
				    of[1] != (a < b ? b : a))
					continue;
				length +=
					distance(g->position + 3 * (size_t)ends[0], g->position + 3 * (size_t)ends[1]);
			}
			assert_true(fabs(length - distance(f->file.position[from], f->file.position[to])) < 1e-9);
		}
	}
}

static void numbers_of_the_file_keep_their_places(void **state)
{
	struct fixture *f = *state;
	static const int refinements[] = {REFINE_NONE, REFINE_MIDPOINT, REFINE_CENTROID};
	srand(1);
	for (int quads = 0; quads < 3; quads++) {
		make_file(&f->file, quads);
		for (int weld = 0; weld < 2; weld++) {
			for (size_t r = 0; r < 3; r++) {
				for (uint32_t levels = 1; levels <= (r ? 3u : 1u); levels++) {
					f->options.weld_mm = weld ? 0.01 : 0;
					f->options.refinement = refinements[r];
					f->options.refine_levels = levels;
					assert_int_equal(import(f), TW_OK);
					assert_int_equal(f->topology.component_count, weld ? 1 : 2);
					check_vertices(f);
					check_faces(f);
					check_edges(f);
				}
			}
		}
	}
}

static void numbers_survive_storage(void **state)
{
	struct fixture *f = *state;
	struct tw_array arrays[GARMENT_ARRAYS];
	size_t count = 0;
	make_file(&f->file, 1);
	f->options.weld_mm = 0.01;
	f->options.refinement = REFINE_MIDPOINT;
	assert_int_equal(import(f), TW_OK);
	assert_int_equal(garment_to_arrays(&f->garment, &f->topology, f->arena, arrays, &count, &f->error), TW_OK);
	assert_int_equal(count, GARMENT_ARRAYS);
	assert_int_equal(garment_from_arrays(&f->garment, f->arena, arrays, count, &f->error), TW_OK);
	check_vertices(f);
	check_faces(f);
	check_edges(f);
}

/* What an imported mesh of 0.1.0 does not say must not be guessed. */
static void a_welded_garment_without_numbers_is_outdated(void **state)
{
	struct fixture *f = *state;
	struct tw_array arrays[GARMENT_ARRAYS];
	size_t count = 0, kept = 0;
	make_file(&f->file, 0);
	f->options.weld_mm = 0.01;
	assert_int_equal(import(f), TW_OK);
	assert_int_equal(garment_to_arrays(&f->garment, &f->topology, f->arena, arrays, &count, &f->error), TW_OK);
	for (size_t i = 0; i < count; i++)
		if (strcmp(arrays[i].name, "mesh_vertex") != 0 && strcmp(arrays[i].name, "file_face") != 0)
			arrays[kept++] = arrays[i];
	assert_int_equal(garment_from_arrays(&f->garment, f->arena, arrays, kept, &f->error), TW_ERROR_INPUT);
	assert_string_equal(f->error.type, "garment-outdated");
}

static void damaged_numbers_are_errors(void **state)
{
	struct fixture *f = *state;
	static const char *const names[] = {"mesh_vertex", "file_face", "file_corner"};
	make_file(&f->file, 1);
	f->options.weld_mm = 0.01;
	f->options.refinement = REFINE_CENTROID;
	assert_int_equal(import(f), TW_OK);
	for (size_t n = 0; n < 3; n++) {
		for (int fault = 0; fault < 3; fault++) {
			struct tw_array arrays[GARMENT_ARRAYS];
			struct garment again;
			size_t count = 0, i = 0;
			assert_int_equal(garment_to_arrays(&f->garment, &f->topology, f->arena, arrays, &count, NULL),
					 TW_OK);
			while (strcmp(arrays[i].name, names[n]) != 0)
				i++;
			size_t values = (size_t)arrays[i].rows * arrays[i].columns;
			uint32_t *copy = ARENA_ARRAY(f->arena, values, uint32_t);
			memcpy(copy, arrays[i].data, values * sizeof *copy);
			arrays[i].data = copy;
			if (fault == 0)
				arrays[i].rows--;
			else if (fault == 1)
				copy[values / 2] = 1u << 30;
			else
				copy[values - 1] = n == 1 ? 0 : 1u << 30; /* no longer ascending */
			assert_int_equal(garment_from_arrays(&again, f->arena, arrays, count, &f->error),
					 TW_ERROR_INPUT);
			assert_string_equal(f->error.type, "garment-damaged");
		}
	}
}

/* A message about a face or vertex speaks of the file's, behind polygons and welding. */
static void errors_speak_in_numbers_of_the_file(void **state)
{
	struct fixture *f = *state;
	make_file(&f->file, 2);
	f->options.weld_mm = 0.01;
	/* a third face on the seam between the copies of row 2, and a quad before it in the list */
	char extra[128];
	uint32_t a = vertex_at(1, 1), b = vertex_at(2, 2), c = vertex_at(3, 4);
	snprintf(extra, sizeof extra, "f %u/%u %u/%u %u/%u\n", a + 1, a + 1, b + 1, b + 1, c + 1, c + 1);
	strcat(f->file.text, extra);
	assert_int_equal(import(f), TW_ERROR_INPUT);
	assert_string_equal(f->error.type, "mesh-non-manifold-edge");
	assert_string_equal(f->error.where, "face 8");
	uint32_t low = vertex_at(2, 1), high = vertex_at(2, 2);
	char ends[64];
	snprintf(ends, sizeof ends, "vertices %u and %u;", low, high);
	assert_non_null(strstr(f->error.text, ends));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(numbers_of_the_file_keep_their_places, setup, teardown),
		cmocka_unit_test_setup_teardown(numbers_survive_storage, setup, teardown),
		cmocka_unit_test_setup_teardown(a_welded_garment_without_numbers_is_outdated, setup, teardown),
		cmocka_unit_test_setup_teardown(damaged_numbers_are_errors, setup, teardown),
		cmocka_unit_test_setup_teardown(errors_speak_in_numbers_of_the_file, setup, teardown),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
