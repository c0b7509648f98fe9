/* Whether a motion belongs to a garment at all. */
#ifndef SOLVER_MOTION_FIT_H
#define SOLVER_MOTION_FIT_H

#include "solver/garment/garment.h"

/* Compares the area of the garment in a frame, position [vertex_count][3] in mm, with its worn area. A motion in
 * another unit, or of a mesh with another order of vertices, is off by far more than fabric stretches: TW_ERROR_INPUT
 * "motion-does-not-fit". */
enum tw_status motion_check_fit(const struct garment *garment, const float *position,
				struct tw_error *error) TW_NODISCARD;

#endif
