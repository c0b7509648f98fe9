/* What a mesh file says, before anything is concluded from it: positions, polygons and labels in the order of the file.
 * Every reader fills one; import.c makes a garment of it. */
#ifndef SOLVER_GARMENT_SOUP_H
#define SOLVER_GARMENT_SOUP_H

#include "solver/arena.h"
#include "solver/garment/garment.h"
#include "solver/garment/report.h"
#include "solver/garment/text.h"

/* Kinds of labels, in the order in which they are tried as a piece's name. */
enum label_kind { LABEL_GROUP, LABEL_MATERIAL, LABEL_OBJECT, LABEL_KINDS };

enum { POLYGON_CORNERS = 64 }; /* most corners of a polygon: cutting it takes cubic time */

struct soup {
	uint32_t vertex_count;
	uint32_t coord_count; /* texture coordinates */
	uint32_t polygon_count;
	uint32_t corner_count; /* of all polygons */
	double *position;      /* [vertex_count][3], in the file's unit, finite */
	double *coord;         /* [coord_count][2], finite; NULL where coord_count is 0 */
	uint32_t
		*polygon_start; /* [polygon_count + 1] first corner of each polygon, of at least 3 different vertices */
	uint32_t *corner_vertex; /* [corner_count] below vertex_count */
	uint32_t *corner_coord;  /* [corner_count] below coord_count; NULL where no polygon has any */
	uint32_t *polygon_line;  /* [polygon_count] line in the file, from 1; NULL for binary formats */

	/* Equal labels have equal numbers. */
	uint32_t *polygon_label[LABEL_KINDS]; /* [polygon_count] index into label or GARMENT_NONE; NULL for formats
						 without */
	struct text *label[LABEL_KINDS];      /* borrowed from the file; valid UTF-8 */
};

/* One reader a format. Everything is allocated from `arena`; what a reader finds odd but harmless goes into the report.
 */
enum tw_status obj_read(struct soup *soup, struct arena *arena, struct text file, struct garment_report *report,
			struct tw_error *error) TW_NODISCARD;
enum tw_status ply_read(struct soup *soup, struct arena *arena, struct text file, struct tw_error *error) TW_NODISCARD;
enum tw_status off_read(struct soup *soup, struct arena *arena, struct text file, struct tw_error *error) TW_NODISCARD;
enum tw_status stl_read(struct soup *soup, struct arena *arena, struct text file, struct tw_error *error) TW_NODISCARD;

/* obj_read without OpenMesh's agreement, for the thousands of frames of a sequence. */
enum tw_status obj_parse(struct soup *soup, struct arena *arena, struct text file, struct garment_report *report,
			 struct tw_error *error) TW_NODISCARD;

/* Whether the first bytes are those of the format. */
bool ply_is(struct text file);
bool off_is(struct text file);
bool stl_is(struct text file);

/* Fails with "line N". */
TW_PRINTF(4, 5)
enum tw_status fail_at_line(struct tw_error *error, const char *type, uint32_t line, const char *format, ...);

/* Fails where a count of the file is beyond a limit of tightwire.h. */
enum tw_status check_counts(uint64_t vertices, uint64_t polygons, struct tw_error *error) TW_NODISCARD;

/* Fails at the first polygon that has a vertex twice. */
enum tw_status check_polygons(const struct soup *soup, struct tw_error *error) TW_NODISCARD;

#endif
