/* A triangle mesh that can be edited, as made on one half of the body. Faces know their neighbours; every vertex knows
 * the cuts on which it lies, every face its pattern piece.
 *
 * Side k of a face runs from corner k to corner (k + 1) % 3. Deleted faces have corner[0] == SURFACE_NONE and stay
 * until surface_compact. */
#ifndef SOLVER_SAMPLE_SURFACE_H
#define SOLVER_SAMPLE_SURFACE_H

#include "solver/arena.h"
#include "solver/sample/vector.h"

#include <stdbool.h>
#include <stdint.h>

#define SURFACE_NONE UINT32_MAX

struct surface {
	uint32_t vertex_count, vertex_capacity;
	uint32_t face_count, face_capacity;
	struct vec3 *position;
	uint8_t *cuts;         /* [vertex] bits 1 << enum body_cut */
	uint32_t *vertex_face; /* [vertex] a face at it, SURFACE_NONE where there is none left */
	uint32_t (*corner)[3];
	uint32_t (*neighbour)[3]; /* the face across each side, SURFACE_NONE on the border */
	uint8_t *piece;           /* [face] */
};

/* The corner (or side) of a triangle after and before corner k. */
static inline int corner_next(int k)
{
	return k == 2 ? 0 : k + 1;
}

static inline int corner_previous(int k)
{
	return k == 0 ? 2 : k - 1;
}

/* Empty, with room for so many. False when memory is out. */
bool surface_init(struct surface *surface, struct arena *arena, uint32_t vertex_capacity,
		  uint32_t face_capacity) TW_NODISCARD;

/* Derives neighbour[] and vertex_face[] from corner[]. False when memory is out. */
bool surface_link(struct surface *surface, struct arena *arena) TW_NODISCARD;

/* Renumbers without deleted faces and unused vertices; keeps the order. `surface_link` must follow. */
bool surface_compact(struct surface *surface, struct arena *arena) TW_NODISCARD;

/* Which corner of `face` is `vertex`; it must be one. */
int surface_corner_of(const struct surface *surface, uint32_t face, uint32_t vertex);

/* Whether a side is a seam or a border. */
bool surface_side_is_line(const struct surface *surface, uint32_t face, int side);

/* The faces around a vertex in order, counter-clockwise from outside; at a border vertex from one border to the other.
 * Returns their number, at most `limit`. */
enum { SURFACE_RING = 64 };
uint32_t surface_ring(const struct surface *surface, uint32_t vertex, uint32_t ring[SURFACE_RING], bool *closed);

/* Splits a side at `middle`; returns the new vertex, or SURFACE_NONE when the room is used up. */
uint32_t surface_split(struct surface *surface, uint32_t face, int side, struct vec3 middle);

/* Turns an inner side; the caller has checked that the new edge does not exist. */
void surface_flip(struct surface *surface, uint32_t face, int side);

/* Removes the end of a side, keeping its start: `face`, its neighbour and the end disappear. The caller has checked the
 * link condition. */
void surface_collapse(struct surface *surface, uint32_t face, int side);

/* Whether an edge joins the two vertices. */
bool surface_joined(const struct surface *surface, uint32_t a, uint32_t b);

#endif
