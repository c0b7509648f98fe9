/* What a request asks beyond the field: where wires may not go, what costs more, and what is there already. */
#ifndef SOLVER_LAYOUT_CONSTRAINTS_H
#define SOLVER_LAYOUT_CONSTRAINTS_H

#include "tightwire.h"

#include <jansson.h>

/* Faces by number, or those that a polygon on a piece touches. */
struct face_region {
	uint32_t *face; /* owned; [face_count] */
	uint32_t face_count;
	char *piece;     /* owned; NULL for a list of faces */
	double *polygon; /* owned; [point_count][2] mm, in the pattern's coordinates, simple, either orientation */
	uint32_t point_count;
	double factor; /* of a multiplier: 0…1000 */
};

struct layout_constraints {
	struct face_region *keep_out; /* owned: no strip may cover any of it */
	uint32_t keep_out_count;
	struct face_region *multiplier; /* owned: density and eta times `factor`; of several on a face, the product */
	uint32_t multiplier_count;
	uint32_t *free_edge; /* owned; [free_edge_count][2] vertices of edges that carry a wire already */
	uint32_t free_edge_count;
	double seam_price_mpa_mm2; /* a wire pays half of it for every edge with which it meets a seam */
};

/* Of the JSON in request.h; `where` is its JSON Pointer. On failure *constraints is to be cleared as well. */
enum tw_status layout_constraints_parse(struct layout_constraints *constraints, const json_t *object, const char *where,
					struct tw_error *error) TW_NODISCARD;
void layout_constraints_clear(struct layout_constraints *constraints);

#endif
