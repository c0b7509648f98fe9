/* How a motion is kept: the options of its import, each with its default in solver/motion/options.c. */
#ifndef SOLVER_MOTION_OPTIONS_H
#define SOLVER_MOTION_OPTIONS_H

#include "solver/option.h"

/* What stays of the frames when the mean strain of every face is known, which is all that fields against the pattern
 * need. Layouts read the frames to report elongation. */
enum motion_frames {
	FRAMES_UPLOAD, /* the file as it came: exact */
	FRAMES_PACKED, /* compressed (solver/motion/pack.h), within MOTION_PACK_ERROR_MM */
	FRAMES_NONE /* nothing: no elongation in this motion, and no fields against another reference than the pattern
		     */
};

struct motion_options {
	int frames; /* enum motion_frames */
};

extern const struct option_table motion_option_table;

#endif
