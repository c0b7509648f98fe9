/* What an import says about a garment beside the garment itself: its warnings, its counts and sizes. */
#ifndef SOLVER_GARMENT_REPORT_H
#define SOLVER_GARMENT_REPORT_H

#include "solver/warning.h"

enum mesh_format { MESH_SNIFF, MESH_OBJ, MESH_PLY, MESH_OFF, MESH_STL };

struct garment_report {
	struct warning_list warnings;
	enum mesh_format format; /* of the worn file, as it was read */
	uint32_t polygon_count;  /* in the file, before triangulation and refinement */
	uint32_t file_vertices;  /* in the file, before welding and refinement */
	uint32_t inner_edges;    /* of the garment, by kind */
	uint32_t seam_edges;
	uint32_t hem_edges;
	uint32_t component_count;
	double worn_box_mm[2][3]; /* least and largest */
	double pattern_box_mm[2][2];
	double worn_area_mm2;
	double pattern_area_mm2;
};

#endif
