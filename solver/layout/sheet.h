/* The sheet that pattern.svg draws: where every piece lies on it, at true scale, and how points of pieces are written.
 * One unit is one millimetre. The pattern's v axis points up, so v changes its sign on the way to SVG. */
#ifndef SOLVER_LAYOUT_SHEET_H
#define SOLVER_LAYOUT_SHEET_H

#include "solver/layout/result.h"

struct sheet {
	const struct layout_result *result;
	struct text *text;
	struct arena *arena; /* scratch of the whole drawing */
	struct vec2 *offset; /* [piece_count] from a piece's plane to the sheet, v still up */
	double left, bottom, right, top;
	double width, height; /* of the page */
};

/* The box around a piece, in its own plane. */
struct extent {
	struct vec2 low, high;
};
struct extent sheet_extent(const struct sheet *sheet, uint32_t piece);

/* Places the pieces; `result`, `text` and `arena` are set. TW_ERROR_MEMORY. */
enum tw_status sheet_arrange(struct sheet *sheet) TW_NODISCARD;

/* A point of a piece on the page: from the top left corner of the drawing, y down. */
struct vec2 sheet_point(const struct sheet *sheet, uint32_t piece, struct vec2 point);

/* Write "x y" of a point on the page, and of a point of a piece. */
void sheet_add_xy(const struct sheet *sheet, struct vec2 page);
void sheet_add_at(const struct sheet *sheet, uint32_t piece, struct vec2 point);

/* A short line across the cut line, inwards. */
void sheet_add_tick(const struct sheet *sheet, uint32_t piece, struct vec2 at, struct vec2 inward, double length);

#endif
