/* The frames of a motion, streamed, as the mean densities that fields are made of (method 2). */
#ifndef SOLVER_FIELD_MEANS_H
#define SOLVER_FIELD_MEANS_H

#include "solver/field/strain.h"
#include "solver/motion/motion.h"
#include "solver/warning.h"

/* Called after every frame; a true answer ends the reading with TW_ERROR_CANCELLED. May be NULL. */
typedef int means_progress(void *context, uint32_t frames_done);

struct means_report {
	uint32_t frame_count;
	struct warning_list warnings; /* "motion-other-size", and those of solver/motion/cloth.h */
};

/* Reads `reader` from where it stands (its first frame) to its end. Of `options` the reference state counts. Writes
 * means[model][face_count] for every model whose pointer is not NULL. Working memory is taken from `arena` and given
 * back. TW_ERROR_INPUT "motion-empty" when there is no frame, "reference-frame" when the motion has too few,
 * "motion-does-not-fit" and "motion-not-cloth" (solver/motion/fit.h, cloth.h); errors of the reader;
 * TW_ERROR_CANCELLED; TW_ERROR_MEMORY. */
enum tw_status means_of_motion(double *const means[STRAIN_MODELS], struct means_report *report, struct arena *arena,
			       const struct garment *garment, struct motion_reader *reader,
			       const struct field_options *options, means_progress *progress, void *context,
			       struct tw_error *error) TW_NODISCARD;

#endif
