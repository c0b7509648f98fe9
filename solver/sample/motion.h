/* The sample motions: keys of poses, joined smoothly. */
#ifndef SOLVER_SAMPLE_MOTION_H
#define SOLVER_SAMPLE_MOTION_H

#include "solver/sample/pose.h"
#include "solver/sample/sample.h"

/* The pose in a frame of a motion. */
void motion_pose(struct pose *pose, uint32_t motion, uint32_t frame);

#endif
