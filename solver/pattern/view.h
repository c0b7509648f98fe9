/* A worn garment seen from the front or from behind: a small picture of shades with its depths, from which a drawing is
 * made whose size does not depend on the mesh. y is up, +z the way the wearer faces. */
#ifndef SOLVER_PATTERN_VIEW_H
#define SOLVER_PATTERN_VIEW_H

#include "solver/arena.h"
#include "solver/curve/vector.h"
#include "solver/garment/garment.h"

#include <stdbool.h>

enum { VIEW_SHADES = 32 };

struct view {
	bool back;
	double cell_mm;
	double left, top; /* of the picture, in the view's millimetres, y up */
	uint32_t columns, rows;
	float *depth;   /* [rows][columns] towards the viewer, mm; -INFINITY where nothing is */
	uint8_t *shade; /* [rows][columns] 0 for nothing, 1 dark … VIEW_SHADES light */
};

/* Renders with `cell_mm` millimetres a cell (larger where the picture would have more than 16 million).
 * TW_ERROR_MEMORY. */
enum tw_status view_render(struct view *view, struct arena *arena, const struct garment *garment, bool back,
			   double cell_mm, struct tw_error *error) TW_NODISCARD;

/* Where a point of space is seen, in the view's millimetres, y up; *depth is towards the viewer. */
struct vec2 view_point(const struct view *view, const double point[3], double *depth);

/* Whether a point of the garment is seen: no more than `slack_mm` lies over it. */
bool view_sees(const struct view *view, const double point[3], double slack_mm);

#endif
