/* The sample suit as tools export it: sewn, cut apart along its seams, as PLY with doubled vertices, in metres on a
 * sheet. All give the suit back. */
#include "solver/sample/sample.h"
#include "solver/field/strain.h"
#include "solver/garment/import.h"
#include "solver/garment/refine.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { VERTICES = 3000 };

struct fixture {
	struct arena *arena;
	struct garment suit, read;
	struct garment_report report;
	struct import_options options;
	struct tw_error error;
	char *text; /* heap */
	size_t size;
};

static int setup(void **state)
{
	struct fixture *f = calloc(1, sizeof *f);
	f->arena = arena_new(0);
	option_defaults(&import_option_table, &f->options);
	assert_int_equal(sample_garment(&f->suit, f->arena, VERTICES, SAMPLE_L, &f->error), TW_OK);
	*state = f;
	return 0;
}

static int teardown(void **state)
{
	struct fixture *f = *state;
	arena_free(f->arena);
	free(f->text);
	free(f);
	return 0;
}

static void import_text(struct fixture *f)
{
	struct garment_source source = {.bytes = f->text, .size = f->size};
	if (garment_import(&f->read, f->arena, &source, NULL, &f->options, &f->report, &f->error) != TW_OK)
		fail_msg("%s: %s: %s", f->error.type, f->error.where, f->error.text);
}

static struct topology topology_of(struct fixture *f, const struct garment *garment)
{
	struct topology topology;
	assert_int_equal(topology_build(&topology, f->arena, garment, &f->error), TW_OK);
	return topology;
}

/* Same pieces, same numbers of edges of each kind, and every corner of every face at the same place. */
static void assert_is_suit(struct fixture *f, double tolerance)
{
	const struct garment *a = &f->suit, *b = &f->read;
	assert_int_equal(a->vertex_count, b->vertex_count);
	assert_int_equal(a->face_count, b->face_count);
	assert_int_equal(a->piece_count, b->piece_count);
	for (uint32_t i = 0; i < 3 * a->face_count; i++) {
		for (uint32_t k = 0; k < 3; k++)
			assert_true(fabs(a->position[3 * a->face_vertex[i] + k] -
					 b->position[3 * b->face_vertex[i] + k]) <= tolerance);
		for (uint32_t k = 0; k < 2; k++)
			assert_true(fabs(a->pattern[2 * a->face_coord[i] + k] - b->pattern[2 * b->face_coord[i] + k]) <=
				    tolerance);
	}
	struct topology s = topology_of(f, a), t = topology_of(f, b);
	assert_int_equal(s.edge_count, t.edge_count);
	assert_int_equal(s.component_count, t.component_count);
	for (uint32_t e = 0; e < s.edge_count; e++)
		assert_int_equal(s.edge_kind[e], t.edge_kind[e]);
}

static void write_faces(FILE *out, const struct garment *g, bool apart)
{
	for (uint32_t face = 0; face < g->face_count; face++) {
		const uint32_t *c = g->face_coord + 3 * face, *v = apart ? c : g->face_vertex + 3 * face;
		if (face == 0 || g->face_piece[face] != g->face_piece[face - 1])
			fprintf(out, "g %s\n", g->piece_name[g->face_piece[face]]);
		fprintf(out, "f %u/%u %u/%u %u/%u\n", v[0] + 1, c[0] + 1, v[1] + 1, c[1] + 1, v[2] + 1, c[2] + 1);
	}
}

/* A vertex of the suit for each pattern position, as tools have it that know no seams. */
static uint32_t *vertex_of_coord(struct fixture *f)
{
	uint32_t *vertex = ARENA_ZEROED(f->arena, f->suit.coord_count, uint32_t);
	for (uint32_t i = 0; i < 3 * f->suit.face_count; i++)
		vertex[f->suit.face_coord[i]] = f->suit.face_vertex[i];
	return vertex;
}

static void sewn_obj_is_the_suit_itself(void **state)
{
	struct fixture *f = *state;
	const struct garment *g = &f->suit;
	FILE *out = open_memstream(&f->text, &f->size);
	for (uint32_t v = 0; v < g->vertex_count; v++)
		fprintf(out, "v %.17g %.17g %.17g\n", g->position[3 * v], g->position[3 * v + 1],
			g->position[3 * v + 2]);
	for (uint32_t c = 0; c < g->coord_count; c++)
		fprintf(out, "vt %.17g %.17g\n", g->pattern[2 * c], g->pattern[2 * c + 1]);
	write_faces(out, g, false);
	fclose(out);
	import_text(f);
	assert_is_suit(f, 0);
	assert_int_equal(f->report.warnings.count, 0);
	assert_memory_equal(g->face_vertex, f->read.face_vertex, 12 * (size_t)g->face_count);
	for (uint32_t p = 0; p < g->piece_count; p++)
		assert_string_equal(g->piece_name[p], f->read.piece_name[p]);
}

static void obj_cut_apart_at_its_seams_is_sewn(void **state)
{
	struct fixture *f = *state;
	const struct garment *g = &f->suit;
	const uint32_t *vertex = vertex_of_coord(f);
	FILE *out = open_memstream(&f->text, &f->size);
	for (uint32_t c = 0; c < g->coord_count; c++) {
		const double *p = g->position + 3 * vertex[c], *u = g->pattern + 2 * c;
		fprintf(out, "v %.4f %.4f %.4f\nvt %.17g %.17g\n", p[0], p[1], p[2], u[0], u[1]);
	}
	write_faces(out, g, true);
	fclose(out);
	import_text(f);
	assert_int_equal(f->read.vertex_count, g->coord_count);
	assert_true(f->report.warnings.count == 1 && strcmp(f->report.warnings.warning[0].type, "seams-open") == 0);
	f->options.weld_mm = 0.01;
	import_text(f);
	assert_is_suit(f, 1e-4);
	assert_int_equal(garment_source_count(&f->read), g->coord_count);
	assert_int_equal(f->report.warnings.warning[0].count, g->coord_count - g->vertex_count);
}

static void ply_in_metres_on_a_sheet_is_sewn(void **state)
{
	struct fixture *f = *state;
	const struct garment *g = &f->suit;
	const uint32_t *vertex = vertex_of_coord(f);
	FILE *out = open_memstream(&f->text, &f->size);
	fprintf(out,
		"ply\nformat binary_little_endian 1.0\nelement vertex %u\nproperty double x\nproperty double y\n"
		"property double z\nproperty double s\nproperty double t\nelement face %u\n"
		"property list uchar uint vertex_indices\nend_header\n",
		g->coord_count, g->face_count);
	for (uint32_t c = 0; c < g->coord_count; c++) {
		const double *p = g->position + 3 * vertex[c], *u = g->pattern + 2 * c;
		fwrite((const double[]){p[0] / 1000, p[1] / 1000, p[2] / 1000, u[0] / 3000, u[1] / 2000}, 8, 5, out);
	}
	for (uint32_t face = 0; face < g->face_count; face++) {
		fputc(3, out);
		fwrite(g->face_coord + 3 * face, 4, 3, out);
	}
	fclose(out);
	f->options.unit = UNIT_M;
	f->options.pattern_unit = UNIT_SHEET;
	f->options.sheet_width_mm = 3000;
	f->options.sheet_height_mm = 2000;
	f->options.weld_mm = 0.01;
	import_text(f);
	assert_int_equal(f->report.format, MESH_PLY);
	assert_is_suit(f, 1e-9);
}

static double *density_in(struct fixture *f, const struct garment *garment, const float *frame)
{
	struct strain_rest rest;
	float *moved = ARENA_ARRAY(f->arena, 3 * (size_t)garment->vertex_count, float);
	double *density = ARENA_ARRAY(f->arena, garment->face_count, double);
	assert_int_equal(strain_rest_from_pattern(&rest, f->arena, garment, &f->error), TW_OK);
	strain_density(&rest, STRAIN_STVK, garment_frame(garment, frame, moved), density);
	return density;
}

static void parts_of_a_face_inherit_its_strain(void **state)
{
	struct fixture *f = *state;
	struct sample_rig *rig = NULL;
	float *frame = ARENA_ARRAY(f->arena, 3 * (size_t)f->suit.vertex_count, float);
	assert_int_equal(sample_rig_build(&rig, f->arena, &f->suit, SAMPLE_L, &f->error), TW_OK);
	sample_rig_pose(rig, 1, 20, frame);
	const double *whole = density_in(f, &f->suit, frame);
	static const struct {
		enum refinement refinement;
		uint32_t parts;
	} rows[] = {{REFINE_MIDPOINT, 4}, {REFINE_CENTROID, 3}};
	for (size_t i = 0; i < 2; i++) {
		struct garment once, twice;
		struct topology topology = topology_of(f, &f->suit);
		assert_int_equal(garment_refine(&once, f->arena, &f->suit, &topology, rows[i].refinement, &f->error),
				 TW_OK);
		topology = topology_of(f, &once);
		assert_int_equal(garment_refine(&twice, f->arena, &once, &topology, rows[i].refinement, &f->error),
				 TW_OK);
		uint32_t parts = rows[i].parts * rows[i].parts;
		assert_int_equal(twice.face_count, parts * f->suit.face_count);
		const double *part = density_in(f, &twice, frame);
		/* frames are floats: a part of a few millimetres knows its shape to about 1e-5 */
		for (uint32_t face = 0; face < twice.face_count; face++)
			assert_true(fabs(part[face] - whole[face / parts]) <= 2e-3 * (0.05 + whole[face / parts]));
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(sewn_obj_is_the_suit_itself, setup, teardown),
		cmocka_unit_test_setup_teardown(obj_cut_apart_at_its_seams_is_sewn, setup, teardown),
		cmocka_unit_test_setup_teardown(parts_of_a_face_inherit_its_strain, setup, teardown),
		cmocka_unit_test_setup_teardown(ply_in_metres_on_a_sheet_is_sewn, setup, teardown),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
