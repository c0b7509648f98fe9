/* A strip laid on the fabric: the integral of a density over a convex polygon that lies in the pattern (method 3).
 *
 * The polygon is given in the pattern plane of a face. Faces are taken by walking outwards from it across every edge
 * that meets the polygon. Within a piece that is the flat pattern itself. At a seam the neighbour is laid against the
 * seam edge by the rigid motion that maps midpoint and direction of its side onto ours; lengths stay as they are, so
 * ease is neither stretched nor gathered. The nearest seam crossing is taken first, and a face is entered at most once.
 * Fabric beyond a hem is missing. Where a seam bends, the unfolded pieces overlap or gape: what adds up to more than
 * the strip's area is scaled down to it. The result is the same to the last bit however faces and corners are numbered.
 *
 * Source: method 3; clipping after Sutherland and Hodgman, Reentrant polygon clipping, CACM 17 (1974). */
#ifndef SOLVER_FIELD_STRIP_H
#define SOLVER_FIELD_STRIP_H

#include "solver/field/options.h"
#include "solver/garment/garment.h"

#include <stdbool.h>

/* What is walked on: one record for a face, a cache line each. Built once, shared by threads. */
struct strip_fabric {
	const struct garment *garment;   /* borrowed */
	const struct topology *topology; /* borrowed */
	const double *value;     /* [face_count] what is integrated: (density + eta) * multiplier, MPa; borrowed */
	struct strip_face *face; /* [face_count] */
};

/* A strip's account. cost = integral of `value` over the fabric that it covers. */
struct strip {
	double cost;         /* MPa mm2 */
	double area_mm2;     /* of the polygon */
	double covered_mm2;  /* what fabric covers; at most area_mm2, but for rounding */
	double largest;      /* largest value of a face that covers more than 1e-6 of the polygon, MPa; where all faces
				together cover less, that of the face that the strip was laid from */
	uint32_t face_count; /* faces entered */
};

/* Scratch of one thread. */
struct strip_walker;

enum { STRIP_CORNERS = 8 }; /* most corners of a polygon */

/* TW_ERROR_MEMORY. */
enum tw_status strip_fabric_build(struct strip_fabric *fabric, struct arena *arena, const struct garment *garment,
				  const struct topology *topology, const double *value,
				  struct tw_error *error) TW_NODISCARD;
enum tw_status strip_walker_new(struct strip_walker **walker, struct arena *arena, const struct strip_fabric *fabric,
				struct tw_error *error) TW_NODISCARD;

/* `corner` [corner_count][2] mm: convex, 3…STRIP_CORNERS corners, either orientation, in the pattern plane of `face`,
 * which it must touch. One without area, or whose corners are no finite numbers, covers nothing. */
void strip_polygon(struct strip_walker *walker, uint32_t face, const double *corner, uint32_t corner_count,
		   struct strip *strip);

/* The rectangle of width `width_mm` with the segment a-b as its midline; `face` touches the segment. */
void strip_segment(struct strip_walker *walker, uint32_t face, const double a[2], const double b[2], double width_mm,
		   struct strip *strip);

/* The strip of a mesh edge; a seam edge is the midline of half a strip on each of its two sides, a hem edge of a strip
 * whose outer half is missing. */
void strip_edge(struct strip_walker *walker, uint32_t edge, double width_mm, struct strip *strip);

/* A flip chord (chord.h), found across an edge. */
struct strip_chord {
	uint32_t vertex[2]; /* it joins, from the face that it is laid from on */
	uint32_t face[2];
	double along; /* where it crosses the edge, as a share from edge_vertex[0] on */
	double length_mm;
};

/* Finds the chord across an edge; false where there is none: at a hem, where the pair of faces is not convex, or where
 * both faces have the same opposite vertex. `fabric` alone is read. */
bool strip_find_chord(const struct strip_fabric *fabric, uint32_t edge, struct strip_chord *chord);

/* Its strip; false where there is no chord. */
bool strip_chord(struct strip_walker *walker, uint32_t edge, double width_mm, struct strip *strip);

/* The sum of two accounts, of the parts of a curve, say. */
void strip_add(struct strip *sum, const struct strip *part);

/* Cost with what is missing charged at the largest value, or not (FIELD_OVERHANG_IGNORE), MPa mm2. */
double strip_cost(const struct strip *strip, int overhang);

/* Of a strip that integrates 1 over some faces: whether it covers any of them; what is less than a millionth of it is a
 * matter of rounding. */
bool strip_touches(const struct strip *strip);

/* Share of the strip that fabric covers, 0…1. */
double strip_coverage(const struct strip *strip);

#endif
