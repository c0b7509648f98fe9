/* The graph that wires are laid in: the garment's vertices and edges, and for this job a node for every terminal that
 * lies inside a face or an edge (method 4). */
#ifndef SOLVER_LAYOUT_NETWORK_H
#define SOLVER_LAYOUT_NETWORK_H

#include "solver/field/field.h"
#include "solver/field/strip.h"
#include "solver/garment/garment.h"
#include "solver/graph/graph.h"
#include "solver/layout/base.h"
#include "solver/layout/terminals.h"

#include <stdbool.h>

/* A wire that comes nearer to a corner of pieces than this many strip widths runs through it. */
#define NETWORK_CORNER_WIDTHS 0.25

/* Node n < vertex_count is that vertex of the garment; node vertex_count + i is the place of site extra_site[i]. Edge
 * e < mesh_edge_count is the garment's edge mesh_edge[e]; later ones lie in faces that hold extra nodes. */
struct network {
	const struct garment *garment;
	const struct topology *topology;
	const struct site_set *sites;
	struct graph graph;       /* weights of the field */
	const uint64_t *baseline; /* [edge_count] weights of the baseline; NULL without one */
	double baseline_scale;    /* its units per mm; BASELINE_UNIT: per edge, what is left over is length */
	const uint32_t *tie;      /* [edge_count] tells trees of equal weight apart: a hash of where the ends lie on the
				     pattern, which knows no numbering */
	const uint32_t *mesh_edge;   /* [mesh_edge_count] */
	const uint32_t *extra_face;  /* [edge_count - mesh_edge_count] face that an extra edge lies in */
	const uint32_t *extra_site;  /* [extra_count] */
	const uint32_t *terminal;    /* [sites->count] node of every site */
	const uint64_t *node_hash;   /* [vertex_count + extra_count] of where each lies on the pattern */
	const struct site *crossing; /* [crossing_count] the nodes behind the extra ones: network_grow */
	const bool *corner;          /* [vertex_count] more than two pieces meet here, and no terminal is here */
	uint32_t mesh_edge_count;
	uint32_t extra_count;
	uint32_t crossing_count;
	double mean_edge_mm; /* of the pattern */
};

/* What edges are priced with. */
struct network_walkers {
	struct strip_walker *price;    /* integrates density + eta of the same field */
	struct strip_walker *keep_out; /* integrates 1 over what is kept out; NULL without keep-outs */
};

/* No wire passes a corner of pieces, and no edge of an extra node covers what is kept out: such edges are left out,
 * unless the terminals could not be joined without them. TW_ERROR_MEMORY, TW_ERROR_INPUT. */
enum tw_status network_build(struct network *network, struct arena *arena, const struct layout_base *base,
			     const struct field *field, const struct site_set *sites,
			     const struct network_walkers *walkers, enum layout_baseline baseline,
			     struct tw_error *error) TW_NODISCARD;

/* An edge of the network as it lies in the pattern, walked from one of its ends to the other. */
struct laid_edge {
	uint32_t face, piece;
	struct vec2 from, to;
	uint64_t from_key, to_key; /* equal keys mean the same point of the same piece */
};

/* The one or two ways in which `edge` lies in the pattern, one for each face on it. Returns how many. */
uint32_t network_lay(const struct network *network, uint32_t edge, uint32_t from_node, struct laid_edge laid[2]);

/* What tells an edge between two nodes from others of the same weight: `tie` has it for the network's own. */
uint32_t network_tie(const struct network *network, uint32_t a, uint32_t b);

/* Places inside edges, as nodes behind those that are there, and edges that join them to others within a face. */
struct network_growth {
	struct site *site; /* [site_count] SITE_EDGE */
	uint32_t *ends;    /* [edge_count][2] nodes */
	uint32_t *face;    /* [edge_count] that each edge lies in */
	uint64_t *weight;  /* [edge_count] */
	uint32_t site_count, edge_count;
};

/* Once for a network. Its edges keep their numbers; baseline and tie have none of the new ones. Borrows the sites.
 * TW_ERROR_MEMORY. */
enum tw_status network_grow(struct network *network, struct arena *arena, const struct network_growth *growth,
			    struct tw_error *error) TW_NODISCARD;

/* The site at a node that is no vertex. */
const struct site *network_site(const struct network *network, uint32_t node);

/* A face that the node lies in, with its weights. */
struct place network_place(const struct network *network, uint32_t node);

#endif
