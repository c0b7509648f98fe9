/* Ear clipping: as long as more than three corners are left, the ear with the shortest diagonal is cut off (the lowest
 * on a tie), so that the same polygon is always cut the same way and into compact triangles. Polygons are small: cubic
 * time does not matter. */
#include "solver/garment/draft.h"

#include <assert.h>

static double cross_of(const double *a, const double *b, const double *c)
{
	return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Whether the corners left[i - 1], left[i], left[i + 1] are an ear. */
static bool is_ear(const double *xy, const uint32_t *left, uint32_t count, uint32_t i)
{
	const double *a = xy + 2 * left[(i + count - 1) % count], *b = xy + 2 * left[i];
	const double *c = xy + 2 * left[(i + 1) % count];
	if (!(cross_of(a, b, c) > 0))
		return false;
	for (uint32_t j = 0; j < count; j++) {
		const double *p = xy + 2 * left[j];
		if (p == a || p == b || p == c)
			continue;
		if (cross_of(a, b, p) >= 0 && cross_of(b, c, p) >= 0 && cross_of(c, a, p) >= 0)
			return false;
	}
	return true;
}

static double diagonal_of(const double *xy, const uint32_t *left, uint32_t count, uint32_t i)
{
	const double *a = xy + 2 * left[(i + count - 1) % count], *c = xy + 2 * left[(i + 1) % count];
	return (c[0] - a[0]) * (c[0] - a[0]) + (c[1] - a[1]) * (c[1] - a[1]);
}

static void cut_fan(uint32_t count, uint32_t *triangles)
{
	for (uint32_t i = 0; i + 2 < count; i++) {
		triangles[3 * i] = 0;
		triangles[3 * i + 1] = i + 1;
		triangles[3 * i + 2] = i + 2;
	}
}

bool polygon_cut(const double *xy, uint32_t count, uint32_t *triangles)
{
	assert(count >= 3 && count <= POLYGON_CORNERS);
	uint32_t left[POLYGON_CORNERS] = {0}, remaining = count;
	uint32_t *triangle = triangles;
	for (uint32_t i = 0; i < count; i++)
		left[i] = i;
	while (remaining > 3) {
		uint32_t best = remaining;
		for (uint32_t i = 0; i < remaining; i++) {
			if (is_ear(xy, left, remaining, i) &&
			    (best == remaining ||
			     diagonal_of(xy, left, remaining, i) < diagonal_of(xy, left, remaining, best)))
				best = i;
		}
		if (best == remaining) {
			cut_fan(count, triangles);
			return false;
		}
		*triangle++ = left[(best + remaining - 1) % remaining];
		*triangle++ = left[best];
		*triangle++ = left[(best + 1) % remaining];
		remaining--;
		for (uint32_t i = best; i < remaining; i++)
			left[i] = left[i + 1];
	}
	for (uint32_t i = 0; i < 3; i++)
		*triangle++ = left[i];
	return cross_of(xy + 2 * left[0], xy + 2 * left[1], xy + 2 * left[2]) > 0;
}
