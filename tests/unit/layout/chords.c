/* Trees that leave the mesh's edges: the graph with chords, and what becomes of a tree's chords. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "solver/layout/pricing.h"
#include "solver/layout/rules.h"
#include "tests/unit/layout/sheet.h"

/* A sheet with a network between `terminals`, which are vertices of the ground. */
struct scene {
	struct bench bench;
	struct ground ground;
	struct layout_input asked;
	struct site_set sites;
	struct pricing pricing;
};

static void scene_open(struct scene *scene, uint32_t seam)
{
	struct bench *bench = &scene->bench;
	const char *json = "{\"terminals\":[{\"vertex\":0}]}";
	set_up(bench, seam, 0.2);
	assert_int_equal(layout_request_parse(&bench->request, json, strlen(json), NULL), TW_OK);
	scene->asked = (struct layout_input){.garment = &bench->garment,
					     .topology = &bench->topology,
					     .field = &bench->field,
					     .request = &bench->request};
	assert_int_equal(ground_build(&scene->ground, bench->arena, &scene->asked, NULL), TW_OK);
}

static void scene_terminals(struct scene *scene, const uint32_t *vertex, uint32_t count)
{
	const struct garment *garment = scene->ground.input.garment;
	scene->sites = (struct site_set){.site = ARENA_ZEROED(scene->bench.arena, count, struct site), .count = count};
	for (uint32_t s = 0; s < count; s++) {
		struct site *site = &scene->sites.site[s];
		*site = (struct site){.kind = SITE_VERTEX, .vertex = vertex[s], .terminal = s};
		for (size_t c = 3 * (size_t)garment->face_count; c-- > 0;)
			if (garment->face_vertex[c] == vertex[s])
				site->place = (struct place){.face = (uint32_t)(c / 3),
							     .barycentric = {c % 3 == 0, c % 3 == 1, c % 3 == 2}};
	}
	assert_int_equal(pricing_build(&scene->pricing, scene->bench.arena, &scene->ground, &scene->sites, NAN, NULL),
			 TW_OK);
	assert_true(scene->pricing.has_chords);
}

/* The edge of the search's graph that is the chord across a mesh edge. */
static uint32_t chord_across(const struct pricing *pricing, uint32_t edge)
{
	const uint32_t edges = pricing->network.graph.edge_count;
	for (uint32_t i = 0; i < pricing->chords.chord_count; i++)
		if (pricing->chords.across[i] == edge)
			return edges + i;
	fail_msg("no chord across edge %u", edge);
	return 0;
}

/* Cuts the tree, and counts what crosses. */
static uint32_t crossings(struct scene *scene, const uint32_t *edges, uint32_t count, struct vec2 *at)
{
	struct pricing *pricing = &scene->pricing;
	struct arena *arena = scene->bench.arena;
	struct steiner_tree tree = {.edges = ARENA_ARRAY(arena, count, uint32_t), .edge_count = count};
	struct branch_set branches;
	struct violation_list list = {0};
	memcpy(tree.edges, edges, count * sizeof *edges);
	assert_int_equal(chord_graph_cut(&pricing->chords, arena, &pricing->network, &tree, &pricing->fabric, NULL),
			 TW_OK);
	assert_int_equal(branches_cut(&branches, arena, &pricing->network, tree.edges, tree.edge_count, 30, NULL),
			 TW_OK);
	assert_int_equal(rules_check_tree(&list, arena, &pricing->network, &branches, NULL), TW_OK);
	for (uint32_t i = 0; i < list.count; i++) {
		assert_int_equal(list.violation[i].rule, RULE_TREE_CROSSING);
		assert_int_not_equal(list.violation[i].branch, list.violation[i].other);
		*at = list.violation[i].at;
	}
	return list.count;
}

/* The fabric of a ground, before there is a network. */
static struct strip_fabric fabric_of(const struct scene *scene)
{
	struct strip_fabric fabric;
	double *value = ARENA_ZEROED(scene->bench.arena, scene->bench.garment.face_count, double);
	assert_int_equal(strip_fabric_build(&fabric, scene->bench.arena, scene->ground.input.garment,
					    scene->ground.input.topology, value, NULL),
			 TW_OK);
	return fabric;
}

static void a_cut_chord_is_two_edges_in_a_face_each(void **state)
{
	(void)state;
	for (uint32_t seam = 0; seam <= 20; seam += 20) {
		uint32_t cut = 0, over_seam = 0;
		for (uint32_t e = 5; cut < 40; e += 53) {
			struct scene scene;
			struct strip_chord chord;
			scene_open(&scene, seam);
			const struct topology *topology = scene.ground.input.topology;
			const struct strip_fabric fabric = fabric_of(&scene);
			if (!strip_find_chord(&fabric, e % topology->edge_count, &chord)) {
				tear_down(&scene.bench);
				continue;
			}
			scene_terminals(&scene, chord.vertex, 2);
			struct pricing *pricing = &scene.pricing;
			uint32_t edge = chord_across(pricing, e % topology->edge_count);
			uint64_t weight = pricing->chords.graph.weight[edge];
			struct steiner_tree tree = {.edges = &edge, .edge_count = 1};
			assert_int_equal(chord_graph_cut(&pricing->chords, scene.bench.arena, &pricing->network, &tree,
							 &pricing->fabric, NULL),
					 TW_OK);
			assert_int_equal(tree.edge_count, 2);
			const struct graph *graph = &pricing->network.graph;
			double length = 0;
			for (uint32_t i = 0; i < 2; i++) {
				struct laid_edge laid[2];
				assert_int_equal(graph->ends[2 * (size_t)tree.edges[i]], chord.vertex[i]);
				assert_int_equal(network_lay(&pricing->network, tree.edges[i], chord.vertex[i], laid),
						 1);
				assert_int_equal(laid[0].face, chord.face[i]);
				length += vec2_distance(laid[0].from, laid[0].to);
			}
			assert_true(graph->weight[tree.edges[0]] + graph->weight[tree.edges[1]] == weight);
			/* The sheet is flat, so that also across the seam the halves are a straight line. */
			assert_near(length, chord.length_mm, 1e-9);
			over_seam += topology->edge_kind[e % topology->edge_count] == EDGE_SEAM;
			cut++;
			tear_down(&scene.bench);
		}
		assert_int_equal(over_seam > 0, seam > 0);
	}
}

/* Two chords out of one face, each from a corner over the opposite side; a chord and the edge under it. */
static void edges_of_a_tree_that_cross_are_named(void **state)
{
	(void)state;
	uint32_t pairs = 0, unders = 0;
	for (uint32_t face = 0; face < 600; face += 7) {
		struct scene scene;
		struct strip_chord chord[2];
		scene_open(&scene, 0);
		const struct topology *topology = scene.ground.input.topology;
		const struct garment *garment = scene.ground.input.garment;
		const uint32_t *edge = topology->face_edge + 3 * (size_t)face;
		const struct strip_fabric fabric = fabric_of(&scene);
		if (!strip_find_chord(&fabric, edge[0], &chord[0]) || !strip_find_chord(&fabric, edge[1], &chord[1])) {
			tear_down(&scene.bench);
			continue;
		}
		struct vec2 at = {0, 0};
		const uint32_t ends[4] = {chord[0].vertex[0], chord[0].vertex[1], chord[1].vertex[0],
					  chord[1].vertex[1]};
		scene_terminals(&scene, ends, 4);
		const uint32_t both[2] = {chord_across(&scene.pricing, edge[0]), chord_across(&scene.pricing, edge[1])};
		assert_int_equal(crossings(&scene, both, 2, &at), 1);
		/* Within the face. */
		for (size_t k = 0; k < 3; k++) {
			const uint32_t *coord = garment->face_coord + 3 * (size_t)face;
			const double *u = garment->pattern + 2 * (size_t)coord[k];
			const double *v = garment->pattern + 2 * (size_t)coord[(k + 1) % 3];
			assert_true((v[0] - u[0]) * (at.y - u[1]) - (v[1] - u[1]) * (at.x - u[0]) > 0);
		}
		pairs++;

		const uint32_t *end = topology->edge_vertex + 2 * (size_t)edge[0];
		const uint32_t four[4] = {chord[0].vertex[0], chord[0].vertex[1], end[0], end[1]};
		scene_terminals(&scene, four, 4);
		uint32_t under[2] = {chord_across(&scene.pricing, edge[0]), 0};
		while (scene.pricing.network.mesh_edge[under[1]] != edge[0])
			under[1]++;
		assert_int_equal(crossings(&scene, under, 2, &at), 1);
		unders++;
		scene_terminals(&scene, four, 4);
		assert_int_equal(crossings(&scene, under, 1, &at), 0);
		tear_down(&scene.bench);
	}
	assert_true(pairs > 20 && unders > 20);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_cut_chord_is_two_edges_in_a_face_each),
		cmocka_unit_test(edges_of_a_tree_that_cross_are_named),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
