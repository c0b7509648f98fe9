/* Small garments in closed form, for tests and benches: a flat sheet, whole or sewn from two pieces, and a tube that is
 * one piece sewn to itself. Each face's corners are counter-clockwise in the pattern. */
#ifndef TESTS_ORACLE_MESHES_H
#define TESTS_ORACLE_MESHES_H

#include "solver/garment/garment.h"

#include <math.h>
#include <stdlib.h>

static inline void mesh_allocate(struct garment *g, struct arena *arena, uint32_t vertices, uint32_t coords,
				 uint32_t faces, uint32_t pieces)
{
	*g = (struct garment){
		.vertex_count = vertices,
		.coord_count = coords,
		.face_count = faces,
		.piece_count = pieces,
		.position = ARENA_ZEROED(arena, 3 * (size_t)vertices, double),
		.pattern = ARENA_ZEROED(arena, 2 * (size_t)coords, double),
		.face_vertex = ARENA_ZEROED(arena, 3 * (size_t)faces, uint32_t),
		.face_coord = ARENA_ZEROED(arena, 3 * (size_t)faces, uint32_t),
		.face_piece = ARENA_ZEROED(arena, faces, uint32_t),
		.piece_name = ARENA_ZEROED(arena, pieces, char *),
	};
	static char names[][8] = {"front", "back", "left", "right"};
	if (!g->position || !g->pattern || !g->face_vertex || !g->face_coord || !g->face_piece || !g->piece_name ||
	    pieces > 4)
		abort();
	for (uint32_t p = 0; p < pieces; p++)
		g->piece_name[p] = names[p];
}

static inline void mesh_set_face(struct garment *g, uint32_t f, const uint32_t vertex[3], const uint32_t coord[3],
				 uint32_t piece)
{
	for (size_t k = 0; k < 3; k++) {
		g->face_vertex[3 * (size_t)f + k] = vertex[k];
		g->face_coord[3 * (size_t)f + k] = coord[k];
	}
	g->face_piece[f] = piece;
}

/* A small deterministic generator, so that meshes and densities are irregular but the same everywhere. */
static inline double mesh_random(uint64_t *state)
{
	*state = *state * 6364136223846793005u + 1442695040888963407u;
	return (double)(*state >> 11) / 9007199254740992.0;
}

/* A sheet of columns x rows cells of `cell` mm, each cut into two faces; inner vertices are moved by up to `jitter`
 * cells. With `seam_column` > 0 the sheet is two pieces sewn together along that column of vertices; the second piece
 * lies on the pattern turned by a right angle and moved away. The worn sheet is flat, in the plane z = 0. */
static inline void mesh_sheet(struct garment *g, struct arena *arena, uint32_t columns, uint32_t rows, double cell,
			      double jitter, uint32_t seam_column)
{
	uint32_t vertices = (columns + 1) * (rows + 1);
	uint32_t doubled = seam_column ? rows + 1 : 0;
	mesh_allocate(g, arena, vertices, vertices + doubled, 2 * columns * rows, seam_column ? 2 : 1);
	uint64_t state = 42;
	for (uint32_t v = 0; v < vertices; v++) {
		uint32_t i = v % (columns + 1), j = v / (columns + 1);
		double dx = (mesh_random(&state) - 0.5) * 2 * jitter, dy = (mesh_random(&state) - 0.5) * 2 * jitter;
		int edge = i == 0 || j == 0 || i == columns || j == rows;
		g->position[3 * (size_t)v] = cell * (i + (edge || i == seam_column ? 0 : dx));
		g->position[3 * (size_t)v + 1] = cell * (j + (edge ? 0 : dy));
	}
	for (uint32_t v = 0; v < vertices; v++) {
		int second = seam_column && v % (columns + 1) > seam_column;
		double x = g->position[3 * (size_t)v], y = g->position[3 * (size_t)v + 1];
		g->pattern[2 * (size_t)v] = second ? 2000 - y : x;
		g->pattern[2 * (size_t)v + 1] = second ? x - 300 : y;
	}
	for (uint32_t j = 0; j < doubled; j++) {
		const double *x = g->position + 3 * (size_t)(j * (columns + 1) + seam_column);
		g->pattern[2 * (size_t)(vertices + j)] = 2000 - x[1];
		g->pattern[2 * (size_t)(vertices + j) + 1] = x[0] - 300;
	}
	for (uint32_t f = 0; f < g->face_count; f++) {
		uint32_t i = f / 2 % columns, j = f / 2 / columns;
		uint32_t a = j * (columns + 1) + i, b = a + 1, c = a + columns + 1, d = c + 1;
		uint32_t vertex[3] = {a, f % 2 ? d : b, f % 2 ? c : d}, coord[3];
		uint32_t piece = seam_column && i >= seam_column;
		for (size_t k = 0; k < 3; k++) {
			int on_seam = piece && vertex[k] % (columns + 1) == seam_column;
			coord[k] = on_seam ? vertices + vertex[k] / (columns + 1) : vertex[k];
		}
		mesh_set_face(g, f, vertex, coord, piece);
	}
}

static inline void mesh_swap_faces(struct garment *g, size_t a, size_t b)
{
	for (size_t k = 0; k < 3; k++) {
		uint32_t vertex = g->face_vertex[3 * a + k], coord = g->face_coord[3 * a + k];
		g->face_vertex[3 * a + k] = g->face_vertex[3 * b + k];
		g->face_coord[3 * a + k] = g->face_coord[3 * b + k];
		g->face_vertex[3 * b + k] = vertex;
		g->face_coord[3 * b + k] = coord;
	}
	uint32_t piece = g->face_piece[a];
	g->face_piece[a] = g->face_piece[b];
	g->face_piece[b] = piece;
}

/* Faces in random order (Fisher and Yates). */
static inline void mesh_shuffle_faces(struct garment *g, uint64_t *random)
{
	for (uint32_t f = g->face_count; f-- > 1;)
		mesh_swap_faces(g, f, (size_t)(mesh_random(random) * (f + 1.0)));
}

/* A tube along y: `around` x `along` cells of `cell` mm, one piece whose first and last columns are sewn together. */
static inline void mesh_tube(struct garment *g, struct arena *arena, uint32_t around, uint32_t along, double cell)
{
	mesh_allocate(g, arena, around * (along + 1), (around + 1) * (along + 1), 2 * around * along, 1);
	double radius = cell * around / (2 * M_PI);
	for (uint32_t j = 0; j <= along; j++) {
		for (uint32_t i = 0; i <= around; i++) {
			double *u = g->pattern + 2 * (size_t)(j * (around + 1) + i);
			u[0] = cell * i;
			u[1] = cell * j;
			if (i == around)
				continue;
			double *x = g->position + 3 * (size_t)(j * around + i);
			x[0] = radius * cos(2 * M_PI * i / around);
			x[1] = cell * j;
			x[2] = -radius * sin(2 * M_PI * i / around);
		}
	}
	for (uint32_t f = 0; f < g->face_count; f++) {
		uint32_t i = f / 2 % around, j = f / 2 / around;
		uint32_t corner[4][2] = {{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}};
		uint32_t vertex[3], coord[3];
		for (size_t k = 0; k < 3; k++) {
			const uint32_t *at = corner[k == 0 ? 0 : f % 2 ? k + 1 : k];
			vertex[k] = at[1] * around + at[0] % around;
			coord[k] = at[1] * (around + 1) + at[0];
		}
		mesh_set_face(g, f, vertex, coord, 0);
	}
}

#endif
