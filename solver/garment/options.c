#include "solver/garment/options.h"

#define ROW(field) .name = #field, .offset = offsetof(struct import_options, field)

static const char *const units[] = {"mm", "cm", "m", NULL};
static const char *const pattern_units[] = {"mm", "cm", "m", "sheet", NULL};
static const char *const mirrored[] = {"refuse", "turn", NULL};
static const char *const refinements[] = {"none", "midpoint", "centroid", NULL};

static const struct option rows[] = {
	{ROW(unit), .kind = OPTION_CHOICE, .choices = units,
	 .help = "length unit of the worn mesh, and of its motions where they say nothing else"},
	{ROW(pattern_unit), .kind = OPTION_CHOICE, .choices = pattern_units,
	 .help = "length unit of the flat pattern; sheet: 0 to 1 across a sheet of the given size"},
	{ROW(sheet_width_mm), .kind = OPTION_NUMBER, .unit = "mm", .fallback = 1000, .minimum = 1, .maximum = 1e6,
	 .help = "width of the sheet, for pattern_unit sheet"},
	{ROW(sheet_height_mm), .kind = OPTION_NUMBER, .unit = "mm", .fallback = 1000, .minimum = 1, .maximum = 1e6,
	 .help = "height of the sheet, for pattern_unit sheet"},
	{ROW(weld_mm), .kind = OPTION_NUMBER, .unit = "mm", .fallback = 0, .minimum = 0, .maximum = 10,
	 .help = "sew hem vertices that lie this close together into one; 0 sews none"},
	{ROW(mirrored_pieces), .kind = OPTION_CHOICE, .choices = mirrored,
	 .help = "a piece that lies wrong side up in the pattern: refuse the file, or turn the piece over"},
	{ROW(refinement), .kind = OPTION_CHOICE, .choices = refinements,
	 .help = "refine the mesh: midpoint cuts a face into 4, centroid into 3"},
	{ROW(refine_levels), .kind = OPTION_INTEGER, .fallback = 1, .minimum = 1, .maximum = 4,
	 .help = "how many times to refine"},
};

const struct option_table import_option_table = {rows, sizeof rows / sizeof *rows};
