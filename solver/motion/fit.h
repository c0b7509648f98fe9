/* Whether a motion belongs to a garment at all. */
#ifndef SOLVER_MOTION_FIT_H
#define SOLVER_MOTION_FIT_H

#include "solver/garment/garment.h"
#include "solver/warning.h"

/* Compares the area of the garment in a frame, position [vertex_count][3] in mm, with its worn area. A motion in
 * another unit, or of a mesh with another order of vertices, is off by far more than fabric stretches: TW_ERROR_INPUT
 * "motion-does-not-fit". */
enum tw_status motion_check_fit(const struct garment *garment, const float *position,
				struct tw_error *error) TW_NODISCARD;

/* Of the sides of all faces, the median of length in the frame over length as worn. Whatever pose the wearer takes,
 * most of the fabric keeps its length to within a per cent; the motion of another size of the garment, which has the
 * same vertices, shows here. */
double motion_size(const struct garment *garment, const float *position);

/* Sizes of garments are some five per cent apart, bodies that wear the same size two. */
#define MOTION_SIZE_TOLERANCE 0.03

/* Adds the warning "motion-other-size" where it is beyond that. */
void motion_warn_of_size(struct warning_list *warnings, double size);

#endif
