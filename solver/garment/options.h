/* How a garment file is to be read: the options of an import, each with its default in garment/options.c. */
#ifndef SOLVER_GARMENT_OPTIONS_H
#define SOLVER_GARMENT_OPTIONS_H

#include "solver/option.h"

enum length_unit {
	UNIT_MM,
	UNIT_CM,
	UNIT_M,
	UNIT_SHEET /* pattern only: 0…1 across a sheet of sheet_width_mm by sheet_height_mm */
};

/* What is done with a whole piece whose faces are all clockwise in the pattern: its wrong side is up. */
enum mirrored_pieces {
	MIRRORED_REFUSE, /* an error that names the piece */
	MIRRORED_TURN    /* the piece is mirrored left to right within its own bounding box, and reported */
};

enum refinement {
	REFINE_NONE,
	REFINE_MIDPOINT, /* 1 to 4, at shared edge midpoints */
	REFINE_CENTROID  /* 1 to 3 */
};

struct import_options {
	int unit;               /* enum length_unit of the worn mesh; not UNIT_SHEET */
	int pattern_unit;       /* enum length_unit of the flat pattern */
	double sheet_width_mm;  /* for UNIT_SHEET */
	double sheet_height_mm; /* for UNIT_SHEET */
	double weld_mm;      /* vertices that lie closer are one (sewn vertices that were exported twice); 0 = none */
	int mirrored_pieces; /* enum mirrored_pieces */
	int refinement;      /* enum refinement */
	uint32_t refine_levels; /* how often, 1…4; counts only with a refinement */
};

extern const struct option_table import_option_table;

#endif
