/* A garment in an order that follows from its shape alone: whatever order a file has for its vertices, faces and
 * corners, the same garment comes out, array for array. What is computed on it depends on no numbering, not even where
 * rounding, ties or the order of a search decide; results are led back by the maps.
 *
 * Faces are numbered breadth first across their sides, corners from face_first_corner's on; vertices, pattern positions
 * and edges as the faces meet them. A part that sides hold together begins at its lowest face on the pattern, and the
 * parts follow each other in that order; faces that lie on each other on the pattern are told apart by their worn
 * places. Pieces keep their numbers. */
#ifndef SOLVER_GARMENT_CANONICAL_H
#define SOLVER_GARMENT_CANONICAL_H

#include "solver/garment/garment.h"

struct canonical {
	const struct garment *original; /* borrowed */
	/* Complete but for what leads to the file and its frames: those are the original's. */
	struct garment garment;
	struct topology topology;
	uint32_t *vertex;    /* [vertex_count] the original's number of each */
	uint32_t *face;      /* [face_count] */
	uint8_t *turn;       /* [face_count] which of the original's corners comes first */
	uint32_t *edge;      /* [edge_count] */
	uint32_t *vertex_of; /* [vertex_count] where each of the original's is */
	uint32_t *face_of;   /* [face_count] */
	uint32_t *edge_of;   /* [edge_count] */
};

/* Linear in faces, but for ordering the components. Arrays lie in the arena. TW_ERROR_MEMORY. */
enum tw_status canonical_build(struct canonical *canonical, struct arena *arena, const struct garment *original,
			       const struct topology *topology, struct tw_error *error) TW_NODISCARD;

/* Weights of the corners of a face, from one to the other; `from` and `to` may not be the same. */
void canonical_weights(const struct canonical *canonical, uint32_t face, const double original[3], double to[3]);
void canonical_original_weights(const struct canonical *canonical, uint32_t face, const double from[3],
				double original[3]);

#endif
