/* OpenMesh's readers behind a C interface, and only behind one of our strict readers, which has seen the whole file
 * before: they would read on after the end of a damaged file, drop faces, and open the material files that an OBJ
 * names. What they deliver is taken as it comes from the parser, before OpenMesh builds a mesh of it (and doubles the
 * vertices of edges that it does not like).
 *
 * The readers are objects of the process; calls are serialised. */
#ifndef SOLVER_GARMENT_OPENMESH_H
#define SOLVER_GARMENT_OPENMESH_H

#include "solver/garment/soup.h"

/* Reads OFF or STL into `soup`; coordinates come as float. Equal positions of an STL are one vertex. Fails with
 * "mesh-unreadable" where the numbers of vertices or polygons are not the expected ones (STL: of vertices, 0). */
enum tw_status openmesh_read(struct soup *soup, struct arena *arena, struct text file, enum mesh_format format,
			     bool binary, uint32_t vertex_count, uint32_t polygon_count,
			     struct tw_error *error) TW_NODISCARD;

/* TW_OK when OpenMesh reads the same vertices, polygons and texture coordinates from an OBJ as are in `soup`; else
 * "mesh-ambiguous" with the line of the first face that differs. Needs no memory of its own worth mentioning. */
enum tw_status openmesh_agrees_on_obj(const struct soup *soup, struct text file, struct tw_error *error) TW_NODISCARD;

/* The lines that OpenMesh gets to see: of an OBJ v, vt and f (obj.c), of an OFF what is neither empty nor a comment
 * (off.c). */
bool obj_line_is_geometry(struct text line);
bool off_line_counts(struct text line);

#endif
