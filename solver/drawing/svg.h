/* A drawing as SVG. Layers are groups that Inkscape takes for layers, a style's name is a class, one unit is one
 * millimetre; where the drawing is of true scale the page says so. */
#ifndef SOLVER_DRAWING_SVG_H
#define SOLVER_DRAWING_SVG_H

#include "solver/drawing/drawing.h"
#include "solver/text.h"

/* A drawing that failed makes the text fail. */
void svg_write(const struct drawing *drawing, struct text *text);

#endif
