/* A garment: a triangle mesh worn on a body together with its flat cutting pattern (method 1).
 *
 * Order is identity: vertices, pattern positions and faces keep the order of the file they came from, because motions,
 * terminals and layouts refer to them by number; where welding, cutting and refining change the numbers,
 * correspondence.h leads back to the file's. */
#ifndef SOLVER_GARMENT_GARMENT_H
#define SOLVER_GARMENT_GARMENT_H

#include "solver/arena.h"
#include "tightwire.h"

#define GARMENT_NONE UINT32_MAX

/* The primary arrays; everything else is derived. A vertex on a seam has one pattern position for each piece it belongs
 * to. All arrays are borrowed from the arena that the garment was made in. */
struct garment {
	uint32_t vertex_count;
	uint32_t face_count;
	uint32_t coord_count; /* pattern positions */
	uint32_t piece_count;
	double *position;      /* [vertex_count][3] worn rest pose, mm */
	double *pattern;       /* [coord_count][2] flat pattern, mm */
	uint32_t *face_vertex; /* [face_count][3] vertex of each corner */
	uint32_t *face_coord;  /* [face_count][3] pattern position of each corner; counter-clockwise in the pattern */
	uint32_t *face_piece;  /* [face_count] */
	char **piece_name;     /* [piece_count] UTF-8, distinct */

	/* How a frame of a motion, which has the vertices of the file, moves the garment: vertex v lies at the sum over
	 * k of source_share[v][k] * frame[source_vertex[v][k]]. Both are NULL where the garment has just the file's
	 * vertices; a welded or refined garment has fewer or more. */
	uint32_t source_count;   /* vertices of the file, the points of a frame; vertex_count where the two are NULL */
	uint32_t *source_vertex; /* [vertex_count][3], or NULL */
	double *source_share;    /* [vertex_count][3], not negative, sum 1; or NULL */

	/* What became of the file's vertices and faces; read through solver/garment/correspondence.h. NULL where the
	 * numbers are the file's. */
	uint32_t *mesh_vertex;    /* [source_count] vertex that each of the file's became, or NULL */
	uint32_t *file_face;      /* [face_count] face of the file that each is part of, ascending; or NULL */
	uint32_t file_face_count; /* faces of the file, where file_face is not NULL */
	uint32_t *file_corner;    /* [file_face_count][3] corners of each as vertices here, GARMENT_NONE of one that is
				     no triangle; where file_face is not NULL */
};

/* Points that a frame of this garment's motions has. */
uint32_t garment_source_count(const struct garment *garment);

/* The garment's vertices in a frame: `frame` itself where the garment has the file's vertices, else `moved`, filled.
 * `frame` is [garment_source_count][3], `moved` [vertex_count][3]. */
const float *garment_frame(const struct garment *garment, const float *frame, float *moved);

enum edge_kind {
	EDGE_INNER, /* two faces that share the pattern positions along the edge */
	EDGE_SEAM,  /* two faces with different pattern positions: two pieces (or two sides of a dart) sewn together */
	EDGE_HEM,   /* one face */
};

/* Derived from a garment in O(faces). Edge e has ends edge_vertex[2e] < edge_vertex[2e + 1]; edges are numbered in the
 * order in which faces first meet them (face by face, corner by corner), so equal garments give equal numbers. Side k
 * of corner k of a face is the edge from corner k to corner (k + 1) % 3. */
struct topology {
	uint32_t edge_count;
	uint32_t component_count;
	uint32_t *edge_vertex; /* [edge_count][2] */
	uint32_t *edge_face;   /* [edge_count][2] the faces on it, the lower first; GARMENT_NONE where there is none */
	uint8_t *edge_side;    /* [edge_count][2] which side of that face it is, 0…2 */
	uint8_t *edge_kind;    /* [edge_count] enum edge_kind */
	uint32_t *face_edge;   /* [face_count][3] edge of each side */
	uint32_t *vertex_component; /* [vertex_count] 0…component_count-1, numbered by lowest vertex */
};

/* TW_ERROR_INPUT names the edge and faces where an edge has more than two faces; TW_ERROR_MEMORY. */
enum tw_status topology_build(struct topology *topology, struct arena *arena, const struct garment *garment,
			      struct tw_error *error) TW_NODISCARD;

/* A garment as named arrays, the form in which it is stored and served; see struct tw_array. Borrowed from the garment
 * and its topology, or in `arena`:
 *
 *   position f64 [vertices][3], pattern f64 [pattern positions][2], face_vertex face_coord u32 [faces][3],
 *   face_piece u32 [faces], piece_name u8, each name with its terminating 0
 *   edge_vertex u32 [edges][2]: the two vertices of each edge, in the order of a field's weights
 *   file_vertex u32 [vertices]: the file's vertex, GARMENT_NONE for one that refinement made
 *   mesh_vertex u32 [the file's vertices]: the vertex here
 *   file_face u32 [faces]: the file's face that each is part of
 *   file_corner u32 [the file's faces][3]: only where faces were cut
 *   source_vertex u32, source_share f64 [vertices][3], source_count u32 [1]: only where vertices are not the file's */
enum { GARMENT_ARRAYS = 14 };
enum tw_status garment_to_arrays(const struct garment *garment, const struct topology *topology, struct arena *arena,
				 struct tw_array arrays[GARMENT_ARRAYS], size_t *count,
				 struct tw_error *error) TW_NODISCARD;

/* The inverse. Borrows the arrays' data, which must live as long as the garment; checks every index and that every
 * number is finite, so that a damaged store is an error and no crash. A garment of 0.1.0, without the file's numbers,
 * is read where they are its own, else it is "garment-outdated". */
enum tw_status garment_from_arrays(struct garment *garment, struct arena *arena, const struct tw_array *arrays,
				   size_t count, struct tw_error *error) TW_NODISCARD;

#endif
