/* Keys are poses at frames; between them every channel is a cubic Hermite curve with the slopes of Catmull and Rom,
 * zero at the ends unless the motion repeats. */
#include "solver/sample/motion.h"

#include <string.h>

#define LENGTH_OF(array) ((uint32_t)(sizeof(array) / sizeof *(array)))

struct key {
	double frame;
	struct pose pose;
};

/* Both arms, or both legs, alike. */
/* clang-format off */
#define BOTH(...) {{__VA_ARGS__}, {__VA_ARGS__}}
/* clang-format on */

/* Arms hanging beside the body, the elbow a little bent. */
#define HANGING(swing_, elbow_)                                                                                        \
	{                                                                                                              \
		.raise = -42, .swing = (swing_), .elbow = (elbow_)                                                     \
	}

/* Where the walk begins and ends: the left leg in front. */
#define LEFT_STEP                                                                                                      \
	{                                                                                                              \
		.yaw = -5, .twist = 10, .bend = 3, .arm = {HANGING(-22, 12), HANGING(24, 28)},                         \
		.leg = { {.lift = 27, .knee = 6},                                                                      \
			 {.lift = -18, .knee = 12} }                                                                   \
	}

static const struct key walk_keys[] = {
	{0, LEFT_STEP},
	{8,
	 {.roll = 3,
	  .bend = 3,
	  .arm = {HANGING(-2, 15), HANGING(4, 18)},
	  .leg = {{.lift = 8, .knee = 12}, {.lift = 14, .knee = 62}}}},
	{16,
	 {.yaw = 5,
	  .twist = -10,
	  .bend = 3,
	  .arm = {HANGING(24, 28), HANGING(-22, 12)},
	  .leg = {{.lift = -18, .knee = 12}, {.lift = 27, .knee = 6}}}},
	{24,
	 {.roll = -3,
	  .bend = 3,
	  .arm = {HANGING(4, 18), HANGING(-2, 15)},
	  .leg = {{.lift = 14, .knee = 62}, {.lift = 8, .knee = 12}}}},
	{32, LEFT_STEP},
};

static const struct key squat_keys[] = {
	{0, {.arm = BOTH(.raise = -25, .elbow = 10)}},
	{14,
	 {.lean = 18,
	  .bend = 8,
	  .arm = BOTH(.raise = 20, .turn = 45, .elbow = 12),
	  .leg = BOTH(.lift = 70, .spread = 6, .twist = 12, .knee = 72)}},
	{26,
	 {.lean = 30,
	  .bend = 12,
	  .arm = BOTH(.raise = 30, .turn = 72, .elbow = 15),
	  .leg = BOTH(.lift = 96, .spread = 8, .twist = 18, .knee = 104)}},
	{32,
	 {.lean = 30,
	  .bend = 12,
	  .arm = BOTH(.raise = 30, .turn = 72, .elbow = 15),
	  .leg = BOTH(.lift = 96, .spread = 8, .twist = 18, .knee = 104)}},
	{47, {.arm = BOTH(.raise = -25, .elbow = 10)}},
};

static const struct key jumping_jack_keys[] = {
	{0, {.arm = BOTH(.raise = -38, .elbow = 8), .leg = BOTH(.spread = -3)}},
	{5, {.bend = 5, .arm = BOTH(.raise = -36, .elbow = 12), .leg = BOTH(.lift = 22, .spread = -2, .knee = 42)}},
	{12, {.rise = 90, .arm = BOTH(.raise = 45, .elbow = 14), .leg = BOTH(.spread = 12, .knee = 4)}},
	{19, {.arm = BOTH(.raise = 90, .elbow = 18), .leg = BOTH(.lift = 8, .spread = 24, .knee = 18)}},
	{27, {.rise = 70, .arm = BOTH(.raise = 40, .elbow = 14), .leg = BOTH(.spread = 12, .knee = 4)}},
	{35, {.arm = BOTH(.raise = -38, .elbow = 8), .leg = BOTH(.spread = -3)}},
};

/* A right hook out of a boxer's guard. */
static const struct key hook_punch_keys[] = {
	{0,
	 {.bend = 8,
	  .yaw = -12,
	  .twist = -4,
	  .arm = BOTH(.raise = -28, .turn = 40, .twist = 35, .elbow = 105),
	  .leg = {{.lift = 24, .spread = 2, .knee = 22}, {.lift = -6, .spread = 6, .knee = 20}}}},
	{12,
	 {.bend = 10,
	  .yaw = -28,
	  .twist = -20,
	  .arm = {{.raise = -26, .turn = 45, .twist = 35, .elbow = 110},
		  {.raise = 10, .turn = 0, .twist = 15, .elbow = 92}},
	  .leg = {{.lift = 26, .spread = 3, .knee = 26}, {.lift = -4, .spread = 8, .knee = 28}}}},
	{20,
	 {.bend = 8,
	  .yaw = 12,
	  .twist = 22,
	  .arm = {{.raise = -30, .turn = 35, .twist = 35, .elbow = 115},
		  {.raise = 35, .turn = 62, .twist = 5, .elbow = 82}},
	  .leg = {{.lift = 18, .spread = 3, .knee = 24}, {.lift = -16, .spread = 6, .twist = -18, .knee = 22}}}},
	{26,
	 {.bend = 8,
	  .yaw = 24,
	  .twist = 28,
	  .arm = {{.raise = -30, .turn = 30, .twist = 35, .elbow = 118},
		  {.raise = 34, .turn = 85, .twist = 5, .elbow = 88}},
	  .leg = {{.lift = 16, .spread = 3, .knee = 24}, {.lift = -18, .spread = 5, .twist = -24, .knee = 24}}}},
	{39,
	 {.bend = 8,
	  .yaw = -12,
	  .twist = -4,
	  .arm = BOTH(.raise = -28, .turn = 40, .twist = 35, .elbow = 105),
	  .leg = {{.lift = 24, .spread = 2, .knee = 22}, {.lift = -6, .spread = 6, .knee = 20}}}},
};

static const struct key elbow_flexion_keys[] = {
	{0, {.arm = BOTH(.raise = -20, .elbow = 5)}},    {10, {.arm = BOTH(.raise = -20, .elbow = 60)}},
	{19, {.arm = BOTH(.raise = -20, .elbow = 125)}}, {29, {.arm = BOTH(.raise = -20, .elbow = 60)}},
	{39, {.arm = BOTH(.raise = -20, .elbow = 5)}},
};

static const struct key torso_twist_keys[] = {
	{0, {.arm = BOTH(.raise = 8, .elbow = 30), .leg = BOTH(.spread = 3)}},
	{12,
	 {.twist = 42,
	  .yaw = 6,
	  .bend = 2,
	  .arm = {{.raise = 8, .turn = 10, .elbow = 45}, {.raise = 8, .turn = 40, .elbow = 70}},
	  .leg = {{.spread = 3, .knee = 4}, {.spread = 3, .twist = -6, .knee = 6}}}},
	{24, {.arm = BOTH(.raise = 8, .elbow = 40), .leg = BOTH(.spread = 3)}},
	{36,
	 {.twist = -42,
	  .yaw = -6,
	  .bend = 2,
	  .arm = {{.raise = 8, .turn = 40, .elbow = 70}, {.raise = 8, .turn = 10, .elbow = 45}},
	  .leg = {{.spread = 3, .twist = -6, .knee = 6}, {.spread = 3, .knee = 4}}}},
	{47, {.arm = BOTH(.raise = 8, .elbow = 30), .leg = BOTH(.spread = 3)}},
};

static const struct {
	struct sample_motion about;
	const struct key *keys;
	uint32_t key_count;
	int repeats; /* the last key is the first again */
} motions[SAMPLE_MOTIONS] = {
	{{"walk", 33, 30}, walk_keys, LENGTH_OF(walk_keys), 1},
	{{"squat", 48, 30}, squat_keys, LENGTH_OF(squat_keys), 0},
	{{"jumping_jack", 36, 30}, jumping_jack_keys, LENGTH_OF(jumping_jack_keys), 0},
	{{"hook_punch", 40, 30}, hook_punch_keys, LENGTH_OF(hook_punch_keys), 0},
	{{"elbow_flexion", 40, 30}, elbow_flexion_keys, LENGTH_OF(elbow_flexion_keys), 0},
	{{"torso_twist", 48, 30}, torso_twist_keys, LENGTH_OF(torso_twist_keys), 0},
};

const struct sample_motion *sample_motion_at(uint32_t index)
{
	return &motions[index].about;
}

/* A pose is nothing but its channels. */
static double channel(const struct key *key, uint32_t index)
{
	double value;
	memcpy(&value, (const char *)&key->pose + index * sizeof value, sizeof value);
	return value;
}

/* Change per frame of a channel at key `i`. */
static double slope_at(uint32_t motion, uint32_t i, uint32_t index)
{
	const struct key *keys = motions[motion].keys;
	uint32_t last = motions[motion].key_count - 1;
	if (i > 0 && i < last)
		return (channel(&keys[i + 1], index) - channel(&keys[i - 1], index)) /
		       (keys[i + 1].frame - keys[i - 1].frame);
	if (!motions[motion].repeats)
		return 0;
	double frames = keys[1].frame - keys[0].frame + keys[last].frame - keys[last - 1].frame;
	return (channel(&keys[1], index) - channel(&keys[last - 1], index)) / frames;
}

void motion_pose(struct pose *pose, uint32_t motion, uint32_t frame)
{
	const struct key *keys = motions[motion].keys;
	uint32_t i = 0;
	while (i + 2 < motions[motion].key_count && frame > keys[i + 1].frame)
		i++;
	double width = keys[i + 1].frame - keys[i].frame, s = (frame - keys[i].frame) / width;
	double h1 = s * s * (3 - 2 * s), g0 = s * (1 - s) * (1 - s) * width, g1 = -s * s * (1 - s) * width;
	for (uint32_t c = 0; c < POSE_CHANNELS; c++) {
		double value = (1 - h1) * channel(&keys[i], c) + h1 * channel(&keys[i + 1], c) +
			       g0 * slope_at(motion, i, c) + g1 * slope_at(motion, i + 1, c);
		memcpy((char *)pose + c * sizeof value, &value, sizeof value);
	}
}
