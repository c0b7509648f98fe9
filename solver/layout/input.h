/* What a layout is computed from, and how it tells how far it is. */
#ifndef SOLVER_LAYOUT_INPUT_H
#define SOLVER_LAYOUT_INPUT_H

#include "solver/garment/garment.h"
#include "solver/layout/request.h"
#include "tightwire.h"

#include <stdbool.h>

struct field;
struct layout_base;
struct layout_trees;
struct motion_reader;
struct steiner_warm;

/* What is known so far of the running computation. */
struct layout_progress {
	const char *stage; /* borrowed, static: "terminals", "eta", "tree", "baseline", "curves", "elongation",
			      "artifacts" */
	double share;      /* 0…1 of the whole, a rough guess */
	uint64_t weight;   /* of the best tree so far, in weight units of the field; UINT64_MAX for none */
	uint64_t lower_bound;
	double energy_scale; /* of these units: field_energy_scale */
};

struct layout_input {
	const struct garment *garment;
	const struct topology *topology;
	const struct field *field;      /* of this garment */
	const struct layout_base *base; /* of this garment and field; NULL: made for this layout */
	const struct layout_request *request;
	const char *const *motion_name; /* [motion_count] for the report; may be NULL when motion_count is 0 */
	uint32_t motion_count;          /* the field's; 0 where nothing is asked of them */
	const bool *motion_has_frames;  /* [motion_count] of which the elongation can be measured; NULL: of all */
	/* Of the same request, garment and field, as a layout_output had them: nothing is searched. NULL: it is. */
	const struct layout_trees *trees;
	const char *file; /* the one file that is wanted, "pattern.svg"; NULL for all */
	unsigned threads; /* 0 and 1: the calling thread only. Never changes the answer */
	/* What an earlier layout on the same garment left for the search; may be NULL. Never changes a proven tree.
	 * After an answer that was slow without need (steiner_warm_is_due) it can be prepared: output.h. */
	struct steiner_warm *warm;
	size_t memory_limit; /* bytes of scratch memory for the Steiner search; 0 for none */
	/* Opens the frames of a motion, positioned at its first frame; layout_compute closes it with motion_close. Only
	 * called for motions that have frames, where the request asks for the elongation; one is open at a time. */
	enum tw_status (*motion_open)(void *context, uint32_t motion, struct motion_reader **reader,
				      struct tw_error *error);
	/* Writes the mean densities of one motion under the field's energy model and reference, [face_count] MPa. May
	 * be NULL: then there are no energies by motion. Called where the request asks for the elongation. */
	enum tw_status (*motion_mean)(void *context, uint32_t motion, double *density, struct tw_error *error);
	void (*progress)(void *context, const struct layout_progress *progress); /* may be NULL */
	bool (*cancelled)(void *context);                                        /* may be NULL */
	void *context;                                                           /* borrowed, handed to all four */
};

static inline bool layout_has_frames(const struct layout_input *input, uint32_t motion)
{
	return !input->motion_has_frames || input->motion_has_frames[motion];
}

#endif
