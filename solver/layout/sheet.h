/* The sheet that a pattern is drawn on: where every piece lies on it, at true scale. */
#ifndef SOLVER_LAYOUT_SHEET_H
#define SOLVER_LAYOUT_SHEET_H

#include "solver/drawing/drawing.h"
#include "solver/layout/result.h"

struct sheet {
	const struct layout_result *result;
	struct drawing *drawing;     /* its page and blocks are the sheet's */
	struct arena *arena;         /* of the drawing */
	struct drawing_block *block; /* [piece_count] */
	double width, height;        /* of the page */
};

/* The box around a piece, in its own plane. */
struct extent {
	struct vec2 low, high;
};
struct extent sheet_extent(const struct sheet *sheet, uint32_t piece);

/* Places the pieces; `result`, `drawing` and `arena` are set. TW_ERROR_MEMORY. */
enum tw_status sheet_arrange(struct sheet *sheet) TW_NODISCARD;

/* A point of a piece on the page. */
struct vec2 sheet_point(const struct sheet *sheet, uint32_t piece, struct vec2 point);

/* From the page's y, up, to that of a label_page, down, and back. */
struct vec2 sheet_flip(const struct sheet *sheet, struct vec2 page);

#endif
