/* The mean strain densities of a motion: what a motion keeps, so that fields of any set of motions need no frames. */
#ifndef SERVICE_WORKER_MOTION_MEANS_H
#define SERVICE_WORKER_MOTION_MEANS_H

#include "service/worker/work.h"
#include "solver/field/means.h"

/* What the arrays are called, by enum strain_model: "mean_stvk" "mean_printed" "mean_tension". */
extern const char *const motion_mean_names[STRAIN_MODELS];

/* The means of all three models against the reference that the options name, mean[model][face_count], in the work's
 * arena. Progress goes from `share_from` to `share_to`. The frame_count of `info` is what was read; what should be said
 * about the motion is added to `warnings`, which may be NULL. */
enum tw_status motion_means(struct work *work, const struct cached_mesh *mesh, const char *motion_id,
			    const struct field_options *options, double share_from, double share_to,
			    double *mean[STRAIN_MODELS], struct motion_info *info, struct warning_list *warnings,
			    struct tw_error *error) TW_NODISCARD;

/* The mean of the options' energy model alone, for a field of the computation version `field_version`: what the motion
 * keeps; from its frames anew where the reference is not the pattern, or where an older release made what it keeps but
 * the field is of today. [face_count] in the work's arena. TW_ERROR_INPUT "motion-outdated" where that would need
 * frames that were not kept. */
enum tw_status motion_mean(struct work *work, const struct cached_mesh *mesh, const char *motion_id,
			   const struct field_options *options, uint32_t field_version, double share_from,
			   double share_to, double **mean, struct tw_error *error) TW_NODISCARD;

#endif
