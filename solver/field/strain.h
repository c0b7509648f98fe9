/* Strain energy density of fabric in motion (method 2).
 *
 *     F = Ds Dm^-1 (3x2)    G = (F^T F - I) / 2    mu = E / (2 (1 + nu))    lambda = E nu / ((1 + nu) (1 - 2 nu))
 *
 * Densities are MPa (N/mm2). They depend on F^T F alone, hence not on rigid motions of frame or pattern. Positions come
 * as the float triples that point caches hold; the arithmetic is single precision per face and frame (2^-24, a
 * thousandth of what rounding the positions to float costs) and sums over frames are double. Every operation is a plain
 * IEEE one in a fixed order: the same input gives the same bits on every machine, whatever its vector width. */
#ifndef SOLVER_FIELD_STRAIN_H
#define SOLVER_FIELD_STRAIN_H

#include "solver/field/options.h"
#include "solver/garment/garment.h"

/* The undeformed shape of every face, which a frame is compared with. */
struct strain_rest {
	uint32_t face_count;
	uint32_t vertex_count;
	uint32_t *corner; /* [face_count][3] vertices, from face_first_corner's on */
	float *inverse;   /* [face_count][3] Dm^-1 with the first side as first axis: (1,1), (1,2), (2,2); 1/mm */
};

/* From the flat pattern (the default), from the worn rest pose, or from a frame: `position` is [vertex_count][3] mm.
 * TW_ERROR_INPUT names a face without area; TW_ERROR_MEMORY. Nothing of the garment is kept. */
enum tw_status strain_rest_from_pattern(struct strain_rest *rest, struct arena *arena, const struct garment *garment,
					struct tw_error *error) TW_NODISCARD;
enum tw_status strain_rest_from_worn(struct strain_rest *rest, struct arena *arena, const struct garment *garment,
				     struct tw_error *error) TW_NODISCARD;
enum tw_status strain_rest_from_frame(struct strain_rest *rest, struct arena *arena, const struct garment *garment,
				      const float *position, struct tw_error *error) TW_NODISCARD;

/* Density of every face in one frame: `position` [vertex_count][3] mm, `density` [face_count]. */
void strain_density(const struct strain_rest *rest, enum strain_model model, const float *position, double *density);

/* The mean of all three models over the frames of a motion, streamed. Frames are taken in blocks of STRAIN_BLOCK, which
 * is all that is kept of them: STRAIN_BLOCK * 12 bytes per vertex.
 *
 *     while (frames are left) {
 *             read a frame into strain_mean_slot(mean);
 *             strain_mean_add(mean);
 *     }
 *     strain_mean_finish(mean, means);
 *
 * The result depends on the frames and their order alone. */
enum { STRAIN_BLOCK = 16 };
struct strain_mean;

/* Borrows `rest`. TW_ERROR_MEMORY. */
enum tw_status strain_mean_new(struct strain_mean **mean, struct arena *arena, const struct strain_rest *rest,
			       struct tw_error *error) TW_NODISCARD;

/* Told of every frame in which a side of a face is longer than its limit, or in which much of the cloth has no area:
 * what the faces' t = tr(F^T F) - 2 is below -1 (without area it is -2) adds up to a fortieth of their number. Called
 * within strain_mean_add and strain_mean_finish. */
struct strain_watch {
	const float *limit; /* [face_count][3] of the square of each side, mm2, > 0 */
	void (*suspect)(void *context, uint32_t frame, const float *position);
	void *context;
};
void strain_mean_watch(struct strain_mean *mean, const struct strain_watch *watch);

/* Where the next frame belongs: [vertex_count][3] mm, finite. Valid until strain_mean_add. */
float *strain_mean_slot(struct strain_mean *mean);
void strain_mean_add(struct strain_mean *mean);

/* Writes the means, means[model][face_count], of the frames since the last finish (zeros if there were none) and starts
 * anew. A model whose pointer is NULL is left out. Returns the number of frames. */
uint32_t strain_mean_finish(struct strain_mean *mean, double *const means[STRAIN_MODELS]);

/* density[f] = max(density[f], mean[f]): one motion more. */
void strain_raise(double *density, const double *mean, uint32_t face_count);

/* density[f] = max over motions of mean[m][f]; the means of one model. No motion gives zeros. */
void strain_worst(const double *const *mean, size_t motion_count, uint32_t face_count, double *density);

#endif
