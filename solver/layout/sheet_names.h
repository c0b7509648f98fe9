/* The lettering of the pattern's sheet: numbers of seams, names of pieces with their grain lines, names of terminals.
 * Found all together, because they must keep off each other; written where their layers are. */
#ifndef SOLVER_LAYOUT_SHEET_NAMES_H
#define SOLVER_LAYOUT_SHEET_NAMES_H

#include "solver/layout/sheet.h"
#include "solver/pattern/label.h"

struct seam_mark {
	uint32_t number;
	struct seam_middle middle;
	struct vec2 label; /* the middle of the number, on the page */
};

struct piece_name {
	struct vec2 at; /* on the page: the middle of its base line; the grain line begins below */
	double size;
};

struct sheet_names {
	struct seam_mark *seam;
	uint32_t seam_count;
	struct piece_name *piece;    /* [piece_count] */
	struct label_page terminals; /* a label for every mark of every site; y down, see sheet_flip */
};

/* Finds all places; memory from the sheet's arena. TW_ERROR_MEMORY. */
enum tw_status sheet_names_find(struct sheet_names *names, const struct sheet *sheet) TW_NODISCARD;

/* Add them to the layer that was begun last. */
void sheet_names_add_seams(const struct sheet_names *names, const struct sheet *sheet);
void sheet_names_add_pieces(const struct sheet_names *names, const struct sheet *sheet);
void sheet_names_add_terminals(const struct sheet_names *names, const struct sheet *sheet);

#endif
