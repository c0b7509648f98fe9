/* The table of layout options. */
#include "solver/layout/options.h"

#include <math.h>

static const char *const baselines[] = {"unit", "length", "none", NULL};

static const char *const etas[] = {"field", "auto", NULL};

static const char *const overs[] = {"reference", "pattern", "worn", "frame", NULL};

#define AT(field) offsetof(struct layout_options, field)

static const char *const presets[] = {"field", "none", "paper", NULL};

static const char *const relaxations[] = {"auto", "none", "chords", NULL};

static const struct option rows[] = {
	{"preset", OPTION_CHOICE, AT(preset), NULL, LAYOUT_PRESET_FIELD, 0, 0, presets,
	 "what auto stands for: as the field's preset says, our own, or the paper's (relaxation none)"},
	{"relaxation", OPTION_CHOICE, AT(relaxation), NULL, RELAXATION_AUTO, 0, 0, relaxations,
	 "where the tree may run: on mesh edges alone, or also straight over an edge from corner to corner (chords)"},
	{"eta", OPTION_CHOICE, AT(eta), NULL, ETA_FIELD, 0, 0, etas,
	 "price of length: the field's, or the one that balances length and deformation for these terminals"},
	{"baseline", OPTION_CHOICE, AT(baseline), NULL, BASELINE_UNIT, 0, 0, baselines,
	 "layout to compare with: fewest edges (as the paper) and of those the shortest, shortest rest length, or "
	 "none"},
	{"time_limit_s", OPTION_NUMBER, AT(time_limit_s), "s", 0, 0, 86400, NULL,
	 "end the search for the optimum after this time with the best tree and its bound; the searches for the "
	 "baseline and for eta auto may each take as long; 0 for no limit"},
	{"minimum_radius_mm", OPTION_NUMBER_OR_AUTO, AT(minimum_radius_mm), "mm", NAN, 0.1, 1000, NULL,
	 "smallest radius of the wires' curves; auto is half the strip width"},
	{"tolerance_mm", OPTION_NUMBER_OR_AUTO, AT(tolerance_mm), "mm", NAN, 0.01, 1000, NULL,
	 "how far a curve may stray from the tree's path; auto is half the strip width, the whole width for a "
	 "tree of mesh edges alone, or more on a coarse mesh"},
	{"seam_clearance_mm", OPTION_NUMBER_OR_AUTO, AT(seam_clearance_mm), "mm", NAN, 0, 1000, NULL,
	 "distance that curves keep from cut lines that they do not cross, where tolerance and radii leave room for "
	 "it; no rule: a curve that comes nearer is no violation; auto is half the strip width"},
	{"strip_spacing_mm", OPTION_NUMBER, AT(strip_spacing_mm), "mm", 0, 0, 1000, NULL,
	 "distance that strips keep which do not meet; 0: they may touch; where they do not keep it, it is named"},
	{"snap_mm", OPTION_NUMBER, AT(snap_mm), "mm", 20, 0, 1000, NULL,
	 "how far a terminal given as a point may be from the fabric that it is snapped to"},
	{"elongation", OPTION_FLAG, AT(elongation), NULL, 1, 0, 1, NULL,
	 "read the motions and report how far the wires are stretched, and their energy, in each"},
	{"elongation_over", OPTION_CHOICE, AT(elongation_over), NULL, ELONGATION_OVER_REFERENCE, 0, 0, overs,
	 "lengths that elongation is measured over: the field's reference, the pattern, the worn rest pose, or in each "
	 "motion the field's reference_frame"},
};

const struct option_table layout_option_table = {rows, sizeof rows / sizeof *rows};
