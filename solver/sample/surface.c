/* Local edits on faces with neighbours. Every edit keeps the mesh an oriented manifold; which edits are worth making is
 * remesh.c's business. */
#include "solver/sample/surface.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

bool surface_init(struct surface *surface, struct arena *arena, uint32_t vertex_capacity, uint32_t face_capacity)
{
	*surface = (struct surface){.vertex_capacity = vertex_capacity, .face_capacity = face_capacity};
	surface->position = ARENA_ARRAY(arena, vertex_capacity, struct vec3);
	surface->cuts = ARENA_ARRAY(arena, vertex_capacity, uint8_t);
	surface->vertex_face = ARENA_ARRAY(arena, vertex_capacity, uint32_t);
	surface->corner = arena_array(arena, face_capacity, sizeof *surface->corner);
	surface->neighbour = arena_array(arena, face_capacity, sizeof *surface->neighbour);
	surface->piece = ARENA_ARRAY(arena, face_capacity, uint8_t);
	return surface->position && surface->cuts && surface->vertex_face && surface->corner && surface->neighbour &&
	       surface->piece;
}

/* A side, to be paired with the one that runs the other way. */
struct side {
	uint32_t low, high, face;
	int side;
};

static int side_compare(const void *left, const void *right)
{
	const struct side *a = left, *b = right;
	if (a->low != b->low)
		return a->low < b->low ? -1 : 1;
	if (a->high != b->high)
		return a->high < b->high ? -1 : 1;
	return a->face < b->face ? -1 : a->face > b->face;
}

bool surface_link(struct surface *surface, struct arena *arena)
{
	struct arena_mark mark = arena_mark(arena);
	struct side *sides = ARENA_ARRAY(arena, (size_t)surface->face_count * 3, struct side);
	if (!sides)
		return false;
	size_t count = 0;
	for (uint32_t v = 0; v < surface->vertex_count; v++)
		surface->vertex_face[v] = SURFACE_NONE;
	for (uint32_t f = 0; f < surface->face_count; f++) {
		if (surface->corner[f][0] == SURFACE_NONE)
			continue;
		for (int k = 0; k < 3; k++) {
			uint32_t a = surface->corner[f][k], b = surface->corner[f][corner_next(k)];
			sides[count++] = (struct side){a < b ? a : b, a < b ? b : a, f, k};
			surface->neighbour[f][k] = SURFACE_NONE;
			surface->vertex_face[a] = f;
		}
	}
	qsort(sides, count, sizeof *sides, side_compare);
	for (size_t i = 0; i + 1 < count; i++)
		if (sides[i].low == sides[i + 1].low && sides[i].high == sides[i + 1].high) {
			surface->neighbour[sides[i].face][sides[i].side] = sides[i + 1].face;
			surface->neighbour[sides[i + 1].face][sides[i + 1].side] = sides[i].face;
		}
	arena_release(arena, mark);
	return true;
}

bool surface_compact(struct surface *surface, struct arena *arena)
{
	struct arena_mark mark = arena_mark(arena);
	uint32_t *number = ARENA_ARRAY(arena, surface->vertex_count, uint32_t);
	if (!number)
		return false;
	memset(number, 0xff, surface->vertex_count * sizeof *number);
	uint32_t faces = 0, vertices = 0;
	for (uint32_t f = 0; f < surface->face_count; f++) {
		if (surface->corner[f][0] == SURFACE_NONE)
			continue;
		memmove(surface->corner[faces], surface->corner[f], sizeof *surface->corner);
		surface->piece[faces] = surface->piece[f];
		for (int k = 0; k < 3; k++)
			number[surface->corner[faces][k]] = 0;
		faces++;
	}
	for (uint32_t v = 0; v < surface->vertex_count; v++) {
		if (number[v] == SURFACE_NONE)
			continue;
		surface->position[vertices] = surface->position[v];
		surface->cuts[vertices] = surface->cuts[v];
		number[v] = vertices++;
	}
	for (uint32_t f = 0; f < faces; f++)
		for (int k = 0; k < 3; k++)
			surface->corner[f][k] = number[surface->corner[f][k]];
	surface->face_count = faces;
	surface->vertex_count = vertices;
	arena_release(arena, mark);
	return true;
}

int surface_corner_of(const struct surface *surface, uint32_t face, uint32_t vertex)
{
	const uint32_t *corner = surface->corner[face];
	assert(corner[0] == vertex || corner[1] == vertex || corner[2] == vertex);
	return corner[0] == vertex ? 0 : corner[1] == vertex ? 1 : 2;
}

bool surface_side_is_line(const struct surface *surface, uint32_t face, int side)
{
	uint32_t other = surface->neighbour[face][side];
	return other == SURFACE_NONE || surface->piece[other] != surface->piece[face];
}

uint32_t surface_ring(const struct surface *surface, uint32_t vertex, uint32_t ring[SURFACE_RING], bool *closed)
{
	uint32_t start = surface->vertex_face[vertex], face = start, count = 0;
	*closed = true;
	/* Back to the border, if there is one. */
	for (uint32_t steps = 0; steps < SURFACE_RING; steps++) {
		uint32_t before = surface->neighbour[face][surface_corner_of(surface, face, vertex)];
		if (before == SURFACE_NONE) {
			*closed = false;
			break;
		}
		face = before;
		if (face == start)
			break;
	}
	for (start = face; count < SURFACE_RING;
	     face = surface->neighbour[face][corner_previous(surface_corner_of(surface, face, vertex))]) {
		if (face == SURFACE_NONE || (count && face == start))
			break;
		ring[count++] = face;
	}
	return count;
}

bool surface_joined(const struct surface *surface, uint32_t a, uint32_t b)
{
	uint32_t ring[SURFACE_RING];
	bool closed;
	uint32_t count = surface_ring(surface, a, ring, &closed);
	for (uint32_t i = 0; i < count; i++)
		for (int k = 0; k < 3; k++)
			if (surface->corner[ring[i]][k] == b)
				return true;
	return false;
}

/* The side of `face` behind which `other` lies. */
static int side_towards(const struct surface *surface, uint32_t face, uint32_t other)
{
	const uint32_t *neighbour = surface->neighbour[face];
	assert(neighbour[0] == other || neighbour[1] == other || neighbour[2] == other);
	return neighbour[0] == other ? 0 : neighbour[1] == other ? 1 : 2;
}

static void relink(struct surface *surface, uint32_t face, uint32_t old, uint32_t new)
{
	if (face != SURFACE_NONE)
		surface->neighbour[face][side_towards(surface, face, old)] = new;
}

/* Puts a new face (m, b, c) beyond the cut of (a, b, c) at m on side a b; returns it. */
static uint32_t split_face(struct surface *surface, uint32_t face, int side, uint32_t m)
{
	assert(surface->face_count < surface->face_capacity);
	uint32_t half = surface->face_count++;
	uint32_t b = surface->corner[face][corner_next(side)], c = surface->corner[face][corner_previous(side)];
	uint32_t beyond = surface->neighbour[face][corner_next(side)];
	surface->corner[half][0] = m;
	surface->corner[half][1] = b;
	surface->corner[half][2] = c;
	surface->neighbour[half][1] = beyond;
	surface->neighbour[half][2] = face;
	surface->piece[half] = surface->piece[face];
	relink(surface, beyond, face, half);
	surface->corner[face][corner_next(side)] = m;
	surface->neighbour[face][corner_next(side)] = half;
	surface->vertex_face[b] = surface->vertex_face[c] = half;
	return half;
}

uint32_t surface_split(struct surface *surface, uint32_t face, int side, struct vec3 middle)
{
	if (surface->vertex_count == surface->vertex_capacity || surface->face_count + 2 > surface->face_capacity)
		return SURFACE_NONE;
	uint32_t a = surface->corner[face][side], b = surface->corner[face][corner_next(side)];
	uint32_t other = surface->neighbour[face][side], m = surface->vertex_count++;
	surface->position[m] = middle;
	surface->cuts[m] = surface_side_is_line(surface, face, side) ? surface->cuts[a] & surface->cuts[b] : 0;
	surface->vertex_face[m] = face;
	int back = other == SURFACE_NONE ? 0 : surface_corner_of(surface, other, b);
	uint32_t half = split_face(surface, face, side, m);
	surface->neighbour[half][0] = SURFACE_NONE;
	if (other == SURFACE_NONE)
		return m;
	/* The neighbour runs b -> a: its first half keeps b, its new half has a. */
	uint32_t other_half = split_face(surface, other, back, m);
	surface->neighbour[face][side] = other_half;
	surface->neighbour[other_half][0] = face;
	surface->neighbour[other][back] = half;
	surface->neighbour[half][0] = other;
	return m;
}

void surface_flip(struct surface *surface, uint32_t face, int side)
{
	uint32_t other = surface->neighbour[face][side];
	assert(other != SURFACE_NONE);
	int back = side_towards(surface, other, face);
	uint32_t a = surface->corner[face][side], b = surface->corner[face][corner_next(side)];
	uint32_t c = surface->corner[face][corner_previous(side)], d = surface->corner[other][corner_previous(back)];
	assert(!surface_joined(surface, c, d));
	uint32_t bc = surface->neighbour[face][corner_next(side)], ca = surface->neighbour[face][corner_previous(side)];
	uint32_t ad = surface->neighbour[other][corner_next(back)],
		 db = surface->neighbour[other][corner_previous(back)];
	memcpy(surface->corner[face], (uint32_t[3]){a, d, c}, sizeof *surface->corner);
	memcpy(surface->corner[other], (uint32_t[3]){d, b, c}, sizeof *surface->corner);
	memcpy(surface->neighbour[face], (uint32_t[3]){ad, other, ca}, sizeof *surface->neighbour);
	memcpy(surface->neighbour[other], (uint32_t[3]){db, bc, face}, sizeof *surface->neighbour);
	relink(surface, ad, other, face);
	relink(surface, bc, face, other);
	surface->vertex_face[a] = surface->vertex_face[c] = surface->vertex_face[d] = face;
	surface->vertex_face[b] = other;
}

/* Takes a face out that has lost one side: the faces beyond its two other sides meet. */
static void close_face(struct surface *surface, uint32_t face, int side)
{
	uint32_t c = surface->corner[face][corner_previous(side)], a = surface->corner[face][side];
	uint32_t x = surface->neighbour[face][corner_next(side)], y = surface->neighbour[face][corner_previous(side)];
	relink(surface, x, face, y);
	relink(surface, y, face, x);
	surface->vertex_face[c] = surface->vertex_face[a] = x != SURFACE_NONE ? x : y;
	surface->corner[face][0] = SURFACE_NONE;
}

void surface_collapse(struct surface *surface, uint32_t face, int side)
{
	uint32_t ring[SURFACE_RING];
	uint32_t a = surface->corner[face][side], b = surface->corner[face][corner_next(side)];
	uint32_t other = surface->neighbour[face][side];
	int back = other == SURFACE_NONE ? 0 : side_towards(surface, other, face);
	bool closed;
	uint32_t count = surface_ring(surface, b, ring, &closed);
	assert(count < SURFACE_RING);
	for (uint32_t i = 0; i < count; i++)
		surface->corner[ring[i]][surface_corner_of(surface, ring[i], b)] = a;
	close_face(surface, face, side);
	if (other != SURFACE_NONE)
		close_face(surface, other, back);
	surface->vertex_face[b] = SURFACE_NONE;
}
