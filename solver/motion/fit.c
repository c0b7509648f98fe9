#include "solver/motion/fit.h"

#include <math.h>

/* Fabric that covers a moving body does not grow or shrink as a whole by more than this. */
static const double most_growth = 9;

static double cross_length(const double *u, const double *v)
{
	double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
	return sqrt(x * x + y * y + z * z);
}

/* By the length of the motion's cloth over that of the worn. */
static const char *advice(double scale)
{
	static const struct {
		double scale;
		const char *text;
	} units[] = {
		{1e-3, "it is 1000 times smaller, as metres are to millimetres; set motion_unit (m, where the mesh is "
		       "in mm)"},
		{1e-2,
		 "it is 100 times smaller, as metres are to centimetres; set motion_unit (m, where the mesh is in cm)"},
		{1e-1,
		 "it is 10 times smaller, as centimetres are to millimetres; set motion_unit (cm, where the mesh is "
		 "in mm)"},
		{1e1,
		 "it is 10 times larger, as millimetres are to centimetres; set motion_unit (mm, where the mesh is in "
		 "cm)"},
		{1e2,
		 "it is 100 times larger, as centimetres are to metres; set motion_unit (cm, where the mesh is in m)"},
		{1e3,
		 "it is 1000 times larger, as millimetres are to metres; set motion_unit (mm, where the mesh is in m)"},
	};
	for (size_t i = 0; i < sizeof units / sizeof *units; i++) {
		if (scale > units[i].scale / 1.5 && scale < units[i].scale * 1.5)
			return units[i].text;
	}
	return "the motion has another unit or another order of vertices; export both from the same mesh";
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
	return tw_fail(error, TW_ERROR_INPUT, "motion-does-not-fit", "frame 0",
		       "in the motion's first frame the garment has %.2f mm2, worn %.2f mm2: %s", moved, worn,
		       advice(sqrt(moved / worn)));
}

/* By counting, in steps of half a per cent; what is beyond the last counts as the last. */
double motion_size(const struct garment *garment, const float *position)
{
	enum { STEPS = 800, STEPS_TO_ONE = 200 };
	uint32_t count[STEPS] = {0};
	uint64_t below = 0;
	for (size_t i = 0; i < 3 * (size_t)garment->face_count; i++) {
		size_t from = 3 * (size_t)garment->face_vertex[i];
		size_t to = 3 * (size_t)garment->face_vertex[i % 3 == 2 ? i - 2 : i + 1];
		double worn = 0, moved = 0;
		for (size_t k = 0; k < 3; k++) {
			double a = garment->position[to + k] - garment->position[from + k];
			double b = (double)position[to + k] - (double)position[from + k];
			worn += a * a;
			moved += b * b;
		}
		double step = worn > 0 ? sqrt(moved / worn) * STEPS_TO_ONE + 0.5 : STEPS_TO_ONE;
		count[step < STEPS - 1 ? (size_t)step : STEPS - 1]++;
	}
	for (size_t step = 0; step < STEPS; step++) {
		below += count[step];
		if (2 * below >= 3 * (uint64_t)garment->face_count)
			return (double)step / STEPS_TO_ONE;
	}
	return 1;
}

void motion_warn_of_size(struct warning_list *warnings, double size)
{
	if (fabs(size - 1) < MOTION_SIZE_TOLERANCE)
		return;
	warning_add(
		warnings, "motion-other-size", "frame", 0,
		"in the first frame the fabric is %.1f %% %s, each way, than on the worn mesh: is this the motion of "
		"another size of the garment? Its strain is measured against this garment's pattern",
		100 * fabs(size - 1), size > 1 ? "longer" : "shorter");
}
