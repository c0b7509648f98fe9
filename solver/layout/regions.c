/* A polygon touches a face when a corner of one lies in the other, or their sides cross. */
#include "solver/layout/regions.h"

#include "solver/curve/vector.h"
#include "solver/garment/correspondence.h"
#include "solver/names.h"

#include <string.h>

struct finder {
	const struct garment *garment;
	const struct topology *topology;
	const struct layout_constraints *constraints;
};

bool constraints_any(const struct layout_constraints *constraints)
{
	return constraints->keep_out_count || constraints->multiplier_count || constraints->free_edge_count ||
	       constraints->seam_price_mpa_mm2 > 0;
}

static struct vec2 point_of(const double *uv)
{
	return (struct vec2){uv[0], uv[1]};
}

/* By the number of sides that a ray to the right crosses. */
static bool inside(const struct vec2 *polygon, uint32_t count, struct vec2 p)
{
	bool in = false;
	for (uint32_t i = 0, j = count - 1; i < count; j = i++) {
		struct vec2 a = polygon[i], b = polygon[j];
		if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y))
			in = !in;
	}
	return in;
}

static bool sides_cross(struct vec2 a, struct vec2 b, struct vec2 c, struct vec2 d)
{
	struct vec2 ab = vec2_sub(b, a), cd = vec2_sub(d, c);
	double c_side = vec2_cross(ab, vec2_sub(c, a)), d_side = vec2_cross(ab, vec2_sub(d, a));
	double a_side = vec2_cross(cd, vec2_sub(a, c)), b_side = vec2_cross(cd, vec2_sub(b, c));
	return c_side * d_side < 0 && a_side * b_side < 0;
}

struct box {
	struct vec2 low, high;
};

static struct box box_around(const struct vec2 *point, uint32_t count)
{
	struct box box = {point[0], point[0]};
	for (uint32_t i = 1; i < count; i++) {
		box.low = (struct vec2){fmin(box.low.x, point[i].x), fmin(box.low.y, point[i].y)};
		box.high = (struct vec2){fmax(box.high.x, point[i].x), fmax(box.high.y, point[i].y)};
	}
	return box;
}

static bool boxes_meet(const struct box *a, const struct box *b)
{
	return a->low.x <= b->high.x && b->low.x <= a->high.x && a->low.y <= b->high.y && b->low.y <= a->high.y;
}

static bool touches(const struct vec2 corner[3], const struct vec2 *polygon, uint32_t count)
{
	for (uint32_t k = 0; k < 3; k++)
		if (inside(polygon, count, corner[k]))
			return true;
	for (uint32_t i = 0; i < count; i++) {
		if (inside(corner, 3, polygon[i]))
			return true;
		for (uint32_t k = 0; k < 3; k++)
			if (sides_cross(corner[k], corner[(k + 1) % 3], polygon[i], polygon[(i + 1) % count]))
				return true;
	}
	return false;
}

static enum tw_status find_piece(const struct finder *finder, const char *name, const char *where, uint32_t *piece,
				 struct tw_error *error)
{
	for (*piece = 0; *piece < finder->garment->piece_count; (*piece)++)
		if (!strcmp(finder->garment->piece_name[*piece], name))
			return TW_OK;
	const struct names names = {(const char *const *)finder->garment->piece_name, finder->garment->piece_count};
	return names_refuse(&names, "pattern piece", name, "unknown-piece", where, error);
}

static enum tw_status mark_polygon(const struct finder *finder, const struct face_region *region, const char *where,
				   uint8_t *mark, struct arena *arena, struct tw_error *error)
{
	const struct garment *garment = finder->garment;
	uint32_t piece;
	enum tw_status status = find_piece(finder, region->piece, where, &piece, error);
	if (status != TW_OK)
		return status;
	struct vec2 *polygon = ARENA_ARRAY(arena, region->point_count, struct vec2);
	if (!polygon)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i < region->point_count; i++)
		polygon[i] = point_of(&region->polygon[2 * (size_t)i]);
	const struct box around = box_around(polygon, region->point_count);
	for (uint32_t f = 0; f < garment->face_count; f++) {
		if (garment->face_piece[f] != piece)
			continue;
		struct vec2 corner[3];
		for (uint32_t k = 0; k < 3; k++)
			corner[k] = point_of(&garment->pattern[2 * (size_t)garment->face_coord[3 * (size_t)f + k]]);
		const struct box here = box_around(corner, 3);
		mark[f] |= boxes_meet(&here, &around) && touches(corner, polygon, region->point_count);
	}
	return TW_OK;
}

static enum tw_status mark_faces(const struct finder *finder, const struct face_region *region, const char *where,
				 uint8_t *mark, struct tw_error *error)
{
	for (uint32_t i = 0; i < region->face_count; i++) {
		if (region->face[i] >= garment_file_faces(finder->garment)) {
			char place[128];
			snprintf(place, sizeof place, "%.90s/faces/%u", where, i);
			return tw_fail(error, TW_ERROR_INPUT, "face-out-of-range", place,
				       "there is no face %u: the garment's file has %u, counted from 0",
				       region->face[i], garment_file_faces(finder->garment));
		}
		uint32_t first = 0, parts = garment_face_parts(finder->garment, region->face[i], &first);
		memset(mark + first, 1, parts);
	}
	return TW_OK;
}

/* Sets mark[f] for every face of the region. */
static enum tw_status mark_region(const struct finder *finder, const struct face_region *region, const char *list,
				  uint32_t index, uint8_t *mark, struct arena *arena, struct tw_error *error)
{
	char where[96];
	snprintf(where, sizeof where, "/constraints/%s/%u", list, index);
	return region->face ? mark_faces(finder, region, where, mark, error)
			    : mark_polygon(finder, region, where, mark, arena, error);
}

static enum tw_status find_keep_outs(const struct finder *finder, struct field_constraints *found, struct arena *arena,
				     struct tw_error *error)
{
	uint8_t *mark = ARENA_ZEROED(arena, finder->garment->face_count, uint8_t);
	if (!mark)
		return tw_fail_memory(error);
	found->face_keep_out = mark;
	enum tw_status status = TW_OK;
	for (uint32_t i = 0; i < finder->constraints->keep_out_count && status == TW_OK; i++)
		status = mark_region(finder, &finder->constraints->keep_out[i], "keep_out", i, mark, arena, error);
	return status;
}

static enum tw_status find_multipliers(const struct finder *finder, struct field_constraints *found,
				       struct arena *arena, struct tw_error *error)
{
	uint32_t faces = finder->garment->face_count;
	double *factor = ARENA_ARRAY(arena, faces, double);
	uint8_t *mark = ARENA_ARRAY(arena, faces, uint8_t);
	if (!factor || !mark)
		return tw_fail_memory(error);
	for (uint32_t f = 0; f < faces; f++)
		factor[f] = 1;
	found->face_multiplier = factor;
	for (uint32_t i = 0; i < finder->constraints->multiplier_count; i++) {
		const struct face_region *region = &finder->constraints->multiplier[i];
		memset(mark, 0, faces);
		enum tw_status status = mark_region(finder, region, "face_multipliers", i, mark, arena, error);
		if (status != TW_OK)
			return status;
		for (uint32_t f = 0; f < faces; f++) {
			factor[f] *= mark[f] ? region->factor : 1;
			factor[f] = factor[f] < 1e9 ? factor[f] : 1e9;
		}
	}
	return TW_OK;
}

/* The garment's edges by the lower end of the file's edge that they are part of. */
struct edge_index {
	/* [edge_count] ends of the file's edge, as the garment's vertices; GARMENT_NONE within a face of the file */
	uint32_t (*file_end)[2];
	uint32_t *head; /* [vertex_count] */
	uint32_t *next; /* [edge_count] */
};

static enum tw_status index_edges(struct edge_index *index, struct arena *arena, const struct finder *finder,
				  struct tw_error *error)
{
	const struct topology *topology = finder->topology;
	uint32_t vertices = finder->garment->vertex_count;
	uint32_t(*file_end)[2] = arena_array(arena, topology->edge_count, sizeof *file_end);
	index->file_end = file_end;
	index->head = ARENA_ARRAY(arena, vertices, uint32_t);
	index->next = ARENA_ARRAY(arena, topology->edge_count, uint32_t);
	if (!file_end || !index->head || !index->next)
		return tw_fail_memory(error);
	memset(index->head, 0xff, vertices * sizeof *index->head);
	for (uint32_t e = 0; e < topology->edge_count; e++) {
		if (!garment_edge_to_file(finder->garment, &topology->edge_vertex[2 * (size_t)e], file_end[e])) {
			file_end[e][0] = file_end[e][1] = GARMENT_NONE;
			continue;
		}
		index->next[e] = index->head[file_end[e][0]];
		index->head[file_end[e][0]] = e;
	}
	return TW_OK;
}

/* Marks all parts of the file's edge between two of the garment's vertices; false where there is none. */
static bool mark_edge(const struct edge_index *index, uint32_t a, uint32_t b, uint8_t *mark)
{
	uint32_t low = a < b ? a : b, high = a < b ? b : a;
	bool found = false;
	for (uint32_t e = index->head[low]; e != GARMENT_NONE; e = index->next[e]) {
		if (index->file_end[e][1] != high)
			continue;
		mark[e] = 1;
		found = true;
	}
	return found;
}

static enum tw_status find_free_edges(const struct finder *finder, struct field_constraints *found, struct arena *arena,
				      struct tw_error *error)
{
	const struct garment *garment = finder->garment;
	uint8_t *is_free = ARENA_ZEROED(arena, finder->topology->edge_count, uint8_t);
	struct edge_index index;
	enum tw_status status = is_free ? index_edges(&index, arena, finder, error) : tw_fail_memory(error);
	if (status != TW_OK)
		return status;
	for (uint32_t i = 0; i < finder->constraints->free_edge_count; i++) {
		const uint32_t *pair = &finder->constraints->free_edge[2 * (size_t)i];
		bool known = pair[0] < garment_source_count(garment) && pair[1] < garment_source_count(garment);
		if (known && mark_edge(&index, garment_mesh_vertex(garment, pair[0]),
				       garment_mesh_vertex(garment, pair[1]), is_free))
			continue;
		char where[64];
		snprintf(where, sizeof where, "/constraints/free_edges/%u", i);
		return tw_fail(error, TW_ERROR_INPUT, "unknown-edge", where,
			       "no edge of the garment's file joins vertices %u and %u", pair[0], pair[1]);
	}
	found->edge_free = is_free;
	return TW_OK;
}

enum tw_status constraints_find(struct field_constraints *found, struct arena *arena, const struct garment *garment,
				const struct topology *topology, const struct layout_constraints *constraints,
				struct tw_error *error)
{
	const struct finder finder = {garment, topology, constraints};
	*found = (struct field_constraints){.seam_price_mpa_mm2 = constraints->seam_price_mpa_mm2};
	enum tw_status status = TW_OK;
	if (constraints->keep_out_count)
		status = find_keep_outs(&finder, found, arena, error);
	if (status == TW_OK && constraints->multiplier_count)
		status = find_multipliers(&finder, found, arena, error);
	if (status == TW_OK && constraints->free_edge_count)
		status = find_free_edges(&finder, found, arena, error);
	return status;
}
