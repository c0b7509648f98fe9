/* The strips of a layout as they lie on the pattern: for every branch and every piece that it covers, the area that is
 * to be pressed there, cut at the piece's cut line. What reaches beyond a seam lies on the piece behind it: a wire
 * along a seam covers half its strip on each of the two (method 6). What reaches beyond a hem is not there. */
#ifndef SOLVER_LAYOUT_STRIPS_H
#define SOLVER_LAYOUT_STRIPS_H

#include "solver/curve/region.h"
#include "solver/layout/wires.h"

struct strip_area {
	uint32_t piece;
	struct region region;  /* not empty */
	struct vec2 low, high; /* the box around it */
};

/* The strip of a wire, or of a part of one. */
struct strip_areas {
	struct strip_area *area; /* [count] by ascending piece */
	uint32_t count;
};

/* What all strips of a garment are cut with. */
struct strip_cutter {
	const struct garment *garment;
	const struct topology *topology;
	const struct outline *outline;
	struct region *piece; /* [piece_count] the pieces themselves */
	struct arena *arena;  /* what strips lie in */
	struct arena *scratch;
};

/* Borrows everything; `arena` and `scratch` are two. TW_ERROR_MEMORY. */
enum tw_status strip_cutter_init(struct strip_cutter *cutter, struct arena *arena, struct arena *scratch,
				 const struct garment *garment, const struct topology *topology,
				 const struct outline *outline, struct tw_error *error) TW_NODISCARD;

/* At its ends a strip stops square; where it crosses a seam it goes through. TW_ERROR_MEMORY. */
enum tw_status strips_cut(const struct strip_cutter *cutter, const struct wire *wire, double width,
			  struct strip_areas *areas, struct tw_error *error) TW_NODISCARD;

/* *areas: [wire_count]. */
enum tw_status strips_cut_all(const struct strip_cutter *cutter, const struct wire *wire, uint32_t wire_count,
			      double width, struct strip_areas **areas, struct tw_error *error) TW_NODISCARD;

#endif
