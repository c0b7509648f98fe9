/* The strip of a curve as an area: what lies within half a width to the side of it, without caps at its ends. */
#ifndef SOLVER_CURVE_RIBBON_H
#define SOLVER_CURVE_RIBBON_H

#include "solver/curve/curve.h"
#include "solver/curve/region.h"

/* How far the chords of a flattened arc may be from it, mm: less than a hundredth of what a cutter can. */
#define RIBBON_CHORD_MM 0.01

/* Adds the strip of spans that follow one another in one plane, its arcs flattened: one loop, and one more for every
 * arc that is tighter than half the width. */
void ribbon_add(struct region_builder *builder, const struct span *span, uint32_t span_count, double width);

/* Adds points of an arc, its first and last among them, off to the left of it by `offset` (to the right where that is
 * negative), or of a line; backwards where asked. */
void ribbon_add_side(struct region_builder *builder, const struct span *span, double offset, bool backwards);

#endif
