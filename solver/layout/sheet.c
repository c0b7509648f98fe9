/* The pattern's sheet: see sheet.h. */
#include "solver/layout/sheet.h"

enum { MARGIN_MM = 30, GAP_MM = 30, SHELF_MM = 2000, HEADER_MM = 150, WIDTH_MIN_MM = 900 };

struct extent sheet_extent(const struct sheet *sheet, uint32_t piece)
{
	const struct layout_result *result = sheet->result;
	struct extent extent = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
	const struct outline *outline = result->outline;
	for (uint32_t i = outline->piece_first[piece]; i < outline->piece_first[piece + 1]; i++) {
		struct vec2 from, to;
		outline_ends(outline, result->input->garment, i, &from, &to);
		extent.low.x = from.x < extent.low.x ? from.x : extent.low.x;
		extent.low.y = from.y < extent.low.y ? from.y : extent.low.y;
		extent.high.x = from.x > extent.high.x ? from.x : extent.high.x;
		extent.high.y = from.y > extent.high.y ? from.y : extent.high.y;
	}
	return extent;
}

static bool extents_meet(const struct extent *a, const struct extent *b)
{
	return a->low.x < b->high.x && b->low.x < a->high.x && a->low.y < b->high.y && b->low.y < a->high.y;
}

/* Pieces that lie over each other, each at its own origin say, are set side by side in shelves. */
static void arrange(struct sheet *sheet, const struct extent *extent, uint32_t pieces)
{
	bool meet = false;
	for (uint32_t p = 0; p < pieces && !meet; p++)
		for (uint32_t q = 0; q < p && !meet; q++)
			meet = extents_meet(&extent[p], &extent[q]);
	double x = 0, y = 0, height = 0;
	for (uint32_t p = 0; p < pieces; p++) {
		sheet->block[p] = (struct drawing_block){.name = sheet->result->input->garment->piece_name[p]};
		if (!meet)
			continue;
		double width = extent[p].high.x - extent[p].low.x;
		if (x > 0 && x + width > SHELF_MM) {
			x = 0;
			y += height + GAP_MM;
			height = 0;
		}
		sheet->block[p].origin = (struct vec2){x - extent[p].low.x, y - extent[p].low.y};
		x += width + GAP_MM;
		if (extent[p].high.y - extent[p].low.y > height)
			height = extent[p].high.y - extent[p].low.y;
	}
}

/* The page around the pieces; the header needs its room, too. */
static void fit_page(struct sheet *sheet, const struct extent *extent, uint32_t pieces)
{
	struct vec2 low = {INFINITY, INFINITY}, high = {-INFINITY, -INFINITY};
	for (uint32_t p = 0; p < pieces; p++) {
		struct vec2 least = vec2_add(extent[p].low, sheet->block[p].origin);
		struct vec2 most = vec2_add(extent[p].high, sheet->block[p].origin);
		low = (struct vec2){fmin(low.x, least.x), fmin(low.y, least.y)};
		high = (struct vec2){fmax(high.x, most.x), fmax(high.y, most.y)};
	}
	for (uint32_t p = 0; p < pieces; p++)
		sheet->block[p].origin =
			vec2_sub(sheet->block[p].origin, (struct vec2){low.x - MARGIN_MM, low.y - MARGIN_MM});
	sheet->width = fmax(WIDTH_MIN_MM, high.x - low.x + 2 * MARGIN_MM);
	sheet->height = high.y - low.y + MARGIN_MM + HEADER_MM;
}

enum tw_status sheet_arrange(struct sheet *sheet)
{
	uint32_t pieces = sheet->result->input->garment->piece_count;
	struct extent *extent = ARENA_ARRAY(sheet->arena, pieces, struct extent);
	sheet->block = ARENA_ARRAY(sheet->arena, pieces, struct drawing_block);
	if (!extent || !sheet->block)
		return tw_fail_memory(NULL);
	for (uint32_t p = 0; p < pieces; p++)
		extent[p] = sheet_extent(sheet, p);
	arrange(sheet, extent, pieces);
	fit_page(sheet, extent, pieces);
	sheet->drawing->width = sheet->width;
	sheet->drawing->height = sheet->height;
	sheet->drawing->block = sheet->block;
	sheet->drawing->block_count = pieces;
	return TW_OK;
}

struct vec2 sheet_point(const struct sheet *sheet, uint32_t piece, struct vec2 point)
{
	return vec2_add(point, sheet->block[piece].origin);
}

struct vec2 sheet_flip(const struct sheet *sheet, struct vec2 page)
{
	return (struct vec2){page.x, sheet->height - page.y};
}
