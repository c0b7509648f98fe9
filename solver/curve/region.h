/* Areas bounded by closed polygons, and what two of them have in common: how strips are cut at cut lines and how much
 * of anything they cover.
 *
 * Points are rounded to a grid of REGION_GRID_MM (coarser, by a power of two, where an area is more than 100 m across)
 * and all decisions are exact integer arithmetic on it: equal input gives equal output, however edges lie on one
 * another. Every edge that is cut may move by a grid's width. Time O(n * m) for n edges near both areas and m edges in
 * all.
 *
 * The edges of both areas are split where they meet, those that coincide are counted together, and an edge is kept
 * where the winding numbers say that the result lies on one of its sides only (as in Martinez, Rueda and Feito, A new
 * algorithm for computing Boolean operations on polygons, Computers & Geosciences 35, 2009, without the sweep). */
#ifndef SOLVER_CURVE_REGION_H
#define SOLVER_CURVE_REGION_H

#include "solver/arena.h"
#include "solver/curve/vector.h"

#include <stdbool.h>

#define REGION_GRID_MM (1.0 / 1024)

/* A point belongs to it where the loops wind around it to the left at least once: areas may be given as loops that
 * overlap or share edges, holes as loops to the right. Results have loops that do not meet but in points, the area on
 * their left. */
struct region {
	struct vec2 *point; /* [first[loop_count]] loop by loop */
	uint32_t *first;    /* [loop_count + 1] */
	uint32_t loop_count;
};

enum region_operation {
	REGION_COMMON, /* what lies in both */
	REGION_LESS,   /* what lies in a and not in b */
};

/* *result lies in `arena`; scratch memory comes from `scratch`, another one, and goes back. TW_ERROR_MEMORY. */
enum tw_status region_combine(struct region *result, struct arena *arena, struct arena *scratch, const struct region *a,
			      const struct region *b, enum region_operation operation,
			      struct tw_error *error) TW_NODISCARD;

/* The area, mm², of loops that do not overlap, such as results have. */
double region_area(const struct region *region);

/* A loop's area, negative to the right, and its centroid. */
double region_loop_area(const struct region *region, uint32_t loop, struct vec2 *centroid);

/* A region under construction; failure sticks. `region` may be read at any time. */
struct region_builder {
	struct arena *arena;
	struct region region;
	uint32_t point_room, loop_room;
	bool failed;
};

void region_start(struct region_builder *builder, struct arena *arena);
void region_begin_loop(struct region_builder *builder);
void region_add_point(struct region_builder *builder, struct vec2 point);
/* All loops of another region. */
void region_add(struct region_builder *builder, const struct region *region);

#endif
