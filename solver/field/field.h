/* The weight field of a garment for a set of motions: what every edge costs a wire (method 3).
 *
 *     density(f) = max over motions of the mean density over frames        weight(e) = strip integral of density + eta
 *
 * Weights are unsigned integers, weight = round(cost * scale), so that "optimal" is exact and the same everywhere. The
 * scale is a power of two for which the smallest positive cost of an edge becomes at least 2^20 units: rounding changes
 * a tree's weight by less than 2^-21 (5e-7) of it. The weights of edges together stay below 2^59; a field whose costs
 * span more than that leaves room for (beyond 2^40 to 1 over a million edges) keeps the largest scale that does. */
#ifndef SOLVER_FIELD_FIELD_H
#define SOLVER_FIELD_FIELD_H

#include "solver/field/options.h"
#include "solver/garment/garment.h"
#include "solver/warning.h"

#define FIELD_FORBIDDEN UINT64_MAX /* the weight of an edge that no wire may use */

struct field {
	uint32_t face_count;
	uint32_t edge_count;
	struct field_options options; /* as it was computed */
	double scale;                 /* units of weight per MPa mm2; per mm (FIELD_LENGTH); per edge (FIELD_UNIT) */
	const double *density;        /* [face_count] MPa, without eta */
	const uint64_t *weight;       /* [edge_count]; FIELD_FORBIDDEN */
	const float *coverage;        /* [edge_count] share of the strip that fabric covers, 0…1 */
	/* The flip chord across each edge (strip.h): its weight, FIELD_FORBIDDEN where there is none or no wire may use
	 * it, and its coverage. NULL where chords are not weighed, or not by deformation. */
	const uint64_t *chord_weight; /* [edge_count] */
	const float *chord_coverage;  /* [edge_count] */
};

/* What a request asks beyond the field; NULL for nothing. Arrays that are NULL do not take part. */
struct field_constraints {
	const double *face_multiplier; /* [face_count] finite, >= 0: scales density + eta */
	const uint8_t *face_keep_out;  /* [face_count] 1: no strip may cover any of it */
	const uint8_t *edge_free;      /* [edge_count] 1: carries a wire already and costs nothing */
	double seam_price_mpa_mm2; /* >= 0: added where a wire meets a seam: half at each seam vertex that an edge joins
				    */
};

/* Computes everything from the per-motion means of the energy model that the options name (strain.h):
 * mean[motion][face]. `threads` >= 1 share the work; the result does not depend on it. Arrays lie in the arena.
 * TW_ERROR_INPUT, TW_ERROR_MEMORY. */
enum tw_status field_compute(struct field *field, struct arena *arena, const struct garment *garment,
			     const struct topology *topology, const double *const *mean, size_t motion_count,
			     const struct field_options *options, unsigned threads,
			     struct tw_error *error) TW_NODISCARD;

/* Weighs anew a field whose `density` is given: other options, or a request's constraints. `density` is borrowed. */
enum tw_status field_weigh(struct field *field, struct arena *arena, const struct garment *garment,
			   const struct topology *topology, const double *density, const struct field_options *options,
			   const struct field_constraints *constraints, unsigned threads,
			   struct tw_error *error) TW_NODISCARD;

/* Told now and then, by the calling thread alone, what share of the edges is weighed; a true answer ends the weighing
 * with TW_ERROR_CANCELLED. */
struct field_watch {
	int (*progress)(void *context, double share);
	void *context;
};

/* field_weigh under a watch, which may be NULL. */
enum tw_status field_weigh_watched(struct field *field, struct arena *arena, const struct garment *garment,
				   const struct topology *topology, const double *density,
				   const struct field_options *options, const struct field_constraints *constraints,
				   unsigned threads, const struct field_watch *watch,
				   struct tw_error *error) TW_NODISCARD;

/* Weighs the chords of a field that is weighed, in its scale, under the same constraints. Does nothing where weights
 * are no deformation: baselines stay on the mesh's edges. */
enum tw_status field_weigh_chords(struct field *field, struct arena *arena, const struct garment *garment,
				  const struct topology *topology, const struct field_constraints *constraints,
				  unsigned threads, const struct field_watch *watch,
				  struct tw_error *error) TW_NODISCARD;

/* value[f] = (density[f] + eta) * multiplier[f], what strips integrate (strip.h) to give the field's own costs. */
void field_value(const struct field *field, const struct field_constraints *constraints, double *value);

/* Weight units per MPa mm2; NAN where the weights are no energies (FIELD_LENGTH, FIELD_UNIT). */
double field_energy_scale(const struct field *field);

/* The weight of a cost in the field's fixed point, as its edges are rounded. */
uint64_t field_round(const struct field *field, double cost);

/* Adds the warning "field-without-motions" where no density is positive: costs are eta and length alone. */
void field_warn_of_no_motion(const struct field *field, struct warning_list *warnings);

/* A field as named arrays; see struct tw_array. Borrowed from the field. The options travel beside them, as JSON.
 * Returns how many: those of chords only where it has them. */
enum { FIELD_ARRAYS = 6 };
size_t field_to_arrays(const struct field *field, struct tw_array arrays[FIELD_ARRAYS]);

/* The inverse; a field without arrays of chords is one without chords; borrows the arrays' data. Checks shapes and
 * values against the garment: a damaged store is an error. */
enum tw_status field_from_arrays(struct field *field, const struct garment *garment, const struct topology *topology,
				 const struct tw_array *arrays, size_t count, const struct field_options *options,
				 struct tw_error *error) TW_NODISCARD;

#endif
