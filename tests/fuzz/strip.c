/* Any triangle or quadrangle on a sewn sheet, as a strip: what it covers lies within it, its cost is that of what it
 * covers, and the walk comes to an end, whatever the numbers are. */
#include "solver/field/strip.h"

#include "tests/oracle/meshes.h"

#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

struct cloth {
	struct arena *arena; /* kept for as long as the program runs */
	struct garment garment;
	struct topology topology;
	struct strip_fabric fabric;
	struct strip_walker *walker;
};

static struct cloth *cloth_once(void)
{
	static struct cloth cloth;
	if (cloth.walker)
		return &cloth;
	struct arena *arena = cloth.arena = arena_new(0);
	mesh_sheet(&cloth.garment, arena, 12, 9, 9, 0.3, 5);
	double *value = ARENA_ARRAY(arena, cloth.garment.face_count, double);
	for (uint32_t f = 0; value && f < cloth.garment.face_count; f++)
		value[f] = 2;
	if (!value || topology_build(&cloth.topology, arena, &cloth.garment, NULL) ||
	    strip_fabric_build(&cloth.fabric, arena, &cloth.garment, &cloth.topology, value, NULL) ||
	    strip_walker_new(&cloth.walker, arena, &cloth.fabric, NULL))
		abort();
	return &cloth;
}

/* Convex, and within ten metres: farther out, rounding leaves nothing to check. */
static int is_plausible(const double *corner, uint32_t count)
{
	int left = 0, right = 0;
	for (uint32_t i = 0; i < 2 * count; i++)
		if (!(fabs(corner[i]) < 1e4))
			return 0;
	for (uint32_t i = 0; i < count; i++) {
		const double *a = corner + 2 * i, *b = corner + 2 * ((i + 1) % count),
			     *c = corner + 2 * ((i + 2) % count);
		double turn = (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]);
		left |= turn > 0;
		right |= turn < 0;
	}
	return !(left && right);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct cloth *cloth = cloth_once();
	double corner[8];
	if (size < 1 + sizeof corner)
		return 0;
	uint32_t count = 3 + (data[0] & 1), face = (uint32_t)(data[0] >> 1) % cloth->garment.face_count;
	memcpy(corner, data + 1, sizeof corner);
	struct strip strip;
	strip_polygon(cloth->walker, face, corner, count, &strip);
	if (strip.face_count > cloth->garment.face_count)
		abort();
	if (!is_plausible(corner, count))
		return 0;
	double slack = 1e-7 * (1 + strip.area_mm2);
	if (strip.covered_mm2 > strip.area_mm2 + slack || fabs(strip.cost - 2 * strip.covered_mm2) > slack)
		abort();
	if (!(strip_coverage(&strip) >= 0 && strip_coverage(&strip) <= 1))
		abort();
	return 0;
}
