/* Sizes: every wearer is the size-L body, scaled along x, y and z. */
#ifndef SOLVER_SAMPLE_SIZE_H
#define SOLVER_SAMPLE_SIZE_H

#include "solver/sample/sample.h"
#include "solver/sample/vector.h"

struct vec3 size_scale(enum sample_size size);

#endif
