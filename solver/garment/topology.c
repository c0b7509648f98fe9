/* Edges of a garment from its faces.
 *
 * Every face has three sides; the sides that join the same two vertices are an edge. They are brought together by a
 * counting sort over the larger vertex and then over the smaller one, both stable, so that the sides of an edge follow
 * each other in the order of faces. No hashing: the cost is O(vertices + faces) on any input, and the numbers that
 * come out depend on nothing but the faces. */
#include "solver/garment/correspondence.h"

#include <stdbool.h>
#include <string.h>

static uint32_t next_corner(uint32_t corner)
{
	return corner % 3 == 2 ? corner - 2 : corner + 1;
}

static uint32_t side_low(const uint32_t *face_vertex, uint32_t side)
{
	uint32_t a = face_vertex[side], b = face_vertex[next_corner(side)];
	return a < b ? a : b;
}

static uint32_t side_high(const uint32_t *face_vertex, uint32_t side)
{
	uint32_t a = face_vertex[side], b = face_vertex[next_corner(side)];
	return a < b ? b : a;
}

/* One stable counting sort of `from` into `to`; `start` is [vertex_count + 1]. */
static void sort_sides(const struct garment *garment, uint32_t (*key)(const uint32_t *, uint32_t), const uint32_t *from,
		       uint32_t *to, uint32_t *start)
{
	const uint32_t sides = 3 * garment->face_count;
	memset(start, 0, ((size_t)garment->vertex_count + 1) * sizeof *start);
	for (uint32_t i = 0; i < sides; i++)
		start[key(garment->face_vertex, i) + 1]++;
	for (uint32_t v = 0; v < garment->vertex_count; v++)
		start[v + 1] += start[v];
	for (uint32_t i = 0; i < sides; i++)
		to[start[key(garment->face_vertex, from ? from[i] : i)]++] = from ? from[i] : i;
}

static enum tw_status too_many_faces(const struct garment *garment, const uint32_t *sides, struct tw_error *error)
{
	char where[64], name[2][VERTEX_NAME_BYTES];
	snprintf(where, sizeof where, "face %u", garment_file_face(garment, sides[2] / 3));
	return tw_fail(
		error, TW_ERROR_INPUT, "mesh-non-manifold-edge", where,
		"faces %u, %u and %u share the edge between vertices %s and %s; an edge may have one face or two",
		garment_file_face(garment, sides[0] / 3), garment_file_face(garment, sides[1] / 3),
		garment_file_face(garment, sides[2] / 3),
		garment_vertex_name(garment, side_low(garment->face_vertex, sides[0]), name[0]),
		garment_vertex_name(garment, side_high(garment->face_vertex, sides[0]), name[1]));
}

/* Sets twin[side]: the other side of its edge, itself on a hem. */
static enum tw_status pair_sides(const struct garment *garment, const uint32_t *sorted, uint32_t *twin,
				 struct tw_error *error)
{
	const uint32_t sides = 3 * garment->face_count;
	const uint32_t *face_vertex = garment->face_vertex;
	for (uint32_t i = 0, run; i < sides; i += run) {
		uint32_t low = side_low(face_vertex, sorted[i]), high = side_high(face_vertex, sorted[i]);
		for (run = 1; i + run < sides && side_low(face_vertex, sorted[i + run]) == low &&
			      side_high(face_vertex, sorted[i + run]) == high;
		     run++)
			;
		if (run > 2)
			return too_many_faces(garment, sorted + i, error);
		twin[sorted[i]] = sorted[i + run - 1];
		twin[sorted[i + run - 1]] = sorted[i];
	}
	return TW_OK;
}

/* The two sides of an inner edge have the same pattern position at each end. */
static enum edge_kind kind_of(const struct garment *garment, uint32_t side, uint32_t twin)
{
	if (side == twin)
		return EDGE_HEM;
	uint32_t a = side, b = next_corner(side), c = twin, d = next_corner(twin);
	if (garment->face_vertex[a] != garment->face_vertex[c]) {
		uint32_t other = c;
		c = d;
		d = other;
	}
	const uint32_t *coord = garment->face_coord;
	return coord[a] == coord[c] && coord[b] == coord[d] ? EDGE_INNER : EDGE_SEAM;
}

/* On entry face_edge[side] is the side's twin, on exit its edge: a side is read before it is overwritten. */
static enum tw_status number_edges(struct topology *topology, struct arena *arena, const struct garment *garment,
				   struct tw_error *error)
{
	const uint32_t sides = 3 * garment->face_count;
	uint32_t *face_edge = topology->face_edge;
	uint32_t edges = 0;
	for (uint32_t side = 0; side < sides; side++)
		edges += side <= face_edge[side];
	topology->edge_count = edges;
	topology->edge_vertex = ARENA_ARRAY(arena, 2 * (size_t)edges, uint32_t);
	topology->edge_face = ARENA_ARRAY(arena, 2 * (size_t)edges, uint32_t);
	topology->edge_side = ARENA_ARRAY(arena, 2 * (size_t)edges, uint8_t);
	topology->edge_kind = ARENA_ARRAY(arena, edges, uint8_t);
	if (!topology->edge_vertex || !topology->edge_face || !topology->edge_side || !topology->edge_kind)
		return tw_fail_memory(error);

	for (uint32_t side = 0, e = 0; side < sides; side++) {
		uint32_t twin = face_edge[side];
		if (twin < side) {
			face_edge[side] = face_edge[twin];
			continue;
		}
		bool hem = twin == side;
		topology->edge_vertex[2 * e] = side_low(garment->face_vertex, side);
		topology->edge_vertex[2 * e + 1] = side_high(garment->face_vertex, side);
		topology->edge_face[2 * e] = side / 3;
		topology->edge_face[2 * e + 1] = hem ? GARMENT_NONE : twin / 3;
		topology->edge_side[2 * e] = (uint8_t)(side % 3);
		topology->edge_side[2 * e + 1] = (uint8_t)(hem ? 0 : twin % 3);
		topology->edge_kind[e] = (uint8_t)kind_of(garment, side, twin);
		face_edge[side] = e++;
	}
	return TW_OK;
}

static uint32_t find_root(uint32_t *parent, uint32_t v)
{
	while (parent[v] != v) {
		parent[v] = parent[parent[v]];
		v = parent[v];
	}
	return v;
}

/* Union by lowest number, so that a component's root is its lowest vertex and is met first. */
static void number_components(struct topology *topology, uint32_t vertex_count)
{
	uint32_t *component = topology->vertex_component;
	for (uint32_t v = 0; v < vertex_count; v++)
		component[v] = v;
	for (uint32_t e = 0; e < topology->edge_count; e++) {
		uint32_t a = find_root(component, topology->edge_vertex[2 * e]);
		uint32_t b = find_root(component, topology->edge_vertex[2 * e + 1]);
		if (a < b)
			component[b] = a;
		else
			component[a] = b;
	}
	for (uint32_t v = 0; v < vertex_count; v++)
		component[v] = find_root(component, v);
	/* Parents are lower than their children: going up, component[root] is already the number when it is read. */
	topology->component_count = 0;
	for (uint32_t v = 0; v < vertex_count; v++)
		component[v] = component[v] == v ? topology->component_count++ : component[component[v]];
}

static enum tw_status find_twins(uint32_t *twin, struct arena *arena, const struct garment *garment,
				 struct tw_error *error)
{
	const size_t sides = 3 * (size_t)garment->face_count;
	struct arena_mark mark = arena_mark(arena);
	uint32_t *by_high = ARENA_ARRAY(arena, sides, uint32_t);
	uint32_t *sorted = ARENA_ARRAY(arena, sides, uint32_t);
	uint32_t *start = ARENA_ARRAY(arena, (size_t)garment->vertex_count + 1, uint32_t);
	if (!by_high || !sorted || !start)
		return tw_fail_memory(error);
	sort_sides(garment, side_high, NULL, by_high, start);
	sort_sides(garment, side_low, by_high, sorted, start);
	enum tw_status status = pair_sides(garment, sorted, twin, error);
	arena_release(arena, mark);
	return status;
}

enum tw_status topology_build(struct topology *topology, struct arena *arena, const struct garment *garment,
			      struct tw_error *error)
{
	*topology = (struct topology){0};
	topology->face_edge = ARENA_ARRAY(arena, 3 * (size_t)garment->face_count, uint32_t);
	topology->vertex_component = ARENA_ARRAY(arena, garment->vertex_count, uint32_t);
	if (!topology->face_edge || !topology->vertex_component)
		return tw_fail_memory(error);
	enum tw_status status = find_twins(topology->face_edge, arena, garment, error);
	if (status == TW_OK)
		status = number_edges(topology, arena, garment, error);
	if (status == TW_OK)
		number_components(topology, garment->vertex_count);
	return status;
}
