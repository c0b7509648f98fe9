/* Strain densities against closed forms: for an affine deformation of a flat sheet every face has the same F, and the
 * three densities follow from its principal strains by hand. */
#include "solver/field/strain.h"

#include "tests/oracle/meshes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

struct sheet {
	struct arena *arena;
	struct garment garment;
	struct strain_rest rest;
	float *position;
	double *density;
};

static void sheet_open(struct sheet *sheet, uint32_t columns, uint32_t rows, uint32_t seam)
{
	sheet->arena = arena_new(0);
	mesh_sheet(&sheet->garment, sheet->arena, columns, rows, 8, 0.3, seam);
	assert_int_equal(strain_rest_from_pattern(&sheet->rest, sheet->arena, &sheet->garment, NULL), TW_OK);
	sheet->position = ARENA_ARRAY(sheet->arena, 3 * (size_t)sheet->garment.vertex_count, float);
	sheet->density = ARENA_ARRAY(sheet->arena, sheet->garment.face_count, double);
	assert_non_null(sheet->density);
}

/* x -> A x + b for the 3x3 matrix A, row by row. */
static void deform(struct sheet *sheet, const double a[9], const double b[3])
{
	for (size_t v = 0; v < sheet->garment.vertex_count; v++)
		for (size_t d = 0; d < 3; d++) {
			const double *x = sheet->garment.position + 3 * v;
			sheet->position[3 * v + d] =
				(float)(a[3 * d] * x[0] + a[3 * d + 1] * x[1] + a[3 * d + 2] * x[2] + b[d]);
		}
}

/* The energy of the Green strain (a b; b c), entry by entry. */
static double stvk_of(double a, double b, double c)
{
	double mu = 5.4 / (2 * 1.33), lambda = 5.4 * 0.33 / (1.33 * 0.34);
	return mu * (a * a + 2 * b * b + c * c) + lambda / 2 * (a + c) * (a + c);
}

/* What wrinkles leave of it: fabric that lies in folds is longer, not shorter, than it looks from afar, so its own
 * strain is (a b; b c) + L L^T with any L = (l0 0; l1 l2), and it takes the one of least energy. Found by trying: from
 * several L each entry is moved up and down by a step that shrinks. */
static double relaxed(double a, double b, double c)
{
	double best = INFINITY;
	for (int start = 0; start < 16; start++) {
		double l[3] = {start % 4 * 0.2, start % 2 ? 0.3 : -0.3, start / 4 * 0.2};
		double least = INFINITY;
		for (double step = 0.5; step > 1e-7;) {
			bool better = false;
			for (int k = 0; k < 6; k++) {
				double kept = l[k / 2];
				l[k / 2] += k % 2 ? -step : step;
				double energy =
					stvk_of(a + l[0] * l[0], b + l[0] * l[1], c + l[1] * l[1] + l[2] * l[2]);
				better |= energy < least;
				l[k / 2] = energy < least ? l[k / 2] : kept;
				least = fmin(least, energy);
			}
			step *= better ? 1 : 0.5;
		}
		best = fmin(best, least);
	}
	return best;
}

/* The densities of principal Green strains g1 and g2, as method 2 writes them. */
static double expected(enum strain_model model, double g1, double g2)
{
	double young = 5.4, poisson = 0.33;
	double mu = young / (2 * (1 + poisson)), lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson));
	double spectral = fmax(fabs(g1), fabs(g2));
	if (model == STRAIN_PRINTED)
		return fmax(0, mu * spectral + lambda / 2 * (g1 + g2));
	if (model == STRAIN_TENSION)
		return relaxed(g1, 0, g2);
	return mu * (g1 * g1 + g2 * g2) + lambda / 2 * (g1 + g2) * (g1 + g2);
}

static void expect_everywhere(struct sheet *sheet, double g1, double g2)
{
	for (enum strain_model model = 0; model < STRAIN_MODELS; model++) {
		strain_density(&sheet->rest, model, sheet->position, sheet->density);
		double want = expected(model, g1, g2);
		for (uint32_t f = 0; f < sheet->garment.face_count; f++)
			assert_true(fabs(sheet->density[f] - want) <= 1e-4 * want + 2e-5);
	}
}

static double green(double stretch)
{
	return (stretch * stretch - 1) / 2;
}

static void an_undeformed_sheet_has_no_energy(void **state)
{
	(void)state;
	struct sheet sheet;
	sheet_open(&sheet, 9, 7, 4);
	deform(&sheet, (double[9]){1, 0, 0, 0, 1, 0, 0, 0, 1}, (double[3]){0});
	expect_everywhere(&sheet, 0, 0);
	arena_free(sheet.arena);
}

static void uniaxial_stretch_matches_the_closed_form(void **state)
{
	(void)state;
	struct sheet sheet;
	sheet_open(&sheet, 9, 7, 0);
	for (double stretch = 0.6; stretch < 1.8; stretch += 0.1) {
		deform(&sheet, (double[9]){stretch, 0, 0, 0, 1, 0, 0, 0, 1}, (double[3]){3, 4, 5});
		expect_everywhere(&sheet, green(stretch), 0);
	}
	arena_free(sheet.arena);
}

static void biaxial_stretch_matches_the_closed_form(void **state)
{
	(void)state;
	struct sheet sheet;
	sheet_open(&sheet, 9, 7, 3);
	for (double x = 0.7; x < 1.6; x += 0.2) {
		for (double y = 0.7; y < 1.6; y += 0.2) {
			deform(&sheet, (double[9]){x, 0, 0, 0, y, 0, 0, 0, 1}, (double[3]){0});
			expect_everywhere(&sheet, green(x), green(y));
		}
	}
	arena_free(sheet.arena);
}

static void simple_shear_matches_the_closed_form(void **state)
{
	(void)state;
	struct sheet sheet;
	sheet_open(&sheet, 9, 7, 0);
	for (double k = 0.1; k < 1; k += 0.2) {
		deform(&sheet, (double[9]){1, k, 0, 0, 1, 0, 0, 0, 1}, (double[3]){0});
		/* G = (0 k/2; k/2 k^2/2) */
		double mean = k * k / 4, radius = sqrt(k * k * k * k / 16 + k * k / 4);
		expect_everywhere(&sheet, mean + radius, mean - radius);
	}
	arena_free(sheet.arena);
}

/* Random deformations of the plane, most of which are compressed one way or both. */
static void cloth_that_would_be_compressed_keeps_what_wrinkles_leave(void **state)
{
	(void)state;
	struct sheet sheet;
	sheet_open(&sheet, 3, 3, 0);
	uint64_t random = 17;
	uint32_t wrinkled = 0, slack = 0, taut = 0;
	for (int round = 0; round < 300; round++) {
		double f[4];
		for (int k = 0; k < 4; k++)
			f[k] = (k == 0 || k == 3) + 0.8 * (mesh_random(&random) - 0.5);
		deform(&sheet, (double[9]){f[0], f[1], 0, f[2], f[3], 0, 0, 0, 1}, (double[3]){0});
		double a = (f[0] * f[0] + f[2] * f[2] - 1) / 2, c = (f[1] * f[1] + f[3] * f[3] - 1) / 2;
		double b = (f[0] * f[1] + f[2] * f[3]) / 2, want = relaxed(a, b, c), whole = stvk_of(a, b, c);
		slack += want < 1e-9;
		taut += want > whole - 1e-9;
		wrinkled += want >= 1e-9 && want <= whole - 1e-9;
		strain_density(&sheet.rest, STRAIN_TENSION, sheet.position, sheet.density);
		for (uint32_t i = 0; i < sheet.garment.face_count; i++)
			assert_true(fabs(sheet.density[i] - want) <= 1e-4 * want + 2e-5);
	}
	assert_true(wrinkled > 50 && slack > 20 && taut > 50);
	arena_free(sheet.arena);
}

/* Through the place where the cloth begins to wrinkle the energy and its slope go on without a step. */
static void tension_is_smooth_where_wrinkles_begin(void **state)
{
	(void)state;
	struct sheet sheet;
	sheet_open(&sheet, 3, 3, 0);
	double before[2] = {NAN, NAN};
	for (double across = 1.02; across > 0.8; across -= 0.004) {
		deform(&sheet, (double[9]){1.3, 0, 0, 0, across, 0, 0, 0, 1}, (double[3]){0});
		strain_density(&sheet.rest, STRAIN_TENSION, sheet.position, sheet.density);
		double slope = sheet.density[0] - before[0];
		/* The second difference of a smooth function is of the order of the step's square; at a kink it is of
		 * that of the step. */
		if (!isnan(before[1]))
			assert_true(fabs(slope - before[1]) < 40 * 0.004 * 0.004);
		before[1] = slope;
		before[0] = sheet.density[0];
	}
	arena_free(sheet.arena);
}

static void rigid_motion_of_a_frame_changes_nothing(void **state)
{
	(void)state;
	struct sheet sheet;
	sheet_open(&sheet, 9, 7, 4);
	double c = cos(0.7), s = sin(0.7), stretch = 1.25;
	/* stretched along x, then turned about x and about z and moved */
	double turned[9] = {c * stretch, -s * c, s * s, s * stretch, c * c, -c * s, 0, s, c};
	deform(&sheet, turned, (double[3]){500, -300, 900});
	expect_everywhere(&sheet, green(stretch), 0);
	arena_free(sheet.arena);
}

static void the_worn_garment_is_undeformed_against_itself(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct garment garment;
	mesh_tube(&garment, arena, 12, 9, 7);
	struct strain_rest worn, frame;
	float *position = ARENA_ARRAY(arena, 3 * (size_t)garment.vertex_count, float);
	double *density = ARENA_ARRAY(arena, garment.face_count, double);
	for (size_t i = 0; i < 3 * (size_t)garment.vertex_count; i++)
		position[i] = (float)garment.position[i];
	assert_int_equal(strain_rest_from_worn(&worn, arena, &garment, NULL), TW_OK);
	assert_int_equal(strain_rest_from_frame(&frame, arena, &garment, position, NULL), TW_OK);
	for (int k = 0; k < 2; k++) {
		strain_density(k ? &worn : &frame, STRAIN_STVK, position, density);
		for (uint32_t f = 0; f < garment.face_count; f++)
			assert_true(density[f] < 1e-9);
	}
	arena_free(arena);
}

static void a_face_without_area_is_named(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct garment garment;
	mesh_sheet(&garment, arena, 3, 3, 10, 0, 0);
	for (size_t d = 0; d < 3; d++)
		garment.position[3 * garment.face_vertex[3 * 5 + 1] + d] =
			garment.position[3 * garment.face_vertex[3 * 5] + d];
	struct strain_rest rest;
	struct tw_error error;
	assert_int_equal(strain_rest_from_worn(&rest, arena, &garment, &error), TW_ERROR_INPUT);
	assert_non_null(strstr(error.where, "face "));
	arena_free(arena);
}

/* Frames of many sizes of block, one by one and as means. */
static void the_mean_of_frames_is_the_mean_of_densities(void **state)
{
	(void)state;
	struct sheet sheet;
	sheet_open(&sheet, 40, 33, 17); /* more than one cluster */
	struct strain_mean *mean;
	assert_int_equal(strain_mean_new(&mean, sheet.arena, &sheet.rest, NULL), TW_OK);
	size_t faces = sheet.garment.face_count, bytes = 3 * (size_t)sheet.garment.vertex_count * sizeof(float);
	double *sum = ARENA_ARRAY(sheet.arena, faces * STRAIN_MODELS, double);
	double *means[STRAIN_MODELS];
	for (int m = 0; m < STRAIN_MODELS; m++)
		means[m] = ARENA_ARRAY(sheet.arena, faces, double);
	uint64_t random = 7;
	const uint32_t counts[] = {1, 5, 16, 0, 37};
	for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
		memset(sum, 0, faces * STRAIN_MODELS * sizeof *sum);
		for (uint32_t j = 0; j < counts[c]; j++) {
			for (size_t i = 0; i < bytes / sizeof(float); i++)
				sheet.position[i] = (float)(sheet.garment.position[i] * 1.1 + 2 * mesh_random(&random));
			memcpy(strain_mean_slot(mean), sheet.position, bytes);
			strain_mean_add(mean);
			for (enum strain_model m = 0; m < STRAIN_MODELS; m++) {
				strain_density(&sheet.rest, m, sheet.position, sheet.density);
				for (size_t f = 0; f < faces; f++)
					sum[(size_t)m * faces + f] += sheet.density[f];
			}
		}
		assert_int_equal(strain_mean_finish(mean, means), counts[c]);
		for (size_t m = 0; m < STRAIN_MODELS; m++)
			for (size_t f = 0; f < faces; f++) {
				double want = counts[c] ? sum[m * faces + f] / counts[c] : 0;
				assert_true(fabs(means[m][f] - want) <= 1e-6 * want);
			}
	}
	arena_free(sheet.arena);
}

/* To the last bit, and whatever corner a face begins with. */
static void shuffled_faces_and_vertices_have_the_same_densities(void **state)
{
	(void)state;
	struct sheet sheet, other;
	sheet_open(&sheet, 60, 50, 20);
	sheet_open(&other, 60, 50, 20);
	uint32_t faces = sheet.garment.face_count, vertices = sheet.garment.vertex_count;
	uint32_t *to = ARENA_ARRAY(sheet.arena, vertices, uint32_t);
	uint32_t *face_to = ARENA_ARRAY(sheet.arena, faces, uint32_t);
	for (uint32_t v = 0; v < vertices; v++)
		to[v] = (uint32_t)((uint64_t)v * 1009 % vertices); /* coprime */
	for (uint32_t f = 0; f < faces; f++)
		face_to[f] = (uint32_t)((uint64_t)f * 2503 % faces);
	for (size_t c = 0; c < 3 * (size_t)faces; c++) {
		size_t corner = 3 * (size_t)face_to[c / 3] + (c + c / 3) % 3;
		other.garment.face_vertex[corner] = to[sheet.garment.face_vertex[c]];
		other.garment.face_coord[corner] = sheet.garment.face_coord[c];
	}
	assert_int_equal(strain_rest_from_pattern(&other.rest, other.arena, &other.garment, NULL), TW_OK);
	struct sheet *both[2] = {&sheet, &other};
	uint64_t random = 3;
	for (size_t i = 0; i < 3 * (size_t)vertices; i++) {
		sheet.position[i] = (float)(sheet.garment.position[i] + mesh_random(&random));
		other.position[3 * (size_t)to[i / 3] + i % 3] = sheet.position[i];
	}
	for (int k = 0; k < 2; k++) {
		struct strain_mean *mean;
		assert_int_equal(strain_mean_new(&mean, both[k]->arena, &both[k]->rest, NULL), TW_OK);
		memcpy(strain_mean_slot(mean), both[k]->position, 3 * (size_t)vertices * sizeof(float));
		strain_mean_add(mean);
		assert_int_equal(strain_mean_finish(mean, (double *[]){both[k]->density, NULL, NULL}), 1);
	}
	for (uint32_t f = 0; f < faces; f++)
		assert_true(sheet.density[f] == other.density[face_to[f]]);
	arena_free(sheet.arena);
	arena_free(other.arena);
}

static void the_worst_motion_counts(void **state)
{
	(void)state;
	double a[3] = {1, 5, 2}, b[3] = {2, 4, 2}, worst[3];
	strain_worst((const double *[]){a, b}, 2, 3, worst);
	assert_true(worst[0] == 2 && worst[1] == 5 && worst[2] == 2);
	a[1] = NAN;
	strain_worst((const double *[]){b, a, b}, 3, 3, worst);
	assert_true(worst[0] == 2 && isnan(worst[1]));
	strain_worst(NULL, 0, 3, worst);
	assert_true(worst[0] == 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_undeformed_sheet_has_no_energy),
		cmocka_unit_test(uniaxial_stretch_matches_the_closed_form),
		cmocka_unit_test(biaxial_stretch_matches_the_closed_form),
		cmocka_unit_test(simple_shear_matches_the_closed_form),
		cmocka_unit_test(cloth_that_would_be_compressed_keeps_what_wrinkles_leave),
		cmocka_unit_test(tension_is_smooth_where_wrinkles_begin),
		cmocka_unit_test(rigid_motion_of_a_frame_changes_nothing),
		cmocka_unit_test(the_worn_garment_is_undeformed_against_itself),
		cmocka_unit_test(a_face_without_area_is_named),
		cmocka_unit_test(the_mean_of_frames_is_the_mean_of_densities),
		cmocka_unit_test(shuffled_faces_and_vertices_have_the_same_densities),
		cmocka_unit_test(the_worst_motion_counts),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
