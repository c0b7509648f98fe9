/* Faces in the order of order.h; edges in that in which the faces meet them. */
#include "solver/field/local.h"

#include "solver/field/order.h"

#include <stdbool.h>

static bool is_identity(const uint32_t *order, uint32_t count)
{
	uint32_t i = 0;
	while (i < count && order[i] == i)
		i++;
	return i == count;
}

static void renumber(struct local *local, const struct garment *garment, const struct topology *topology,
		     const uint32_t *order, uint32_t *place, uint32_t *edge_order)
{
	uint32_t edges = 0;
	for (uint32_t i = 0; i < garment->face_count; i++)
		place[order[i]] = i;
	for (size_t i = 0; i < garment->face_count; i++) {
		size_t face = order[i];
		for (size_t k = 0; k < 3; k++) {
			uint32_t edge = topology->face_edge[3 * face + k];
			local->garment.face_coord[3 * i + k] = garment->face_coord[3 * face + k];
			local->garment.face_vertex[3 * i + k] = garment->face_vertex[3 * face + k];
			if (topology->edge_face[2 * (size_t)edge] == face)
				edge_order[edges++] = edge;
		}
	}
	for (size_t e = 0; e < 2 * (size_t)topology->edge_count; e++) {
		uint32_t face = topology->edge_face[e];
		local->topology.edge_face[e] = face == GARMENT_NONE ? GARMENT_NONE : place[face];
	}
	local->face = order;
	local->edge_order = edge_order;
}

enum tw_status local_build(struct local *local, struct arena *arena, const struct garment *garment,
			   const struct topology *topology, struct tw_error *error)
{
	const uint32_t faces = garment->face_count;
	*local = (struct local){.garment = *garment, .topology = *topology};
	struct arena_mark mark = arena_mark(arena);
	uint32_t *order = ARENA_ARRAY(arena, faces, uint32_t);
	if (!order)
		return tw_fail_memory(error);
	enum tw_status status = order_faces(order, arena, garment->face_vertex, faces, garment->vertex_count, error);
	if (status != TW_OK || is_identity(order, faces)) {
		arena_release(arena, mark);
		return status;
	}
	uint32_t *place = ARENA_ARRAY(arena, faces, uint32_t);
	uint32_t *edge_order = ARENA_ARRAY(arena, topology->edge_count, uint32_t);
	local->garment.face_coord = ARENA_ARRAY(arena, 3 * (size_t)faces, uint32_t);
	local->garment.face_vertex = ARENA_ARRAY(arena, 3 * (size_t)faces, uint32_t);
	local->topology.edge_face = ARENA_ARRAY(arena, 2 * (size_t)topology->edge_count, uint32_t);
	if (!place || !edge_order || !local->garment.face_coord || !local->garment.face_vertex ||
	    !local->topology.edge_face)
		return tw_fail_memory(error);
	renumber(local, garment, topology, order, place, edge_order);
	return TW_OK;
}

const double *local_values(const struct local *local, struct arena *arena, const double *value)
{
	if (!local->face)
		return value;
	double *own = ARENA_ARRAY(arena, local->garment.face_count, double);
	for (uint32_t f = 0; own && f < local->garment.face_count; f++)
		own[f] = value[local->face[f]];
	return own;
}
