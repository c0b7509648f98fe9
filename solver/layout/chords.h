/* The graph that trees are searched in when they may leave the mesh's edges: the network's, and behind its edges the
 * flip chords (solver/field/strip.h), each between the two vertices that it joins (method 4). A chord lies in two
 * faces; once a tree is found, those that it uses are cut in two at the edge that they cross, and the network gets the
 * place as a node, so that all that follows knows of edges within a face alone. */
#ifndef SOLVER_LAYOUT_CHORDS_H
#define SOLVER_LAYOUT_CHORDS_H

#include "solver/layout/network.h"
#include "solver/steiner/steiner.h"

struct chord_graph {
	struct graph graph;      /* the network's edges, then the chords */
	const uint32_t *tie;     /* [graph.edge_count] as the network's */
	const uint32_t *across;  /* [chord_count] the mesh edge that each crosses */
	const double *length_mm; /* [chord_count] */
	uint32_t chord_count;
};

/* `field` has weights of chords. Chords whose ends no edge of the network reaches, and
 * those that pass a corner of pieces, are left out. TW_ERROR_MEMORY. */
enum tw_status chord_graph_build(struct chord_graph *chords, struct arena *arena, const struct network *network,
				 const struct layout_base *base, const struct field *field,
				 struct tw_error *error) TW_NODISCARD;

/* Cuts the chords of a tree: the network grows by their crossings, and tree->edges becomes the network's edges, of the
 * same tree. The graph of `chords` stays as it is. TW_ERROR_MEMORY. */
enum tw_status chord_graph_cut(const struct chord_graph *chords, struct arena *arena, struct network *network,
			       struct steiner_tree *tree, const struct strip_fabric *fabric,
			       struct tw_error *error) TW_NODISCARD;

#endif
