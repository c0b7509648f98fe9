#include "solver/motion/options.h"

static const char *const kept[] = {"upload", "packed", "none", NULL};

static const struct option rows[] = {
	{"frames", OPTION_CHOICE, offsetof(struct motion_options, frames), NULL, FRAMES_UPLOAD, 0, 0, kept,
	 "what is kept of the frames: the file as it came, packed to within 0.01 mm, or nothing"},
};

const struct option_table motion_option_table = {rows, sizeof rows / sizeof *rows};
