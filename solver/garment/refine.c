/* New vertices are means of old ones, in space and in the pattern alike. All of them lie in a face of the file's mesh,
 * however often it was refined, so that three of the file's vertices are enough to say where. */
#include "solver/garment/refine.h"

#include "solver/garment/correspondence.h"

#include <assert.h>
#include <string.h>

/* Writes vertex `v` of `fine` as the mean of `count` vertices of `coarse`. */
static void add_mean(struct garment *fine, const struct garment *coarse, uint32_t v, const uint32_t *of, uint32_t count)
{
	uint32_t source[3] = {0}, used = 0;
	double share[3] = {0};
	for (size_t axis = 0; axis < 3; axis++) {
		double sum = 0;
		for (uint32_t i = 0; i < count; i++)
			sum += coarse->position[3 * (size_t)of[i] + axis];
		fine->position[3 * (size_t)v + axis] = sum / count;
	}
	for (size_t i = 0; i < 3 * (size_t)count; i++) {
		size_t from = 3 * (size_t)of[i / 3] + i % 3;
		bool own = !coarse->source_vertex;
		if (own ? i % 3 > 0 : coarse->source_share[from] == 0)
			continue;
		uint32_t vertex = own ? of[i / 3] : coarse->source_vertex[from], k = 0;
		while (k < used && source[k] != vertex)
			k++;
		assert(k < 3);
		source[k] = vertex;
		share[k] += (own ? 1 : coarse->source_share[from]) / count;
		used = k == used ? used + 1 : used;
	}
	for (size_t k = 0; k < 3; k++) {
		fine->source_vertex[3 * (size_t)v + k] = source[k < used ? k : 0];
		fine->source_share[3 * (size_t)v + k] = share[k];
	}
}

static void mean_coord(double *pattern, uint32_t coord, const uint32_t *of, uint32_t count)
{
	for (size_t axis = 0; axis < 2; axis++) {
		double sum = 0;
		for (uint32_t i = 0; i < count; i++)
			sum += pattern[2 * (size_t)of[i] + axis];
		pattern[2 * (size_t)coord + axis] = sum / count;
	}
}

/* `face` of `fine` is a part of face `of` of `coarse`. */
static void add_face(struct garment *fine, uint32_t face, const struct garment *coarse, uint32_t of,
		     const uint32_t *vertex, const uint32_t *coord)
{
	memcpy(fine->face_vertex + 3 * (size_t)face, vertex, 3 * sizeof *vertex);
	memcpy(fine->face_coord + 3 * (size_t)face, coord, 3 * sizeof *coord);
	fine->face_piece[face] = coarse->face_piece[of];
	fine->file_face[face] = garment_file_face(coarse, of);
}

static enum tw_status allocate(struct garment *fine, struct arena *arena, const struct garment *coarse,
			       uint64_t vertices, uint64_t coords, uint64_t faces, struct tw_error *error)
{
	if (vertices > TW_LIMIT_VERTICES || faces > TW_LIMIT_FACES)
		return tw_fail(
			error, TW_ERROR_LIMIT, "mesh-too-large", NULL,
			"refined, the mesh would have %llu vertices and %llu faces; at most %u and %u are accepted",
			(unsigned long long)vertices, (unsigned long long)faces, TW_LIMIT_VERTICES, TW_LIMIT_FACES);
	*fine = (struct garment){.vertex_count = (uint32_t)vertices, .face_count = (uint32_t)faces};
	fine->piece_count = coarse->piece_count;
	fine->piece_name = coarse->piece_name;
	fine->source_count = garment_source_count(coarse);
	fine->mesh_vertex = coarse->mesh_vertex;
	fine->file_corner = coarse->file_face ? coarse->file_corner : coarse->face_vertex;
	fine->file_face_count = garment_file_faces(coarse);
	fine->file_face = ARENA_ARRAY(arena, faces, uint32_t);
	fine->coord_count = coarse->coord_count;
	fine->position = ARENA_ARRAY(arena, 3 * vertices, double);
	fine->pattern = ARENA_ARRAY(arena, 2 * coords, double);
	fine->face_vertex = ARENA_ARRAY(arena, 3 * faces, uint32_t);
	fine->face_coord = ARENA_ARRAY(arena, 3 * faces, uint32_t);
	fine->face_piece = ARENA_ARRAY(arena, faces, uint32_t);
	fine->source_vertex = ARENA_ARRAY(arena, 3 * vertices, uint32_t);
	fine->source_share = ARENA_ARRAY(arena, 3 * vertices, double);
	if (!fine->position || !fine->pattern || !fine->face_vertex || !fine->face_coord || !fine->face_piece ||
	    !fine->source_vertex || !fine->source_share || !fine->file_face)
		return tw_fail_memory(error);
	memcpy(fine->pattern, coarse->pattern, 2 * (size_t)coarse->coord_count * sizeof(double));
	for (uint32_t v = 0; v < coarse->vertex_count; v++)
		add_mean(fine, coarse, v, &v, 1);
	return TW_OK;
}

/* side_coord[side]: the pattern position in the middle of each side of a face, the same for both sides of an inner
 * edge. */
static void halve_coords(struct garment *fine, const struct garment *coarse, const struct topology *topology,
			 uint32_t *side_coord)
{
	for (uint32_t side = 0; side < 3 * coarse->face_count; side++) {
		uint32_t e = topology->face_edge[side];
		uint32_t first = 3 * topology->edge_face[2 * (size_t)e] + topology->edge_side[2 * (size_t)e];
		if (topology->edge_kind[e] == EDGE_INNER && first != side) {
			side_coord[side] = side_coord[first];
			continue;
		}
		uint32_t ends[2] = {coarse->face_coord[side], coarse->face_coord[side % 3 == 2 ? side - 2 : side + 1]};
		side_coord[side] = fine->coord_count++;
		mean_coord(fine->pattern, side_coord[side], ends, 2);
	}
}

static void cut_in_four(struct garment *fine, const struct garment *coarse, const struct topology *topology,
			const uint32_t *side_coord)
{
	for (uint32_t f = 0; f < coarse->face_count; f++) {
		const uint32_t *v = coarse->face_vertex + 3 * (size_t)f, *c = coarse->face_coord + 3 * (size_t)f;
		const uint32_t *d = side_coord + 3 * (size_t)f;
		uint32_t m[3];
		for (size_t k = 0; k < 3; k++)
			m[k] = coarse->vertex_count + topology->face_edge[3 * (size_t)f + k];
		for (uint32_t k = 0; k < 3; k++)
			add_face(fine, 4 * f + k, coarse, f, (uint32_t[]){v[k], m[k], m[(k + 2) % 3]},
				 (uint32_t[]){c[k], d[k], d[(k + 2) % 3]});
		add_face(fine, 4 * f + 3, coarse, f, m, d);
	}
}

static enum tw_status refine_midpoint(struct garment *fine, struct arena *arena, const struct garment *coarse,
				      const struct topology *topology, struct tw_error *error)
{
	uint64_t edges = topology->edge_count, sides = 3 * (uint64_t)coarse->face_count;
	enum tw_status status = allocate(fine, arena, coarse, coarse->vertex_count + edges, coarse->coord_count + sides,
					 4 * (uint64_t)coarse->face_count, error);
	if (status != TW_OK)
		return status;
	struct arena_mark mark = arena_mark(arena);
	uint32_t *side_coord = ARENA_ARRAY(arena, sides, uint32_t);
	if (!side_coord)
		return tw_fail_memory(error);
	for (uint32_t e = 0; e < topology->edge_count; e++)
		add_mean(fine, coarse, coarse->vertex_count + e, topology->edge_vertex + 2 * (size_t)e, 2);
	halve_coords(fine, coarse, topology, side_coord);
	cut_in_four(fine, coarse, topology, side_coord);
	arena_release(arena, mark);
	return TW_OK;
}

static enum tw_status refine_centroid(struct garment *fine, struct arena *arena, const struct garment *coarse,
				      struct tw_error *error)
{
	uint64_t faces = coarse->face_count;
	enum tw_status status = allocate(fine, arena, coarse, coarse->vertex_count + faces, coarse->coord_count + faces,
					 3 * faces, error);
	if (status != TW_OK)
		return status;
	for (uint32_t f = 0; f < coarse->face_count; f++) {
		const uint32_t *v = coarse->face_vertex + 3 * (size_t)f, *c = coarse->face_coord + 3 * (size_t)f;
		uint32_t vertex = coarse->vertex_count + f, coord = fine->coord_count++;
		add_mean(fine, coarse, vertex, v, 3);
		mean_coord(fine->pattern, coord, c, 3);
		for (uint32_t k = 0; k < 3; k++)
			add_face(fine, 3 * f + k, coarse, f, (uint32_t[]){v[k], v[(k + 1) % 3], vertex},
				 (uint32_t[]){c[k], c[(k + 1) % 3], coord});
	}
	return TW_OK;
}

enum tw_status garment_refine(struct garment *fine, struct arena *arena, const struct garment *coarse,
			      const struct topology *topology, enum refinement refinement, struct tw_error *error)
{
	return refinement == REFINE_CENTROID ? refine_centroid(fine, arena, coarse, error)
					     : refine_midpoint(fine, arena, coarse, topology, error);
}
