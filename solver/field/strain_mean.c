/* The mean strain energy density over the frames of a motion.
 *
 * It wants little arithmetic a byte, so it is a matter of moving bytes. Frames are collected in blocks of
 * STRAIN_BLOCK; a face is then evaluated for all frames of the block at once, one frame a vector lane, so that indices
 * and rest shapes are read once a block and nothing is gathered lane by lane. Faces are cut into clusters, in an order
 * that keeps neighbours together; the vertices of a cluster are first transposed from frame-by-frame to lane-by-lane
 * into a tile that stays in the second-level cache. Data of a cluster: vertex list, corners as 16-bit places in that
 * list, rest shapes, and sums as double.
 *
 * Lanes never mix but in one final sum of fixed shape, so vector width and processor do not show in the result. */
#include "solver/field/strain.h"

#include "solver/field/clones.h"
#include "solver/field/density.h"
#include "solver/field/order.h"

#include <string.h>

enum {
	LANES = STRAIN_BLOCK,
	CLUSTER_FACES = 2048, /* a tile of some 1,200 vertices, 220 KiB */
	FRAME_PADDING = 16,   /* floats behind a frame, so that its last vertex can be read as four */
};

typedef float quad __attribute__((vector_size(16))); /* the one vector that every machine has */
typedef double quad_double __attribute__((vector_size(32)));

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
	/* For the watch, over all faces of the block: the largest t over its limit, and the sum of what t is below -1.
	 */
	_Alignas(64) float excess[LANES], lack[LANES];
};

struct strain_mean {
	const struct strain_rest *rest; /* borrowed */
	size_t frame_stride;            /* floats from a frame to the next */
	float *frame;                   /* [STRAIN_BLOCK][frame_stride] frames not yet evaluated */
	uint32_t pending;               /* frames in it */
	uint32_t frame_count;           /* frames since the last finish, pending ones too */
	uint32_t cluster_count;
	struct cluster *cluster;   /* [cluster_count] */
	uint32_t *order;           /* [face_count] the face at each place */
	uint32_t *vertex;          /* vertices of the clusters, one after the other */
	uint32_t places;           /* face_count, rounded up to whole batches; what is behind it is a point */
	uint16_t (*corner)[3];     /* [places] indices into the cluster's vertex list */
	float (*inverse)[3];       /* [places] */
	float (*limit_share)[3];   /* [places] 1 over the limits of the watch; 0 behind face_count, and without one */
	struct strain_watch watch; /* suspect is NULL without one */
	float excess[LANES], lack[LANES]; /* of the block, see struct batch */
	double *sum[STRAIN_MODELS];       /* [places] over the frames that are evaluated */
	float (*tile)[3][LANES];          /* [vertices of the largest cluster] */
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
	mean->limit_share = arena_zeroed(arena, mean->places, sizeof *mean->limit_share);
	double *sum = ARENA_ZEROED(arena, STRAIN_MODELS * (size_t)mean->places, double);
	mean->tile = arena_array(arena, 3 * (size_t)CLUSTER_FACES, sizeof *mean->tile);
	if (!mean->frame || !mean->cluster || !mean->order || !mean->vertex || !mean->corner || !mean->inverse ||
	    !mean->limit_share || !sum || !mean->tile)
		return tw_fail_memory(error);
	for (size_t model = 0; model < STRAIN_MODELS; model++)
		mean->sum[model] = sum + model * mean->places;
	struct arena_mark mark = arena_mark(arena);
	uint32_t *place = ARENA_ARRAY(arena, vertices, uint32_t);
	enum tw_status status =
		place ? order_faces(mean->order, arena, rest->corner, rest->face_count, rest->vertex_count, error)
		      : tw_fail_memory(error);
	if (status == TW_OK)
		cut_clusters(mean, place);
	arena_release(arena, mark);
	*out = mean;
	return status;
}

void strain_mean_watch(struct strain_mean *mean, const struct strain_watch *watch)
{
	mean->watch = *watch;
	for (uint32_t i = 0; i < mean->rest->face_count; i++)
		for (size_t side = 0; side < 3; side++)
			mean->limit_share[i][side] = 1 / watch->limit[3 * (size_t)mean->order[i] + side];
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
	quad_double total;
	memcpy(&total, sum, sizeof total);
	total += __builtin_convertvector(all, quad_double);
	memcpy(sum, &total, sizeof total);
}

static inline __attribute__((always_inline)) float square_of(const float side[3])
{
	return side[0] * side[0] + side[1] * side[1] + side[2] * side[2];
}

static inline __attribute__((always_inline)) float larger(float a, float b)
{
	return a > b ? a : b;
}

/* All lanes of the face at place `i`. */
static inline __attribute__((always_inline)) void face_invariants(const struct strain_mean *mean, uint32_t i,
								  float *restrict t, float *restrict r2,
								  float *restrict excess, float *restrict lack)
{
	const uint16_t *corner = mean->corner[i];
	float(*restrict p)[LANES] = mean->tile[corner[0]];
	float(*restrict q)[LANES] = mean->tile[corner[1]];
	float(*restrict r)[LANES] = mean->tile[corner[2]];
	float inverse[3] = {mean->inverse[i][0], mean->inverse[i][1], mean->inverse[i][2]};
	float share[3] = {mean->limit_share[i][0], mean->limit_share[i][1], mean->limit_share[i][2]};
	for (int l = 0; l < LANES; l++) {
		float first[3] = {q[0][l] - p[0][l], q[1][l] - p[1][l], q[2][l] - p[2][l]};
		float second[3] = {r[0][l] - p[0][l], r[1][l] - p[1][l], r[2][l] - p[2][l]};
		float third[3] = {second[0] - first[0], second[1] - first[1], second[2] - first[2]};
		struct invariants invariants = side_invariants(first, second, inverse);
		float longest = larger(square_of(first) * share[0], square_of(third) * share[1]);
		longest = larger(longest, square_of(second) * share[2]);
		t[l] = invariants.t;
		r2[l] = invariants.r2;
		excess[l] = larger(longest, excess[l]);
		lack[l] += larger(-1.0F - invariants.t, 0);
	}
}

/* In stages, so that each has short chains of dependent operations and many of them under way. */
static inline __attribute__((always_inline)) void add_batch(struct strain_mean *mean, struct batch *batch, uint32_t i,
							    uint32_t lanes)
{
	for (uint32_t k = 0; k < BATCH; k++)
		face_invariants(mean, i + k, batch->t[k], batch->r2[k], batch->excess, batch->lack);
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
	memset(batch.excess, 0, sizeof batch.excess);
	memset(batch.lack, 0, sizeof batch.lack);
	for (uint32_t c = 0; c < mean->cluster_count; c++) {
		const struct cluster *cluster = &mean->cluster[c];
		fill_tile(mean, cluster);
		for (uint32_t i = cluster->first_face; i < cluster->first_face + cluster->face_count; i += BATCH)
			add_batch(mean, &batch, i, mean->pending);
	}
	memcpy(mean->excess, batch.excess, sizeof mean->excess);
	memcpy(mean->lack, batch.lack, sizeof mean->lack);
}

static void tell_suspects(struct strain_mean *mean)
{
	/* What fills up the last batch is a point, and lacks 1. */
	const float points = (float)(mean->places - mean->rest->face_count);
	const float limit = 0.025F * (float)mean->rest->face_count;
	for (uint32_t l = 0; mean->watch.suspect && l < mean->pending; l++) {
		if (mean->excess[l] > 1 || mean->lack[l] - points > limit)
			mean->watch.suspect(mean->watch.context, mean->frame_count - mean->pending + l,
					    mean->frame + l * mean->frame_stride);
	}
}

static void finish_block(struct strain_mean *mean)
{
	evaluate_block(mean);
	tell_suspects(mean);
	mean->pending = 0;
}

void strain_mean_add(struct strain_mean *mean)
{
	mean->pending++;
	mean->frame_count++;
	if (mean->pending == STRAIN_BLOCK)
		finish_block(mean);
}

uint32_t strain_mean_finish(struct strain_mean *mean, double *const means[STRAIN_MODELS])
{
	uint32_t frames = mean->frame_count;
	if (mean->pending)
		finish_block(mean);
	for (uint32_t i = 0; i < mean->rest->face_count; i++)
		for (int model = 0; model < STRAIN_MODELS; model++)
			if (means[model])
				means[model][mean->order[i]] = frames ? mean->sum[model][i] / frames : 0;
	memset(mean->sum[0], 0, STRAIN_MODELS * (size_t)mean->places * sizeof(double));
	mean->frame_count = 0;
	return frames;
}
