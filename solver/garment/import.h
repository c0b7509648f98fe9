/* Garment files in, a checked garment out (method 1).
 *
 * Formats: OBJ, PLY, OFF, STL. The readers are strict and name what is wrong; OpenMesh reads OBJ, OFF and STL a second
 * time, and a file that two readers understand differently is refused. Two ways in: one file with the flat pattern as
 * texture coordinates (the `vt` of an OBJ, a PLY's s t), or a worn mesh of any format plus a flat mesh (x y its plane,
 * z constant) with the same faces in the same order.
 *
 * Faces, vertices and pattern positions keep the order of the file. Quads and larger polygons are cut into triangles
 * along their shortest valid diagonals, and reported. STL has no shared vertices: equal positions are one vertex,
 * numbered by first use.
 *
 * Pieces are the sets of faces joined by edges whose two sides share their pattern positions, numbered by their first
 * face. A piece is named by its `g`, else its `usemtl`, else its `o`, where its faces agree; else "piece-N". Equal
 * names get
 * "-2", "-3", … */
#ifndef SOLVER_GARMENT_IMPORT_H
#define SOLVER_GARMENT_IMPORT_H

#include "solver/garment/garment.h"
#include "solver/garment/options.h"
#include "solver/garment/report.h"

/* A file in memory. Borrowed. */
struct garment_source {
	const void *bytes;
	size_t size;
	enum mesh_format format; /* MESH_SNIFF: decided by mesh_format_of_name(name), else by the first bytes */
	const char *name;        /* file name, for its ending; may be NULL */
};

/* By the ending (".obj", any case); MESH_SNIFF when it is none of ours. */
enum mesh_format mesh_format_of_name(const char *name);

/* Reads `worn`, and `pattern` where it is not NULL. The garment lives in `arena`; working memory, at most 2 GiB, is
 * freed at the end. Errors: TW_ERROR_INPUT with a stable type and the line, byte, face or vertex in `where` (numbers of
 * faces and vertices from 0, of lines from 1); TW_ERROR_LIMIT; TW_ERROR_MEMORY. */
enum tw_status garment_import(struct garment *garment, struct arena *arena, const struct garment_source *worn,
			      const struct garment_source *pattern, const struct import_options *options,
			      struct garment_report *report, struct tw_error *error) TW_NODISCARD;

#endif
