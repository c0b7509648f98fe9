/* The figures of a layout (method 7): energy, elongation, lengths. */
#ifndef SOLVER_LAYOUT_METRICS_H
#define SOLVER_LAYOUT_METRICS_H

#include "solver/field/field.h"
#include "solver/field/strip.h"
#include "solver/layout/input.h"
#include "solver/layout/wires.h"

#include <stdbool.h>

/* Over the frames of one motion; over all motions the largest, and the mean of the motions' means. 0.12 is 12 %. NAN
 * where a motion has no frames. */
struct elongation {
	double max;
	double mean;
};

/* What the curves would cost if one motion were all. */
struct motion_energy {
	double energy;      /* with eta, MPa·mm² */
	double without_eta; /* MPa·mm² */
};

struct branch_metrics {
	double length_mm;
	double energy;                      /* deformation energy with eta, MPa·mm² */
	double energy_without_eta;          /* MPa·mm² */
	double coverage;                    /* share of its strip that lies on fabric */
	double minimum_radius_mm;           /* INFINITY when it is straight */
	struct elongation elongation;       /* over all frames of all motions */
	const struct elongation *by_motion; /* [motion_count]; NULL where not computed */
};

struct layout_metrics {
	struct branch_metrics *branch; /* [branch_count] */
	struct branch_metrics total;   /* elongation: of the whole wire, the lengths of all branches together */
	const struct motion_energy *energy_by_motion; /* [motion_count]; NULL where not computed */
	uint32_t junction_count;
	uint32_t seam_crossings;
};

/* A curve as it lies on the mesh: points at every edge that it meets, so that between two of them fabric is one face.
 */
struct trace {
	struct place *place;
	bool *lands;     /* of each place: it is the one before it, seen from behind the seam that is crossed there */
	uint32_t *first; /* [branch_count + 1] */
	double *rest_mm; /* [branch_count] length of the polyline of places on the pattern */
};

struct metrics_input {
	const struct garment *garment;
	const struct locator *locator;
	const struct field *field;
	const struct branch_set *branches;
	const struct wire_set *wires;
	const struct strip_fabric *fabric; /* with the values density + eta */
	struct strip_walker *walker;       /* on this fabric */
};

/* Everything but the elongation, and the trace from which that is measured. TW_ERROR_MEMORY. */
enum tw_status metrics_measure(struct layout_metrics *metrics, struct trace *trace, struct arena *arena,
			       const struct metrics_input *input, struct tw_error *error) TW_NODISCARD;

/* The energies in each motion alone, by the densities that the input gives: motion_mean's face face[f] is this
 * garment's f. Errors of motion_mean; TW_ERROR_CANCELLED; TW_ERROR_MEMORY. */
enum tw_status metrics_energies(struct layout_metrics *const *metrics, const struct metrics_input *const *inputs,
				uint32_t layout_count, const struct layout_input *input, const uint32_t *face,
				struct arena *arena, struct tw_error *error) TW_NODISCARD;

/* What elongation is measured over, as the request and the field say. */
enum field_reference metrics_elongation_over(const struct layout_input *input);

/* Streams the motions once and measures the elongation of several layouts, whose metrics are filled in. Errors of the
 * reader; TW_ERROR_INPUT "reference-frame" where a motion is too short for it; TW_ERROR_CANCELLED; TW_ERROR_MEMORY. */
enum tw_status metrics_elongation(struct layout_metrics *const *metrics, const struct trace *const *trace,
				  const struct branch_set *const *branches, uint32_t layout_count,
				  const struct layout_input *input, struct arena *arena,
				  struct tw_error *error) TW_NODISCARD;

#endif
