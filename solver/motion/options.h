/* How a motion is read and kept: the options of its import, each with its default in solver/motion/options.c. */
#ifndef SOLVER_MOTION_OPTIONS_H
#define SOLVER_MOTION_OPTIONS_H

#include "solver/garment/options.h"

/* What stays of the frames when the mean strain of every face against the pattern is known, which is all that fields
 * need. Whatever is computed later reads what was kept: the elongation of layouts, and the strain against another
 * reference. The commands without a store keep to the same, so that equal options give equal results. */
enum motion_frames {
	FRAMES_UPLOAD, /* the file as it came: exact */
	FRAMES_PACKED, /* compressed (solver/motion/pack.h), within MOTION_PACK_ERROR_MM */
	FRAMES_NONE /* nothing: no elongation in this motion, and no fields against another reference than the pattern
		     */
};

enum motion_unit {
	MOTION_UNIT_MESH, /* that of the worn mesh */
	MOTION_UNIT_MM,
	MOTION_UNIT_CM,
	MOTION_UNIT_M
};

struct motion_options {
	int frames;      /* enum motion_frames */
	int motion_unit; /* enum motion_unit; packed motions are in mm in any case */
};

/* The unit of the motion of a garment whose worn mesh is in `mesh_unit`. */
enum length_unit motion_unit(const struct motion_options *options, enum length_unit mesh_unit);

extern const struct option_table motion_option_table;

#endif
