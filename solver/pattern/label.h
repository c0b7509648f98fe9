/* Where names go beside the points that they name: off each other, and as far as there is room off what is drawn. A
 * page is filled with points to be named and with boxes to keep off; label_page_settle then finds the places.
 * Coordinates are the page's, y down, and any unit.
 *
 * The point-feature label problem is NP-hard; this is the usual discrete local search over a few places a label
 * (Christensen, Marks, Shieber: An empirical study of algorithms for point-feature label placement, ACM TOG 14(3),
 * 1995), in a fixed order, so that equal input gives equal places. */
#ifndef SOLVER_PATTERN_LABEL_H
#define SOLVER_PATTERN_LABEL_H

#include "solver/arena.h"
#include "solver/curve/vector.h"

struct label_box {
	double left, top, right, bottom;
};

enum label_anchor { LABEL_START, LABEL_MIDDLE, LABEL_END };

struct label {
	struct vec2 at; /* what it names */
	double width, height;
	/* Results: the place of the text, and which end of its base line is `text`, as SVG's text-anchor. */
	struct label_box box;
	struct vec2 text;
	enum label_anchor anchor;
};

/* Something to keep off, at a price for every unit of area that is covered; a label costs LABEL_PRICE. */
struct label_block {
	struct label_box box;
	double price;
};
enum { LABEL_PRICE = 10 };

struct label_page {
	struct label_box bounds;
	double gap; /* between a point and its name */
	struct label *label;
	uint32_t label_count, label_room;
	struct label_block *block;
	uint32_t block_count, block_room;
	struct label_block *near; /* [label_room + block_room] scratch */
};

/* An empty page with room for so many labels and blocks. TW_ERROR_MEMORY. */
enum tw_status label_page_init(struct label_page *page, struct arena *arena, struct label_box bounds, double gap,
			       uint32_t label_room, uint32_t block_room, struct tw_error *error) TW_NODISCARD;

/* A name of letters `size` high; its width is estimated. */
void label_page_add(struct label_page *page, struct vec2 at, const char *name, double size);

/* The square of `width` around a point. What is more than there is room for is left out. */
void label_page_block(struct label_page *page, struct vec2 at, double width, double price);
void label_page_block_box(struct label_page *page, struct label_box box, double price);

/* Fills in the results of all labels. */
void label_page_settle(struct label_page *page);

/* About how wide a UTF-8 text is in a sans-serif type of that size. */
double label_width(const char *text, double size);

/* "start", "middle", "end" */
const char *label_anchor_name(enum label_anchor anchor);

#endif
