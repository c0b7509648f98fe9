/* The strip integral by way of GEOS, the engine under Shapely: polygons, intersections and areas are its own. Two
 * oracles. `plane_strip` knows no walking at all: every face lies somewhere in one plane, and the strip is intersected
 * with all that are near. `walked_strip` follows method 3 for any garment, in the most obvious way. */
#ifndef TESTS_ORACLE_GEOS_STRIP_H
#define TESTS_ORACLE_GEOS_STRIP_H

#include "solver/garment/garment.h"

#include <geos_c.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

struct geos_strip {
	double cost, covered_mm2, area_mm2, largest;
};

static inline void geos_print(const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	vfprintf(stderr, format, arguments);
	va_end(arguments);
	fputc('\n', stderr);
}

static inline GEOSGeometry *geos_polygon(size_t count, const double *x, const double *y)
{
	GEOSCoordSequence *ring = GEOSCoordSeq_create((unsigned)count + 1, 2);
	for (size_t i = 0; i <= count; i++)
		GEOSCoordSeq_setXY(ring, (unsigned)i, x[i % count], y[i % count]);
	return GEOSGeom_createPolygon(GEOSGeom_createLinearRing(ring), NULL, 0);
}

static inline GEOSGeometry *geos_segment(const double p[2], const double q[2])
{
	GEOSCoordSequence *line = GEOSCoordSeq_create(2, 2);
	GEOSCoordSeq_setXY(line, 0, p[0], p[1]);
	GEOSCoordSeq_setXY(line, 1, q[0], q[1]);
	return GEOSGeom_createLineString(line);
}

static inline double geos_common_area(const GEOSGeometry *a, const GEOSGeometry *b)
{
	GEOSGeometry *common = GEOSIntersection(a, b);
	double area = 0;
	if (!common || !GEOSArea(common, &area))
		abort();
	GEOSGeom_destroy(common);
	return area;
}

static inline void geos_account(struct geos_strip *strip, double area, double value)
{
	strip->covered_mm2 += area;
	strip->cost += area * value;
	if (area > 1e-6 * strip->area_mm2 && value > strip->largest)
		strip->largest = value;
}

/* The strip of width `width` with a-b as its midline: its sides at `low` and `high` times the width to the left. */
static inline GEOSGeometry *geos_rectangle(const double a[2], const double b[2], double low, double high)
{
	double dx = b[0] - a[0], dy = b[1] - a[1], length = hypot(dx, dy);
	double nx = -dy / length, ny = dx / length;
	double x[4] = {a[0] + low * nx, b[0] + low * nx, b[0] + high * nx, a[0] + high * nx};
	double y[4] = {a[1] + low * ny, b[1] + low * ny, b[1] + high * ny, a[1] + high * ny};
	return geos_polygon(4, x, y);
}

/* Faces laid in one plane, corner[face][k][x, y], and what each of them is worth. */
static inline struct geos_strip plane_strip(const double (*corner)[3][2], const double *value, uint32_t count,
					    const GEOSGeometry *rectangle)
{
	struct geos_strip strip = {0};
	if (!GEOSArea(rectangle, &strip.area_mm2))
		abort();
	double x0, y0, x1, y1;
	GEOSGeom_getXMin(rectangle, &x0);
	GEOSGeom_getYMin(rectangle, &y0);
	GEOSGeom_getXMax(rectangle, &x1);
	GEOSGeom_getYMax(rectangle, &y1);
	for (uint32_t f = 0; f < count; f++) {
		double x[3], y[3];
		for (int k = 0; k < 3; k++) {
			x[k] = corner[f][k][0];
			y[k] = corner[f][k][1];
		}
		if (fmax(fmax(x[0], x[1]), x[2]) < x0 || fmin(fmin(x[0], x[1]), x[2]) > x1 ||
		    fmax(fmax(y[0], y[1]), y[2]) < y0 || fmin(fmin(y[0], y[1]), y[2]) > y1)
			continue;
		GEOSGeometry *face = geos_polygon(3, x, y);
		geos_account(&strip, geos_common_area(face, rectangle), value[f]);
		GEOSGeom_destroy(face);
	}
	return strip;
}

/* --- method 3, step by step ----------------------------------------------------------------------------------------
 */

struct geos_place {
	uint32_t face;
	double distance;
	double x[3], y[3]; /* where the corners lie in the plane of the strip */
};

enum { GEOS_PLACES = 4096 };

struct geos_walk {
	const struct garment *garment;
	const struct topology *topology;
	const double *value;
	uint8_t *entered; /* [face_count] all 0 between strips */
	struct geos_place crossing[GEOS_PLACES], laid[GEOS_PLACES];
	size_t crossings, laids;
	int doubled; /* the last strip's areas added up to more than its own */
};

static inline const double *geos_pattern(const struct geos_walk *walk, uint32_t face, unsigned corner)
{
	return walk->garment->pattern + 2 * (size_t)walk->garment->face_coord[3 * (size_t)face + corner % 3];
}

/* Lays `face` so that the points p and q of its pattern come to lie at p1 and q1, midpoint on midpoint. */
static inline struct geos_place geos_lay(const struct geos_walk *walk, uint32_t face, const double *p, const double *q,
					 const double *p1, const double *q1)
{
	double angle = atan2(q1[1] - p1[1], q1[0] - p1[0]) - atan2(q[1] - p[1], q[0] - p[0]);
	struct geos_place place = {.face = face};
	for (unsigned k = 0; k < 3; k++) {
		const double *u = geos_pattern(walk, face, k);
		double x = u[0] - (p[0] + q[0]) / 2, y = u[1] - (p[1] + q[1]) / 2;
		place.x[k] = cos(angle) * x - sin(angle) * y + (p1[0] + q1[0]) / 2;
		place.y[k] = sin(angle) * x + cos(angle) * y + (p1[1] + q1[1]) / 2;
	}
	return place;
}

/* The neighbours of a laid face across every side of which some length is in the strip: into the flood within the
 * piece, among the crossings across a seam. */
static inline void geos_reach(struct geos_walk *walk, const struct geos_place *at, const GEOSGeometry *rectangle,
			      uint32_t closed_edge)
{
	for (unsigned k = 0; k < 3; k++) {
		uint32_t edge = walk->topology->face_edge[3 * (size_t)at->face + k];
		const uint32_t *faces = walk->topology->edge_face + 2 * (size_t)edge;
		const uint8_t *sides = walk->topology->edge_side + 2 * (size_t)edge;
		unsigned other = faces[0] == at->face && sides[0] == k;
		uint32_t next = faces[other];
		if (next == GARMENT_NONE || walk->entered[next] || edge == closed_edge)
			continue;
		unsigned l = (k + 1) % 3;
		double p[2] = {at->x[k], at->y[k]}, q[2] = {at->x[l], at->y[l]}, length;
		GEOSGeometry *segment = geos_segment(p, q);
		GEOSGeometry *inside = GEOSIntersection(segment, rectangle);
		GEOSLength(inside, &length);
		if (length > 1e-9 * hypot(q[0] - p[0], q[1] - p[1])) {
			struct geos_place place = geos_lay(walk, next, geos_pattern(walk, next, sides[other]),
							   geos_pattern(walk, next, sides[other] + 1u), q, p);
			GEOSGeometry *middle = GEOSGetCentroid(rectangle), *part = GEOSGetCentroid(inside);
			GEOSDistance(middle, part, &place.distance);
			GEOSGeom_destroy(middle);
			GEOSGeom_destroy(part);
			int seam = walk->topology->edge_kind[edge] == EDGE_SEAM;
			if (walk->crossings == GEOS_PLACES || walk->laids == GEOS_PLACES)
				abort();
			if (seam) {
				walk->crossing[walk->crossings++] = place;
			} else {
				walk->entered[next] = 1;
				walk->laid[walk->laids++] = place;
			}
		}
		GEOSGeom_destroy(segment);
		GEOSGeom_destroy(inside);
	}
}

/* Half a strip (`half`) on the left of a face's side, or the whole. */
static inline struct geos_strip geos_walk_side(struct geos_walk *walk, uint32_t edge, unsigned which, double width,
					       int half)
{
	uint32_t face = walk->topology->edge_face[2 * (size_t)edge + which];
	unsigned side = walk->topology->edge_side[2 * (size_t)edge + which];
	const double *a = geos_pattern(walk, face, side), *b = geos_pattern(walk, face, side + 1);
	GEOSGeometry *rectangle = geos_rectangle(a, b, half ? 0 : -width / 2, width / 2);
	struct geos_strip strip = {0};
	GEOSArea(rectangle, &strip.area_mm2);
	walk->crossings = 0;
	walk->laids = 0;
	/* The first face lies where it lies. Laid by a turn of nothing, its side would miss the rectangle's by a
	 * rounding, of which GEOS makes an empty intersection now and then. */
	struct geos_place start = {.face = face};
	for (unsigned k = 0; k < 3; k++) {
		start.x[k] = geos_pattern(walk, face, k)[0];
		start.y[k] = geos_pattern(walk, face, k)[1];
	}
	walk->crossing[walk->crossings++] = start;
	size_t done = 0;
	while (walk->crossings) {
		size_t best = 0;
		for (size_t i = 0; i < walk->crossings; i++)
			if (walk->crossing[i].distance < walk->crossing[best].distance)
				best = i;
		struct geos_place place = walk->crossing[best];
		walk->crossing[best] = walk->crossing[--walk->crossings];
		if (walk->entered[place.face])
			continue;
		walk->entered[place.face] = 1;
		walk->laid[walk->laids++] = place;
		for (; done < walk->laids; done++) {
			struct geos_place at = walk->laid[done];
			GEOSGeometry *triangle = geos_polygon(3, at.x, at.y);
			geos_account(&strip, geos_common_area(triangle, rectangle), walk->value[at.face]);
			GEOSGeom_destroy(triangle);
			geos_reach(walk, &at, rectangle, half ? edge : UINT32_MAX);
		}
	}
	for (size_t i = 0; i < walk->laids; i++)
		walk->entered[walk->laid[i].face] = 0;
	GEOSGeom_destroy(rectangle);
	return strip;
}

static inline struct geos_strip walked_strip(struct geos_walk *walk, uint32_t edge, double width)
{
	uint8_t kind = walk->topology->edge_kind[edge];
	struct geos_strip strip = geos_walk_side(walk, edge, 0, width, kind != EDGE_INNER);
	if (kind == EDGE_HEM)
		strip.area_mm2 *= 2;
	if (kind == EDGE_SEAM) {
		struct geos_strip other = geos_walk_side(walk, edge, 1, width, 1);
		strip.cost += other.cost;
		strip.covered_mm2 += other.covered_mm2;
		strip.area_mm2 += other.area_mm2;
		strip.largest = fmax(strip.largest, other.largest);
	}
	walk->doubled = strip.covered_mm2 > strip.area_mm2 * (1 + 1e-9);
	if (strip.covered_mm2 > strip.area_mm2) {
		strip.cost *= strip.area_mm2 / strip.covered_mm2;
		strip.covered_mm2 = strip.area_mm2;
	}
	return strip;
}

#endif
