/* Edges are listed first (the garment's that a wire may use, then those of the extra nodes, site by site), with two
 * weights each: the field's and the baseline's. The graph's rows are built once; a baseline is the same rows with other
 * weights. */
#include "solver/layout/network.h"

#include "solver/splitmix.h"
#include "solver/steiner/union_find.h"

#include <stdbool.h>
#include <string.h>

/* Baselines count lengths in 1/1024 mm. */
static const double length_scale = 1024;

/* All of a baseline's weights together. */
static const uint64_t baseline_total = UINT64_C(1) << 61;

/* What edges should not do. */
enum avoidable { AVOID_CORNERS = 1, AVOID_KEEP_OUTS = 2 };

struct lister {
	struct network *network;
	const struct layout_base *base;
	const struct field *field;
	const struct network_walkers *walkers;
	unsigned avoided; /* a set of enum avoidable */
	uint32_t *ends;
	uint64_t *weight;
	uint64_t *baseline;
	uint32_t *mesh_edge;
	uint32_t *extra_face;
	uint32_t *extra_site;
	uint32_t *terminal;
	uint32_t count;
	uint32_t capacity;
};

static struct vec2 coord_of(const struct garment *garment, uint32_t coord)
{
	const double *uv = &garment->pattern[2 * (size_t)coord];
	return (struct vec2){uv[0], uv[1]};
}

static bool is_extra(const struct network *network, uint32_t node)
{
	return node >= network->garment->vertex_count;
}

static uint32_t extra_of(const struct network *network, uint32_t node)
{
	return node - network->garment->vertex_count;
}

const struct site *network_site(const struct network *network, uint32_t node)
{
	uint32_t extra = extra_of(network, node);
	if (extra >= network->extra_count)
		return &network->crossing[extra - network->extra_count];
	return &network->sites->site[network->extra_site[extra]];
}

/* Where a node lies in the pattern plane of a face that it touches, and the key of that point. */
static struct vec2 node_in_face(const struct network *network, uint32_t node, uint32_t face, uint64_t *key)
{
	const struct garment *garment = network->garment;
	const uint32_t *vertex = &garment->face_vertex[3 * (size_t)face];
	const uint32_t *coord = &garment->face_coord[3 * (size_t)face];
	if (!is_extra(network, node)) {
		uint32_t k = vertex[0] == node ? 0 : vertex[1] == node ? 1 : 2;
		*key = coord[k];
		return coord_of(garment, coord[k]);
	}
	const struct site *site = network_site(network, node);
	*key = garment->coord_count + 2 * (uint64_t)extra_of(network, node);
	if (site->kind == SITE_FACE)
		return place_on_pattern(garment, &site->place);
	const struct topology *topology = network->topology;
	const uint32_t *faces = &topology->edge_face[2 * (size_t)site->edge];
	uint32_t side = faces[0] == face ? 0 : 1, k = topology->edge_side[2 * (size_t)site->edge + side];
	*key += side == 1 && topology->edge_kind[site->edge] == EDGE_SEAM;
	bool forward = topology->edge_vertex[2 * (size_t)site->edge] == vertex[k];
	return vec2_mix(coord_of(garment, coord[k]), coord_of(garment, coord[(k + 1) % 3]),
			forward ? site->along : 1 - site->along);
}

/* The garment's edge that two nodes lie on, when one of them is inside it. */
static uint32_t common_edge(const struct network *network, uint32_t a, uint32_t b)
{
	for (int turn = 0; turn < 2; turn++) {
		uint32_t p = turn ? b : a, q = turn ? a : b;
		if (!is_extra(network, p) || network_site(network, p)->kind != SITE_EDGE)
			continue;
		uint32_t edge = network_site(network, p)->edge;
		const uint32_t *end = &network->topology->edge_vertex[2 * (size_t)edge];
		if (is_extra(network, q)
			    ? network_site(network, q)->kind == SITE_EDGE && network_site(network, q)->edge == edge
			    : end[0] == q || end[1] == q)
			return edge;
	}
	return GARMENT_NONE;
}

static void lay_in_face(const struct network *network, uint32_t face, uint32_t from, uint32_t to,
			struct laid_edge *laid)
{
	laid->face = face;
	laid->piece = network->garment->face_piece[face];
	laid->from = node_in_face(network, from, face, &laid->from_key);
	laid->to = node_in_face(network, to, face, &laid->to_key);
}

uint32_t network_lay(const struct network *network, uint32_t edge, uint32_t from_node, struct laid_edge laid[2])
{
	const uint32_t *end = network->graph.ends + 2 * (size_t)edge;
	uint32_t to_node = end[0] == from_node ? end[1] : end[0];
	bool extra = edge >= network->mesh_edge_count;
	laid[0] = laid[1] = (struct laid_edge){0};
	uint32_t mesh_edge = extra ? common_edge(network, from_node, to_node) : network->mesh_edge[edge];
	if (mesh_edge == GARMENT_NONE) {
		lay_in_face(network, network->extra_face[edge - network->mesh_edge_count], from_node, to_node,
			    &laid[0]);
		return 1;
	}
	const uint32_t *face = &network->topology->edge_face[2 * (size_t)mesh_edge];
	uint32_t count = 0;
	for (uint32_t side = 0; side < 2; side++)
		if (face[side] != GARMENT_NONE)
			lay_in_face(network, face[side], from_node, to_node, &laid[count++]);
	return count;
}

struct place network_place(const struct network *network, uint32_t node)
{
	if (is_extra(network, node))
		return network_site(network, node)->place;
	struct place place = {.face = GARMENT_NONE};
	uint32_t arc = network->graph.first[node];
	if (arc == network->graph.first[node + 1])
		return place;
	struct laid_edge laid[2];
	network_lay(network, network->graph.edge[arc], node, laid);
	place.face = laid[0].face;
	for (uint32_t k = 0; k < 3; k++)
		place.barycentric[k] = network->garment->face_vertex[3 * (size_t)place.face + k] == node;
	return place;
}

static uint64_t length_weight(double length)
{
	uint64_t weight = (uint64_t)(length * length_scale + 0.5);
	return weight ? weight : 1;
}

/* Fewest edges, and of equally many the shortest: an edge weighs more than all lengths together. There are very many
 * trees of fewest edges, whose energies differ by points of per cent; which one is found must not be luck. */
static void count_edges_first(struct lister *lister)
{
	uint64_t total = 0;
	for (uint32_t e = 0; e < lister->count; e++)
		total += lister->baseline[e];
	unsigned coarser = 0;
	while ((total >> coarser) + lister->count >= baseline_total / (lister->count + 1))
		coarser++;
	const uint64_t an_edge = (total >> coarser) + lister->count;
	for (uint32_t e = 0; e < lister->count; e++)
		lister->baseline[e] = (lister->baseline[e] >> coarser) + an_edge;
	lister->network->baseline_scale = (double)an_edge;
}

uint32_t network_tie(const struct network *network, uint32_t a, uint32_t b)
{
	return (uint32_t)(splitmix(network->node_hash[a] + network->node_hash[b]) >> 32);
}

/* Of a node within a face or an edge, the place; of a vertex all its places. */
static void hash_nodes(const struct network *network, const struct layout_base *base, uint64_t *hash)
{
	const struct garment *garment = network->garment;
	memcpy(hash, base->vertex_hash, garment->vertex_count * sizeof *hash);
	for (uint32_t i = 0; i < network->extra_count; i++) {
		const struct site *site = &network->sites->site[network->extra_site[i]];
		hash[garment->vertex_count + i] = layout_hash_point(place_on_pattern(garment, &site->place));
	}
}

static enum tw_status break_ties(struct network *network, struct arena *arena, const struct lister *lister,
				 struct tw_error *error)
{
	uint32_t *tie = ARENA_ARRAY(arena, lister->count, uint32_t);
	uint64_t *hash = ARENA_ARRAY(arena, (size_t)network->garment->vertex_count + network->extra_count, uint64_t);
	if (!tie || !hash)
		return tw_fail_memory(error);
	hash_nodes(network, lister->base, hash);
	network->node_hash = hash;
	for (uint32_t e = 0; e < lister->count; e++)
		tie[e] = network_tie(network, lister->ends[2 * (size_t)e], lister->ends[2 * (size_t)e + 1]);
	network->tie = tie;
	return TW_OK;
}

/* A wire may end at a corner. */
static enum tw_status take_corners(struct network *network, const struct layout_base *base, struct arena *arena,
				   struct tw_error *error)
{
	bool *corner = ARENA_ARRAY(arena, network->garment->vertex_count, bool);
	if (!corner)
		return tw_fail_memory(error);
	memcpy(corner, base->corner, network->garment->vertex_count * sizeof *corner);
	for (uint32_t s = 0; s < network->sites->count; s++)
		if (network->sites->site[s].kind == SITE_VERTEX)
			corner[network->sites->site[s].vertex] = false;
	network->corner = corner;
	return TW_OK;
}

static bool is_avoided_corner(const struct lister *lister, uint32_t node)
{
	return lister->avoided & AVOID_CORNERS && !is_extra(lister->network, node) && lister->network->corner[node];
}

static void list_mesh_edges(struct lister *lister)
{
	struct network *network = lister->network;
	const struct topology *topology = network->topology;
	lister->count = 0;
	for (uint32_t e = 0; e < topology->edge_count; e++) {
		const uint32_t *end = &topology->edge_vertex[2 * (size_t)e];
		if (lister->field->weight[e] == FIELD_FORBIDDEN || is_avoided_corner(lister, end[0]) ||
		    is_avoided_corner(lister, end[1]))
			continue;
		uint32_t i = lister->count++;
		memcpy(&lister->ends[2 * (size_t)i], end, 2 * sizeof *end);
		lister->weight[i] = lister->field->weight[e];
		lister->baseline[i] = length_weight(lister->base->edge_length_mm[e]);
		lister->mesh_edge[i] = e;
	}
	network->mesh_edge_count = lister->count;
	network->mean_edge_mm = lister->base->mean_edge_mm;
}

/* Edges of an extra node are always allowed, whatever the overhang rule: a terminal must be reachable. */
static uint64_t extra_weight(struct lister *lister, const struct laid_edge *laid)
{
	const struct field_options *options = &lister->field->options;
	if (options->weight == FIELD_UNIT)
		return field_round(lister->field, 1);
	if (options->weight == FIELD_LENGTH)
		return field_round(lister->field, vec2_distance(laid->from, laid->to));
	struct strip strip;
	const double a[2] = {laid->from.x, laid->from.y}, b[2] = {laid->to.x, laid->to.y};
	strip_segment(lister->walkers->price, laid->face, a, b, options->strip_width_mm, &strip);
	return field_round(lister->field, strip_cost(&strip, options->overhang));
}

static bool covers_keep_out(const struct lister *lister, const struct laid_edge *laid)
{
	struct strip strip;
	const double a[2] = {laid->from.x, laid->from.y}, b[2] = {laid->to.x, laid->to.y};
	if (!(lister->avoided & AVOID_KEEP_OUTS))
		return false;
	strip_segment(lister->walkers->keep_out, laid->face, a, b, lister->field->options.strip_width_mm, &strip);
	return strip_touches(&strip);
}

static enum tw_status list_extra(struct lister *lister, uint32_t from, uint32_t to, uint32_t face,
				 struct tw_error *error)
{
	if (lister->count == lister->capacity)
		return tw_fail(error, TW_ERROR_LIMIT, "too-many-terminals", "/terminals",
			       "too many terminals lie in one face: spread them, or give them by vertex");
	struct laid_edge laid;
	lay_in_face(lister->network, face, from, to, &laid);
	if (is_avoided_corner(lister, to) || covers_keep_out(lister, &laid))
		return TW_OK;
	uint32_t i = lister->count++;
	lister->ends[2 * (size_t)i] = from < to ? from : to;
	lister->ends[2 * (size_t)i + 1] = from < to ? to : from;
	lister->weight[i] = extra_weight(lister, &laid);
	lister->baseline[i] = length_weight(vec2_distance(laid.from, laid.to));
	lister->extra_face[i - lister->network->mesh_edge_count] = face;
	return TW_OK;
}

/* The faces that a site lies in: one, or those on its edge. */
static uint32_t faces_of(const struct network *network, const struct site *site, uint32_t face[2])
{
	face[0] = site->place.face;
	if (site->kind != SITE_EDGE)
		return 1;
	memcpy(face, &network->topology->edge_face[2 * (size_t)site->edge], 2 * sizeof *face);
	return face[1] == GARMENT_NONE ? 1 : 2;
}

static enum tw_status join_corners(struct lister *lister, uint32_t node, const struct site *site,
				   struct tw_error *error)
{
	struct network *network = lister->network;
	uint32_t face[2], faces = faces_of(network, site, face);
	for (uint32_t f = 0; f < faces; f++) {
		for (uint32_t k = 0; k < 3; k++) {
			uint32_t vertex = network->garment->face_vertex[3 * (size_t)face[f] + k];
			/* The ends of the edge that the site lies on are met in both faces. */
			if (f == 1 && common_edge(network, node, vertex) != GARMENT_NONE)
				continue;
			enum tw_status status = list_extra(lister, node, vertex, face[f], error);
			if (status != TW_OK)
				return status;
		}
	}
	return TW_OK;
}

/* Joins the node to those before it that share a face with it. */
static enum tw_status join_extras(struct lister *lister, uint32_t node, const struct site *site, struct tw_error *error)
{
	struct network *network = lister->network;
	uint32_t face[2], faces = faces_of(network, site, face);
	for (uint32_t other = network->garment->vertex_count; other < node; other++) {
		uint32_t other_face[2], others = faces_of(network, network_site(network, other), other_face);
		for (uint32_t i = 0; i < faces * others; i++) {
			if (face[i / others] != other_face[i % others])
				continue;
			enum tw_status status = list_extra(lister, node, other, face[i / others], error);
			if (status != TW_OK)
				return status;
			break;
		}
	}
	return TW_OK;
}

static enum tw_status list_extras(struct lister *lister, struct tw_error *error)
{
	struct network *network = lister->network;
	network->extra_count = 0;
	for (uint32_t s = 0; s < network->sites->count; s++) {
		const struct site *site = &network->sites->site[s];
		lister->terminal[s] = site->vertex;
		if (site->kind == SITE_VERTEX)
			continue;
		uint32_t node = network->garment->vertex_count + network->extra_count;
		lister->extra_site[network->extra_count++] = s;
		lister->terminal[s] = node;
		enum tw_status status = join_corners(lister, node, site, error);
		if (status == TW_OK)
			status = join_extras(lister, node, site, error);
		if (status != TW_OK)
			return status;
	}
	return TW_OK;
}

enum { CORNER_EDGES = 4, PAIR_EDGES = 60 }; /* extra edges that a site may have, at most and on the mean */

/* Whether the listed edges join all terminals. */
static bool joins_terminals(const struct lister *lister, uint32_t *parent)
{
	const struct network *network = lister->network;
	uint32_t nodes = network->garment->vertex_count + network->extra_count;
	for (uint32_t n = 0; n < nodes; n++)
		parent[n] = n;
	for (size_t i = 0; i < lister->count; i++)
		parent[union_find(parent, lister->ends[2 * i])] = union_find(parent, lister->ends[2 * i + 1]);
	for (uint32_t s = 1; s < network->sites->count; s++)
		if (union_find(parent, lister->terminal[s]) != union_find(parent, lister->terminal[0]))
			return false;
	return true;
}

/* Avoids as much as leaves a way between the terminals; where nothing does, nothing is avoided, and the search says
 * which terminals are apart. */
static enum tw_status list_edges(struct lister *lister, struct arena *arena, struct tw_error *error)
{
	static const unsigned attempts[] = {AVOID_CORNERS | AVOID_KEEP_OUTS, AVOID_CORNERS, AVOID_KEEP_OUTS, 0};
	struct arena_mark mark = arena_mark(arena);
	size_t nodes = (size_t)lister->network->garment->vertex_count + lister->network->sites->count;
	uint32_t *parent = ARENA_ARRAY(arena, nodes, uint32_t);
	enum tw_status status = parent ? TW_OK : tw_fail_memory(error);
	bool joined = false;
	for (size_t i = 0; i < sizeof attempts / sizeof *attempts && status == TW_OK && !joined; i++) {
		lister->avoided = attempts[i];
		if (!lister->walkers->keep_out)
			lister->avoided &= ~(unsigned)AVOID_KEEP_OUTS;
		list_mesh_edges(lister);
		status = list_extras(lister, error);
		joined = status == TW_OK && joins_terminals(lister, parent);
	}
	arena_release(arena, mark);
	return status;
}

enum tw_status network_build(struct network *network, struct arena *arena, const struct layout_base *base,
			     const struct field *field, const struct site_set *sites,
			     const struct network_walkers *walkers, enum layout_baseline baseline,
			     struct tw_error *error)
{
	const struct garment *garment = &base->canonical.garment;
	const struct topology *topology = &base->canonical.topology;
	*network = (struct network){.garment = garment, .topology = topology, .sites = sites};
	uint32_t extra = sites->count * (CORNER_EDGES + PAIR_EDGES), edges = topology->edge_count + extra;
	struct lister lister = {.network = network, .base = base, .field = field, .walkers = walkers};
	lister.capacity = edges;
	lister.ends = ARENA_ARRAY(arena, 2 * (size_t)edges, uint32_t);
	lister.weight = ARENA_ARRAY(arena, edges, uint64_t);
	lister.baseline = ARENA_ARRAY(arena, edges, uint64_t);
	lister.mesh_edge = ARENA_ARRAY(arena, topology->edge_count, uint32_t);
	lister.extra_face = ARENA_ARRAY(arena, edges, uint32_t);
	lister.extra_site = ARENA_ARRAY(arena, sites->count, uint32_t);
	lister.terminal = ARENA_ARRAY(arena, sites->count, uint32_t);
	if (!lister.ends || !lister.weight || !lister.baseline || !lister.mesh_edge || !lister.extra_face ||
	    !lister.extra_site || !lister.terminal)
		return tw_fail_memory(error);
	network->extra_site = lister.extra_site;
	enum tw_status status = take_corners(network, base, arena, error);
	if (status == TW_OK)
		status = list_edges(&lister, arena, error);
	if (status != TW_OK)
		return status;
	network->baseline = baseline == BASELINE_NONE ? NULL : lister.baseline;
	network->baseline_scale = length_scale;
	if (baseline == BASELINE_UNIT)
		count_edges_first(&lister);
	status = break_ties(network, arena, &lister, error);
	if (status != TW_OK)
		return status;
	network->mesh_edge = lister.mesh_edge;
	network->extra_face = lister.extra_face;
	network->terminal = lister.terminal;
	return graph_build(&network->graph, arena, garment->vertex_count + network->extra_count, lister.count,
			   lister.ends, lister.weight, error);
}

enum tw_status network_grow(struct network *network, struct arena *arena, const struct network_growth *growth,
			    struct tw_error *error)
{
	const struct graph *old = &network->graph;
	const size_t own = old->edge_count, extra = own - network->mesh_edge_count, all = own + growth->edge_count;
	uint32_t *ends = ARENA_ARRAY(arena, 2 * all, uint32_t);
	uint64_t *weight = ARENA_ARRAY(arena, all, uint64_t);
	uint32_t *face = ARENA_ARRAY(arena, extra + growth->edge_count, uint32_t);
	if (!ends || !weight || !face)
		return tw_fail_memory(error);
	memcpy(ends, old->ends, 2 * own * sizeof *ends);
	memcpy(ends + 2 * own, growth->ends, 2 * (size_t)growth->edge_count * sizeof *ends);
	memcpy(weight, old->weight, own * sizeof *weight);
	memcpy(weight + own, growth->weight, growth->edge_count * sizeof *weight);
	memcpy(face, network->extra_face, extra * sizeof *face);
	memcpy(face + extra, growth->face, growth->edge_count * sizeof *face);
	network->extra_face = face;
	network->crossing = growth->site;
	network->crossing_count = growth->site_count;
	return graph_build(&network->graph, arena, old->vertex_count + growth->site_count, (uint32_t)all, ends, weight,
			   error);
}
