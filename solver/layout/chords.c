#include "solver/layout/chords.h"

#include <assert.h>
#include <string.h>

/* What is listed behind the network's edges. */
struct list {
	uint32_t *ends, *tie, *across;
	uint64_t *weight;
	double *length_mm;
	uint32_t edges; /* of the network */
	uint32_t count; /* with the chords so far */
};

static bool is_reached(const struct network *network, uint32_t vertex)
{
	return network->graph.first[vertex] < network->graph.first[vertex + 1];
}

/* Where a vertex of a face lies in the face's pattern plane. */
static struct vec2 vertex_in_face(const struct garment *garment, uint32_t face, uint32_t vertex)
{
	const uint32_t *corner = &garment->face_vertex[3 * (size_t)face];
	uint32_t k = corner[0] == vertex ? 0 : corner[1] == vertex ? 1 : 2;
	assert(corner[k] == vertex);
	const double *uv = &garment->pattern[2 * (size_t)garment->face_coord[3 * (size_t)face + k]];
	return (struct vec2){uv[0], uv[1]};
}

/* Whether a chord comes too near to a corner of pieces that wires avoid, which has no edges then, at an end of the edge
 * that it crosses. */
static bool passes_corner(const struct network *network, const struct strip_chord *chord, uint32_t edge, double limit)
{
	const uint32_t *end = &network->topology->edge_vertex[2 * (size_t)edge];
	for (uint32_t i = 0; i < 4; i++) {
		uint32_t half = i / 2, corner = end[i % 2], face = chord->face[half];
		if (!network->corner[corner] || is_reached(network, corner))
			continue;
		struct vec2 from = vertex_in_face(network->garment, face, chord->vertex[half]);
		struct vec2 across = vec2_mix(vertex_in_face(network->garment, face, end[0]),
					      vertex_in_face(network->garment, face, end[1]), chord->along);
		struct vec2 at = vertex_in_face(network->garment, face, corner);
		if (vec2_distance(at, vec2_mix(from, across, vec2_nearest(from, across, at))) < limit)
			return true;
	}
	return false;
}

static void list_chords(struct list *list, const struct network *network, const struct layout_base *base,
			const struct field *field)
{
	double corner_mm = NETWORK_CORNER_WIDTHS * field->options.strip_width_mm;
	for (uint32_t c = 0; c < base->chord_count; c++) {
		const struct strip_chord *chord = &base->chord[c].chord;
		const uint32_t e = base->chord[c].edge;
		if (field->chord_weight[e] == FIELD_FORBIDDEN || !is_reached(network, chord->vertex[0]) ||
		    !is_reached(network, chord->vertex[1]) || passes_corner(network, chord, e, corner_mm))
			continue;
		uint32_t i = list->count++;
		memcpy(list->ends + 2 * (size_t)i, chord->vertex, sizeof chord->vertex);
		list->weight[i] = field->chord_weight[e];
		list->tie[i] = network_tie(network, chord->vertex[0], chord->vertex[1]);
		list->across[i - list->edges] = e;
		list->length_mm[i - list->edges] = chord->length_mm;
	}
}

enum tw_status chord_graph_build(struct chord_graph *chords, struct arena *arena, const struct network *network,
				 const struct layout_base *base, const struct field *field, struct tw_error *error)
{
	const uint32_t edges = network->graph.edge_count;
	const size_t most = (size_t)edges + field->edge_count;
	struct list list = {
		.ends = ARENA_ARRAY(arena, 2 * most, uint32_t),
		.tie = ARENA_ARRAY(arena, most, uint32_t),
		.across = ARENA_ARRAY(arena, field->edge_count, uint32_t),
		.weight = ARENA_ARRAY(arena, most, uint64_t),
		.length_mm = ARENA_ARRAY(arena, field->edge_count, double),
		.edges = edges,
		.count = edges,
	};
	if (!list.ends || !list.tie || !list.across || !list.weight || !list.length_mm)
		return tw_fail_memory(error);
	memcpy(list.ends, network->graph.ends, 2 * (size_t)edges * sizeof *list.ends);
	memcpy(list.weight, network->graph.weight, edges * sizeof *list.weight);
	memcpy(list.tie, network->tie, edges * sizeof *list.tie);
	list_chords(&list, network, base, field);
	*chords = (struct chord_graph){
		.tie = list.tie, .across = list.across, .length_mm = list.length_mm, .chord_count = list.count - edges};
	return graph_build(&chords->graph, arena, network->graph.vertex_count, list.count, list.ends, list.weight,
			   error);
}

/* The chord that an edge of the tree is; false for an edge of the network. */
static bool chord_at(const struct chord_graph *chords, uint32_t edge, const struct strip_fabric *fabric,
		     struct strip_chord *chord, uint32_t *across)
{
	const uint32_t edges = chords->graph.edge_count - chords->chord_count;
	if (edge < edges)
		return false;
	*across = chords->across[edge - edges];
	const bool found = strip_find_chord(fabric, *across, chord);
	assert(found);
	return found;
}

static struct site crossing_at(const struct network *network, const struct strip_chord *chord, uint32_t edge)
{
	const struct topology *topology = network->topology;
	struct site site = {.kind = SITE_EDGE, .edge = edge, .along = chord->along, .terminal = GARMENT_NONE};
	uint32_t face = topology->edge_face[2 * (size_t)edge];
	uint32_t from = topology->edge_side[2 * (size_t)edge], to = from == 2 ? 0 : from + 1;
	bool forward =
		topology->edge_vertex[2 * (size_t)edge] == network->garment->face_vertex[3 * (size_t)face + from];
	site.place.face = face;
	site.place.barycentric[from] = forward ? 1 - site.along : site.along;
	site.place.barycentric[to] = forward ? site.along : 1 - site.along;
	return site;
}

/* A chord becomes two edges in a face each, which share its weight. */
static void cut_one(struct network_growth *growth, const struct network *network, const struct strip_chord *chord,
		    uint32_t across, uint64_t weight)
{
	const uint32_t node = network->graph.vertex_count + growth->site_count;
	growth->site[growth->site_count++] = crossing_at(network, chord, across);
	for (uint32_t half = 0; half < 2; half++) {
		uint32_t i = growth->edge_count++;
		growth->ends[2 * (size_t)i] = chord->vertex[half];
		growth->ends[2 * (size_t)i + 1] = node;
		growth->face[i] = chord->face[half];
		growth->weight[i] = half ? weight - weight / 2 : weight / 2;
	}
}

enum tw_status chord_graph_cut(const struct chord_graph *chords, struct arena *arena, struct network *network,
			       struct steiner_tree *tree, const struct strip_fabric *fabric, struct tw_error *error)
{
	const size_t most = tree->edge_count;
	uint32_t *edges = ARENA_ARRAY(arena, 2 * most, uint32_t), count = 0;
	struct network_growth growth = {
		.site = ARENA_ARRAY(arena, most, struct site),
		.ends = ARENA_ARRAY(arena, 4 * most, uint32_t),
		.weight = ARENA_ARRAY(arena, 2 * most, uint64_t),
		.face = ARENA_ARRAY(arena, 2 * most, uint32_t),
	};
	if (!edges || !growth.site || !growth.ends || !growth.weight || !growth.face)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i < tree->edge_count; i++) {
		struct strip_chord chord;
		uint32_t across = 0, e = tree->edges[i];
		if (!chord_at(chords, e, fabric, &chord, &across)) {
			edges[count++] = e;
			continue;
		}
		edges[count++] = network->graph.edge_count + growth.edge_count;
		edges[count++] = network->graph.edge_count + growth.edge_count + 1;
		cut_one(&growth, network, &chord, across, chords->graph.weight[e]);
	}
	tree->edges = edges;
	tree->edge_count = count;
	return growth.site_count ? network_grow(network, arena, &growth, error) : TW_OK;
}
