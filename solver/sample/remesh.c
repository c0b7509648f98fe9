/* Each round takes the edits in the order of the faces, so the result is determined by the input. Vertices with two
 * cuts (corners of pieces) never move nor disappear. */
#include "solver/sample/remesh.h"

#include <string.h>

/* Shares of the wanted length beyond which an edge is split or collapsed. */
static const double longest = 4.0 / 3, shortest = 4.0 / 5;

static bool is_corner(const struct surface *surface, uint32_t vertex)
{
	unsigned cuts = surface->cuts[vertex];
	return (cuts & (cuts - 1)) != 0;
}

static double side_squared(const struct surface *surface, uint32_t face, int k)
{
	return vec3_apart(surface->position[surface->corner[face][k]],
			  surface->position[surface->corner[face][corner_next(k)]]);
}

static bool side_is_longest(const struct surface *surface, uint32_t face, double squared)
{
	if (face == SURFACE_NONE)
		return true;
	return side_squared(surface, face, 0) <= squared && side_squared(surface, face, 1) <= squared &&
	       side_squared(surface, face, 2) <= squared;
}

/* Only a side that is the longest of both its faces is split: in a sliver, halving a lesser one would put vertices on
 * top of each other without end. Passes follow until the chains of longer sides are worked off. */
static void split_long(struct surface *surface, const struct body *body, double length)
{
	double limit = longest * length * longest * length;
	bool changed = true;
	for (int pass = 0; pass < 6 && changed; pass++) {
		changed = false;
		for (uint32_t f = 0; f < surface->face_count; f++)
			for (int k = 0; k < 3 && surface->corner[f][0] != SURFACE_NONE; k++) {
				double squared = side_squared(surface, f, k);
				if (squared <= limit || !side_is_longest(surface, f, squared) ||
				    !side_is_longest(surface, surface->neighbour[f][k], squared))
					continue;
				struct vec3 p = surface->position[surface->corner[f][k]];
				struct vec3 q = surface->position[surface->corner[f][corner_next(k)]];
				uint32_t m = surface_split(surface, f, k, vec3_middle(p, q));
				if (m == SURFACE_NONE)
					return;
				surface->position[m] = body_project(body, surface->cuts[m], surface->position[m]);
				changed = true;
				k = -1;
			}
	}
}

/* Whether `vertex` may disappear into `onto` along a side. */
static bool may_vanish(const struct surface *surface, uint32_t vertex, uint32_t onto, bool line)
{
	unsigned cuts = surface->cuts[vertex];
	if (is_corner(surface, vertex))
		return false;
	return !cuts || (line && (surface->cuts[onto] & cuts) == cuts);
}

/* Ends of an inner side have two common neighbours, those of a border side one; more would pinch the surface. */
static bool link_condition(const struct surface *surface, uint32_t a, uint32_t b, uint32_t wanted)
{
	uint32_t ring[SURFACE_RING], common = 0;
	bool a_closed, b_closed;
	uint32_t a_count = surface_ring(surface, a, ring, &a_closed),
		 b_count = surface_ring(surface, b, ring, &b_closed);
	if (a_count < 2 || b_count < 2 || a_count + b_count >= SURFACE_RING || (wanted == 2 && !a_closed && !b_closed))
		return false;
	for (uint32_t i = 0; i < b_count; i++) {
		const uint32_t *corner = surface->corner[ring[i]];
		int k = surface_corner_of(surface, ring[i], b);
		uint32_t v = corner[corner_next(k)], last = corner[corner_previous(k)];
		common += v != a && surface_joined(surface, a, v);
		common += !b_closed && i + 1 == b_count && last != a && surface_joined(surface, a, last);
	}
	return common == wanted;
}

/* Area-weighted normal of the faces around a vertex: steady also where single faces are slivers. */
static struct vec3 ring_normal(const struct surface *surface, const uint32_t *ring, uint32_t count)
{
	struct vec3 sum = {0, 0, 0};
	for (uint32_t i = 0; i < count; i++) {
		const uint32_t *c = surface->corner[ring[i]];
		const struct vec3 *p = surface->position;
		sum = vec3_add(sum, vec3_normal(p[c[0]], p[c[1]], p[c[2]]));
	}
	return vec3_unit(sum);
}

/* With `vertex` at `p`: no face around it turns over or becomes a needle (those with `other`, which disappear, do not
 * count), and no edge becomes long. */
static bool ring_accepts(const struct surface *surface, uint32_t vertex, uint32_t other, struct vec3 p, double limit)
{
	uint32_t ring[SURFACE_RING];
	bool closed;
	uint32_t count = surface_ring(surface, vertex, ring, &closed);
	struct vec3 normal = ring_normal(surface, ring, count);
	for (uint32_t i = 0; i < count; i++) {
		const uint32_t *corner = surface->corner[ring[i]];
		int k = surface_corner_of(surface, ring[i], vertex);
		uint32_t b = corner[corner_next(k)], c = corner[corner_previous(k)];
		if (b == other || c == other)
			continue;
		struct vec3 pb = surface->position[b], pc = surface->position[c], after = vec3_normal(p, pb, pc);
		double to_b = vec3_apart(p, pb), to_c = vec3_apart(p, pc), far = to_b > to_c ? to_b : to_c;
		double least = 0.1 * (far > vec3_apart(pb, pc) ? far : vec3_apart(pb, pc)), size = vec3_length(after);
		if (far > limit || size < least || vec3_dot(normal, after) < 0.3 * size)
			return false;
	}
	return true;
}

/* Collapses side k of a face if that is allowed and does no harm. */
static bool try_collapse(struct surface *surface, const struct body *body, uint32_t face, int k, double limit)
{
	uint32_t a = surface->corner[face][k], b = surface->corner[face][corner_next(k)];
	uint32_t other = surface->neighbour[face][k];
	bool line = surface_side_is_line(surface, face, k);
	bool b_vanishes = may_vanish(surface, b, a, line), a_vanishes = may_vanish(surface, a, b, line);
	if ((!a_vanishes && !b_vanishes) || !link_condition(surface, a, b, other == SURFACE_NONE ? 1 : 2))
		return false;
	struct vec3 p = surface->position[a_vanishes && !b_vanishes ? b : a];
	uint8_t cuts = surface->cuts[a_vanishes && !b_vanishes ? b : a];
	if (a_vanishes && b_vanishes)
		p = body_project(body, cuts, vec3_middle(surface->position[a], surface->position[b]));
	if (!ring_accepts(surface, a, b, p, limit) || !ring_accepts(surface, b, a, p, limit))
		return false;
	surface_collapse(surface, face, k);
	surface->position[a] = p;
	surface->cuts[a] = cuts;
	return true;
}

static void collapse_short(struct surface *surface, const struct body *body, double length)
{
	double least = shortest * length * shortest * length, limit = longest * length * longest * length;
	for (uint32_t f = 0; f < surface->face_count; f++)
		for (int k = 0; k < 3 && surface->corner[f][0] != SURFACE_NONE; k++) {
			struct vec3 p = surface->position[surface->corner[f][k]];
			struct vec3 q = surface->position[surface->corner[f][corner_next(k)]];
			if (vec3_apart(p, q) < least && try_collapse(surface, body, f, k, limit))
				break;
		}
}

/* Cotangent of the angle at c in (a, b, c). */
static double cotangent(struct vec3 a, struct vec3 b, struct vec3 c)
{
	struct vec3 u = vec3_sub(a, c), v = vec3_sub(b, c);
	return vec3_dot(u, v) / (vec3_length(vec3_cross(u, v)) + 1e-12);
}

/* Delaunay: the angles opposite a side sum to more than 180 degrees; and the flip folds nothing. */
static bool should_flip(const struct surface *surface, uint32_t face, int k)
{
	if (surface_side_is_line(surface, face, k))
		return false;
	uint32_t other = surface->neighbour[face][k];
	uint32_t a = surface->corner[face][k], b = surface->corner[face][corner_next(k)];
	uint32_t c = surface->corner[face][corner_previous(k)];
	uint32_t d = surface->corner[other][corner_previous(surface_corner_of(surface, other, b))];
	const struct vec3 *p = surface->position;
	if (cotangent(p[a], p[b], p[c]) + cotangent(p[a], p[b], p[d]) >= -1e-3)
		return false;
	struct vec3 n = vec3_add(vec3_normal(p[a], p[b], p[c]), vec3_normal(p[b], p[a], p[d]));
	struct vec3 left = vec3_normal(p[a], p[d], p[c]), right = vec3_normal(p[d], p[b], p[c]);
	double size = vec3_length(n);
	return vec3_dot(left, n) > 0.5 * size * vec3_length(left) &&
	       vec3_dot(right, n) > 0.5 * size * vec3_length(right) && !surface_joined(surface, c, d);
}

static void flip_sides(struct surface *surface)
{
	for (int sweep = 0; sweep < 3; sweep++)
		for (uint32_t f = 0; f < surface->face_count; f++)
			for (int k = 0; k < 3 && surface->corner[f][0] != SURFACE_NONE; k++)
				if (should_flip(surface, f, k))
					surface_flip(surface, f, k);
}

/* Where a vertex wants to be: amid its neighbours along the surface; on a line, amid its two neighbours on the line. */
static struct vec3 relaxed(const struct surface *surface, const struct body *body, uint32_t vertex)
{
	uint32_t ring[SURFACE_RING];
	bool closed;
	uint32_t count = surface_ring(surface, vertex, ring, &closed), uses = 0;
	struct vec3 sum = {0, 0, 0}, p = surface->position[vertex], normal = {0, 0, 0};
	bool on_line = surface->cuts[vertex] != 0;
	for (uint32_t i = 0; i < count; i++) {
		int k = surface_corner_of(surface, ring[i], vertex);
		const uint32_t *corner = surface->corner[ring[i]];
		struct vec3 b = surface->position[corner[corner_next(k)]],
			    c = surface->position[corner[corner_previous(k)]];
		normal = vec3_add(normal, vec3_normal(p, b, c));
		if (!on_line || surface_side_is_line(surface, ring[i], k)) {
			sum = vec3_add(sum, b);
			uses++;
		}
		bool last = !closed && i + 1 == count;
		if (on_line && last) {
			sum = vec3_add(sum, c);
			uses++;
		}
	}
	if (!uses)
		return p;
	struct vec3 move = vec3_sub(vec3_scale(sum, 1.0 / uses), p);
	if (!on_line) {
		normal = vec3_unit(normal);
		move = vec3_step(move, normal, -vec3_dot(move, normal));
	}
	return body_project(body, surface->cuts[vertex], vec3_step(p, move, 0.8));
}

static void relax(struct surface *surface, const struct body *body)
{
	for (uint32_t v = 0; v < surface->vertex_count; v++) {
		if (surface->vertex_face[v] == SURFACE_NONE || is_corner(surface, v))
			continue;
		struct vec3 p = relaxed(surface, body, v);
		if (ring_accepts(surface, v, SURFACE_NONE, p, 1e9))
			surface->position[v] = p;
	}
}

bool remesh_half(struct surface *surface, struct arena *arena, const struct body *body, double length, int rounds)
{
	for (uint32_t v = 0; v < surface->vertex_count; v++)
		surface->position[v] = body_project(body, surface->cuts[v], surface->position[v]);
	for (int round = 0; round < rounds; round++) {
		/* Short before long: to split a sliver makes two. */
		collapse_short(surface, body, length);
		flip_sides(surface);
		split_long(surface, body, length);
		collapse_short(surface, body, length);
		flip_sides(surface);
		relax(surface, body);
		if (!surface_compact(surface, arena) || !surface_link(surface, arena))
			return false;
	}
	flip_sides(surface);
	relax(surface, body);
	return surface_compact(surface, arena) && surface_link(surface, arena);
}
