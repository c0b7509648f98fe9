/* Strain energy density, and its mean over the frames of a motion.
 *
 * The mean wants little arithmetic a byte, so it is a matter of moving bytes. Frames are collected in blocks of
 * STRAIN_BLOCK; a face is then evaluated for all frames of the block at once, one frame a vector lane, so that indices
 * and rest shapes are read once a block and nothing is gathered lane by lane. Faces are cut into clusters, in an order
 * that keeps neighbours together; the vertices of a cluster are first transposed from frame-by-frame to lane-by-lane
 * into a tile that stays in the second-level cache. Data of a cluster: vertex list, corners as 16-bit places in that
 * list, rest shapes, and sums as double.
 *
 * Lanes never mix but in one final sum of fixed shape, so vector width and processor do not show in the result. */
#include "solver/field/strain.h"

#include "solver/field/clones.h"
#include "solver/field/order.h"

#include <math.h>
#include <string.h>

enum {
	LANES = STRAIN_BLOCK,
	CLUSTER_FACES = 2048, /* a tile of some 1,200 vertices, 220 KiB */
	FRAME_PADDING = 16,   /* floats behind a frame, so that its last vertex can be read as four */
};

#define MU (STRAIN_YOUNG_MPA / (2 * (1 + STRAIN_POISSON)))
#define LAMBDA (STRAIN_YOUNG_MPA * STRAIN_POISSON / ((1 + STRAIN_POISSON) * (1 - 2 * STRAIN_POISSON)))

typedef float quad __attribute__((vector_size(16))); /* the one vector that every machine has */

/* What all three densities of a face are made of. With C = F^T F: t = tr(C - I), r2 = the squared difference of the
 * eigenvalues of C. */
struct invariants {
	float t, r2;
};

/* From the two sides of a face in a frame, and its rest shape. */
static inline __attribute__((always_inline)) struct invariants
side_invariants(const float first[3], const float second[3], const float inverse[3])
{
	float f1x = first[0] * inverse[0], f2x = first[0] * inverse[1] + second[0] * inverse[2];
	float f1y = first[1] * inverse[0], f2y = first[1] * inverse[1] + second[1] * inverse[2];
	float f1z = first[2] * inverse[0], f2z = first[2] * inverse[1] + second[2] * inverse[2];
	float c11 = f1x * f1x + f1y * f1y + f1z * f1z - 1;
	float c22 = f2x * f2x + f2y * f2y + f2z * f2z - 1;
	float c12 = f1x * f2x + f1y * f2y + f1z * f2z;
	float d = c11 - c22, s = c12 + c12;
	return (struct invariants){c11 + c22, d * d + s * s};
}

struct energies {
	float model[STRAIN_MODELS];
};

/* The principal strains are (t + r) / 4 and (t - r) / 4, so that |G|_F^2 = (t^2 + r^2) / 8 and |G|_2 = (|t| + r) / 4.
 * The tensile part is all of G, one principal strain, or nothing. */
static inline __attribute__((always_inline)) struct energies densities(float t, float r2)
{
	const float stvk_t = (float)(MU / 8 + LAMBDA / 8), stvk_r = (float)(MU / 8);
	const float printed_s = (float)(MU / 4), printed_t = (float)(LAMBDA / 4);
	const float tension_h = (float)(MU / 16 + LAMBDA / 32);
	float r = sqrtf(r2);
	float high = t + r > 0 ? t + r : 0;
	float stvk = stvk_t * (t * t) + stvk_r * r2;
	float printed = printed_s * (fabsf(t) + r) + printed_t * t;
	return (struct energies){{
		[STRAIN_STVK] = stvk,
		[STRAIN_PRINTED] = printed > 0 ? printed : 0,
		[STRAIN_TENSION] = t - r > 0 ? stvk : tension_h * (high * high),
	}};
}

/* --- rest shapes ----------------------------------------------------------------------------------------------------
 */

struct sides {
	double first[3], second[3];
};

/* The triangle laid into the plane with its first side on the first axis: Dm = (l m; 0 h). */
static enum tw_status invert_sides(const struct sides *sides, uint32_t face, float inverse[3], struct tw_error *error)
{
	const double *s = sides->first, *t = sides->second;
	double l = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
	double m = (s[0] * t[0] + s[1] * t[1] + s[2] * t[2]) / l;
	double c[3] = {s[1] * t[2] - s[2] * t[1], s[2] * t[0] - s[0] * t[2], s[0] * t[1] - s[1] * t[0]};
	double h = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]) / l;
	inverse[0] = (float)(1 / l);
	inverse[1] = (float)(-m / (l * h));
	inverse[2] = (float)(1 / h);
	if (isfinite(inverse[0]) && isfinite(inverse[1]) && isfinite(inverse[2]))
		return TW_OK;
	char where[32];
	snprintf(where, sizeof where, "face %u", face);
	return tw_fail(error, TW_ERROR_INPUT, "reference-degenerate-face", where,
		       "the face has no area in the reference state; choose another reference");
}

static enum tw_status rest_init(struct strain_rest *rest, struct arena *arena, const struct garment *garment,
				struct tw_error *error)
{
	*rest = (struct strain_rest){
		.face_count = garment->face_count,
		.vertex_count = garment->vertex_count,
		.corner = garment->face_vertex,
		.inverse = ARENA_ARRAY(arena, 3 * (size_t)garment->face_count, float),
	};
	return rest->inverse ? TW_OK : tw_fail_memory(error);
}

enum tw_status strain_rest_from_pattern(struct strain_rest *rest, struct arena *arena, const struct garment *garment,
					struct tw_error *error)
{
	enum tw_status status = rest_init(rest, arena, garment, error);
	for (uint32_t f = 0; !status && f < rest->face_count; f++) {
		const uint32_t *c = garment->face_coord + 3 * (size_t)f;
		const double *u = garment->pattern;
		struct sides sides = {{0}, {0}};
		for (size_t d = 0; d < 2; d++) {
			sides.first[d] = u[2 * (size_t)c[1] + d] - u[2 * (size_t)c[0] + d];
			sides.second[d] = u[2 * (size_t)c[2] + d] - u[2 * (size_t)c[0] + d];
		}
		status = invert_sides(&sides, f, rest->inverse + 3 * (size_t)f, error);
	}
	return status;
}

enum tw_status strain_rest_from_worn(struct strain_rest *rest, struct arena *arena, const struct garment *garment,
				     struct tw_error *error)
{
	enum tw_status status = rest_init(rest, arena, garment, error);
	for (uint32_t f = 0; !status && f < rest->face_count; f++) {
		const uint32_t *c = garment->face_vertex + 3 * (size_t)f;
		const double *x = garment->position;
		struct sides sides;
		for (size_t d = 0; d < 3; d++) {
			sides.first[d] = x[3 * (size_t)c[1] + d] - x[3 * (size_t)c[0] + d];
			sides.second[d] = x[3 * (size_t)c[2] + d] - x[3 * (size_t)c[0] + d];
		}
		status = invert_sides(&sides, f, rest->inverse + 3 * (size_t)f, error);
	}
	return status;
}

enum tw_status strain_rest_from_frame(struct strain_rest *rest, struct arena *arena, const struct garment *garment,
				      const float *position, struct tw_error *error)
{
	enum tw_status status = rest_init(rest, arena, garment, error);
	for (uint32_t f = 0; !status && f < rest->face_count; f++) {
		const uint32_t *c = garment->face_vertex + 3 * (size_t)f;
		struct sides sides;
		for (size_t d = 0; d < 3; d++) {
			double origin = position[3 * (size_t)c[0] + d];
			sides.first[d] = position[3 * (size_t)c[1] + d] - origin;
			sides.second[d] = position[3 * (size_t)c[2] + d] - origin;
		}
		status = invert_sides(&sides, f, rest->inverse + 3 * (size_t)f, error);
	}
	return status;
}

/* --- one frame ------------------------------------------------------------------------------------------------------
 */

/* Faces, one a lane. */
struct lane_faces {
	_Alignas(64) float first[3][LANES], second[3][LANES], inverse[3][LANES];
};

static inline __attribute__((always_inline)) void fill_lane(struct lane_faces *faces, const struct strain_rest *rest,
							    const float *position, uint32_t face, uint32_t lane)
{
	const uint32_t *corner = rest->corner + 3 * (size_t)face;
	const float *p = position + 3 * (size_t)corner[0];
	const float *q = position + 3 * (size_t)corner[1];
	const float *r = position + 3 * (size_t)corner[2];
	for (size_t d = 0; d < 3; d++) {
		faces->first[d][lane] = q[d] - p[d];
		faces->second[d][lane] = r[d] - p[d];
		faces->inverse[d][lane] = rest->inverse[3 * (size_t)face + d];
	}
}

CLONES void strain_density(const struct strain_rest *rest, enum strain_model model, const float *position,
			   double *density)
{
	struct lane_faces faces = {0};
	for (uint32_t face = 0; face < rest->face_count; face += LANES) {
		uint32_t lanes = rest->face_count - face < LANES ? rest->face_count - face : LANES;
		for (uint32_t l = 0; l < lanes; l++)
			fill_lane(&faces, rest, position, face + l, l);
		float energy[STRAIN_MODELS][LANES];
		for (int l = 0; l < LANES; l++) {
			float first[3] = {faces.first[0][l], faces.first[1][l], faces.first[2][l]};
			float second[3] = {faces.second[0][l], faces.second[1][l], faces.second[2][l]};
			float inverse[3] = {faces.inverse[0][l], faces.inverse[1][l], faces.inverse[2][l]};
			struct invariants i = side_invariants(first, second, inverse);
			struct energies e = densities(i.t, i.r2);
			for (int m = 0; m < STRAIN_MODELS; m++)
				energy[m][l] = e.model[m];
		}
		for (uint32_t l = 0; l < lanes; l++)
			density[face + l] = (double)energy[model][l];
	}
}

/* --- mean over frames -----------------------------------------------------------------------------------------------
 */

/* Faces order[first_face…] of the mean, and the vertices that they have, in the order in which they are met. */
struct cluster {
	uint32_t first_face, face_count;
	uint32_t first_vertex, vertex_count;
};

/* A few faces, lane by lane, on their way from invariants to energies to sums. */
enum { BATCH = 8 };
struct batch {
	_Alignas(64) float t[BATCH][LANES], r2[BATCH][LANES];
	_Alignas(64) float energy[STRAIN_MODELS][BATCH][LANES];
};

struct strain_mean {
	const struct strain_rest *rest; /* borrowed */
	size_t frame_stride;            /* floats from a frame to the next */
	float *frame;                   /* [STRAIN_BLOCK][frame_stride] frames not yet evaluated */
	uint32_t pending;               /* frames in it */
	uint32_t frame_count;           /* frames since the last finish, pending ones too */
	uint32_t cluster_count;
	struct cluster *cluster;    /* [cluster_count] */
	uint32_t *order;            /* [face_count] the face at each place */
	uint32_t *vertex;           /* vertices of the clusters, one after the other */
	uint32_t places;            /* face_count, rounded up to whole batches; what is behind it is a point */
	uint16_t (*corner)[3];      /* [places] indices into the cluster's vertex list */
	float (*inverse)[3];        /* [places] */
	double *sum[STRAIN_MODELS]; /* [places] over the frames that are evaluated */
	float (*tile)[3][LANES];    /* [vertices of the largest cluster] */
};

/* Cuts the ordered faces into clusters and lists each cluster's vertices. `place` is scratch, [vertex_count]. */
static void cut_clusters(struct strain_mean *mean, uint32_t *place)
{
	const struct strain_rest *rest = mean->rest;
	memset(place, 0xff, rest->vertex_count * sizeof *place);
	uint32_t vertices = 0;
	mean->cluster_count = 0;
	for (uint32_t first = 0; first < rest->face_count; first += CLUSTER_FACES) {
		uint32_t end = rest->face_count - first < CLUSTER_FACES ? rest->face_count : first + CLUSTER_FACES;
		struct cluster *cluster = &mean->cluster[mean->cluster_count++];
		*cluster = (struct cluster){first, end - first, vertices, 0};
		for (uint32_t i = first; i < end; i++) {
			for (int k = 0; k < 3; k++) {
				uint32_t v = rest->corner[3 * (size_t)mean->order[i] + (size_t)k];
				/* A place of an earlier cluster lies before this cluster's first. */
				if (place[v] == UINT32_MAX || place[v] < cluster->first_vertex) {
					place[v] = vertices;
					mean->vertex[vertices++] = v;
				}
				mean->corner[i][k] = (uint16_t)(place[v] - cluster->first_vertex);
			}
			memcpy(mean->inverse[i], rest->inverse + 3 * (size_t)mean->order[i], sizeof *mean->inverse);
		}
		cluster->vertex_count = vertices - cluster->first_vertex;
	}
}

enum tw_status strain_mean_new(struct strain_mean **out, struct arena *arena, const struct strain_rest *rest,
			       struct tw_error *error)
{
	struct strain_mean *mean = ARENA_ZEROED(arena, 1, struct strain_mean);
	if (!mean)
		return tw_fail_memory(error);
	size_t faces = rest->face_count, vertices = rest->vertex_count;
	mean->rest = rest;
	mean->frame_stride = (3 * vertices + 2 * FRAME_PADDING - 1) / FRAME_PADDING * FRAME_PADDING;
	mean->frame = arena_zeroed(arena, mean->frame_stride, STRAIN_BLOCK * sizeof(float));
	mean->cluster = ARENA_ARRAY(arena, faces / CLUSTER_FACES + 1, struct cluster);
	mean->order = ARENA_ARRAY(arena, faces, uint32_t);
	mean->vertex = ARENA_ARRAY(arena, 3 * faces, uint32_t);
	mean->places = (rest->face_count + BATCH - 1) / BATCH * BATCH;
	mean->corner = arena_zeroed(arena, mean->places, sizeof *mean->corner);
	mean->inverse = arena_zeroed(arena, mean->places, sizeof *mean->inverse);
	double *sum = ARENA_ZEROED(arena, STRAIN_MODELS * (size_t)mean->places, double);
	mean->tile = arena_array(arena, 3 * (size_t)CLUSTER_FACES, sizeof *mean->tile);
	if (!mean->frame || !mean->cluster || !mean->order || !mean->vertex || !mean->corner || !mean->inverse ||
	    !sum || !mean->tile)
		return tw_fail_memory(error);
	for (size_t model = 0; model < STRAIN_MODELS; model++)
		mean->sum[model] = sum + model * mean->places;
	struct arena_mark mark = arena_mark(arena);
	uint32_t *place = ARENA_ARRAY(arena, vertices, uint32_t);
	enum tw_status status =
		place ? order_faces(mean->order, arena, rest->corner, rest->face_count, rest->vertex_count, error)
		      : tw_fail_memory(error);
	if (!status)
		cut_clusters(mean, place);
	arena_release(arena, mark);
	*out = mean;
	return status;
}

float *strain_mean_slot(struct strain_mean *mean)
{
	return mean->frame + mean->pending * mean->frame_stride;
}

/* Four frames of a vertex, read as x y z and a float too many, become four lanes each of x, y and z. */
static inline __attribute__((always_inline)) void transpose_four(const float *from, size_t stride,
								 float (*restrict to)[LANES])
{
	quad a, b, c, d;
	memcpy(&a, from, sizeof a);
	memcpy(&b, from + stride, sizeof b);
	memcpy(&c, from + 2 * stride, sizeof c);
	memcpy(&d, from + 3 * stride, sizeof d);
	quad xy_low = __builtin_shufflevector(a, b, 0, 4, 1, 5), z_low = __builtin_shufflevector(a, b, 2, 6, 3, 7);
	quad xy_high = __builtin_shufflevector(c, d, 0, 4, 1, 5), z_high = __builtin_shufflevector(c, d, 2, 6, 3, 7);
	quad x = __builtin_shufflevector(xy_low, xy_high, 0, 1, 4, 5);
	quad y = __builtin_shufflevector(xy_low, xy_high, 2, 3, 6, 7);
	quad z = __builtin_shufflevector(z_low, z_high, 0, 1, 4, 5);
	memcpy(to[0], &x, sizeof x);
	memcpy(to[1], &y, sizeof y);
	memcpy(to[2], &z, sizeof z);
}

/* The cluster's vertices, from frames to lanes. */
static inline __attribute__((always_inline)) void fill_tile(const struct strain_mean *mean,
							    const struct cluster *cluster)
{
	const uint32_t *vertex = mean->vertex + cluster->first_vertex;
	size_t stride = mean->frame_stride;
	for (uint32_t i = 0; i < cluster->vertex_count; i++) {
		const float *from = mean->frame + 3 * (size_t)vertex[i];
		float *to = mean->tile[i][0];
		for (size_t l = 0; l < LANES; l += 4)
			transpose_four(from + l * stride, stride, (float(*)[LANES])(to + l));
	}
}

/* Lanes l, l + 4, l + 8 and l + 12 of a face's energy, pairwise. */
static inline __attribute__((always_inline)) quad fold_lanes(const float *lane)
{
	quad a, b, c, d;
	memcpy(&a, lane, sizeof a);
	memcpy(&b, lane + 4, sizeof b);
	memcpy(&c, lane + 8, sizeof c);
	memcpy(&d, lane + 12, sizeof d);
	return (a + c) + (b + d);
}

/* The sums over lanes of four faces: (0 + 2) + (1 + 3) of each fold. */
static inline __attribute__((always_inline)) void add_four_faces(double *sum, float energy[4][LANES])
{
	quad a = fold_lanes(energy[0]), b = fold_lanes(energy[1]);
	quad c = fold_lanes(energy[2]), d = fold_lanes(energy[3]);
	quad ab = __builtin_shufflevector(a, b, 0, 4, 1, 5) + __builtin_shufflevector(a, b, 2, 6, 3, 7);
	quad cd = __builtin_shufflevector(c, d, 0, 4, 1, 5) + __builtin_shufflevector(c, d, 2, 6, 3, 7);
	quad all = __builtin_shufflevector(ab, cd, 0, 1, 4, 5) + __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
	for (int i = 0; i < 4; i++)
		sum[i] += (double)all[i];
}

/* All lanes of the face at place `i`. */
static inline __attribute__((always_inline)) void face_invariants(const struct strain_mean *mean, uint32_t i,
								  float *restrict t, float *restrict r2)
{
	const uint16_t *corner = mean->corner[i];
	float(*restrict p)[LANES] = mean->tile[corner[0]];
	float(*restrict q)[LANES] = mean->tile[corner[1]];
	float(*restrict r)[LANES] = mean->tile[corner[2]];
	float inverse[3] = {mean->inverse[i][0], mean->inverse[i][1], mean->inverse[i][2]};
	for (int l = 0; l < LANES; l++) {
		float first[3] = {q[0][l] - p[0][l], q[1][l] - p[1][l], q[2][l] - p[2][l]};
		float second[3] = {r[0][l] - p[0][l], r[1][l] - p[1][l], r[2][l] - p[2][l]};
		struct invariants invariants = side_invariants(first, second, inverse);
		t[l] = invariants.t;
		r2[l] = invariants.r2;
	}
}

/* In stages, so that each has short chains of dependent operations and many of them under way. */
static inline __attribute__((always_inline)) void add_batch(struct strain_mean *mean, struct batch *batch, uint32_t i,
							    uint32_t lanes)
{
	for (uint32_t k = 0; k < BATCH; k++)
		face_invariants(mean, i + k, batch->t[k], batch->r2[k]);
	for (uint32_t k = 0; k < BATCH; k++)
		for (uint32_t l = 0; l < LANES; l++) {
			struct energies e = densities(batch->t[k][l], batch->r2[k][l]);
			for (int model = 0; model < STRAIN_MODELS; model++)
				batch->energy[model][k][l] = e.model[model];
		}
	for (int model = 0; model < STRAIN_MODELS; model++) {
		for (uint32_t k = 0; lanes < LANES && k < BATCH; k++)
			memset(batch->energy[model][k] + lanes, 0, (LANES - lanes) * sizeof(float));
		for (uint32_t k = 0; k < BATCH; k += 4)
			add_four_faces(mean->sum[model] + i + k, &batch->energy[model][k]);
	}
}

/* Evaluates the pending frames; lanes behind them hold old frames, whose energies are dropped. */
CLONES static void evaluate_block(struct strain_mean *mean)
{
	struct batch batch;
	for (uint32_t c = 0; c < mean->cluster_count; c++) {
		const struct cluster *cluster = &mean->cluster[c];
		fill_tile(mean, cluster);
		for (uint32_t i = cluster->first_face; i < cluster->first_face + cluster->face_count; i += BATCH)
			add_batch(mean, &batch, i, mean->pending);
	}
	mean->pending = 0;
}

void strain_mean_add(struct strain_mean *mean)
{
	mean->pending++;
	mean->frame_count++;
	if (mean->pending == STRAIN_BLOCK)
		evaluate_block(mean);
}

uint32_t strain_mean_finish(struct strain_mean *mean, double *const means[STRAIN_MODELS])
{
	uint32_t frames = mean->frame_count;
	if (mean->pending)
		evaluate_block(mean);
	for (uint32_t i = 0; i < mean->rest->face_count; i++)
		for (int model = 0; model < STRAIN_MODELS; model++)
			if (means[model])
				means[model][mean->order[i]] = frames ? mean->sum[model][i] / frames : 0;
	memset(mean->sum[0], 0, STRAIN_MODELS * (size_t)mean->places * sizeof(double));
	mean->frame_count = 0;
	return frames;
}

void strain_worst(const double *const *mean, size_t motion_count, uint32_t face_count, double *density)
{
	memset(density, 0, face_count * sizeof *density);
	for (size_t m = 0; m < motion_count; m++)
		for (uint32_t f = 0; f < face_count; f++)
			density[f] = mean[m][f] > density[f] ? mean[m][f] : density[f];
}
