/* Sides of marked faces that no other marked face of the piece shares bound the area; each leads from one pattern
 * position to the next, and following them gives loops with the area on their left. */
#include "solver/layout/sheet_faces.h"

#include <assert.h>
#include <string.h>

struct side {
	uint32_t from, to; /* pattern positions */
	uint32_t next;     /* another side that begins where this one does; GARMENT_NONE */
	bool drawn;
};

struct bounds {
	const struct garment *garment;
	const struct topology *topology;
	const uint8_t *marked;
	struct side *side; /* [count] */
	uint32_t count;
	uint32_t *first; /* [coord_count] a side that begins there; GARMENT_NONE */
};

static bool is_bound(const struct bounds *bounds, uint32_t face, uint32_t k)
{
	uint32_t edge = bounds->topology->face_edge[3 * (size_t)face + k];
	const uint32_t *pair = &bounds->topology->edge_face[2 * (size_t)edge];
	uint32_t other = pair[0] == face ? pair[1] : pair[0];
	return bounds->topology->edge_kind[edge] != EDGE_INNER || !bounds->marked[other];
}

static void find_sides(struct bounds *bounds, uint32_t piece)
{
	bounds->count = 0;
	memset(bounds->first, 0xff, bounds->garment->coord_count * sizeof *bounds->first);
	for (uint32_t f = 0; f < bounds->garment->face_count; f++) {
		const uint32_t *coord = &bounds->garment->face_coord[3 * (size_t)f];
		if (!bounds->marked[f] || bounds->garment->face_piece[f] != piece)
			continue;
		for (uint32_t k = 0; k < 3; k++) {
			if (!is_bound(bounds, f, k))
				continue;
			uint32_t from = coord[k];
			bounds->side[bounds->count] =
				(struct side){from, coord[(k + 1) % 3], bounds->first[from], false};
			bounds->first[from] = bounds->count++;
		}
	}
}

static struct side *undrawn_at(const struct bounds *bounds, uint32_t coord)
{
	for (uint32_t i = bounds->first[coord]; i != GARMENT_NONE; i = bounds->side[i].next)
		if (!bounds->side[i].drawn)
			return &bounds->side[i];
	return NULL;
}

static void add_loop(const struct sheet *sheet, struct drawing_item *path, uint32_t piece, const struct bounds *bounds,
		     struct side *start)
{
	for (struct side *side = start; side; side = undrawn_at(bounds, side->to)) {
		const double *uv = &bounds->garment->pattern[2 * (size_t)side->from];
		struct vec2 at = sheet_point(sheet, piece, (struct vec2){uv[0], uv[1]});
		if (side == start)
			drawing_move_to(sheet->drawing, path, at);
		else
			drawing_line_to(sheet->drawing, path, at);
		side->drawn = true;
	}
}

enum tw_status sheet_add_faces(const struct sheet *sheet, const struct drawing_style *style, const uint8_t *marked)
{
	struct bounds bounds = {
		.garment = sheet->result->input->garment, .topology = sheet->result->input->topology, .marked = marked};
	size_t faces = 0;
	for (uint32_t f = 0; f < bounds.garment->face_count; f++)
		faces += marked[f] != 0;
	bounds.side = ARENA_ARRAY(sheet->arena, 3 * faces, struct side);
	bounds.first = ARENA_ARRAY(sheet->arena, bounds.garment->coord_count, uint32_t);
	if (!bounds.side || !bounds.first)
		return tw_fail_memory(NULL);
	for (uint32_t p = 0; p < bounds.garment->piece_count; p++) {
		find_sides(&bounds, p);
		assert(bounds.count <= 3 * faces);
		struct drawing_item *path = bounds.count ? drawing_add_path(sheet->drawing, style, p, true) : NULL;
		for (uint32_t i = 0; i < bounds.count; i++)
			if (!bounds.side[i].drawn)
				add_loop(sheet, path, p, &bounds, &bounds.side[i]);
	}
	return TW_OK;
}
