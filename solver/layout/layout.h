/* A layout: the wiring tree of least strain energy between given terminals, smoothed into curves that can be cut and
 * pressed, with its metrics beside those of a baseline (method 4 to 7).
 *
 * Deterministic: equal input gives equal artifact bytes on every machine and for every number of threads, unless the
 * request sets a time limit. No ids, times or paths stand in the artifacts. */
#ifndef SOLVER_LAYOUT_LAYOUT_H
#define SOLVER_LAYOUT_LAYOUT_H

#include "solver/layout/input.h"
#include "solver/layout/output.h"
#include "tightwire.h"

/* Computes the layout. All of *output is allocated from `arena`. TW_ERROR_INPUT names the terminal that cannot be
 * placed
 * ("terminal-out-of-range", "terminal-off-fabric", "terminal-unknown-piece", "terminals-apart", where: JSON Pointer
 * into the request); TW_ERROR_CANCELLED when `cancelled` said so; TW_ERROR_MEMORY. A time limit that was reached is no
 * error: the summary's outcome is STEINER_LIMIT and the bound says how far off the tree can be. */
enum tw_status layout_compute(const struct layout_input *input, struct arena *arena, struct layout_output *output,
			      struct tw_error *error) TW_NODISCARD;

#endif
