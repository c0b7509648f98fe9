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
		sheet->offset[p] = (struct vec2){0, 0};
		if (!meet)
			continue;
		double width = extent[p].high.x - extent[p].low.x;
		if (x > 0 && x + width > SHELF_MM) {
			x = 0;
			y += height + GAP_MM;
			height = 0;
		}
		sheet->offset[p] = (struct vec2){x - extent[p].low.x, y - extent[p].low.y};
		x += width + GAP_MM;
		if (extent[p].high.y - extent[p].low.y > height)
			height = extent[p].high.y - extent[p].low.y;
	}
}

enum tw_status sheet_arrange(struct sheet *sheet)
{
	uint32_t pieces = sheet->result->input->garment->piece_count;
	struct extent *extent = ARENA_ARRAY(sheet->arena, pieces, struct extent);
	sheet->offset = ARENA_ARRAY(sheet->arena, pieces, struct vec2);
	if (!extent || !sheet->offset)
		return tw_fail_memory(NULL);
	for (uint32_t p = 0; p < pieces; p++)
		extent[p] = sheet_extent(sheet, p);
	arrange(sheet, extent, pieces);
	sheet->left = sheet->bottom = INFINITY;
	sheet->right = sheet->top = -INFINITY;
	for (uint32_t p = 0; p < pieces; p++) {
		struct vec2 low = vec2_add(extent[p].low, sheet->offset[p]);
		struct vec2 high = vec2_add(extent[p].high, sheet->offset[p]);
		sheet->left = fmin(sheet->left, low.x);
		sheet->bottom = fmin(sheet->bottom, low.y);
		sheet->right = fmax(sheet->right, high.x);
		sheet->top = fmax(sheet->top, high.y);
	}
	/* The header needs its room, too. */
	sheet->width = fmax(WIDTH_MIN_MM, sheet->right - sheet->left + 2 * MARGIN_MM);
	sheet->height = sheet->top - sheet->bottom + MARGIN_MM + HEADER_MM;
	return TW_OK;
}

struct vec2 sheet_point(const struct sheet *sheet, uint32_t piece, struct vec2 point)
{
	struct vec2 p = vec2_add(point, sheet->offset[piece]);
	return (struct vec2){p.x - sheet->left + MARGIN_MM, sheet->top - p.y + HEADER_MM};
}

void sheet_add_xy(const struct sheet *sheet, struct vec2 p)
{
	text_number(sheet->text, p.x, 3);
	text_add(sheet->text, " ");
	text_number(sheet->text, p.y, 3);
}

void sheet_add_at(const struct sheet *sheet, uint32_t piece, struct vec2 point)
{
	sheet_add_xy(sheet, sheet_point(sheet, piece, point));
}

void sheet_add_tick(const struct sheet *sheet, uint32_t piece, struct vec2 at, struct vec2 inward, double length)
{
	text_add(sheet->text, "<path d=\"M");
	sheet_add_at(sheet, piece, at);
	text_add(sheet->text, "L");
	sheet_add_at(sheet, piece, vec2_along(at, inward, length));
	text_add(sheet->text, "\"/>\n");
}
