/* The flow dual's floats are the same bits on every machine and for every number of threads: its kernels for SSE2 or
 * NEON, for AVX2 and for AVX-512 (as far as this machine has them) are run side by side, from the factor on. */
#include "setting.h"
#include "solver/steiner/flow/state.h"

enum { SIDE = 40, TERMINALS_MOST = 57, MESHES = 4, ITERATIONS = 25, THREADS = 3 };

/* What iterations leave. */
struct bits {
	uint64_t z, price, potential, value;
};

static uint64_t hash(const void *data, size_t size)
{
	const unsigned char *bytes = data;
	uint64_t h = 0xcbf29ce484222325u;
	for (size_t i = 0; i < size; i++)
		h = (h ^ bytes[i]) * 0x100000001b3u;
	return h;
}

/* A search on a mesh that is large enough for parts and threads. */
static void open_mesh(struct setting *s, uint64_t seed)
{
	enum { ROOM = 3 * SIDE * SIDE };
	static uint32_t ends[2 * ROOM], terminal[TERMINALS_MOST];
	static uint64_t weight[ROOM];
	uint64_t numbers = seed;
	uint32_t apart[2];
	*s = (struct setting){.arena = arena_new(0)};
	assert_non_null(s->arena);
	const uint32_t count = mesh_edges(SIDE, 0, ends), terminals = 3 + (uint32_t)(seed * 18 % TERMINALS_MOST);
	for (uint32_t e = 0; e < count; e++)
		weight[e] = 1000 + random_below(&numbers, seed % 2 ? 9000 : 100);
	for (uint32_t i = 0; i < terminals; i++)
		terminal[i] = (uint32_t)(i * 83 + random_below(&numbers, 20)) % (SIDE * SIDE);
	assert_int_equal(graph_build(&s->graph, s->arena, SIDE * SIDE, count, ends, weight, NULL), TW_OK);
	s->search = (struct search){
		.graph = &s->graph,
		.terminals = terminal,
		.terminal_count = terminals,
		.options = &s->options,
		.stats = &s->stats,
		.arena = s->arena,
		.best_weight = UINT64_MAX,
		.best_edges = ARENA_ARRAY(s->arena, SIDE * SIDE, uint32_t),
		.best_fine = FINE_MAX,
		.assumed = FINE_MAX,
		.stage = "test",
	};
	assert_int_equal(
		instance_init(&s->search.instance, s->arena, &s->graph, terminal, terminals, NULL, true, apart), TW_OK);
	assert_int_equal(primal_first(&s->search), TW_OK);
}

/* The whole of a flow's life: factor, then iterations, in two goes. */
static struct bits run(enum isa isa, uint64_t seed, unsigned threads)
{
	struct setting s;
	struct dual dual;
	struct flow *flow;
	open_mesh(&s, seed);
	s.options.threads = threads;
	assert_int_equal(dual_ascend_best(&dual, &s.search, 1000), TW_OK);
	assert_int_equal(flow_new(&flow, &s.search, &dual), TW_OK);
	assert_true(flow->ldl.part_count > 4 && flow->ldl.place_count > flow->vertex_count);
	const struct instance *instance = &s.search.instance;
	const struct ldl_graph graph = {instance->vertex_count, instance->edge_count, instance->ends};
	double *weight = ARENA_ARRAY(s.arena, instance->edge_count, double);
	assert_non_null(weight);
	for (uint32_t e = 0; e < instance->edge_count; e++)
		weight[e] = flow->inverse[flow->slot[e]];
	flow->ldl.isa = isa;
	assert_int_equal(ldl_factorise(&flow->ldl, s.arena, &graph, weight, instance->terminal[dual.root], NULL, NULL),
			 TW_OK);
	assert_int_equal(flow_iterate(flow, &s.search, ITERATIONS), TW_OK);
	assert_int_equal(flow_iterate(flow, &s.search, ITERATIONS / 2), TW_OK);
	const size_t row = flow->stride * sizeof(float);
	const struct bits bits = {
		.z = hash(flow->z, flow->edge_count * row),
		.price = hash(flow->price, flow->edge_count * sizeof *flow->price),
		.potential = hash(flow->potential, flow->ldl.place_count * row),
		.value = hash(flow->ldl.value, flow->ldl.value_count * sizeof(float)),
	};
	arena_free(s.arena);
	return bits;
}

static void every_instruction_set_and_number_of_threads_gives_the_same_bits(void **state)
{
	(void)state;
	uint32_t compared = 0;
	for (uint64_t seed = 0; seed < MESHES; seed++) {
		const struct bits base = run(ISA_BASE, seed, 1);
		for (enum isa isa = ISA_BASE; isa < ISA_COUNT; isa++)
			for (unsigned threads = 1; threads <= THREADS && isa_is_there(isa); threads++) {
				const struct bits other = run(isa, seed, threads);
				if (memcmp(&base, &other, sizeof base) != 0)
					fail_msg("instruction set %u, %u threads, mesh %u: other bits", (unsigned)isa,
						 threads, (unsigned)seed);
				compared++;
			}
	}
	assert_true(compared >= THREADS * MESHES);
}

/* What a goes-on that stops leaves behind is a flow that can go on. */
static void iterations_in_several_goes_are_the_same_as_in_one(void **state)
{
	(void)state;
	struct bits all[2];
	for (unsigned goes = 0; goes < 2; goes++) {
		struct setting s;
		struct dual dual;
		struct flow *flow;
		open_mesh(&s, 3);
		assert_int_equal(dual_ascend_best(&dual, &s.search, 1000), TW_OK);
		assert_int_equal(flow_new(&flow, &s.search, &dual), TW_OK);
		for (uint32_t i = 0; i < (goes ? ITERATIONS : 1); i++)
			assert_int_equal(flow_iterate(flow, &s.search, goes ? 1 : ITERATIONS), TW_OK);
		all[goes] = (struct bits){
			.z = hash(flow->z, flow->edge_count * flow->stride * sizeof(float)),
			.price = hash(flow->price, flow->edge_count * sizeof *flow->price),
		};
		arena_free(s.arena);
	}
	assert_memory_equal(&all[0], &all[1], sizeof all[0]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_instruction_set_and_number_of_threads_gives_the_same_bits),
		cmocka_unit_test(iterations_in_several_goes_are_the_same_as_in_one),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
