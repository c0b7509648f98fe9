/* A drawing as the files of a cutting room carry it: layers of lines, arcs, circles and texts in millimetres. Layout
 * code fills it; a writer for each format (svg.h) reads it.
 *
 * Coordinates are the page's: x to the right, y up, from the lower left corner, so that a piece is only moved on its
 * way from the pattern to the page, never mirrored. A block is a pattern piece: what belongs to it says so, and formats
 * that know blocks write it in the piece's own coordinates.
 *
 * Failure sticks, as in struct text: a filler need not look after every line, a writer refuses a drawing that failed.
 * Memory lies in the arena. Names, texts and styles are borrowed. */
#ifndef SOLVER_DRAWING_DRAWING_H
#define SOLVER_DRAWING_DRAWING_H

#include "solver/arena.h"
#include "solver/curve/curve.h"

#include <stdbool.h>

#define DRAWING_NONE UINT32_MAX

/* How a line, an area or a text looks; formats without colours go by the name. */
struct drawing_style {
	const char *name;   /* "cut", "strip", …: lower case, unique in a drawing */
	const char *stroke; /* "#rrggbb"; NULL for none */
	const char *fill;   /* "#rrggbb"; NULL for none. Areas are filled even-odd: a loop within a loop is a hole */
	double stroke_mm;
	double opacity;    /* 0…1 of stroke and fill; 0 means 1 */
	double dash_mm[2]; /* dash and gap; 0, 0 for a full line */
	bool halo;         /* the stroke is a halo behind the fill */
};

/* A corner of a path. */
struct drawing_vertex {
	struct vec2 at;
	double bulge; /* of the way to the next vertex: tan(turn / 4), positive to the left; 0 for a line */
	bool begins;  /* a new line of the path begins here */
};

struct drawing_path {
	struct drawing_vertex *vertex;
	uint32_t count, room;
	bool closed; /* the last vertex of every line joins its first */
};

struct drawing_circle {
	struct vec2 centre;
	double radius;
};

enum drawing_anchor { DRAWING_START, DRAWING_MIDDLE, DRAWING_END };

struct drawing_text {
	struct vec2 at; /* on the base line */
	double size_mm;
	enum drawing_anchor anchor; /* which end of the text is `at` */
	const char *text;           /* UTF-8 */
};

/* A picture of shades, row by row from the top: 0 for nothing, else an index into `colour`. */
struct drawing_cells {
	struct vec2 at; /* the upper left corner */
	double cell_mm;
	uint32_t columns, rows;
	const uint8_t *shade;    /* [rows][columns] */
	const char (*colour)[8]; /* [shade_count] "#rrggbb"; colour[0] is not used */
	uint32_t shade_count;
};

enum drawing_kind { DRAWING_PATH, DRAWING_CIRCLE, DRAWING_TEXT, DRAWING_CELLS };

struct drawing_item {
	enum drawing_kind kind;
	const struct drawing_style *style; /* NULL for cells */
	uint32_t block;                    /* DRAWING_NONE outside all pieces */
	const char *title;                 /* what it is, for those who point at it; NULL for nothing */
	struct drawing_item *next;
	union {
		struct drawing_path path;
		struct drawing_circle circle;
		struct drawing_text text;
		struct drawing_cells cells;
	};
};

struct drawing_layer {
	const char *id;    /* "cut-line": lower case letters and hyphens, unique */
	const char *label; /* for people */
	struct drawing_item *first, *last;
	struct drawing_layer *next;
};

struct drawing_block {
	const char *name;
	struct vec2 origin; /* where the piece's own origin lies on the page */
};

struct drawing {
	struct arena *arena;
	const char *title;
	double width, height;              /* of the page, mm */
	bool true_scale;                   /* a millimetre is a millimetre; else the drawing is a picture of any size */
	int decimals;                      /* that coordinates are written with */
	const struct drawing_block *block; /* [block_count] borrowed */
	uint32_t block_count;
	struct drawing_layer *first, *last;
	bool failed;
};

/* Begins a layer: what is added goes there. */
void drawing_begin_layer(struct drawing *drawing, const char *id, const char *label);

/* Add an item to the layer that was begun last, and return it, for a title say; the path is empty. NULL after a
 * failure, which every function below takes and does nothing. */
struct drawing_item *drawing_add_path(struct drawing *drawing, const struct drawing_style *style, uint32_t block,
				      bool closed);
struct drawing_item *drawing_add_circle(struct drawing *drawing, const struct drawing_style *style, uint32_t block,
					struct vec2 centre, double radius);
struct drawing_item *drawing_add_text(struct drawing *drawing, const struct drawing_style *style, uint32_t block,
				      const struct drawing_text *text);
struct drawing_item *drawing_add_cells(struct drawing *drawing, const struct drawing_cells *cells);

/* A straight line of two points. */
void drawing_add_line(struct drawing *drawing, const struct drawing_style *style, uint32_t block, struct vec2 from,
		      struct vec2 to);

/* Begin a line of a path; go on straight; go on along an arc that sweeps `turn` radians, positive to the left,
 * |turn| < 2 pi. */
void drawing_move_to(struct drawing *drawing, struct drawing_item *path, struct vec2 at);
void drawing_line_to(struct drawing *drawing, struct drawing_item *path, struct vec2 to);
void drawing_arc_to(struct drawing *drawing, struct drawing_item *path, struct vec2 to, double turn);

void drawing_set_title(struct drawing_item *item, const char *title);

/* Text that lives as long as the drawing. NULL after a failure. */
TW_PRINTF(2, 3) const char *drawing_format(struct drawing *drawing, const char *format, ...);

#endif
