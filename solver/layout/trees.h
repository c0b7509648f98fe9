/* What of a layout takes a search to find. With it all else follows quickly, to the same bytes: a file that was not
 * made at first can be made later. */
#ifndef SOLVER_LAYOUT_TREES_H
#define SOLVER_LAYOUT_TREES_H

#include <stdbool.h>
#include <stdint.h>

struct layout_tree {
	bool is_optimal; /* proven */
	uint64_t weight, lower_bound;
	const uint32_t *edges; /* borrowed; numbers of the graph that was searched, ascending */
	uint32_t edge_count;
};

struct layout_trees {
	double eta_mpa; /* that was found for a request that leaves it to us; NaN: nothing was to be found */
	struct layout_tree ours;
	struct layout_tree baseline; /* zero without one */
};

#endif
