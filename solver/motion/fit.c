#include "solver/motion/fit.h"

#include <math.h>

/* Fabric that covers a moving body does not grow or shrink as a whole by more than this. */
static const double most_growth = 9;

static double cross_length(const double *u, const double *v)
{
	double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
	return sqrt(x * x + y * y + z * z);
}

enum tw_status motion_check_fit(const struct garment *garment, const float *position, struct tw_error *error)
{
	double worn = 0, moved = 0;
	for (uint32_t f = 0; f < garment->face_count; f++) {
		const uint32_t *v = garment->face_vertex + 3 * (size_t)f;
		double side[2][3], moved_side[2][3];
		for (size_t i = 0; i < 6; i++) {
			size_t from = 3 * (size_t)v[0] + i % 3, to = 3 * (size_t)v[1 + i / 3] + i % 3;
			side[i / 3][i % 3] = garment->position[to] - garment->position[from];
			moved_side[i / 3][i % 3] = (double)position[to] - (double)position[from];
		}
		worn += cross_length(side[0], side[1]) / 2;
		moved += cross_length(moved_side[0], moved_side[1]) / 2;
	}
	if (moved <= most_growth * worn && worn <= most_growth * moved)
		return TW_OK;
	return tw_fail(
		error, TW_ERROR_INPUT, "motion-does-not-fit", NULL,
		"in the motion's first frame the garment has %.4g mm2, worn %.4g mm2: the motion has another unit or "
		"another order of vertices; export both from the same mesh",
		moved, worn);
}
