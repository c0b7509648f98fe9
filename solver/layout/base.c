#include "solver/layout/base.h"

#include "solver/splitmix.h"

#include <string.h>

enum { CORNER_PARTS = 3 }; /* so many pieces make a corner */

static struct vec2 coord_of(const struct garment *garment, uint32_t coord)
{
	const double *uv = &garment->pattern[2 * (size_t)coord];
	return (struct vec2){uv[0], uv[1]};
}

static enum tw_status take_chords(struct layout_base *base, const struct field *asked, struct arena *arena,
				  struct tw_error *error)
{
	uint64_t *weight = ARENA_ARRAY(arena, asked->edge_count, uint64_t);
	float *coverage = ARENA_ARRAY(arena, asked->edge_count, float);
	if (!weight || !coverage)
		return tw_fail_memory(error);
	for (uint32_t e = 0; e < asked->edge_count; e++) {
		weight[e] = asked->chord_weight[base->canonical.edge[e]];
		coverage[e] = asked->chord_coverage[base->canonical.edge[e]];
	}
	base->field.chord_weight = weight;
	base->field.chord_coverage = coverage;
	return TW_OK;
}

static enum tw_status take_field(struct layout_base *base, const struct field *asked, struct arena *arena,
				 struct tw_error *error)
{
	const struct canonical *canonical = &base->canonical;
	double *density = ARENA_ARRAY(arena, asked->face_count, double);
	uint64_t *weight = ARENA_ARRAY(arena, asked->edge_count, uint64_t);
	float *coverage = ARENA_ARRAY(arena, asked->edge_count, float);
	if (!density || !weight || !coverage)
		return tw_fail_memory(error);
	for (uint32_t f = 0; f < asked->face_count; f++)
		density[f] = asked->density[canonical->face[f]];
	for (uint32_t e = 0; e < asked->edge_count; e++) {
		weight[e] = asked->weight[canonical->edge[e]];
		coverage[e] = asked->coverage[canonical->edge[e]];
	}
	base->field = *asked;
	base->field.density = density;
	base->field.weight = weight;
	base->field.coverage = coverage;
	return asked->chord_weight ? take_chords(base, asked, arena, error) : TW_OK;
}

uint64_t layout_hash_point(struct vec2 point)
{
	const double at[2] = {point.x + 0.0, point.y + 0.0}; /* the two zeros are one place */
	uint64_t bits[2];
	memcpy(bits, at, sizeof bits);
	return splitmix(splitmix(bits[0]) ^ bits[1]);
}

/* Of a vertex on a seam all its places count, of which the order does not. */
static enum tw_status hash_vertices(struct layout_base *base, struct arena *arena, struct tw_error *error)
{
	const struct garment *garment = &base->canonical.garment;
	uint64_t *hash = ARENA_ZEROED(arena, garment->vertex_count, uint64_t);
	const struct arena_mark mark = arena_mark(arena);
	bool *seen = ARENA_ZEROED(arena, garment->coord_count, bool);
	if (!hash || !seen)
		return tw_fail_memory(error);
	for (size_t corner = 0; corner < 3 * (size_t)garment->face_count; corner++) {
		uint32_t coord = garment->face_coord[corner];
		if (!seen[coord])
			hash[garment->face_vertex[corner]] += layout_hash_point(coord_of(garment, coord));
		seen[coord] = true;
	}
	arena_release(arena, mark);
	base->vertex_hash = hash;
	return TW_OK;
}

static double edge_length(const struct layout_base *base, uint32_t edge)
{
	const struct garment *garment = &base->canonical.garment;
	const struct topology *topology = &base->canonical.topology;
	double sum = 0, sides = 0;
	for (uint32_t side = 0; side < 2; side++) {
		uint32_t face = topology->edge_face[2 * (size_t)edge + side];
		if (face == GARMENT_NONE)
			continue;
		uint32_t k = topology->edge_side[2 * (size_t)edge + side];
		const uint32_t *coord = &garment->face_coord[3 * (size_t)face];
		sum += vec2_distance(coord_of(garment, coord[k]), coord_of(garment, coord[(k + 1) % 3]));
		sides++;
	}
	return sides > 0 ? sum / sides : 0;
}

static enum tw_status measure_edges(struct layout_base *base, struct arena *arena, struct tw_error *error)
{
	const uint32_t edges = base->canonical.topology.edge_count;
	double *length = ARENA_ARRAY(arena, edges, double), sum = 0;
	if (!length)
		return tw_fail_memory(error);
	for (uint32_t e = 0; e < edges; e++)
		sum += length[e] = edge_length(base, e);
	base->edge_length_mm = length;
	base->mean_edge_mm = edges ? sum / edges : 1;
	return TW_OK;
}

/* A vertex has a pattern position for every piece, or part of one, that meets there. */
static enum tw_status find_corners(struct layout_base *base, struct arena *arena, struct tw_error *error)
{
	const struct garment *garment = &base->canonical.garment;
	bool *corner = ARENA_ZEROED(arena, garment->vertex_count, bool);
	const struct arena_mark mark = arena_mark(arena);
	uint8_t *parts = ARENA_ZEROED(arena, garment->vertex_count, uint8_t);
	bool *seen = ARENA_ZEROED(arena, garment->coord_count, bool);
	if (!corner || !parts || !seen)
		return tw_fail_memory(error);
	for (size_t c = 0; c < 3 * (size_t)garment->face_count; c++) {
		uint32_t vertex = garment->face_vertex[c], coord = garment->face_coord[c];
		if (seen[coord] || parts[vertex] == CORNER_PARTS)
			continue;
		seen[coord] = true;
		corner[vertex] = ++parts[vertex] == CORNER_PARTS;
	}
	arena_release(arena, mark);
	base->corner = corner;
	return TW_OK;
}

static enum tw_status find_chords(struct layout_base *base, struct arena *arena, struct tw_error *error)
{
	const struct garment *garment = &base->canonical.garment;
	const struct topology *topology = &base->canonical.topology;
	struct base_chord *chord = ARENA_ARRAY(arena, topology->edge_count, struct base_chord);
	const struct arena_mark mark = arena_mark(arena);
	double *nothing = ARENA_ZEROED(arena, garment->face_count, double);
	struct strip_fabric fabric;
	if (!chord || !nothing)
		return tw_fail_memory(error);
	enum tw_status status = strip_fabric_build(&fabric, arena, garment, topology, nothing, error);
	for (uint32_t e = 0; status == TW_OK && e < topology->edge_count; e++) {
		struct base_chord *next = &chord[base->chord_count];
		next->edge = e;
		base->chord_count += strip_find_chord(&fabric, e, &next->chord);
	}
	arena_release(arena, mark);
	base->chord = chord;
	return status;
}

enum tw_status layout_base_build(struct layout_base *base, struct arena *arena, const struct garment *garment,
				 const struct topology *topology, const struct field *field, struct tw_error *error)
{
	*base = (struct layout_base){0};
	enum tw_status status = canonical_build(&base->canonical, arena, garment, topology, error);
	if (status == TW_OK)
		status = take_field(base, field, arena, error);
	if (status == TW_OK)
		status = locator_build(&base->locator, arena, &base->canonical.garment, error);
	if (status == TW_OK)
		status = outline_build(&base->outline, arena, &base->canonical.garment, &base->canonical.topology,
				       error);
	if (status == TW_OK)
		status = measure_edges(base, arena, error);
	if (status == TW_OK)
		status = hash_vertices(base, arena, error);
	if (status == TW_OK)
		status = find_corners(base, arena, error);
	/* Baselines, and fields that are one, stay on the mesh's edges. */
	const bool has_chords = field->options.weight == FIELD_DEFORMATION;
	return status == TW_OK && has_chords ? find_chords(base, arena, error) : status;
}
