/* What all layouts on a field share: the garment and its field in the canonical order, and what of the network depends
 * on neither terminals nor prices. Some ten milliseconds on a suit, which a worker keeps from drag to drag. */
#ifndef SOLVER_LAYOUT_BASE_H
#define SOLVER_LAYOUT_BASE_H

#include "solver/field/field.h"
#include "solver/field/strip.h"
#include "solver/garment/canonical.h"
#include "solver/pattern/locate.h"
#include "solver/pattern/outline.h"

#include <stdbool.h>

struct base_chord {
	struct strip_chord chord;
	uint32_t edge; /* that it crosses */
};

/* All arrays are borrowed from the arena; the caller's garment, topology and field are borrowed too. */
struct layout_base {
	struct canonical canonical;
	struct field field; /* the caller's, in the canonical order */
	const struct locator *locator;
	struct outline outline;
	const double *edge_length_mm; /* [edge_count] on the pattern: the mean of an edge's sides */
	double mean_edge_mm;
	const uint64_t *vertex_hash; /* [vertex_count] of all places of a vertex on the pattern */
	const bool *corner;          /* [vertex_count] more than two pieces meet here */
	struct base_chord *chord;    /* [chord_count] all that there are, by edge; none of a field that is a baseline */
	uint32_t chord_count;
};

/* `base` must stay where it is. TW_ERROR_MEMORY. */
enum tw_status layout_base_build(struct layout_base *base, struct arena *arena, const struct garment *garment,
				 const struct topology *topology, const struct field *field,
				 struct tw_error *error) TW_NODISCARD;

/* The hash of a place on the pattern, which no numbering changes. */
uint64_t layout_hash_point(struct vec2 point);

#endif
