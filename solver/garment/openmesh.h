/* OpenMesh as a second reader of a file that one of our strict readers has read whole: what the two understand
 * differently is refused rather than guessed at. OpenMesh alone would not do: it drops faces with bad indexes, doubles
 * the vertices of edges that it does not like, keeps floats, reads on past the end of a damaged file, and opens the
 * material files that an OBJ names. It is therefore heard where its parser reports, before it builds a mesh, and sees
 * only the lines that matter.
 *
 * Its readers are objects of the process; calls are serialised. */
#ifndef SOLVER_GARMENT_OPENMESH_H
#define SOLVER_GARMENT_OPENMESH_H

#include "solver/garment/soup.h"

/* TW_OK when OpenMesh reads the same vertices, polygons and texture coordinates from an OBJ, OFF or STL (`binary` or
 * not) as are in `soup`; else "mesh-ambiguous" with the line or number of the first face that differs. */
enum tw_status openmesh_agrees(const struct soup *soup, struct text file, enum mesh_format format, bool binary,
			       struct tw_error *error) TW_NODISCARD;

/* The next line of an OBJ, with those that are joined to it: the first word of data says whether a backslash at the end
 * joins, names end with their line. *lines grows by the lines taken. */
bool obj_next_line(struct text *text, struct text *line, uint32_t *lines);

/* The lines that OpenMesh gets to see: of an OBJ v, vt and f (obj.c); of an OFF and an STL what is neither empty nor a
 * comment (off.c). */
bool obj_line_is_geometry(struct text line);
bool off_line_counts(struct text line);

#endif
