#include "solver/motion/options.h"

static const char *const kept[] = {"upload", "packed", "none", NULL};
static const char *const units[] = {"mesh", "mm", "cm", "m", NULL};

static const struct option rows[] = {
	{"frames", OPTION_CHOICE, offsetof(struct motion_options, frames), NULL, FRAMES_PACKED, 0, 0, kept,
	 "what is kept of the frames: the file as it came, packed to within 0.01 mm, or nothing"},
	{"motion_unit", OPTION_CHOICE, offsetof(struct motion_options, motion_unit), NULL, MOTION_UNIT_MESH, 0, 0,
	 units, "length unit of the motion; mesh: that of the worn mesh"},
};

enum length_unit motion_unit(const struct motion_options *options, enum length_unit mesh_unit)
{
	switch (options->motion_unit) {
	case MOTION_UNIT_MM:
		return UNIT_MM;
	case MOTION_UNIT_CM:
		return UNIT_CM;
	case MOTION_UNIT_M:
		return UNIT_M;
	default:
		return mesh_unit;
	}
}

const struct option_table motion_option_table = {rows, sizeof rows / sizeof *rows};
