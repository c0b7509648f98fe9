/* Between the numbers of the uploaded file, in which requests and answers speak, and those of the garment that is
 * computed with: welding makes one vertex of several, and cutting polygons and refining several faces of one.
 *
 * A file's vertex always is a vertex of the garment; a garment's vertex need not be one of the file. A file's face is
 * a run of the garment's faces, its parts. Weights within a face of the file are defined where it is a triangle. */
#ifndef SOLVER_GARMENT_CORRESPONDENCE_H
#define SOLVER_GARMENT_CORRESPONDENCE_H

#include "solver/garment/garment.h"

#include <stdbool.h>

/* How many faces the file has; how many vertices: garment_source_count. */
uint32_t garment_file_faces(const struct garment *garment);

/* The garment's vertex that the file's vertex became; `file_vertex` is below garment_source_count. */
uint32_t garment_mesh_vertex(const struct garment *garment, uint32_t file_vertex);

/* The lowest of the file's vertices that became this one; GARMENT_NONE for a vertex that refinement made. */
uint32_t garment_file_vertex(const struct garment *garment, uint32_t vertex);

/* The face of the file that a face is part of. */
uint32_t garment_file_face(const struct garment *garment, uint32_t face);

/* The parts of a face of the file, from `first` on, one or more; `file_face` is below garment_file_faces. */
uint32_t garment_face_parts(const struct garment *garment, uint32_t file_face, uint32_t *first);

/* Whether it is a triangle in the file, and its corners then, as the garment's vertices, in the file's order. */
bool garment_file_corners(const struct garment *garment, uint32_t file_face, uint32_t corner[3]);

/* The point of a triangle of the file with these weights (>= 0, sum 1) as a face and weights of the garment: the same
 * point, whatever the refinement. On an edge between parts the lowest of them. False where the face is no triangle. */
bool garment_place_from_file(const struct garment *garment, uint32_t file_face, const double weights[3], uint32_t *face,
			     double barycentric[3]);

/* The inverse. */
bool garment_place_to_file(const struct garment *garment, uint32_t face, const double barycentric[3],
			   uint32_t *file_face, double weights[3]);

/* Whether an edge of the garment is part of an edge of the file (or of a diagonal along which a polygon was cut), and
 * that edge's ends then, as the garment's vertices, the lower first. */
bool garment_edge_to_file(const struct garment *garment, const uint32_t ends[2], uint32_t file_ends[2]);

/* "17", or of a vertex that refinement made "between 3 and 17" (and 5), in the file's numbers: for messages. */
enum { VERTEX_NAME_BYTES = 64 };
const char *garment_vertex_name(const struct garment *garment, uint32_t vertex, char name[VERTEX_NAME_BYTES]);

#endif
