/* The files that a layout gives: one table. */
#ifndef SOLVER_LAYOUT_ARTIFACTS_H
#define SOLVER_LAYOUT_ARTIFACTS_H

#include "solver/layout/output.h"
#include "solver/layout/result.h"

/* Writes the file that the input wants into the output, or all. The bytes lie in the arena. TW_ERROR_MEMORY. */
enum tw_status artifacts_write(const struct layout_result *result, struct arena *arena, struct layout_output *output,
			       struct tw_error *error) TW_NODISCARD;

#endif
