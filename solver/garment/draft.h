/* A garment while it is being imported: the stages of import.c, one function each, in the order in which they run. All
 * work in a scratch arena. */
#ifndef SOLVER_GARMENT_DRAFT_H
#define SOLVER_GARMENT_DRAFT_H

#include "solver/garment/garment.h"
#include "solver/garment/options.h"
#include "solver/garment/soup.h"

struct draft {
	struct garment garment;    /* in millimetres; its file_face is there from the first stage on */
	struct topology topology;  /* of it; from draft_connect on */
	const struct soup *worn;   /* borrowed */
	const struct soup *labels; /* borrowed: the soup that names the pieces, `worn` or the flat pattern */
	struct arena *arena;       /* borrowed: scratch */
	struct garment_report *report;
	struct tw_error *error;
};

/* From polygons to triangles, and from the file's units to millimetres. `pattern` is NULL where `worn` has coords. */
enum tw_status draft_from_soup(struct draft *draft, const struct soup *worn, const struct soup *pattern,
			       const struct import_options *options) TW_NODISCARD;

/* Whether the units can be right: that of the worn mesh before anything is made of the soups, and that of the pattern
 * by the areas of the faces, which go into the report. Named before anything else that is wrong. */
enum tw_status draft_check_unit(struct draft *draft, const struct soup *worn, const struct soup *pattern,
				const struct import_options *options) TW_NODISCARD;
enum tw_status draft_check_scale(struct draft *draft, const struct import_options *options) TW_NODISCARD;

/* Cuts a polygon of `count` corners at xy [count][2] into count - 2 triangles of corner numbers, all counter-clockwise;
 * false where that cannot be (it crosses itself or runs clockwise), and then a fan. */
bool polygon_cut(const double *xy, uint32_t count, uint32_t *triangles);

/* Joins hem vertices that lie within `weld_mm`; 0 joins none. */
enum tw_status draft_weld(struct draft *draft, double weld_mm) TW_NODISCARD;

/* The warning "seams-open" where hems lie along each other, with their length. */
enum tw_status draft_warn_of_open_seams(struct draft *draft, double weld_mm) TW_NODISCARD;

/* Equal pattern positions at a vertex become one, then edges are built and must have at most two faces, in opposite
 * directions. */
enum tw_status draft_connect(struct draft *draft) TW_NODISCARD;

/* Numbers and names the pieces; every pattern position belongs to one piece afterwards. */
enum tw_status draft_find_pieces(struct draft *draft) TW_NODISCARD;

/* Areas and directions of the faces in the pattern; turns mirrored pieces where `mirrored` allows it. */
enum tw_status draft_check_faces(struct draft *draft, enum mirrored_pieces mirrored) TW_NODISCARD;

/* A piece may not overlap itself; pieces that overlap each other are a warning. */
enum tw_status draft_check_overlap(struct draft *draft) TW_NODISCARD;

/* A mesh with an inner and an outer side is not a garment in the sense of method 1. */
enum tw_status draft_check_thickness(struct draft *draft) TW_NODISCARD;

/* The corners of the file's faces, where some were cut into triangles; where none was, file_face goes. The last stage.
 */
enum tw_status draft_number_faces(struct draft *draft) TW_NODISCARD;

/* Fails at a face of the garment, with "face N" of the file and, for text formats, its line. */
TW_PRINTF(4, 5)
enum tw_status fail_at_face(const struct draft *draft, uint32_t face, const char *type, const char *format, ...);

/* Twice the area of a face in the pattern, negative where it is clockwise. */
double draft_face_cross(const struct draft *draft, uint32_t face);

#endif
