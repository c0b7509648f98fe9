/* A first tree for any costs on the instance's edges. */
#ifndef SOLVER_STEINER_PRIMAL_PATH_H
#define SOLVER_STEINER_PRIMAL_PATH_H

#include "solver/steiner/search.h"

/* Connects the terminals by Mehlhorn's heuristic for the costs `cost` [edge_count], over allowed vertices only
 * (`allowed` [vertex_count], NULL: all). Writes the edges to `edges` (room for vertex_count + terminal_count): they
 * form a tree, maybe with bare ends, or a forest if the allowed vertices do not connect the terminals. TW_ERROR_MEMORY.
 */
enum tw_status primal_path_connect(struct search *search, const fine_t *cost, const uint8_t *allowed, uint32_t *edges,
				   uint32_t *edge_count) TW_NODISCARD;

#endif
