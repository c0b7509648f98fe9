/* What a layout is computed on: garment, field, constraints and terminals in the canonical order of the garment
 * (solver/garment/canonical.h), so that no figure depends on how a file numbers its vertices and faces, nor on the
 * order in which a request lists its terminals. Everything between the request and the writers speaks these numbers. */
#ifndef SOLVER_LAYOUT_GROUND_H
#define SOLVER_LAYOUT_GROUND_H

#include "solver/layout/base.h"
#include "solver/layout/input.h"
#include "solver/layout/terminals.h"

struct ground {
	const struct layout_input *asked; /* borrowed: the caller's numbers */
	const struct layout_base *base;   /* the caller's, or `own` */
	struct layout_base own;
	struct field_constraints found;
	const struct field_constraints *constraints; /* `found`, or NULL without any */
	struct layout_input input;                   /* the caller's, but garment, topology and field are these */
};

/* `ground` must stay where it is. TW_ERROR_INPUT names the constraint that is wrong; TW_ERROR_MEMORY. */
enum tw_status ground_build(struct ground *ground, struct arena *arena, const struct layout_input *asked,
			    struct tw_error *error) TW_NODISCARD;

/* Renumbers the sites of the caller's garment, and puts them in an order that their places give. TW_ERROR_MEMORY. */
enum tw_status ground_take_sites(const struct ground *ground, struct arena *arena, struct site_set *sites,
				 struct tw_error *error) TW_NODISCARD;

/* A place in the caller's numbers. */
struct place ground_asked_place(const struct ground *ground, const struct place *place);

#endif
