/* Searches from a warm state: terminals move, come and go, on vertices and inside faces, and every answer is the one
 * from scratch, edge by edge. MOVES=n in the environment for more of them. */
#include "solver/steiner/warm/warm.h"
#include "oracle.h"
#include "solver/splitmix.h"
#include "tests/bench/suit.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

enum { MOVES = 300, TERMINALS_MOST = 24, CORNERS = 3 };

/* A terminal on a vertex, or joined to the corners of a face by edges of its own: then it is a vertex, whose number
 * differs from request to request. */
struct place {
	uint32_t vertex; /* the first corner */
	bool is_inside;
	uint32_t corner[CORNERS];
	uint64_t weight[CORNERS];
	uint64_t name;
};

struct world {
	struct arena *arena;
	uint64_t numbers; /* of the random generator */
	uint32_t vertex_count, edge_count;
	uint32_t *ends;
	uint64_t *weight;
	struct graph graph; /* of the lasting vertices, to find neighbours in */
	struct place place[TERMINALS_MOST];
	uint32_t place_count;
	struct steiner_warm *warm;
	uint32_t asked, answered; /* searches, and those from the warm state */
};

struct request {
	struct graph graph;
	uint32_t terminal[TERMINALS_MOST];
	uint64_t name[TERMINALS_MOST];
	uint32_t *tie;
	struct steiner_options options;
};

/* --- worlds ----------------------------------------------------------------------------------------------------- */

static void open_world(struct world *world, uint64_t seed)
{
	*world = (struct world){.arena = arena_new(0), .numbers = seed, .warm = steiner_warm_new(0)};
	assert_non_null(world->arena);
	assert_non_null(world->warm);
}

static void close_world(struct world *world)
{
	steiner_warm_free(world->warm);
	arena_free(world->arena);
}

static void allocate(struct world *world, uint32_t vertices, uint32_t edges_most)
{
	world->vertex_count = vertices;
	world->ends = ARENA_ARRAY(world->arena, 2 * (size_t)edges_most, uint32_t);
	world->weight = ARENA_ARRAY(world->arena, edges_most, uint64_t);
	assert_true(world->ends && world->weight);
}

static void build(struct world *world)
{
	struct tw_error error = {0};
	if (graph_build(&world->graph, world->arena, world->vertex_count, world->edge_count, world->ends, world->weight,
			&error) != TW_OK)
		fail_msg("%s", error.text);
}

/* Triangles, and the other diagonals of some: they cross. */
static void make_mesh(struct world *world, uint32_t side, bool has_chords)
{
	allocate(world, side * side, 4 * side * side);
	world->edge_count = mesh_edges(side, 0, world->ends);
	for (uint32_t y = 0; has_chords && y + 1 < side; y++)
		for (uint32_t x = 0; x + 1 < side; x++) {
			world->ends[2 * world->edge_count] = y * side + x + 1;
			world->ends[2 * world->edge_count + 1] = (y + 1) * side + x;
			world->edge_count++;
		}
	for (uint32_t e = 0; e < world->edge_count; e++)
		world->weight[e] = 10000 + random_below(&world->numbers, 9000);
	build(world);
}

/* Of any graph of the other tests; huge weights leave room for the terminals' own edges. */
static void make_case(struct world *world, const struct instance_case *c)
{
	allocate(world, c->vertex_count, c->edge_count);
	world->edge_count = c->edge_count;
	memcpy(world->ends, c->ends, 2 * sizeof *c->ends * c->edge_count);
	for (uint32_t e = 0; e < c->edge_count; e++)
		world->weight[e] = c->weight[e] >> (c->weight[e] >> 32 ? 6 : 0);
	build(world);
}

/* The sample suit, with weights of its motions; chords join the vertices opposite to an edge. */
static void make_suit(struct world *world, bool has_chords)
{
	struct suit suit;
	suit_make(&suit, world->arena, 3000, 0, "joints10");
	const struct topology *topology = &suit.topology;
	allocate(world, suit.garment.vertex_count, 2 * topology->edge_count);
	for (uint32_t e = 0; e < topology->edge_count; e++) {
		memcpy(world->ends + 2 * (size_t)e, topology->edge_vertex + 2 * (size_t)e, 2 * sizeof *world->ends);
		world->weight[e] = suit.field.weight[e];
	}
	world->edge_count = topology->edge_count;
	for (uint32_t e = 0; has_chords && e < topology->edge_count; e++) {
		const uint32_t *face = topology->edge_face + 2 * (size_t)e;
		const uint8_t *side = topology->edge_side + 2 * (size_t)e;
		if (face[1] == GARMENT_NONE)
			continue;
		const uint32_t i = world->edge_count++;
		for (uint32_t k = 0; k < 2; k++)
			world->ends[2 * (size_t)i + k] =
				suit.garment.face_vertex[3 * (size_t)face[k] + (side[k] + 2u) % 3];
		world->weight[i] = suit.field.weight[e] + suit.field.weight[e] / 2;
	}
	build(world);
}

/* --- terminals -------------------------------------------------------------------------------------------------- */

static uint32_t neighbour(struct world *world, uint32_t v)
{
	const uint32_t first = world->graph.first[v], end = world->graph.first[v + 1];
	return end > first ? world->graph.head[first + random_below(&world->numbers, end - first)] : v;
}

static struct place place_at(struct world *world, uint32_t vertex)
{
	struct place place = {.vertex = vertex, .is_inside = random_below(&world->numbers, 2)};
	place.name = random_next(&world->numbers);
	place.corner[0] = vertex;
	for (uint32_t i = 1; i < CORNERS; i++)
		place.corner[i] = neighbour(world, place.corner[i - 1]);
	for (uint32_t i = 0; i < CORNERS; i++)
		place.weight[i] = world->weight[random_below(&world->numbers, world->edge_count)] / 2;
	return place;
}

static void change_terminals(struct world *world)
{
	const uint32_t what = random_below(&world->numbers, 8), count = world->place_count;
	const uint32_t i = random_below(&world->numbers, count);
	if (what == 0 && count < TERMINALS_MOST) {
		world->place[world->place_count++] =
			place_at(world, random_below(&world->numbers, world->vertex_count));
	} else if (what == 1 && count > 2) {
		world->place[i] = world->place[--world->place_count];
	} else {
		uint32_t v = world->place[i].vertex;
		for (uint32_t hops = random_below(&world->numbers, 6); hops > 0; hops--)
			v = neighbour(world, v);
		world->place[i] = place_at(world, v);
	}
}

static void shuffle_terminals(struct world *world)
{
	for (uint32_t i = world->place_count; i > 1; i--) {
		const uint32_t other = random_below(&world->numbers, i);
		const struct place place = world->place[i - 1];
		world->place[i - 1] = world->place[other];
		world->place[other] = place;
	}
}

/* --- searches --------------------------------------------------------------------------------------------------- */

static void make_request(const struct world *world, struct request *request, struct arena *arena)
{
	const size_t most = (size_t)world->edge_count + CORNERS * world->place_count;
	uint32_t *ends = ARENA_ARRAY(arena, 2 * most, uint32_t), extras = 0, count = world->edge_count;
	uint64_t *weight = ARENA_ARRAY(arena, most, uint64_t);
	struct tw_error error = {0};
	assert_true(ends && weight);
	memcpy(ends, world->ends, 2 * sizeof *ends * count);
	memcpy(weight, world->weight, sizeof *weight * count);
	for (uint32_t i = 0; i < world->place_count; i++) {
		const struct place *place = &world->place[i];
		request->terminal[i] = place->is_inside ? world->vertex_count + extras : place->vertex;
		for (uint32_t k = 0; place->is_inside && k < CORNERS; k++) {
			ends[2 * (size_t)count] = place->corner[k];
			ends[2 * (size_t)count + 1] = request->terminal[i];
			weight[count++] = place->weight[k];
		}
		if (place->is_inside)
			request->name[extras++] = place->name;
	}
	if (graph_build(&request->graph, arena, world->vertex_count + extras, count, ends, weight, &error) != TW_OK)
		fail_msg("%s", error.text);
	request->tie = ARENA_ARRAY(arena, count, uint32_t);
	assert_non_null(request->tie);
	for (uint32_t e = 0; e < count; e++)
		request->tie[e] = (uint32_t)(splitmix(e * SPLITMIX_STEP) >> 32);
	request->options = (struct steiner_options){
		.ties = request->tie,
		.lasting_count = world->vertex_count,
		.vertex_name = request->name,
	};
}

static struct steiner_tree solve(const struct world *world, const struct request *request,
				 const struct steiner_options *options, struct arena *arena)
{
	struct steiner_tree tree;
	struct tw_error error = {0};
	if (steiner_solve(&request->graph, request->terminal, world->place_count, options, arena, &tree, &error) !=
	    TW_OK)
		fail_msg("%s", error.text);
	return tree;
}

static void expect_equal(const struct steiner_tree *warm, const struct steiner_tree *scratch)
{
	assert_int_equal(warm->outcome, scratch->outcome);
	assert_int_equal(warm->is_unique, scratch->is_unique);
	assert_int_equal(warm->weight, scratch->weight);
	assert_int_equal(warm->lower_bound, scratch->lower_bound);
	assert_int_equal(warm->edge_count, scratch->edge_count);
	assert_int_equal(warm->is_reproducible, scratch->is_reproducible);
	if (warm->edge_count)
		assert_memory_equal(warm->edges, scratch->edges, warm->edge_count * sizeof *warm->edges);
}

static void search(struct world *world, unsigned threads)
{
	const struct arena_mark mark = arena_mark(world->arena);
	struct request request;
	make_request(world, &request, world->arena);
	struct steiner_options options = request.options;
	options.threads = threads;
	options.warm = world->warm;
	const struct steiner_tree warm = solve(world, &request, &options, world->arena);
	const struct steiner_tree scratch = solve(world, &request, &request.options, world->arena);
	assert_false(scratch.stats.is_from_warm);
	expect_equal(&warm, &scratch);
	world->asked++;
	world->answered += warm.stats.is_from_warm;
	if (steiner_warm_is_due(world->warm) && warm.is_unique && random_below(&world->numbers, 4))
		assert_int_equal(steiner_warm_prepare(world->warm, &request.graph, request.terminal, world->place_count,
						      &options, &warm),
				 TW_OK);
	arena_release(world->arena, mark);
}

static void drag(struct world *world, uint32_t terminals, uint32_t moves, unsigned threads)
{
	for (world->place_count = 0; world->place_count < terminals; world->place_count++)
		world->place[world->place_count] = place_at(world, random_below(&world->numbers, world->vertex_count));
	for (uint32_t i = 0; i < moves; i++) {
		search(world, threads);
		change_terminals(world);
		if (!random_below(&world->numbers, 8))
			shuffle_terminals(world);
	}
}

static uint32_t moves_of(uint32_t share_percent)
{
	const char *moves = getenv("MOVES");
	return (moves ? (uint32_t)strtoul(moves, NULL, 10) : MOVES) * share_percent / 100;
}

/* --- claims ----------------------------------------------------------------------------------------------------- */

static void drag_on_mesh(uint64_t seed, bool has_chords, unsigned threads)
{
	struct world world;
	open_world(&world, seed);
	make_mesh(&world, 40, has_chords);
	drag(&world, 12, moves_of(20), threads);
	print_message("mesh: %u of %u from the warm state\n", world.answered, world.asked);
	assert_true(world.answered * 2 > world.asked);
	close_world(&world);
}

static void a_terminal_that_moves_on_a_mesh_has_the_tree_from_scratch(void **state)
{
	(void)state;
	drag_on_mesh(1, false, 1);
}

static void and_so_with_chords_and_two_threads(void **state)
{
	(void)state;
	drag_on_mesh(2, true, 2);
}

static void drag_on_suit(uint64_t seed, bool has_chords)
{
	struct world world;
	open_world(&world, seed);
	make_suit(&world, has_chords);
	drag(&world, 10, moves_of(15), 1);
	print_message("suit: %u of %u from the warm state\n", world.answered, world.asked);
	assert_true(world.answered * 2 > world.asked);
	close_world(&world);
}

static void a_terminal_that_moves_on_the_sample_suit_has_the_tree_from_scratch(void **state)
{
	(void)state;
	drag_on_suit(3, false);
	drag_on_suit(4, true);
}

/* Ties, zeros, huge weights, dense graphs, graphs in parts. */
static void on_any_small_graph_the_tree_is_that_from_scratch(void **state)
{
	(void)state;
	uint32_t answered = 0;
	const uint32_t cases = moves_of(100);
	for (uint32_t i = 0; i < cases; i++) {
		struct world world;
		struct instance_case c;
		uint64_t numbers = 9000 + i;
		if (i % 3)
			case_random(&c, 8, &numbers);
		else
			case_mesh(&c, &numbers);
		if (!c.edge_count)
			continue;
		open_world(&world, 77 + i);
		make_case(&world, &c);
		drag(&world, 4, 8, 1 + i % 2);
		answered += world.answered;
		close_world(&world);
	}
	print_message("small graphs: %u of %u from the warm state\n", answered, 8 * cases);
	assert_true(answered > cases);
}

/* What the state claims is checked: edges get lighter and heavier behind its back, come and go. */
static void a_state_of_other_costs_misleads_nobody(void **state)
{
	(void)state;
	struct world world;
	open_world(&world, 5);
	make_mesh(&world, 24, true);
	drag(&world, 8, 2, 1);
	for (uint32_t i = 0; i < moves_of(15); i++) {
		const uint32_t edge = random_below(&world.numbers, world.edge_count);
		const uint32_t what = random_below(&world.numbers, 4), last = world.edge_count - 1;
		if (what == 0)
			world.weight[edge] /= 2;
		else if (what == 1)
			world.weight[edge] *= 2;
		else if (what == 2 && world.edge_count > 2 * world.vertex_count) {
			memcpy(world.ends + 2 * (size_t)edge, world.ends + 2 * (size_t)last, 2 * sizeof *world.ends);
			world.weight[edge] = world.weight[last];
			world.edge_count--;
		}
		search(&world, 1);
		change_terminals(&world);
	}
	close_world(&world);
}

static void add_edge(struct world *world, uint32_t u, uint32_t v, uint64_t weight)
{
	world->ends[2 * (size_t)world->edge_count] = u;
	world->ends[2 * (size_t)world->edge_count + 1] = v;
	world->weight[world->edge_count++] = weight;
}

/* A ring of edges without weight but one, and a vertex beside vertex 0, whose edge is the one numbered `at`. */
enum { RING = 13 };
static void make_ring(struct world *world, uint32_t at)
{
	allocate(world, RING + 1, RING + 1);
	for (uint32_t v = 0; v < RING; v++) {
		if (v == at)
			add_edge(world, 0, RING, 0);
		add_edge(world, v, (v + 1) % RING, v + 1 == RING);
	}
	build(world);
}

/* Where trees weighed no more than a tie-break, the coarse costs of the state cannot tell how much heavier others are:
 * the way round the ring weighs nothing, but its tie-breaks are many times those of the tree before, and the short way
 * weighs a unit. */
static void nor_does_one_of_trees_that_weighed_next_to_nothing(void **state)
{
	(void)state;
	for (uint32_t i = 0; i < 2 * RING; i++) {
		struct world world;
		struct request request;
		open_world(&world, 12);
		make_ring(&world, i / 2);
		world.place[i % 2] = (struct place){.vertex = 0};
		world.place[1 - i % 2] = (struct place){.vertex = RING};
		world.place_count = 2;
		make_request(&world, &request, world.arena);
		const struct steiner_tree tree = solve(&world, &request, &request.options, world.arena);
		assert_int_equal(steiner_warm_prepare(world.warm, &request.graph, request.terminal, world.place_count,
						      &request.options, &tree),
				 TW_OK);
		world.place[1 - i % 2].vertex = RING - 1;
		search(&world, 1);
		close_world(&world);
	}
}

static void two_vertices_of_one_name_are_no_help_and_no_harm(void **state)
{
	(void)state;
	struct world world;
	open_world(&world, 6);
	make_mesh(&world, 20, false);
	drag(&world, 8, 4, 1);
	for (uint32_t i = 0; i < world.place_count; i++) {
		world.place[i].is_inside = true;
		world.place[i].name = 7;
	}
	const uint32_t before = world.answered;
	search(&world, 1);
	assert_int_equal(world.answered, before);
	close_world(&world);
}

/* Prepares the state where `gone` has the name of the place i, then searches without it. */
static void mistake(struct world *world, uint32_t i, uint32_t gone)
{
	const struct arena_mark mark = arena_mark(world->arena);
	const struct place place = world->place[gone];
	struct request request;
	world->place[gone].name = world->place[i].name;
	make_request(world, &request, world->arena);
	const struct steiner_tree tree = solve(world, &request, &request.options, world->arena);
	assert_int_equal(steiner_warm_prepare(world->warm, &request.graph, request.terminal, world->place_count,
					      &request.options, &tree),
			 TW_OK);
	world->place[gone] = world->place[--world->place_count];
	search(world, 1);
	world->place[world->place_count++] = world->place[gone];
	world->place[gone] = place;
	arena_release(world->arena, mark);
}

/* One of them may even be the root of the state's dual, and then the name is that of another terminal, too. */
static void nor_are_they_when_one_of_them_is_gone(void **state)
{
	(void)state;
	for (uint32_t seed = 0; seed < 40; seed++) {
		struct world world;
		open_world(&world, 100 + seed);
		make_mesh(&world, 10, true);
		drag(&world, 5, 0, 1);
		for (uint32_t i = 0; i < world.place_count; i++) {
			world.place[i].is_inside = true;
			world.place[i].name = 1 + i;
		}
		for (uint32_t i = 0; i < world.place_count; i++)
			for (uint32_t gone = i + 1; gone < world.place_count; gone++)
				mistake(&world, i, gone);
		close_world(&world);
	}
}

static bool says_stop(void *context)
{
	return --*(int *)context < 0;
}

/* Nor does it begin to look for one, since it would not know better the next time. */
static void a_state_larger_than_its_budget_is_not_kept(void **state)
{
	(void)state;
	struct world world;
	struct request request;
	int polls = 0;
	open_world(&world, 8);
	make_mesh(&world, 40, false);
	drag(&world, 12, 0, 1);
	make_request(&world, &request, world.arena);
	const struct steiner_tree tree = solve(&world, &request, &request.options, world.arena);
	struct steiner_warm *small = steiner_warm_new(10000);
	assert_non_null(small);
	request.options.cancelled = says_stop;
	request.options.context = &polls;
	assert_int_equal(steiner_warm_prepare(small, &request.graph, request.terminal, world.place_count,
					      &request.options, &tree),
			 TW_ERROR_MEMORY);
	assert_true(steiner_warm_bytes(small) <= 10000);
	steiner_warm_free(small);
	close_world(&world);
}

/* Lanes fit, the flow beside them does not. */
static void a_state_without_room_for_its_flow_serves_too(void **state)
{
	(void)state;
	struct world world;
	open_world(&world, 10);
	steiner_warm_free(world.warm);
	world.warm = steiner_warm_new(150000);
	assert_non_null(world.warm);
	make_mesh(&world, 40, false);
	drag(&world, 12, 20, 1);
	assert_true(steiner_warm_bytes(world.warm) <= 150000);
	assert_true(steiner_warm_is_ready(world.warm));
	assert_true(world.answered * 2 > world.asked);
	close_world(&world);
}

static void a_preparation_that_is_stopped_leaves_the_state_as_it_was(void **state)
{
	(void)state;
	struct world world;
	struct request request;
	int polls = 1;
	open_world(&world, 9);
	make_mesh(&world, 60, false);
	drag(&world, 12, 3, 1);
	make_request(&world, &request, world.arena);
	const struct steiner_tree tree = solve(&world, &request, &request.options, world.arena);
	const size_t bytes = steiner_warm_bytes(world.warm);
	struct steiner_options options = request.options;
	options.cancelled = says_stop;
	options.context = &polls;
	assert_int_equal(
		steiner_warm_prepare(world.warm, &request.graph, request.terminal, world.place_count, &options, &tree),
		TW_ERROR_CANCELLED);
	assert_int_equal(steiner_warm_bytes(world.warm), bytes);
	search(&world, 1);
	close_world(&world);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_terminal_that_moves_on_a_mesh_has_the_tree_from_scratch),
		cmocka_unit_test(and_so_with_chords_and_two_threads),
		cmocka_unit_test(a_terminal_that_moves_on_the_sample_suit_has_the_tree_from_scratch),
		cmocka_unit_test(on_any_small_graph_the_tree_is_that_from_scratch),
		cmocka_unit_test(a_state_of_other_costs_misleads_nobody),
		cmocka_unit_test(nor_does_one_of_trees_that_weighed_next_to_nothing),
		cmocka_unit_test(two_vertices_of_one_name_are_no_help_and_no_harm),
		cmocka_unit_test(nor_are_they_when_one_of_them_is_gone),
		cmocka_unit_test(a_state_larger_than_its_budget_is_not_kept),
		cmocka_unit_test(a_state_without_room_for_its_flow_serves_too),
		cmocka_unit_test(a_preparation_that_is_stopped_leaves_the_state_as_it_was),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
