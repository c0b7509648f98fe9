/* The sample motions strain the suit where a wearer's joints would, moderately and without jumps; terminals lie where
 * they should, left as right. */
#include "solver/sample/sample.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct fixture {
	struct arena *arena;
	struct garment suit;
	struct sample_rig *rig;
	float *frame, *before;
	double *strain; /* [face] largest principal Green strain */
};

static int setup(void **state)
{
	struct fixture *f = calloc(1, sizeof *f);
	struct tw_error error;
	f->arena = arena_new(0);
	if (sample_garment(&f->suit, f->arena, 6000, SAMPLE_L, &error) ||
	    sample_rig_build(&f->rig, f->arena, &f->suit, SAMPLE_L, &error))
		return -1;
	f->frame = malloc(3 * sizeof(float) * f->suit.vertex_count);
	f->before = malloc(3 * sizeof(float) * f->suit.vertex_count);
	f->strain = malloc(sizeof(double) * f->suit.face_count);
	*state = f;
	return 0;
}

static int teardown(void **state)
{
	struct fixture *f = *state;
	arena_free(f->arena);
	free(f->frame);
	free(f->before);
	free(f->strain);
	free(f);
	return 0;
}

static uint32_t motion_named(const char *name)
{
	for (uint32_t m = 0; m < SAMPLE_MOTIONS; m++)
		if (!strcmp(sample_motion_at(m)->name, name))
			return m;
	fail_msg("no motion %s", name);
	return 0;
}

/* Largest eigenvalue of (F^T F - I) / 2. */
static void measure(struct fixture *f)
{
	const struct garment *g = &f->suit;
	for (uint32_t t = 0; t < g->face_count; t++) {
		const double *u[3];
		const float *x[3];
		for (int k = 0; k < 3; k++) {
			u[k] = g->pattern + 2 * (size_t)g->face_coord[3 * t + (uint32_t)k];
			x[k] = f->frame + 3 * (size_t)g->face_vertex[3 * t + (uint32_t)k];
		}
		double a = u[1][0] - u[0][0], b = u[2][0] - u[0][0], c = u[1][1] - u[0][1], d = u[2][1] - u[0][1];
		double area = a * d - b * c, g00 = 0, g01 = 0, g11 = 0;
		for (int i = 0; i < 3; i++) {
			double p = (double)x[1][i] - (double)x[0][i], q = (double)x[2][i] - (double)x[0][i];
			double f0 = (p * d - q * c) / area, f1 = (q * a - p * b) / area;
			g00 += f0 * f0 / 2;
			g01 += f0 * f1 / 2;
			g11 += f1 * f1 / 2;
		}
		f->strain[t] = (g00 + g11 - 1) / 2 + hypot((g00 - g11) / 2, g01);
	}
}

static int double_compare(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return x < y ? -1 : x > y;
}

static void motions_have_thirty_frames_or_more(void **state)
{
	(void)state;
	for (uint32_t m = 0; m < SAMPLE_MOTIONS; m++) {
		assert_true(sample_motion_at(m)->frame_count >= 30);
		assert_true(sample_motion_at(m)->frames_per_second == 30);
	}
}

static void no_vertex_jumps(void **state)
{
	struct fixture *f = *state;
	size_t count = 3 * (size_t)f->suit.vertex_count;
	for (uint32_t m = 0; m < SAMPLE_MOTIONS; m++)
		for (uint32_t i = 0; i < sample_motion_at(m)->frame_count; i++) {
			memcpy(f->before, f->frame, count * sizeof(float));
			sample_rig_pose(f->rig, m, i, f->frame);
			for (size_t c = 0; c < count; c++) {
				assert_true(isfinite(f->frame[c]));
				/* A fist travels at some 6 m/s. */
				assert_true(i == 0 || fabsf(f->frame[c] - f->before[c]) < 210);
			}
		}
}

/* The suit ends 98 mm above the floor; a foot that rolls or points lowers its hem a little. */
static void a_foot_is_on_the_floor_unless_the_wearer_jumps(void **state)
{
	struct fixture *f = *state;
	for (uint32_t m = 0; m < SAMPLE_MOTIONS; m++)
		for (uint32_t i = 0; i < sample_motion_at(m)->frame_count; i++) {
			float lowest = 1e9F;
			sample_rig_pose(f->rig, m, i, f->frame);
			for (uint32_t v = 0; v < f->suit.vertex_count; v++)
				lowest = f->frame[3 * v + 1] < lowest ? f->frame[3 * v + 1] : lowest;
			assert_true(lowest > 65);
			assert_true(lowest < 105 || m == motion_named("jumping_jack"));
		}
}

static void strain_is_moderate_in_every_frame(void **state)
{
	struct fixture *f = *state;
	uint32_t n = f->suit.face_count;
	for (uint32_t m = 0; m < SAMPLE_MOTIONS; m++)
		for (uint32_t i = 0; i < sample_motion_at(m)->frame_count; i += 3) {
			sample_rig_pose(f->rig, m, i, f->frame);
			measure(f);
			qsort(f->strain, n, sizeof *f->strain, double_compare);
			if (f->strain[n / 2] > 0.25 || f->strain[n * 99 / 100] > 1.3 || f->strain[n - 1] > 2.6)
				fail_msg("%s frame %u: median %.2f, 99 %% %.2f, most %.2f", sample_motion_at(m)->name,
					 i, f->strain[n / 2], f->strain[n * 99 / 100], f->strain[n - 1]);
		}
}

/* Mean strain over a motion of the faces within `radius` of a place in rest, both sides. */
static double strain_around(struct fixture *f, const char *motion, double x, double y, double z, double radius)
{
	uint32_t m = motion_named(motion);
	double sum = 0, count = 0;
	for (uint32_t i = 0; i < sample_motion_at(m)->frame_count; i += 4) {
		sample_rig_pose(f->rig, m, i, f->frame);
		measure(f);
		for (uint32_t t = 0; t < f->suit.face_count; t++) {
			const double *p = f->suit.position + 3 * (size_t)f->suit.face_vertex[3 * t];
			double dx = fabs(p[0]) - x, dy = p[1] - y, dz = p[2] - z;
			if (dx * dx + dy * dy + dz * dz > radius * radius)
				continue;
			sum += f->strain[t];
			count++;
		}
	}
	assert_true(count > 0);
	return sum / count;
}

static void joints_are_strained_most(void **state)
{
	const struct {
		const char *motion, *joint;
		double x, y, z, times;
	} places[] = {
		{"elbow_flexion", "elbow", 416, 1210, -60, 1.5},
		{"squat", "knee", 134, 482, 55, 1.7},
		{"walk", "knee", 134, 482, 55, 1.15},
		{"squat", "seat", 80, 850, -120, 1.5},
		{"jumping_jack", "armpit", 180, 1310, -26, 2},
		{"hook_punch", "elbow", 416, 1210, -60, 1.4},
	};
	for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
		double everywhere = strain_around(*state, places[i].motion, 0, 900, 0, 1e6);
		double there = strain_around(*state, places[i].motion, places[i].x, places[i].y, places[i].z, 60);
		if (there < places[i].times * everywhere)
			fail_msg("%s: %.2f at the %s, %.2f everywhere", places[i].motion, there, places[i].joint,
				 everywhere);
	}
}

static void a_frame_depends_on_its_number_alone(void **state)
{
	struct fixture *f = *state;
	size_t bytes = 3 * sizeof(float) * f->suit.vertex_count;
	sample_rig_pose(f->rig, 1, 20, f->before);
	sample_rig_pose(f->rig, 3, 7, f->frame);
	sample_rig_pose(f->rig, 1, 20, f->frame);
	assert_memory_equal(f->frame, f->before, bytes);
}

static void a_finer_suit_moves_alike(void **state)
{
	struct fixture *f = *state;
	struct arena *arena = arena_new(0);
	struct garment fine;
	struct sample_rig *rig;
	struct tw_error error;
	assert_int_equal(sample_garment(&fine, arena, 12000, SAMPLE_L, &error), TW_OK);
	assert_int_equal(sample_rig_build(&rig, arena, &fine, SAMPLE_L, &error), TW_OK);
	float *frame = malloc(3 * sizeof(float) * fine.vertex_count);
	sample_rig_pose(f->rig, 1, 28, f->frame);
	sample_rig_pose(rig, 1, 28, frame);
	/* Where two rest positions are close, so are their places in the frame. */
	for (uint32_t a = 0; a < f->suit.vertex_count; a += 7) {
		const double *p = f->suit.position + 3 * (size_t)a;
		for (uint32_t b = 0; b < fine.vertex_count; b++) {
			const double *q = fine.position + 3 * (size_t)b;
			double rest = hypot(hypot(p[0] - q[0], p[1] - q[1]), p[2] - q[2]);
			if (rest > 2)
				continue;
			const float *x = f->frame + 3 * (size_t)a, *y = frame + 3 * (size_t)b;
			assert_true(fabsf(x[0] - y[0]) + fabsf(x[1] - y[1]) + fabsf(x[2] - y[2]) < 8);
		}
	}
	free(frame);
	arena_free(arena);
}

/* Where a terminal lies in rest. */
static void place_of(const struct garment *g, const struct sample_terminal *t, double at[3])
{
	for (int i = 0; i < 3; i++) {
		at[i] = t->face == GARMENT_NONE ? g->position[3 * (size_t)t->vertex + (size_t)i] : 0;
		for (uint32_t k = 0; k < 3 && t->face != GARMENT_NONE; k++)
			at[i] += t->barycentric[k] *
				 g->position[3 * (size_t)g->face_vertex[3 * t->face + k] + (size_t)i];
	}
}

static void terminals_are_symmetric_and_apart(void **state)
{
	const struct fixture *f = *state;
	const uint32_t counts[SAMPLE_TERMINAL_SETS] = {10, 17, 36, 80};
	for (uint32_t set = 0; set < SAMPLE_TERMINAL_SETS; set++) {
		struct sample_terminal *t;
		struct tw_error error;
		uint32_t count;
		assert_int_equal(sample_terminals(&t, &count, f->arena, &f->suit, SAMPLE_L, set, &error), TW_OK);
		assert_int_equal(count, counts[set]);
		for (uint32_t i = 0; i < count; i++) {
			double p[3], q[3];
			int has_mirror = 0;
			place_of(&f->suit, &t[i], p);
			if (t[i].face != GARMENT_NONE)
				assert_true(t[i].barycentric[0] + t[i].barycentric[1] + t[i].barycentric[2] - 1 <
						    1e-9 &&
					    t[i].barycentric[0] > 0.03 && t[i].barycentric[1] > 0.03 &&
					    t[i].barycentric[2] > 0.03);
			for (uint32_t j = 0; j < count; j++) {
				place_of(&f->suit, &t[j], q);
				has_mirror |= fabs(p[0] + q[0]) + fabs(p[1] - q[1]) + fabs(p[2] - q[2]) < 1e-6;
				if (i == j)
					continue;
				assert_string_not_equal(t[i].name, t[j].name);
				assert_true(hypot(hypot(p[0] - q[0], p[1] - q[1]), p[2] - q[2]) > 25);
			}
			assert_true(has_mirror);
		}
	}
}

static void terminals_lie_on_the_joints_they_are_named_after(void **state)
{
	const struct fixture *f = *state;
	const struct {
		const char *name;
		double x, y, z;
	} joints[] = {
		{"shoulder_left", 225, 1420, -20}, {"elbow_left", 420, 1215, -65}, {"wrist_right", -620, 1075, -25},
		{"hip_right", -180, 915, 20},      {"knee_left", 134, 482, 60},
	};
	struct sample_terminal *t;
	struct tw_error error;
	uint32_t count;
	assert_int_equal(sample_terminals(&t, &count, f->arena, &f->suit, SAMPLE_L, 0, &error), TW_OK);
	for (size_t j = 0; j < sizeof joints / sizeof *joints; j++)
		for (uint32_t i = 0; i < count; i++) {
			double p[3];
			place_of(&f->suit, &t[i], p);
			double far = hypot(hypot(p[0] - joints[j].x, p[1] - joints[j].y), p[2] - joints[j].z);
			if (!strcmp(t[i].name, joints[j].name) && far > 45)
				fail_msg("%s is %.0f mm off", t[i].name, far);
		}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(motions_have_thirty_frames_or_more),
		cmocka_unit_test(no_vertex_jumps),
		cmocka_unit_test(a_foot_is_on_the_floor_unless_the_wearer_jumps),
		cmocka_unit_test(strain_is_moderate_in_every_frame),
		cmocka_unit_test(joints_are_strained_most),
		cmocka_unit_test(a_frame_depends_on_its_number_alone),
		cmocka_unit_test(a_finer_suit_moves_alike),
		cmocka_unit_test(terminals_are_symmetric_and_apart),
		cmocka_unit_test(terminals_lie_on_the_joints_they_are_named_after),
	};
	return cmocka_run_group_tests(tests, setup, teardown);
}
