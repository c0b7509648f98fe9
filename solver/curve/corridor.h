/* The polygon that a smoothed wire is rounded from: few long legs that stay near a given path.
 *
 * A tree on a mesh zigzags along edges. Among all polygons whose corners are points of the path and whose legs stay
 * within a tolerance of it, `corridor_straighten` takes the one that costs least: every leg its length times a cost
 * rate, every corner a price that grows with its turn, and much more where the arc of the
 * smallest radius has no room. */
#ifndef SOLVER_CURVE_CORRIDOR_H
#define SOLVER_CURVE_CORRIDOR_H

#include "solver/arena.h"
#include "solver/curve/vector.h"

#include <stdbool.h>

struct corridor {
	const struct vec2 *point; /* [count] the path */
	const double *rate;       /* [count] cost of a millimetre at each point, > 0 */
	const bool *stop;         /* [count] the polygon must have a corner here */
	uint32_t count;           /* >= 2 */
	double tolerance;         /* mm */
	double minimum_radius;    /* mm */
	double bend_price;        /* mm of path that a corner costs, before its turn */
	/* What the leg between two points of the path costs, INFINITY where it may not be used; NULL, and INFINITY
	 * between neighbours, for its length times the mean rate of the path along it. */
	double (*leg_cost)(void *context, uint32_t i, uint32_t j);
	void *context;
};

/* Writes the chosen points, ascending, first and last included: kept[*kept_count], room for `count`. Scratch memory
 * comes from `arena` and goes back. O(count * window²) with a window of CORRIDOR_WINDOW points. TW_ERROR_MEMORY. */
enum { CORRIDOR_WINDOW = 48 };
enum tw_status corridor_straighten(const struct corridor *corridor, struct arena *arena, uint32_t *kept,
				   uint32_t *kept_count, struct tw_error *error) TW_NODISCARD;

#endif
