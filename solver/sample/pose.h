/* How the wearer stands: joint angles, and what they do to the bones. Degrees; 0 is the rest pose. */
#ifndef SOLVER_SAMPLE_POSE_H
#define SOLVER_SAMPLE_POSE_H

#include "solver/sample/vector.h"

struct arm_pose {
	double raise; /* outwards and up, from the rest pose (37 degrees below level) */
	double swing; /* then forward, as in walking */
	double turn;  /* then forward around the body, at the level reached */
	double twist; /* about the arm's own axis, before all others; thumb up is positive */
	double elbow; /* bent */
};

struct leg_pose {
	double lift;   /* forward */
	double spread; /* outwards */
	double twist;  /* toes outwards */
	double knee;   /* bent */
};

/* Side 0 is left, 1 right. The wearer stands: the angles alone say where the pelvis is above the feet. */
struct pose {
	double rise;              /* of the lower foot from the floor, mm */
	double lean, yaw, roll;   /* of the pelvis: forward, to the left, to the left side */
	double bend, twist, side; /* of the spine, from pelvis to chest: forward, to the left, to the left side */
	struct arm_pose arm[2];
	struct leg_pose leg[2];
};

enum { POSE_CHANNELS = sizeof(struct pose) / sizeof(double) };

enum bone {
	BONE_PELVIS,
	BONE_LUMBAR,
	BONE_CHEST,
	BONE_CLAVICLE, /* left, then right */
	BONE_UPPER_ARM = BONE_CLAVICLE + 2,
	BONE_FOREARM = BONE_UPPER_ARM + 2,
	BONE_THIGH = BONE_FOREARM + 2,
	BONE_SHIN = BONE_THIGH + 2,
	BONE_COUNT = BONE_SHIN + 2,
};

/* A unit quaternion w + xi + yj + zk. */
struct quaternion {
	double w, x, y, z;
};

/* A rigid motion: turn about the origin, then move. */
struct rigid {
	struct quaternion turn;
	struct vec3 move;
};

/* The motion of every bone from its place in rest, for a wearer scaled by `scale`. */
void pose_bones(struct rigid bone[BONE_COUNT], const struct pose *pose, struct vec3 scale);

/* v turned by q. */
struct vec3 pose_turned(struct quaternion q, struct vec3 v);

/* The bone that carries this one; the pelvis is its own. */
enum bone pose_parent(enum bone bone);

/* Where the joint at a bone's root is in rest, size L. */
struct vec3 pose_joint(enum bone bone);

#endif
