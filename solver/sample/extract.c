/* Marching tetrahedra over a grid (six tetrahedra to a cube, Kuhn's subdivision, so that a grid edge is told by its
 * lower end and one of seven directions), then one cut after the other: vertices close to a cut are moved to it in
 * name, edges that still cross it are divided. A grid plane coincides with the plane of symmetry, where the mesh simply
 * ends. */
#include "solver/sample/extract.h"

#include <string.h>

/* mm; the grid's cell, and how close to a vertex (as a share of an edge) the skin or a cut may pass. */
static const double cell = 14, closest = 0.12;
static const struct vec3 grid_origin = {0, 56, -196};
enum { GRID_X = 50, GRID_Y = 106, GRID_Z = 28, GRID_POINTS = GRID_X * GRID_Y * GRID_Z };

struct grid {
	const struct body *body;
	struct surface *surface;
	float *distance;         /* [GRID_POINTS] */
	uint32_t (*crossing)[7]; /* [GRID_POINTS] vertex on the edge in each direction, SURFACE_NONE where none yet */
};

static uint32_t grid_index(uint32_t x, uint32_t y, uint32_t z)
{
	return (z * GRID_Y + y) * GRID_X + x;
}

static struct vec3 grid_point(uint32_t index)
{
	uint32_t x = index % GRID_X, y = index / GRID_X % GRID_Y, z = index / ((uint32_t)GRID_X * GRID_Y);
	return vec3_add(grid_origin, (struct vec3){cell * x, cell * y, cell * z});
}

static void grid_fill(struct grid *grid)
{
	for (uint32_t i = 0; i < GRID_POINTS; i++) {
		double d = body_distance(grid->body, grid_point(i));
		double least = closest * cell;
		if (fabs(d) < least)
			d = d < 0 ? -least : least;
		grid->distance[i] = (float)d;
	}
	memset(grid->crossing, 0xff, GRID_POINTS * sizeof *grid->crossing);
}

/* The vertex where the skin crosses the edge between two grid points; `low`'s offsets are a subset of `high`'s. */
static uint32_t crossing_vertex(struct grid *grid, uint32_t base, unsigned low, unsigned high)
{
	const uint32_t offset[3] = {1, GRID_X, (uint32_t)GRID_X * GRID_Y};
	uint32_t a = base, b = base;
	for (int axis = 0; axis < 3; axis++) {
		a += low >> axis & 1 ? offset[axis] : 0;
		b += high >> axis & 1 ? offset[axis] : 0;
	}
	uint32_t *known = &grid->crossing[a][(high ^ low) - 1];
	struct surface *surface = grid->surface;
	if (*known != SURFACE_NONE || surface->vertex_count == surface->vertex_capacity)
		return *known;
	double da = (double)grid->distance[a], db = (double)grid->distance[b], t = da / (da - db);
	struct vec3 p = grid_point(a), q = grid_point(b);
	*known = surface->vertex_count++;
	surface->position[*known] = vec3_step(p, vec3_sub(q, p), t);
	surface->cuts[*known] = p.x == 0 && q.x == 0 ? 1u << CUT_CENTRE : 0;
	return *known;
}

static bool face_add(struct surface *surface, uint32_t a, uint32_t b, uint32_t c, struct vec3 outward)
{
	if (a == SURFACE_NONE || b == SURFACE_NONE || c == SURFACE_NONE ||
	    surface->face_count == surface->face_capacity)
		return false;
	const struct vec3 *p = surface->position;
	bool turn = vec3_dot(vec3_normal(p[a], p[b], p[c]), outward) < 0;
	uint32_t f = surface->face_count++;
	memcpy(surface->corner[f], (uint32_t[3]){a, turn ? c : b, turn ? b : c}, sizeof *surface->corner);
	surface->piece[f] = 0;
	return true;
}

static struct vec3 corner_offset(unsigned corner)
{
	return (struct vec3){corner & 1, corner >> 1 & 1, corner >> 2 & 1};
}

/* One tetrahedron: its corners are bit sets, each containing the one before. */
static bool tetrahedron_add(struct grid *grid, uint32_t base, const unsigned corner[4], const bool inside[8])
{
	unsigned in[4], out[4];
	int ins = 0, outs = 0;
	for (int i = 0; i < 4; i++) {
		if (inside[corner[i]])
			in[ins++] = corner[i];
		else
			out[outs++] = corner[i];
	}
	if (!ins || !outs)
		return true;
	uint32_t vertex[4];
	struct vec3 outward = {0, 0, 0};
	int n = 0;
	for (int i = 0; i < ins; i++)
		for (int o = 0; o < outs; o++) {
			unsigned low = in[i] & out[o];
			vertex[n++] = crossing_vertex(grid, base, low, in[i] | out[o]);
			outward = vec3_add(outward, vec3_sub(corner_offset(out[o]), corner_offset(in[i])));
		}
	if (n == 3)
		return face_add(grid->surface, vertex[0], vertex[1], vertex[2], outward);
	/* Around the quadrilateral: 00, 01, 11, 10. */
	return face_add(grid->surface, vertex[0], vertex[1], vertex[3], outward) &&
	       face_add(grid->surface, vertex[0], vertex[3], vertex[2], outward);
}

static bool cube_add(struct grid *grid, uint32_t base)
{
	static const unsigned tetrahedra[6][4] = {
		{0, 1, 3, 7}, {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 6, 7},
	};
	bool inside[8];
	int count = 0;
	for (unsigned c = 0; c < 8; c++) {
		uint32_t at = base + (c & 1) + (c >> 1 & 1) * GRID_X + (c >> 2) * (GRID_X * GRID_Y);
		inside[c] = grid->distance[at] < 0;
		count += inside[c];
	}
	if (count == 0 || count == 8)
		return true;
	for (int t = 0; t < 6; t++)
		if (!tetrahedron_add(grid, base, tetrahedra[t], inside))
			return false;
	return true;
}

static bool march(struct grid *grid)
{
	grid_fill(grid);
	for (uint32_t z = 0; z + 1 < GRID_Z; z++)
		for (uint32_t y = 0; y + 1 < GRID_Y; y++)
			for (uint32_t x = 0; x + 1 < GRID_X; x++)
				if (!cube_add(grid, grid_index(x, y, z)))
					return false;
	return true;
}

/* Values of a cut at the vertices; those that are small against their edges become 0. */
static void cut_values(const struct surface *surface, const struct body *body, enum body_cut cut, double *value)
{
	for (uint32_t v = 0; v < surface->vertex_count; v++)
		value[v] = body_cut_side(body, cut, surface->position[v]);
	for (uint32_t f = 0; f < surface->face_count; f++)
		for (int k = 0; k < 3; k++) {
			uint32_t a = surface->corner[f][k], b = surface->corner[f][corner_next(k)];
			if (value[a] * value[b] < 0 && fabs(value[a]) < closest * fabs(value[a] - value[b]))
				value[a] = 0;
			if (value[a] * value[b] < 0 && fabs(value[b]) < closest * fabs(value[a] - value[b]))
				value[b] = 0;
		}
}

/* Divides every edge that crosses the cut. A face has at most two such edges and their splits do not meet others. */
static bool cut_edges(struct surface *surface, enum body_cut cut, double *value)
{
	for (uint32_t f = 0; f < surface->face_count; f++)
		for (int k = 0; k < 3; k++) {
			uint32_t a = surface->corner[f][k], b = surface->corner[f][corner_next(k)];
			if (value[a] * value[b] >= 0)
				continue;
			double t = value[a] / (value[a] - value[b]);
			struct vec3 pa = surface->position[a], pb = surface->position[b];
			uint8_t common = surface->cuts[a] & surface->cuts[b];
			bool line = surface_side_is_line(surface, f, k);
			uint32_t m = surface_split(surface, f, k, vec3_step(pa, vec3_sub(pb, pa), t));
			if (m == SURFACE_NONE)
				return false;
			surface->cuts[m] = (uint8_t)(line ? common : 0);
			value[m] = 0;
			k = -1; /* the face has new sides */
		}
	for (uint32_t v = 0; v < surface->vertex_count; v++)
		if (value[v] == 0)
			surface->cuts[v] |= (uint8_t)(1u << cut);
	return true;
}

/* The sign of a face after the cut: that of its corner farthest from it. */
static bool face_is_beyond(const struct surface *surface, uint32_t face, const double *value)
{
	double most = 0;
	for (int k = 0; k < 3; k++) {
		double v = value[surface->corner[face][k]];
		most = fabs(v) > fabs(most) ? v : most;
	}
	return most > 0;
}

static void face_assign(struct surface *surface, uint32_t face, enum body_cut cut)
{
	if (cut == CUT_SIDE)
		surface->piece[face] |= 1u;
	else if (cut == CUT_ARMHOLE)
		surface->piece[face] = 2 * BODY_SLEEVE;
	else if (cut == CUT_WAIST)
		surface->piece[face] = 2 * BODY_LEG;
	else
		surface->corner[face][0] = SURFACE_NONE;
}

static bool apply_cut(struct surface *surface, struct arena *arena, const struct body *body, enum body_cut cut)
{
	struct arena_mark mark = arena_mark(arena);
	double *value = ARENA_ARRAY(arena, surface->vertex_capacity, double);
	if (!value)
		return false;
	cut_values(surface, body, cut, value);
	bool done = cut_edges(surface, cut, value);
	for (uint32_t f = 0; done && f < surface->face_count; f++)
		if (face_is_beyond(surface, f, value))
			face_assign(surface, f, cut);
	arena_release(arena, mark);
	return done && surface_compact(surface, arena) && surface_link(surface, arena);
}

/* Keeps of each vertex's cuts those of which a line really runs through it. */
static bool cuts_settle(struct surface *surface, struct arena *arena)
{
	struct arena_mark mark = arena_mark(arena);
	uint8_t *real = ARENA_ZEROED(arena, surface->vertex_count, uint8_t);
	if (!real)
		return false;
	for (uint32_t f = 0; f < surface->face_count; f++)
		for (int k = 0; k < 3; k++) {
			uint32_t a = surface->corner[f][k], b = surface->corner[f][corner_next(k)];
			if (!surface_side_is_line(surface, f, k))
				continue;
			real[a] |= surface->cuts[a] & surface->cuts[b];
			real[b] |= surface->cuts[a] & surface->cuts[b];
		}
	memcpy(surface->cuts, real, surface->vertex_count);
	arena_release(arena, mark);
	return true;
}

bool extract_half(struct surface *surface, struct arena *arena, const struct body *body, uint32_t vertex_capacity)
{
	static const enum body_cut order[] = {CUT_NECK, CUT_WRIST, CUT_ANKLE, CUT_ARMHOLE, CUT_WAIST, CUT_SIDE};
	if (!surface_init(surface, arena, vertex_capacity, 2 * vertex_capacity))
		return false;
	struct arena_mark mark = arena_mark(arena);
	struct grid grid = {.body = body, .surface = surface};
	grid.distance = ARENA_ARRAY(arena, GRID_POINTS, float);
	grid.crossing = arena_array(arena, GRID_POINTS, sizeof *grid.crossing);
	bool done = grid.distance && grid.crossing && march(&grid) && surface_link(surface, arena);
	arena_release(arena, mark);
	for (size_t i = 0; done && i < sizeof order / sizeof *order; i++)
		done = apply_cut(surface, arena, body, order[i]);
	return done && cuts_settle(surface, arena);
}
