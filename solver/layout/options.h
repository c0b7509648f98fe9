/* The options of a layout, as one table: used by the command line, by the request check and by the worker alike. */
#ifndef SOLVER_LAYOUT_OPTIONS_H
#define SOLVER_LAYOUT_OPTIONS_H

#include "solver/option.h"

enum layout_baseline {
	BASELINE_UNIT,   /* fewest edges, the paper's minimum-length baseline */
	BASELINE_LENGTH, /* shortest rest length */
	BASELINE_NONE,
};

enum layout_eta {
	ETA_FIELD, /* the field's own */
	ETA_AUTO,  /* where length and deformation are in balance for these terminals (method 3) */
};

/* The values of a paper's or the field's own, where an option says auto. */
enum layout_preset { LAYOUT_PRESET_FIELD, LAYOUT_PRESET_NONE, LAYOUT_PRESET_PAPER };

/* Where a tree may run. */
enum layout_relaxation {
	RELAXATION_AUTO,   /* chords; of the preset paper none */
	RELAXATION_NONE,   /* on mesh edges */
	RELAXATION_CHORDS, /* on mesh edges and flip chords */
};

/* Which lengths elongation is measured over. */
enum layout_elongation_over {
	ELONGATION_OVER_REFERENCE, /* in the field's reference state */
	ELONGATION_OVER_PATTERN,
	ELONGATION_OVER_WORN,
	ELONGATION_OVER_FRAME, /* the field's `reference_frame` of each motion */
};

struct layout_options {
	int preset;          /* enum layout_preset */
	int relaxation;      /* enum layout_relaxation */
	int eta;             /* enum layout_eta */
	int baseline;        /* enum layout_baseline: what the layout is compared with */
	double time_limit_s; /* of the Steiner search; 0 for none. With a limit the answer depends on the machine */
	double minimum_radius_mm; /* of the curves; NaN for half the strip width */
	double tolerance_mm;      /* how far a curve may stray from the tree's path; NaN chooses from strip and mesh */
	double seam_clearance_mm; /* distance that a curve keeps, where it can, from cut lines that it does not cross;
				     NaN for half the strip width */
	double strip_spacing_mm;  /* kept between strips that do not meet */
	double snap_mm;           /* how far a point in space, or on the pattern, may be from the fabric */
	bool elongation;          /* read the motions: frames for the elongation of the curves, means for energies */
	int elongation_over;      /* enum layout_elongation_over */
};

extern const struct option_table layout_option_table;

#endif
