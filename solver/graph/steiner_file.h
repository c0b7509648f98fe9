/* Steiner tree instances as files: PACE 2018 `.gr` and SteinLib `.stp`. Both list `E u v w` lines in a section Graph
 * and `T v` lines in a section Terminals, vertices counted from 1; an .stp opens with the word 33D32945, by which the
 * two are told apart. Sources: PACE 2018 track descriptions (Bonnet & Sikora 2019); SteinLib format 1.0 (Koch, Martin &
 * Voß 2001).
 *
 * Strict: what could change the problem is refused, never skipped (arcs, fractional weights, degree limits); only
 * sections Comment, Coordinates and Tree Decomposition are passed over, and edges from a vertex to itself, which no
 * tree has. A section Presolve says that the graph is what reductions left of another one, and with FIXED how much of
 * that one's tree they took; its other lines tell how they got there. Announced counts must hold. Keywords are read in
 * any case, lines with any end. */
#ifndef SOLVER_GRAPH_STEINER_FILE_H
#define SOLVER_GRAPH_STEINER_FILE_H

#include "solver/arena.h"
#include "solver/graph/graph.h"
#include "tightwire.h"

#include <stdbool.h>

#define STEINER_FILE_VERTICES_MAX 16000000u
#define STEINER_FILE_EDGES_MAX 64000000u

enum steiner_format { STEINER_FORMAT_GR, STEINER_FORMAT_STP };

struct steiner_file {
	enum steiner_format format;
	struct graph graph;  /* vertex v of the file is v - 1 here; edges in the order of the file, without loops */
	uint32_t loop_count; /* edges from a vertex to itself, which were left out */
	size_t loop_line;    /* of the first of them, from 1 */
	bool is_presolved;   /* there is a section Presolve */
	uint64_t fixed;      /* a tree of the graph before that weighs so much more */
	uint32_t *terminals; /* [terminal_count], as listed; equal ones possible; borrowed from the arena */
	uint32_t terminal_count;
	uint32_t repeated_count; /* of them, those that were listed before */
	size_t repeated_line;    /* of the first of these, from 1 */
};

/* Reads `length` bytes (they need no terminator). Every array is sized by what the bytes can hold, not by what they
 * announce. TW_ERROR_INPUT, TW_ERROR_LIMIT and TW_ERROR_UNSUPPORTED name the line; TW_ERROR_MEMORY. */
enum tw_status steiner_file_read(struct steiner_file *file, struct arena *arena, const char *bytes, size_t length,
				 struct tw_error *error) TW_NODISCARD;

#endif
