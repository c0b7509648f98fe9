/* The wires: a tree's branches smoothed into line segments and circular arcs on the pattern (method 6). */
#ifndef SOLVER_LAYOUT_WIRES_H
#define SOLVER_LAYOUT_WIRES_H

#include "solver/layout/branches.h"
#include "solver/layout/wire_set.h"
#include "solver/pattern/outline.h"

/* Smooths all branches, strand by strand. `cost_per_mm` [edge_count of the network] is what a millimetre along each
 * edge costs, NULL for the same everywhere. Where a rule cannot be met the curve breaks it as little as there is room
 * for; metrics find that. TW_ERROR_MEMORY. */
enum tw_status wires_smooth(struct wire_set *wires, struct arena *arena, const struct network *network,
			    const struct branch_set *set, const struct outline *outline, const struct locator *locator,
			    const struct wire_rules *rules, const double *cost_per_mm,
			    struct tw_error *error) TW_NODISCARD;

#endif
