/* Whether what moves is cloth: every edge of every frame against the worn garment.
 *
 * A simulation that exploded or collapsed, a vertex that went astray and vertices in another order show in edges that
 * no fabric has: on the real suits and motions (38 of them, 12 suits) no edge becomes longer than 1.9 times its worn
 * length, on the generated ones 2.2; at most 0.9 % of the edges are shorter than half, and 0.06 % than a fifth of it.
 * The length that counts is the longer one of the worn garment's and the pattern's, where fabric that is folded in the
 * worn pose has its own, and not less than a quarter of the mean, so that slivers do not count. */
#ifndef SOLVER_MOTION_CLOTH_H
#define SOLVER_MOTION_CLOTH_H

#include "solver/arena.h"
#include "solver/garment/garment.h"
#include "solver/warning.h"

/* Lengths over those of the garment, and shares of all edges that are short. Vertices of the file that were sewn
 * together must stay so: they may part by a quarter of the mean edge, and never by more than CLOTH_STRETCH_REFUSED of
 * it. */
#define CLOTH_STRETCH_WARNED 3.0
#define CLOTH_STRETCH_REFUSED 6.0
#define CLOTH_SHORT 0.5
#define CLOTH_SHORT_SHARE_WARNED 0.05
#define CLOTH_COLLAPSED 0.2
#define CLOTH_COLLAPSED_SHARE_REFUSED 0.2

/* An edge in a frame. */
struct cloth_edge {
	uint32_t frame;
	uint32_t vertex[2]; /* of the garment */
	double stretch;     /* its length over that of the garment */
	double length_mm;
};

struct cloth {
	const struct garment *garment; /* borrowed */
	const float *rest;             /* [face_count][3] squares of the lengths that count, mm2 */
	struct warning_list *warnings; /* borrowed */
	const uint32_t (*copy)[2];     /* [copy_count] vertices of the file that were sewn to another, and that other */
	uint32_t copy_count;
	double mean_mm;               /* of the rest's edges */
	struct cloth_edge widest;     /* of all sewn vertices that parted, in numbers of the file */
	uint32_t opened;              /* frames in which some did */
	struct cloth_edge longest;    /* of all frames that were judged */
	uint32_t stretched, crumpled; /* frames warned of */
	double short_share;           /* of the edges, the most of all frames */
};

/* TW_ERROR_MEMORY. */
enum tw_status cloth_init(struct cloth *cloth, struct arena *arena, const struct garment *garment,
			  struct warning_list *warnings, struct tw_error *error) TW_NODISCARD;

/* Judges a frame, position [vertex_count][3] mm: TW_ERROR_INPUT "motion-not-cloth" with frame, vertices (of the file)
 * and stretch where an edge or the share of short ones is beyond what is refused, with the frame as its place; what is
 * warned of is kept for cloth_warn. */
enum tw_status cloth_judge(struct cloth *cloth, uint32_t frame, const float *position,
			   struct tw_error *error) TW_NODISCARD;

/* The same of the vertices of a frame as the file has it, `frame_position` [garment_source_count][3] mm, that were sewn
 * together. */
enum tw_status cloth_judge_copies(struct cloth *cloth, uint32_t frame, const float *frame_position,
				  struct tw_error *error) TW_NODISCARD;

/* Adds the warnings "motion-stretched", "motion-crumpled" and "motion-seam-opens" where frames asked for them. */
void cloth_warn(struct cloth *cloth);

#endif
