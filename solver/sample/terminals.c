/* Places are given as a tailor's chalk marks: so far along a limb, in that direction from its axis. Only the left half
 * is searched; the right one is its mirror image by construction: a right piece follows its left one with the same
 * faces in the same order, corners 1 and 2 exchanged (suit.c). */
#include "solver/sample/body.h"
#include "solver/sample/sample.h"
#include "solver/sample/size.h"

#include <stdbool.h>
#include <string.h>

#define LENGTH_OF(array) ((uint32_t)(sizeof(array) / sizeof *(array)))

struct mark {
	const char *name;
	enum body_part part;
	int rank;           /* of the muscle table: 1 when also in the smaller set */
	double along;       /* torso: height; sleeve: from the shoulder; leg: from the hip; mm */
	double side, front; /* direction from the axis; side 0 on the torso is the middle, which has no pair */
};

static const struct mark joints[] = {
	{"shoulder", BODY_SLEEVE, 0, 18, 1, 0.2}, {"elbow", BODY_SLEEVE, 0, 290, 0.4, -1},
	{"wrist", BODY_SLEEVE, 0, 532, 0.6, -1},  {"hip", BODY_LEG, 0, 10, 1, 0.25},
	{"knee", BODY_LEG, 0, 440, 0.1, 1},
};

static const struct mark segments[] = {
	{"collar", BODY_TORSO, 0, 1462, 0, -1},      {"sternum", BODY_TORSO, 0, 1330, 0, 1},
	{"pelvis", BODY_TORSO, 0, 1000, 0, -1},      {"shoulder_blade", BODY_TORSO, 0, 1350, 0.75, -1},
	{"upper_arm", BODY_SLEEVE, 0, 150, 1, -0.4}, {"forearm", BODY_SLEEVE, 0, 410, 0.7, -1},
	{"wrist", BODY_SLEEVE, 0, 532, 0.6, -1},     {"thigh", BODY_LEG, 0, 250, 1, 0.3},
	{"shank", BODY_LEG, 0, 590, 0.1, 1},         {"ankle", BODY_LEG, 0, 800, 0.5, 1},
};

static const struct mark muscles[] = {
	{"pectoral_upper", BODY_TORSO, 0, 1375, 0.55, 1},
	{"pectoral_lower", BODY_TORSO, 1, 1310, 0.75, 1},
	{"pectoral_outer", BODY_TORSO, 0, 1335, 1, 0.6},
	{"serratus", BODY_TORSO, 0, 1235, 1, 0.35},
	{"abdominal_upper", BODY_TORSO, 1, 1205, 0.45, 1},
	{"abdominal_middle", BODY_TORSO, 0, 1130, 0.45, 1},
	{"abdominal_lower", BODY_TORSO, 0, 1010, 0.5, 1},
	{"oblique", BODY_TORSO, 1, 1115, 1, 0.35},
	{"trapezius_upper", BODY_TORSO, 0, 1425, 0.7, -1},
	{"trapezius_middle", BODY_TORSO, 1, 1375, 0.3, -1},
	{"infraspinatus", BODY_TORSO, 0, 1345, 0.85, -1},
	{"rhomboid", BODY_TORSO, 0, 1305, 0.35, -1},
	{"latissimus_upper", BODY_TORSO, 1, 1262, 1, -0.7},
	{"latissimus_lower", BODY_TORSO, 0, 1175, 0.9, -0.8},
	{"erector_upper", BODY_TORSO, 0, 1225, 0.3, -1},
	{"erector_lower", BODY_TORSO, 1, 1110, 0.3, -1},
	{"gluteus_medius", BODY_TORSO, 1, 960, 1, -0.5},
	{"gluteus_maximus", BODY_TORSO, 1, 880, 0.75, -1},
	{"deltoid_front", BODY_SLEEVE, 0, 40, 0.4, 1},
	{"deltoid_middle", BODY_SLEEVE, 1, 62, 1, 0.25},
	{"deltoid_back", BODY_SLEEVE, 0, 45, 0.4, -1},
	{"biceps", BODY_SLEEVE, 1, 165, 0.2, 1},
	{"triceps", BODY_SLEEVE, 1, 170, 0.2, -1},
	{"brachialis", BODY_SLEEVE, 0, 228, 0.9, 0.6},
	{"forearm_flexor", BODY_SLEEVE, 1, 368, -0.3, 1},
	{"forearm_extensor", BODY_SLEEVE, 1, 372, 0.6, -1},
	{"wrist_extensor", BODY_SLEEVE, 0, 462, 0.3, -1},
	{"tensor_fasciae", BODY_LEG, 0, 75, 1, 0.45},
	{"sartorius", BODY_LEG, 0, 120, 0.3, 1},
	{"adductor", BODY_LEG, 0, 205, -1, 0.5},
	{"rectus_femoris", BODY_LEG, 1, 225, 0.15, 1},
	{"vastus_lateralis", BODY_LEG, 1, 295, 1, 0.6},
	{"vastus_medialis", BODY_LEG, 0, 365, -0.7, 0.9},
	{"biceps_femoris", BODY_LEG, 1, 255, 0.55, -1},
	{"semitendinosus", BODY_LEG, 0, 300, -0.55, -1},
	{"tibialis", BODY_LEG, 1, 590, 0.55, 1},
	{"peroneus", BODY_LEG, 0, 640, 1, 0.35},
	{"gastrocnemius_outer", BODY_LEG, 1, 565, 0.6, -1},
	{"gastrocnemius_inner", BODY_LEG, 0, 575, -0.6, -1},
	{"soleus", BODY_LEG, 0, 695, 0.25, -1},
};

static const struct {
	const char *name;
	const struct mark *marks;
	uint32_t mark_count;
	int rank;        /* of the marks, at least */
	int inside_face; /* else on a vertex */
} sets[SAMPLE_TERMINAL_SETS] = {
	{"joints10", joints, LENGTH_OF(joints), 0, 0},
	{"segments17", segments, LENGTH_OF(segments), 0, 0},
	{"muscles36", muscles, LENGTH_OF(muscles), 1, 1},
	{"muscles80", muscles, LENGTH_OF(muscles), 0, 1},
};

const char *sample_terminal_set_name(uint32_t index)
{
	return sets[index].name;
}

static struct vec3 corner_position(const struct garment *garment, uint32_t face, uint32_t corner)
{
	const double *p = garment->position + 3 * (size_t)garment->face_vertex[3 * (size_t)face + corner];
	return (struct vec3){p[0], p[1], p[2]};
}

/* The face of the mirror image; `face` belongs to a left piece. */
static uint32_t mirror_face(const struct garment *garment, uint32_t face)
{
	uint32_t piece = garment->face_piece[face], count = 0;
	for (uint32_t f = 0; f < garment->face_count; f++)
		count += garment->face_piece[f] == piece;
	return face + count;
}

/* Barycentric coordinates of the point of a triangle's plane under p, kept inside the triangle. */
static void barycentric_of(const struct vec3 t[3], struct vec3 p, double weight[3])
{
	struct vec3 normal = vec3_normal(t[0], t[1], t[2]);
	double whole = vec3_dot(normal, normal), sum = 0;
	for (int k = 0; k < 3; k++) {
		struct vec3 part = vec3_normal(p, t[(k + 1) % 3], t[(k + 2) % 3]);
		weight[k] = vec3_dot(part, normal) / whole;
		weight[k] = weight[k] < 0 ? 0 : weight[k];
		sum += weight[k];
	}
	for (int k = 0; k < 3; k++)
		weight[k] /= sum;
}

static struct vec3 face_point(const struct vec3 t[3], const double weight[3])
{
	return vec3_step(vec3_step(vec3_scale(t[0], weight[0]), t[1], weight[1]), t[2], weight[2]);
}

/* The left face nearest to p. */
static uint32_t nearest_face(const struct garment *garment, struct vec3 p, double weight[3])
{
	uint32_t best = 0;
	double least = 1e18;
	for (uint32_t f = 0; f < garment->face_count; f++) {
		struct vec3 t[3] = {corner_position(garment, f, 0)};
		/* No edge of a sample is longer than 100 mm. */
		double near = vec3_apart(t[0], p);
		if (garment->face_piece[f] % 2 || near > least + 2 * 100 * sqrt(least) + 100 * 100)
			continue;
		t[1] = corner_position(garment, f, 1);
		t[2] = corner_position(garment, f, 2);
		double w[3];
		barycentric_of(t, p, w);
		double d = vec3_apart(face_point(t, w), p);
		if (d < least) {
			least = d;
			best = f;
			memcpy(weight, w, sizeof w);
		}
	}
	return best;
}

/* Six decimals, well inside the face, summing to 1. */
static void settle(double weight[3])
{
	double sum = 0;
	for (int k = 0; k < 3; k++) {
		weight[k] = weight[k] < 0.05 ? 0.05 : weight[k];
		sum += weight[k];
	}
	for (int k = 1; k < 3; k++)
		weight[k] = floor(weight[k] / sum * 1e6 + 0.5) / 1e6;
	weight[0] = floor((1 - weight[1] - weight[2]) * 1e6 + 0.5) / 1e6;
}

static void place(struct sample_terminal *left, struct sample_terminal *right, const struct garment *garment,
		  const struct mark *mark, struct vec3 at, int inside_face)
{
	double weight[3] = {1, 0, 0};
	uint32_t face = nearest_face(garment, at, weight), image = mirror_face(garment, face);
	unsigned k = weight[0] >= weight[1] && weight[0] >= weight[2] ? 0 : weight[1] >= weight[2] ? 1 : 2;
	settle(weight);
	*left = (struct sample_terminal){.vertex = GARMENT_NONE, .face = GARMENT_NONE};
	*right = *left;
	snprintf(left->name, sizeof left->name, "%s_left", mark->name);
	snprintf(right->name, sizeof right->name, "%s_right", mark->name);
	if (!inside_face) {
		left->vertex = garment->face_vertex[3 * (size_t)face + k];
		right->vertex = garment->face_vertex[3 * (size_t)image + (k ? 3 - k : 0)];
		return;
	}
	left->face = face;
	right->face = image;
	memcpy(left->barycentric, weight, sizeof left->barycentric);
	memcpy(right->barycentric, (double[3]){weight[0], weight[2], weight[1]}, sizeof right->barycentric);
}

/* A mark in the middle: the nearest vertex on the plane of symmetry. */
static void place_middle(struct sample_terminal *terminal, const struct garment *garment, const struct mark *mark,
			 struct vec3 at)
{
	double least = 1e18;
	*terminal = (struct sample_terminal){.vertex = GARMENT_NONE, .face = GARMENT_NONE};
	snprintf(terminal->name, sizeof terminal->name, "%s", mark->name);
	for (uint32_t v = 0; v < garment->vertex_count; v++) {
		const double *p = garment->position + 3 * (size_t)v;
		double d = vec3_apart((struct vec3){p[0], p[1], p[2]}, at);
		if (p[0] == 0 && d < least) {
			least = d;
			terminal->vertex = v;
		}
	}
}

enum tw_status sample_terminals(struct sample_terminal **terminals, uint32_t *count, struct arena *arena,
				const struct garment *garment, enum sample_size size, uint32_t set,
				struct tw_error *error)
{
	struct body body;
	struct vec3 scale = size_scale(size);
	body_init(&body);
	*count = 0;
	*terminals = ARENA_ZEROED(arena, 2 * (size_t)sets[set].mark_count, struct sample_terminal);
	if (!*terminals)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i < sets[set].mark_count; i++) {
		const struct mark *mark = &sets[set].marks[i];
		if (mark->rank < sets[set].rank)
			continue;
		struct vec3 p = body_skin_point(&body, mark->part, mark->along, mark->side, mark->front);
		struct vec3 at = {p.x * scale.x, p.y * scale.y, p.z * scale.z};
		struct sample_terminal *next = *terminals + *count;
		bool middle = mark->part == BODY_TORSO && mark->side == 0;
		if (middle)
			place_middle(next, garment, mark, at);
		else
			place(next, next + 1, garment, mark, at, sets[set].inside_face);
		*count += middle ? 1 : 2;
	}
	return TW_OK;
}
