/* Which face of a pattern piece lies under a point, and how far a point is from its piece. */
#ifndef SOLVER_PATTERN_LOCATE_H
#define SOLVER_PATTERN_LOCATE_H

#include "solver/arena.h"
#include "solver/curve/vector.h"
#include "solver/garment/garment.h"

/* A point on the fabric. */
struct place {
	uint32_t face;
	double barycentric[3]; /* of the face's corners, each >= 0, sum 1 */
	double distance;       /* mm from the point that was asked for; 0 when it lies in the face */
};

struct locator;

/* A grid over every piece, built in O(faces). The garment is borrowed. TW_ERROR_MEMORY. */
enum tw_status locator_build(const struct locator **locator, struct arena *arena, const struct garment *garment,
			     struct tw_error *error) TW_NODISCARD;

/* The nearest place of `piece` to `point`, in the pattern; of several at the same distance the face with the lowest
 * number. A distance below 1e-9 mm is 0. */
void locator_find(const struct locator *locator, uint32_t piece, struct vec2 point, struct place *place);

/* The parameters 0 < t < 1, ascending, at which the segment from a to b meets edges of the piece's faces: between two
 * of them it runs in one face. Writes at most `limit` and returns how many; where that is `limit`, there may be more.
 */
uint32_t locator_cuts(const struct locator *locator, uint32_t piece, struct vec2 a, struct vec2 b, double *t,
		      uint32_t limit);

/* The point of the pattern, of the worn mesh, or of a frame (float [vertex_count][3]), that a place names. */
struct vec2 place_on_pattern(const struct garment *garment, const struct place *place);
void place_on_worn(const struct garment *garment, const struct place *place, double point[3]);
void place_in_frame(const struct garment *garment, const struct place *place, const float *positions, double point[3]);

#endif
