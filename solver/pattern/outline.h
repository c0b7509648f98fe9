/* The outlines of the pattern pieces: their cut lines, as closed loops, and which parts of them are sewn together. */
#ifndef SOLVER_PATTERN_OUTLINE_H
#define SOLVER_PATTERN_OUTLINE_H

#include "solver/arena.h"
#include "solver/curve/vector.h"
#include "solver/garment/garment.h"

#include <stdbool.h>

/* One mesh edge on a cut line, directed so that its piece lies to the left. */
struct outline_segment {
	uint32_t edge; /* of the topology */
	uint32_t face;
	uint32_t from, to; /* pattern positions (coords) */
	uint32_t seam;     /* index into seams; GARMENT_NONE on a hem */
	uint32_t side;     /* of the seam, 0 or 1 */
};

struct outline_loop {
	uint32_t first, count; /* of the segments */
	uint32_t piece;
};

/* A maximal chain of seam edges between the same two sides, as a tailor would sew it in one go. Its two sides are
 * chains of segments, one in each loop's direction, the second run backwards. */
struct outline_seam {
	uint32_t piece[2];
	double length_mm[2]; /* of each side */
};

struct outline {
	struct outline_segment *segment; /* [segment_count], loop by loop, each in order */
	uint32_t segment_count;
	struct outline_loop *loop; /* [loop_count], in order of piece, then of the loop's lowest edge */
	uint32_t loop_count;
	struct outline_seam *seam; /* [seam_count] */
	uint32_t seam_count;
	uint32_t
		*piece_first; /* [piece_count + 1]: the segments of a piece are piece_first[p]…piece_first[p + 1] - 1 */
};

/* TW_ERROR_MEMORY. */
enum tw_status outline_build(struct outline *outline, struct arena *arena, const struct garment *garment,
			     const struct topology *topology, struct tw_error *error) TW_NODISCARD;

/* The distance of a point from the outline of its piece, and the nearest segment (may be NULL). */
double outline_distance(const struct outline *outline, const struct garment *garment, uint32_t piece, struct vec2 point,
			uint32_t *segment);

/* Whether a point lies in a piece: within its outline, and in none of its holes. */
bool outline_contains(const struct outline *outline, const struct garment *garment, uint32_t piece, struct vec2 point);

/* The middle of one side of a seam by length, where a tailor puts the two sides together first. */
struct seam_middle {
	uint32_t piece;
	struct vec2 at, inward; /* in the piece's plane; inward is a unit vector */
};

/* *middle: [seam_count][2], from the arena. TW_ERROR_MEMORY. */
enum tw_status outline_seam_middles(const struct outline *outline, const struct garment *garment, struct arena *arena,
				    struct seam_middle (**middle)[2], struct tw_error *error) TW_NODISCARD;

/* The ends of a segment in the pattern. */
void outline_ends(const struct outline *outline, const struct garment *garment, uint32_t segment, struct vec2 *from,
		  struct vec2 *to);

#endif
