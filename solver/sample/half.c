/* Mesh, count, order, flatten, refine. The vertex count is steered by the edge length: mesh, count, correct, again. */
#include "solver/sample/half.h"

#include "solver/sample/flatten.h"
#include "solver/sample/remesh.h"

#include <stdlib.h>
#include <string.h>

/* The cloth as a share of the body: negative ease, as in a real tight suit. */
static const double girth_ease = 0.94, length_ease = 0.97;

uint32_t half_whole_count(const struct half *half)
{
	uint32_t centre = 0;
	for (uint32_t v = 0; v < half->surface.vertex_count; v++)
		centre += half->surface.cuts[v] >> CUT_CENTRE & 1;
	return 2 * half->surface.vertex_count - centre;
}

/* Vertices of the whole suit after subdivisions. */
static double count_after(const struct half *half, int levels)
{
	const struct surface *surface = &half->surface;
	double vertices = half_whole_count(half), faces = 2.0 * surface->face_count, sides = 0;
	for (uint32_t f = 0; f < surface->face_count; f++)
		for (int k = 0; k < 3; k++) {
			uint32_t a = surface->corner[f][k], b = surface->corner[f][corner_next(k)];
			bool centre = surface->neighbour[f][k] == SURFACE_NONE &&
				      (surface->cuts[a] & surface->cuts[b] & 1u << CUT_CENTRE);
			/* An edge is counted once from each of its two sides; one at an opening twice from its one. */
			sides += surface->neighbour[f][k] == SURFACE_NONE && !centre ? 2 : 1;
		}
	double edges = sides;
	for (int level = 0; level < levels; level++) {
		vertices += edges;
		edges = 2 * edges + 3 * faces;
		faces *= 4;
	}
	return vertices;
}

static double surface_area(const struct surface *surface)
{
	double twice = 0;
	for (uint32_t f = 0; f < surface->face_count; f++) {
		const uint32_t *c = surface->corner[f];
		const struct vec3 *p = surface->position;
		twice += vec3_length(vec3_normal(p[c[0]], p[c[1]], p[c[2]]));
	}
	return twice / 2;
}

/* Faces by piece and then from the top down, vertices as the faces meet them. */
struct face_key {
	double height;
	uint32_t piece, face;
};

static int key_compare(const void *left, const void *right)
{
	const struct face_key *a = left, *b = right;
	if (a->piece != b->piece)
		return a->piece < b->piece ? -1 : 1;
	if (a->height != b->height)
		return a->height > b->height ? -1 : 1;
	return a->face < b->face ? -1 : a->face > b->face;
}

static bool order_faces(struct surface *surface, struct arena *arena, const struct body *body)
{
	struct arena_mark mark = arena_mark(arena);
	uint32_t n = surface->face_count, vertices = 0;
	struct face_key *key = ARENA_ARRAY(arena, n, struct face_key);
	uint32_t(*corner)[3] = arena_array(arena, n, sizeof *corner);
	uint32_t *number = ARENA_ARRAY(arena, surface->vertex_count, uint32_t);
	struct vec3 *position = ARENA_ARRAY(arena, surface->vertex_count, struct vec3);
	uint8_t *cuts = ARENA_ARRAY(arena, surface->vertex_count, uint8_t);
	if (!key || !corner || !number || !position || !cuts)
		return false;
	for (uint32_t f = 0; f < n; f++) {
		struct vec3 up = body_upward(body, piece_part(surface->piece[f]));
		key[f] =
			(struct face_key){vec3_dot(up, surface->position[surface->corner[f][0]]), surface->piece[f], f};
	}
	qsort(key, n, sizeof *key, key_compare);
	memset(number, 0xff, surface->vertex_count * sizeof *number);
	for (uint32_t f = 0; f < n; f++)
		for (int k = 0; k < 3; k++) {
			uint32_t v = surface->corner[key[f].face][k];
			if (number[v] == SURFACE_NONE) {
				position[vertices] = surface->position[v];
				cuts[vertices] = surface->cuts[v];
				number[v] = vertices++;
			}
			corner[f][k] = number[v];
		}
	for (uint32_t f = 0; f < n; f++)
		surface->piece[f] = (uint8_t)key[f].piece;
	memcpy(surface->corner, corner, n * sizeof *corner);
	memcpy(surface->position, position, vertices * sizeof *position);
	memcpy(surface->cuts, cuts, vertices);
	arena_release(arena, mark);
	return surface_link(surface, arena);
}

bool half_mesh(struct half *half, struct arena *arena, const struct body *body, uint32_t vertices, int levels)
{
	struct surface *surface = &half->surface;
	double divided = 1;
	for (int level = 0; level < levels; level++)
		divided *= 4;
	uint32_t capacity = 30000 + (uint32_t)(1.5 * vertices / divided);
	if (!extract_half(surface, arena, body, capacity))
		return false;
	/* Equilateral triangles, two to a vertex. */
	double length = sqrt(2 * surface_area(surface) / (vertices / divided) * 2 / sqrt(3.0));
	if (!remesh_half(surface, arena, body, length, 8))
		return false;
	for (int round = 0; round < 8; round++) {
		double ratio = count_after(half, levels) / vertices;
		if (fabs(ratio - 1) < 0.006)
			break;
		length *= sqrt(ratio);
		if (!remesh_half(surface, arena, body, length, 3))
			return false;
	}
	return order_faces(surface, arena, body);
}

/* Numbers the vertices of one piece; `coord` of its faces gets numbers from half->coord_count on. */
static uint32_t number_piece(struct half *half, uint32_t first, uint32_t last, uint32_t *number)
{
	uint32_t count = 0;
	memset(number, 0xff, half->surface.vertex_count * sizeof *number);
	for (uint32_t f = first; f < last; f++)
		for (int k = 0; k < 3; k++) {
			uint32_t v = half->surface.corner[f][k];
			if (number[v] == SURFACE_NONE)
				number[v] = count++;
			half->coord[f][k] = number[v];
		}
	return count;
}

static bool flatten_range(struct half *half, struct arena *arena, const struct body *body, struct vec3 scale,
			  uint32_t first, uint32_t last)
{
	const struct surface *surface = &half->surface;
	uint32_t *number = ARENA_ARRAY(arena, surface->vertex_count, uint32_t);
	struct vec3 *position = ARENA_ARRAY(arena, surface->vertex_count, struct vec3);
	if (!number || !position)
		return false;
	uint32_t count = number_piece(half, first, last, number);
	for (uint32_t v = 0; v < surface->vertex_count; v++) {
		struct vec3 p = surface->position[v];
		if (number[v] != SURFACE_NONE)
			position[number[v]] = (struct vec3){p.x * scale.x, p.y * scale.y, p.z * scale.z};
	}
	struct vec3 up = body_upward(body, piece_part(surface->piece[first]));
	struct flatten_piece piece = {
		.vertex_count = count,
		.face_count = last - first,
		.position = position,
		.corner = (const uint32_t(*)[3])half->coord + first,
		.upward = vec3_unit((struct vec3){up.x * scale.x, up.y * scale.y, up.z * scale.z}),
		.girth = girth_ease,
		.length = length_ease,
	};
	if (!flatten_piece(half->flat + half->coord_count, arena, &piece))
		return false;
	for (uint32_t f = first; f < last; f++)
		for (int k = 0; k < 3; k++)
			half->coord[f][k] += half->coord_count;
	half->coord_count += count;
	return true;
}

bool half_flatten(struct half *half, struct arena *arena, const struct body *body, struct vec3 scale)
{
	struct surface *surface = &half->surface;
	half->coord_count = 0;
	half->coord = arena_array(arena, surface->face_count, sizeof *half->coord);
	half->flat = arena_array(arena, 2 * (size_t)surface->vertex_count, sizeof *half->flat);
	if (!half->coord || !half->flat)
		return false;
	for (uint32_t first = 0, last; first < surface->face_count; first = last) {
		last = first;
		while (last < surface->face_count && surface->piece[last] == surface->piece[first])
			last++;
		struct arena_mark mark = arena_mark(arena);
		bool done = flatten_range(half, arena, body, scale, first, last);
		arena_release(arena, mark);
		if (!done)
			return false;
	}
	return true;
}

/* The midpoints of a face's sides, as vertices and as pattern positions. */
struct middle {
	uint32_t vertex[3], coord[3];
};

static void middle_vertex(struct half *fine, const struct half *coarse, const struct body *body, uint32_t f, int k,
			  struct middle *middle)
{
	const struct surface *surface = &coarse->surface;
	uint32_t a = surface->corner[f][k], b = surface->corner[f][corner_next(k)], m = fine->surface.vertex_count++;
	bool line = surface_side_is_line(surface, f, k);
	uint8_t cuts = line ? surface->cuts[a] & surface->cuts[b] : 0;
	fine->surface.cuts[m] = cuts;
	fine->surface.position[m] = body_project(body, cuts, vec3_middle(surface->position[a], surface->position[b]));
	middle->vertex[k] = m;
}

static void middle_coord(struct half *fine, const struct half *coarse, uint32_t f, int k, struct middle *middle)
{
	const double *a = coarse->flat[coarse->coord[f][k]], *b = coarse->flat[coarse->coord[f][corner_next(k)]];
	double *m = fine->flat[fine->coord_count];
	m[0] = 0.5 * (a[0] + b[0]);
	m[1] = 0.5 * (a[1] + b[1]);
	middle->coord[k] = fine->coord_count++;
}

static void middles_make(struct half *fine, const struct half *coarse, const struct body *body, struct middle *middle)
{
	const struct surface *surface = &coarse->surface;
	for (uint32_t f = 0; f < surface->face_count; f++)
		for (int k = 0; k < 3; k++) {
			uint32_t other = surface->neighbour[f][k];
			if (other == SURFACE_NONE || f < other) {
				middle_vertex(fine, coarse, body, f, k, &middle[f]);
				middle_coord(fine, coarse, f, k, &middle[f]);
				continue;
			}
			int back = surface_corner_of(surface, other, surface->corner[f][corner_next(k)]);
			middle[f].vertex[k] = middle[other].vertex[back];
			if (surface->piece[other] == surface->piece[f])
				middle[f].coord[k] = middle[other].coord[back];
			else
				middle_coord(fine, coarse, f, k, &middle[f]);
		}
}

static void quarter(uint32_t (*out)[3], const uint32_t corner[3], const uint32_t middle[3])
{
	const uint32_t four[4][3] = {
		{corner[0], middle[0], middle[2]},
		{middle[0], corner[1], middle[1]},
		{middle[2], middle[1], corner[2]},
		{middle[0], middle[1], middle[2]},
	};
	memcpy(out, four, sizeof four);
}

bool half_refine(struct half *fine, struct arena *arena, const struct body *body, const struct half *coarse)
{
	const struct surface *old = &coarse->surface;
	struct surface *new = &fine->surface;
	uint32_t faces = 4 * old->face_count;
	/* Every face brings at most three midpoints. */
	if (!surface_init(new, arena, old->vertex_count + 3 * old->face_count / 2 + 4096, faces))
		return false;
	fine->coord = arena_array(arena, faces, sizeof *fine->coord);
	fine->flat = arena_array(arena, (size_t)coarse->coord_count + 3 * (size_t)old->face_count, sizeof *fine->flat);
	if (!fine->coord || !fine->flat)
		return false;
	memcpy(new->position, old->position, old->vertex_count * sizeof *old->position);
	memcpy(new->cuts, old->cuts, old->vertex_count);
	memcpy(fine->flat, coarse->flat, coarse->coord_count * sizeof *coarse->flat);
	new->vertex_count = old->vertex_count;
	fine->coord_count = coarse->coord_count;
	struct arena_mark mark = arena_mark(arena);
	struct middle *middle = ARENA_ARRAY(arena, old->face_count, struct middle);
	if (!middle)
		return false;
	middles_make(fine, coarse, body, middle);
	for (uint32_t f = 0; f < old->face_count; f++) {
		quarter(new->corner + 4 * (size_t)f, old->corner[f], middle[f].vertex);
		quarter(fine->coord + 4 * (size_t)f, coarse->coord[f], middle[f].coord);
		memset(new->piece + 4 * (size_t)f, old->piece[f], 4);
	}
	new->face_count = faces;
	arena_release(arena, mark);
	return surface_link(new, arena);
}
