/* A set of faces on the sheet, drawn as areas: keep-outs, say. */
#ifndef SOLVER_LAYOUT_SHEET_FACES_H
#define SOLVER_LAYOUT_SHEET_FACES_H

#include "solver/layout/sheet.h"

/* Adds one path for every piece that has such faces to the layer that was begun last. `marked`: [face_count].
 * TW_ERROR_MEMORY. */
enum tw_status sheet_add_faces(const struct sheet *sheet, const struct drawing_style *style,
			       const uint8_t *marked) TW_NODISCARD;

#endif
