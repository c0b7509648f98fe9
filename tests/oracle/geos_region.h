/* Regions and curves as GEOS' geometries. */
#ifndef TESTS_ORACLE_GEOS_REGION_H
#define TESTS_ORACLE_GEOS_REGION_H

#include "solver/curve/curve.h"
#include "solver/curve/region.h"
#include "tests/oracle/geos_strip.h"

static inline GEOSGeometry *geos_loop(const struct region *region, uint32_t loop)
{
	uint32_t first = region->first[loop], count = region->first[loop + 1] - first;
	GEOSCoordSequence *ring = GEOSCoordSeq_create(count + 1, 2);
	for (uint32_t i = 0; i <= count; i++)
		GEOSCoordSeq_setXY(ring, i, region->point[first + i % count].x, region->point[first + i % count].y);
	return GEOSGeom_createPolygon(GEOSGeom_createLinearRing(ring), NULL, 0);
}

static inline GEOSGeometry *geos_joined(GEOSGeometry *a, GEOSGeometry *b,
					GEOSGeometry *(*operation)(const GEOSGeometry *, const GEOSGeometry *))
{
	GEOSGeometry *result = operation(a, b);
	if (!result)
		abort();
	GEOSGeom_destroy(a);
	GEOSGeom_destroy(b);
	return result;
}

/* Even-odd: of loops that do not cross, as results have them. Loops that touch themselves in a point are mended. */
static inline GEOSGeometry *geos_region(const struct region *region)
{
	GEOSGeometry *sum = GEOSGeom_createEmptyPolygon();
	for (uint32_t l = 0; l < region->loop_count; l++) {
		GEOSGeometry *loop = geos_loop(region, l), *valid = GEOSMakeValid(loop);
		GEOSGeom_destroy(loop);
		sum = geos_joined(sum, valid, GEOSSymDifference);
	}
	return sum;
}

/* The union of loops to the left that do not cross themselves. */
static inline GEOSGeometry *geos_wound(const struct region *region)
{
	GEOSGeometry *sum = GEOSGeom_createEmptyPolygon();
	for (uint32_t l = 0; l < region->loop_count; l++) {
		GEOSGeometry *loop = geos_loop(region, l), *valid = GEOSMakeValid(loop);
		GEOSGeom_destroy(loop);
		sum = geos_joined(sum, valid, GEOSUnion);
	}
	return sum;
}

/* Points of spans in one plane, an arc by many, through libm. */
static inline GEOSGeometry *geos_line_of(const struct span *span, uint32_t count)
{
	enum { PARTS = 64 };
	GEOSCoordSequence *line = GEOSCoordSeq_create(1 + count * PARTS, 2);
	unsigned n = 0;
	GEOSCoordSeq_setXY(line, n++, span[0].from.x, span[0].from.y);
	for (uint32_t s = 0; s < count; s++)
		for (int i = 1; i <= PARTS; i++) {
			double t = (double)i / PARTS, x = span[s].from.x + t * (span[s].to.x - span[s].from.x),
			       y = span[s].from.y + t * (span[s].to.y - span[s].from.y);
			if (span[s].radius > 0) {
				double angle =
					atan2(span[s].from.y - span[s].centre.y, span[s].from.x - span[s].centre.x) +
					t * span[s].turn;
				x = span[s].centre.x + span[s].radius * cos(angle);
				y = span[s].centre.y + span[s].radius * sin(angle);
			}
			GEOSCoordSeq_setXY(line, n++, x, y);
		}
	return GEOSGeom_createLineString(line);
}

/* What lies within half the width of the curve, its ends square. */
static inline GEOSGeometry *geos_strip_of(const struct span *span, uint32_t count, double width)
{
	GEOSGeometry *line = geos_line_of(span, count);
	GEOSGeometry *strip = GEOSBufferWithStyle(line, width / 2, 64, GEOSBUF_CAP_FLAT, GEOSBUF_JOIN_ROUND, 5);
	GEOSGeom_destroy(line);
	return strip;
}

#endif
