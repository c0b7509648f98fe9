/* A request's constraints, found on a garment: which faces, which edges. */
#ifndef SOLVER_LAYOUT_REGIONS_H
#define SOLVER_LAYOUT_REGIONS_H

#include "solver/field/field.h"
#include "solver/layout/constraints.h"

#include <stdbool.h>

/* Whether there is anything to heed. */
bool constraints_any(const struct layout_constraints *constraints);

/* Faces and edges of the constraints are the uploaded file's: all parts of them count. Fills *found; its arrays lie in
 * the arena, those of constraints that were not given are NULL. Errors, with a JSON Pointer below /constraints:
 * "face-out-of-range", "unknown-piece", "unknown-edge" (TW_ERROR_INPUT); TW_ERROR_MEMORY.
 */
enum tw_status constraints_find(struct field_constraints *found, struct arena *arena, const struct garment *garment,
				const struct topology *topology, const struct layout_constraints *constraints,
				struct tw_error *error) TW_NODISCARD;

#endif
