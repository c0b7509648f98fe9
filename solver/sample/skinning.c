/* Skinning, between two known ways: dual quaternions (L. Kavan, S. Collins, J. Zara, C. O'Sullivan: "Geometric Skinning
 * with Approximate Dual Quaternion Blending", ACM TOG 27(4), 2008) and the linear mean of the bones' matrices; then the
 * cloth slides (slide.h). How much a bone moves a vertex is a smooth function of its place in rest, so a finer mesh of
 * the same suit moves just as a coarse one. */
#include "solver/sample/motion.h"
#include "solver/sample/pose.h"
#include "solver/sample/sample.h"
#include "solver/sample/size.h"
#include "solver/sample/slide.h"

#include <string.h>

/* Bones that move one vertex; more never matter. */
enum { INFLUENCES = 6 };

/* How much of the way from bulging to caving in a bent limb goes; see moved. */
static const double caving = 0.6;

struct influence {
	float weight[INFLUENCES]; /* sums to 1; 0 where unused; the largest first */
	uint8_t bone[INFLUENCES];
};

struct sample_rig {
	struct vec3 scale;
	uint32_t vertex_count;
	const double *rest; /* borrowed from the garment: [vertex_count][3] */
	struct influence *influence;
	struct slide *slide;
	struct influence *net_influence;
	struct vec3 *net_posed;
};

/* 0 below `from`, 1 above `to`, straight between but for eased ends: the slope is what stretches the cloth over a
 * joint, so it stays as low as it can and has no jumps. */
static double rise(double from, double to, double x)
{
	const double ease = 0.25;
	double t = (x - from) / (to - from);
	t = t < 0 ? 0 : t > 1 ? 1 : t;
	double end = t > 0.5 ? 1 - t : t, value = end < ease ? end * end / (2 * ease) : end - ease / 2;
	value /= 1 - ease;
	return t > 0.5 ? 1 - value : value;
}

/* How far p lies beyond a joint of the left arm or leg, along the bone from `root` to `end`; mm. */
static double beyond(enum bone joint, enum bone root, enum bone end, struct vec3 p)
{
	struct vec3 axis = vec3_unit(vec3_sub(pose_joint(end), pose_joint(root)));
	return vec3_dot(vec3_sub(p, pose_joint(joint)), axis);
}

/* How far p lies into the arm: along it, less what lies far below it, which is the flank. mm, roughly. */
static double into_arm(struct vec3 p)
{
	struct vec3 axis = vec3_unit(vec3_sub(pose_joint(BONE_FOREARM), pose_joint(BONE_UPPER_ARM)));
	struct vec3 d = vec3_sub(p, pose_joint(BONE_UPPER_ARM));
	double below = d.x * axis.y - d.y * axis.x - 60;
	double less = below < 0 ? 0 : below < 30 ? below * below / 30 : 2 * below - 30;
	return vec3_dot(d, axis) - less;
}

/* Weights of all bones at p, size L. */
static void weights_at(struct vec3 p, double weight[BONE_COUNT])
{
	int side = p.x < 0;
	struct vec3 left = {fabs(p.x), p.y, p.z};
	double arm = rise(-100, 150, into_arm(left));
	double fore = rise(-115, 115, beyond(BONE_FOREARM, BONE_UPPER_ARM, BONE_FOREARM, left));
	double crease = 0.745 * left.x - 0.667 * (left.y - 775);
	double leg = (1 - arm) * rise(-150, 140, crease) * rise(1060, 960, left.y);
	double shin = rise(-135, 135, beyond(BONE_SHIN, BONE_THIGH, BONE_SHIN, left));
	double across = rise(-45, 45, left.x);
	double trunk = 1 - arm - leg;
	double lumbar = rise(960, 1140, left.y), chest = rise(1110, 1300, left.y);
	double girdle = 0.85 * rise(1320, 1440, left.y) * rise(15, 125, left.x);
	weight[BONE_PELVIS] = trunk * (1 - lumbar);
	weight[BONE_LUMBAR] = trunk * lumbar * (1 - chest);
	weight[BONE_CHEST] = trunk * lumbar * chest * (1 - girdle);
	weight[BONE_CLAVICLE + side] = trunk * lumbar * chest * girdle;
	weight[BONE_CLAVICLE + !side] = 0;
	weight[BONE_UPPER_ARM + side] = arm * (1 - fore);
	weight[BONE_FOREARM + side] = arm * fore;
	weight[BONE_UPPER_ARM + !side] = weight[BONE_FOREARM + !side] = 0;
	weight[BONE_THIGH + side] = leg * across * (1 - shin);
	weight[BONE_SHIN + side] = leg * across * shin;
	weight[BONE_THIGH + !side] = leg * (1 - across) * (1 - shin);
	weight[BONE_SHIN + !side] = leg * (1 - across) * shin;
}

static void keep_strongest(struct influence *influence, const double weight[BONE_COUNT])
{
	double left[BONE_COUNT], sum = 0;
	memcpy(left, weight, sizeof left);
	memset(influence, 0, sizeof *influence);
	for (int i = 0; i < INFLUENCES; i++) {
		int best = 0;
		for (int b = 1; b < BONE_COUNT; b++)
			best = left[b] > left[best] ? b : best;
		influence->bone[i] = (uint8_t)best;
		influence->weight[i] = (float)left[best];
		sum += left[best];
		left[best] = 0;
	}
	for (int i = 0; i < INFLUENCES; i++)
		influence->weight[i] = (float)((double)influence->weight[i] / sum);
}

static void influence_at(struct influence *influence, struct vec3 p, struct vec3 scale)
{
	double weight[BONE_COUNT];
	weights_at((struct vec3){p.x / scale.x, p.y / scale.y, p.z / scale.z}, weight);
	keep_strongest(influence, weight);
}

static struct vec3 rest_of(const struct sample_rig *rig, uint32_t v)
{
	const double *p = rig->rest + 3 * (size_t)v;
	return (struct vec3){p[0], p[1], p[2]};
}

static bool net_build(struct sample_rig *rig, struct arena *arena)
{
	struct body body;
	uint32_t count;
	body_init(&body);
	if (!slide_build(&rig->slide, arena, &body, rig->scale, rig->rest, rig->vertex_count))
		return false;
	const struct vec3 *net = slide_rest(rig->slide, &count);
	rig->net_influence = ARENA_ARRAY(arena, count, struct influence);
	rig->net_posed = ARENA_ARRAY(arena, count, struct vec3);
	if (!rig->net_influence || !rig->net_posed)
		return false;
	for (uint32_t v = 0; v < count; v++)
		influence_at(&rig->net_influence[v], net[v], rig->scale);
	return true;
}

enum tw_status sample_rig_build(struct sample_rig **rig, struct arena *arena, const struct garment *garment,
				enum sample_size size, struct tw_error *error)
{
	struct sample_rig *made = ARENA_ZEROED(arena, 1, struct sample_rig);
	if (!made)
		return tw_fail_memory(error);
	made->scale = size_scale(size);
	made->vertex_count = garment->vertex_count;
	made->rest = garment->position;
	made->influence = ARENA_ARRAY(arena, garment->vertex_count, struct influence);
	if (!made->influence || !net_build(made, arena))
		return tw_fail_memory(error);
	for (uint32_t v = 0; v < garment->vertex_count; v++)
		influence_at(&made->influence[v], rest_of(made, v), made->scale);
	*rig = made;
	return TW_OK;
}

/* A rigid motion as a dual quaternion: turn + eps * half the move times the turn. */
struct dual {
	struct quaternion real, dual;
};

static struct dual dual_from(const struct rigid *rigid)
{
	struct quaternion q = rigid->turn;
	struct vec3 t = vec3_scale(rigid->move, 0.5);
	return (struct dual){q,
			     {-t.x * q.x - t.y * q.y - t.z * q.z, t.x * q.w + t.y * q.z - t.z * q.y,
			      -t.x * q.z + t.y * q.w + t.z * q.x, t.x * q.y - t.y * q.x + t.z * q.w}};
}

/* A bone's motion, ready to move points. */
struct bone_motion {
	struct dual dual;
	struct vec3 column[3], move; /* the same as a matrix */
};

static double dot4(struct quaternion a, struct quaternion b)
{
	return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
}

static struct quaternion step4(struct quaternion a, struct quaternion b, double s)
{
	return (struct quaternion){a.w + s * b.w, a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

/* The point moved by the blended motion: turns about a blended axis, keeps its distance from it, and so bulges. */
static struct vec3 moved_as_dual(const struct bone_motion bone[BONE_COUNT], const struct influence *influence,
				 struct vec3 p)
{
	const struct quaternion zero = {0, 0, 0, 0};
	struct quaternion r = zero, d = zero;
	for (int i = 0; i < INFLUENCES && influence->weight[i] > 0; i++) {
		const struct dual *b = &bone[influence->bone[i]].dual;
		r = step4(r, b->real, (double)influence->weight[i]);
		d = step4(d, b->dual, (double)influence->weight[i]);
	}
	double size = 1 / sqrt(dot4(r, r));
	r = step4(zero, r, size);
	d = step4(zero, d, size);
	struct vec3 axis = {r.x, r.y, r.z}, dual = {d.x, d.y, d.z};
	struct vec3 turn = vec3_cross(axis, vec3_step(vec3_cross(axis, p), p, r.w));
	struct vec3 move = vec3_sub(vec3_scale(dual, r.w), vec3_scale(axis, d.w));
	move = vec3_add(move, vec3_cross(axis, dual));
	return vec3_step(vec3_step(p, turn, 2), move, 2);
}

/* The mean of where the bones would have the point: cuts corners, and so caves in. */
static struct vec3 moved_as_mean(const struct bone_motion bone[BONE_COUNT], const struct influence *influence,
				 struct vec3 p)
{
	struct vec3 sum = {0, 0, 0};
	for (int i = 0; i < INFLUENCES && influence->weight[i] > 0; i++) {
		const struct bone_motion *b = &bone[influence->bone[i]];
		struct vec3 q = vec3_step(vec3_step(vec3_step(b->move, b->column[0], p.x), b->column[1], p.y),
					  b->column[2], p.z);
		sum = vec3_step(sum, q, (double)influence->weight[i]);
	}
	return sum;
}

/* Flesh does something between the two. */
static struct vec3 moved(const struct bone_motion bone[BONE_COUNT], const struct influence *influence, struct vec3 p)
{
	struct vec3 bulged = moved_as_dual(bone, influence, p), caved = moved_as_mean(bone, influence, p);
	return vec3_step(bulged, vec3_sub(caved, bulged), caving);
}

/* A turn and its negative are the same turn, but blend differently: each bone takes the one nearer to its parent's, so
 * that the choice never changes from one vertex to the next. Parents come before their children. */
static void align_to_parents(struct bone_motion bone[BONE_COUNT])
{
	for (int b = BONE_LUMBAR; b < BONE_COUNT; b++) {
		struct dual *own = &bone[b].dual;
		if (dot4(own->real, bone[pose_parent((enum bone)b)].dual.real) >= 0)
			continue;
		own->real = step4((struct quaternion){0, 0, 0, 0}, own->real, -1);
		own->dual = step4((struct quaternion){0, 0, 0, 0}, own->dual, -1);
	}
}

static void bones_ready(struct bone_motion bone[BONE_COUNT], const struct rigid rigid[BONE_COUNT])
{
	for (int b = 0; b < BONE_COUNT; b++) {
		struct quaternion q = rigid[b].turn;
		bone[b].dual = dual_from(&rigid[b]);
		bone[b].move = rigid[b].move;
		bone[b].column[0] = pose_turned(q, (struct vec3){1, 0, 0});
		bone[b].column[1] = pose_turned(q, (struct vec3){0, 1, 0});
		bone[b].column[2] = pose_turned(q, (struct vec3){0, 0, 1});
	}
	align_to_parents(bone);
}

void sample_rig_pose(struct sample_rig *rig, uint32_t motion, uint32_t frame, float *position)
{
	struct pose pose;
	struct rigid rigid[BONE_COUNT];
	struct bone_motion bone[BONE_COUNT];
	uint32_t net_count;
	const struct vec3 *net = slide_rest(rig->slide, &net_count);
	motion_pose(&pose, motion, frame);
	pose_bones(rigid, &pose, rig->scale);
	bones_ready(bone, rigid);
	for (uint32_t v = 0; v < net_count; v++)
		rig->net_posed[v] = moved(bone, &rig->net_influence[v], net[v]);
	slide_relax(rig->slide, rig->net_posed);
	for (uint32_t v = 0; v < rig->vertex_count; v++) {
		struct vec3 q = vec3_add(moved(bone, &rig->influence[v], rest_of(rig, v)), slide_shift(rig->slide, v));
		position[3 * (size_t)v] = (float)q.x;
		position[3 * (size_t)v + 1] = (float)q.y;
		position[3 * (size_t)v + 2] = (float)q.z;
	}
}
