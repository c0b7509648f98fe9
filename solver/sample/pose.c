/* Forward kinematics. Every bone's rest orientation is the world's, so a joint's turn is a product of turns about fixed
 * axes. Right limbs are computed as left ones and mirrored. Sine and cosine are our own series, so that frames do not
 * depend on the machine's mathematics library. */
#include "solver/sample/pose.h"

static const struct vec3 rest_joints[BONE_COUNT] = {
	[BONE_PELVIS] = {0, 960, -15},     [BONE_LUMBAR] = {0, 1060, -28},      [BONE_CHEST] = {0, 1200, -36},
	[BONE_CLAVICLE] = {28, 1412, -20}, [BONE_UPPER_ARM] = {180, 1382, -28}, [BONE_FOREARM] = {416, 1210, -24},
	[BONE_THIGH] = {94, 915, -6},      [BONE_SHIN] = {134, 482, -4},
};

/* Where the left shin ends. */
static const struct vec3 rest_ankle = {168, 98, -16};

/* The arm's axis in rest, and the axis about which the left elbow bends forward. */
static const struct vec3 arm_axis = {0.8, -0.6, 0}, elbow_axis = {-0.6, -0.8, 0};

/* How much of an arm's raise and turn the shoulder girdle takes. */
static const double girdle_raise = 0.36, girdle_turn = 0.22;

struct vec3 pose_joint(enum bone bone)
{
	return rest_joints[bone];
}

enum bone pose_parent(enum bone bone)
{
	if (bone <= BONE_CHEST)
		return bone == BONE_PELVIS ? BONE_PELVIS : bone - 1;
	if (bone < BONE_UPPER_ARM)
		return BONE_CHEST;
	return bone == BONE_THIGH || bone == BONE_THIGH + 1 ? BONE_PELVIS : bone - 2;
}

/* Sine and cosine of half an angle of at most 360 degrees, by their series. */
static void half_angle(double degrees, double *cosine, double *sine)
{
	double x = degrees * (3.14159265358979323846 / 360), square = x * x, term = 1;
	*cosine = 0;
	*sine = 0;
	for (int n = 1; n <= 31; n += 2) {
		*cosine += term;
		*sine += term * x / n;
		term *= -square / (n * (n + 1.0));
	}
}

static struct quaternion about(struct vec3 axis, double degrees)
{
	double c, s;
	half_angle(degrees, &c, &s);
	return (struct quaternion){c, s * axis.x, s * axis.y, s * axis.z};
}

/* First b, then a. */
static struct quaternion times(struct quaternion a, struct quaternion b)
{
	return (struct quaternion){
		a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
		a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
		a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
		a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
	};
}

struct vec3 pose_turned(struct quaternion q, struct vec3 v)
{
	struct vec3 axis = {q.x, q.y, q.z}, t = vec3_scale(vec3_cross(axis, v), 2);
	return vec3_add(vec3_step(v, t, q.w), vec3_cross(axis, t));
}

static const struct vec3 x_axis = {1, 0, 0}, y_axis = {0, 1, 0}, z_axis = {0, 0, 1};

static struct quaternion mirrored(struct quaternion q, int side)
{
	return side ? (struct quaternion){q.w, q.x, -q.y, -q.z} : q;
}

/* The motion that turns a bone by `turn` about its joint, which its parent carries along. */
static struct rigid bone_at(struct vec3 joint, const struct rigid *parent, struct quaternion turn)
{
	struct vec3 carried = vec3_add(pose_turned(parent->turn, joint), parent->move);
	return (struct rigid){turn, vec3_sub(carried, pose_turned(turn, joint))};
}

static struct vec3 joint_of(enum bone bone, int side, struct vec3 scale)
{
	struct vec3 p = rest_joints[bone];
	return (struct vec3){(side ? -p.x : p.x) * scale.x, p.y * scale.y, p.z * scale.z};
}

static void pose_arm(struct rigid bone[BONE_COUNT], const struct arm_pose *arm, int side, struct vec3 scale)
{
	const struct rigid *chest = &bone[BONE_CHEST];
	struct quaternion girdle =
		times(about(y_axis, -girdle_turn * arm->turn), about(z_axis, girdle_raise * arm->raise));
	struct quaternion upper = times(about(z_axis, arm->raise), about(arm_axis, -arm->twist));
	upper = times(about(y_axis, -arm->turn), times(about(x_axis, -arm->swing), upper));
	struct quaternion fore = times(upper, about(elbow_axis, arm->elbow));
	struct rigid *clavicle = &bone[BONE_CLAVICLE + side], *upper_arm = &bone[BONE_UPPER_ARM + side];
	*clavicle = bone_at(joint_of(BONE_CLAVICLE, side, scale), chest, times(chest->turn, mirrored(girdle, side)));
	*upper_arm =
		bone_at(joint_of(BONE_UPPER_ARM, side, scale), clavicle, times(chest->turn, mirrored(upper, side)));
	bone[BONE_FOREARM + side] =
		bone_at(joint_of(BONE_FOREARM, side, scale), upper_arm, times(chest->turn, mirrored(fore, side)));
}

static void pose_leg(struct rigid bone[BONE_COUNT], const struct leg_pose *leg, int side, struct vec3 scale)
{
	const struct rigid *pelvis = &bone[BONE_PELVIS];
	struct quaternion thigh = times(about(z_axis, leg->spread), about(y_axis, leg->twist));
	thigh = times(thigh, about(x_axis, -leg->lift));
	struct quaternion shin = times(thigh, about(x_axis, leg->knee));
	struct rigid *upper = &bone[BONE_THIGH + side];
	*upper = bone_at(joint_of(BONE_THIGH, side, scale), pelvis, times(pelvis->turn, mirrored(thigh, side)));
	bone[BONE_SHIN + side] =
		bone_at(joint_of(BONE_SHIN, side, scale), upper, times(pelvis->turn, mirrored(shin, side)));
}

/* The left or right ankle, moved by its shin. */
static struct vec3 ankle_of(const struct rigid bone[BONE_COUNT], int side, struct vec3 scale)
{
	const struct rigid *shin = &bone[BONE_SHIN + side];
	struct vec3 p = {(side ? -rest_ankle.x : rest_ankle.x) * scale.x, rest_ankle.y * scale.y,
			 rest_ankle.z * scale.z};
	return vec3_add(pose_turned(shin->turn, p), shin->move);
}

/* Puts the lower foot on the floor, and the middle between the feet where it is in rest. */
static void stand(struct rigid bone[BONE_COUNT], double rise, struct vec3 scale)
{
	struct vec3 left = ankle_of(bone, 0, scale), right = ankle_of(bone, 1, scale);
	struct vec3 shift = {-0.5 * (left.x + right.x),
			     rest_ankle.y * scale.y - (left.y < right.y ? left.y : right.y) + rise,
			     rest_ankle.z * scale.z - 0.5 * (left.z + right.z)};
	for (int b = 0; b < BONE_COUNT; b++)
		bone[b].move = vec3_add(bone[b].move, shift);
}

void pose_bones(struct rigid bone[BONE_COUNT], const struct pose *pose, struct vec3 scale)
{
	const struct rigid ground = {{1, 0, 0, 0}, {0, 0, 0}};
	struct quaternion pelvis =
		times(about(y_axis, pose->yaw), times(about(x_axis, pose->lean), about(z_axis, -pose->roll)));
	struct quaternion half = times(about(y_axis, pose->twist / 2),
				       times(about(x_axis, pose->bend / 2), about(z_axis, -pose->side / 2)));
	bone[BONE_PELVIS] = bone_at(joint_of(BONE_PELVIS, 0, scale), &ground, pelvis);
	bone[BONE_LUMBAR] = bone_at(joint_of(BONE_LUMBAR, 0, scale), &bone[BONE_PELVIS], times(pelvis, half));
	bone[BONE_CHEST] =
		bone_at(joint_of(BONE_CHEST, 0, scale), &bone[BONE_LUMBAR], times(times(pelvis, half), half));
	for (int side = 0; side < 2; side++) {
		pose_arm(bone, &pose->arm[side], side, scale);
		pose_leg(bone, &pose->leg[side], side, scale);
	}
	stand(bone, pose->rise, scale);
}
