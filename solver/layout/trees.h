/* What of a layout takes a search to find. With it all else follows quickly, to the same bytes: a file that was not
 * made at first can be made later. */
#ifndef SOLVER_LAYOUT_TREES_H
#define SOLVER_LAYOUT_TREES_H

#include "solver/arena.h"
#include "tightwire.h"

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

/* As one array of numbers, to be kept, which the caller names; its data lies in the arena. TW_ERROR_MEMORY. */
enum tw_status trees_to_array(const struct layout_trees *trees, struct arena *arena, struct tw_array *array,
			      struct tw_error *error) TW_NODISCARD;

/* And back. TW_ERROR_INTERNAL for an array that is none of these; TW_ERROR_MEMORY. */
enum tw_status trees_from_array(struct layout_trees *trees, struct arena *arena, const struct tw_array *array,
				struct tw_error *error) TW_NODISCARD;

#endif
