/* A tree that grows from one terminal to the others, for any costs on the instance's edges. */
#ifndef SOLVER_STEINER_PRIMAL_GROW_H
#define SOLVER_STEINER_PRIMAL_GROW_H

#include "solver/steiner/search.h"

/* Connects the terminals by Takahashi & Matsuyama's heuristic for the costs `cost` [edge_count], over allowed vertices
 * only (`allowed` [vertex_count], NULL: all), starting with the vertex `start`. Writes the edges
 * of the tree, which may have a bare end at `start`, to `edges` (room for vertex_count). *edge_count is 0 when the
 * allowed vertices do not connect the terminals, or when the heuristic would take more than `effort` work units.
 * TW_ERROR_MEMORY. */
enum tw_status primal_grow_tree(struct search *search, const fine_t *cost, const uint8_t *allowed, uint32_t start,
				uint64_t effort, uint32_t *edges, uint32_t *edge_count) TW_NODISCARD;

#endif
