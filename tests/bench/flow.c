/* The flow dual by itself: milliseconds to set it up, and of an iteration with each instruction set on one thread and
 * on two. Without arguments on the sample suit; else `flow FILE.gr…`. */
#include "solver/graph/steiner_file.h"
#include "solver/steiner/flow/state.h"
#include "solver/steiner/primal/primal.h"
#include "solver/steiner/reduce/reduce.h"

#include "tests/bench/bench.h"
#include "tests/bench/suit.h"

#include <math.h>
#include <string.h>

static const char *const isa_name[ISA_COUNT] = {"base", "avx2", "avx512"};
enum { VERTICES = 23500, ROUNDS = 4, ITERATIONS = 10, ASCENT_WORK = 1500000 };

static void expect(enum tw_status status)
{
	if (status == TW_OK)
		return;
	fprintf(stderr, "flow: status %d\n", (int)status);
	exit(1);
}

/* The least of some rounds. */
static double iteration_ms(struct flow *flow, struct search *search, struct steiner_options *options, unsigned threads)
{
	double least_s = INFINITY;
	options->threads = threads;
	for (int round = 0; round < ROUNDS; round++) {
		const double start_s = bench_wall_seconds();
		expect(flow_iterate(flow, search, ITERATIONS));
		least_s = fmin(least_s, bench_wall_seconds() - start_s);
	}
	return least_s / ITERATIONS * 1e3;
}

static void measure(const char *name, const struct graph *graph, const uint32_t *terminals, uint32_t terminal_count,
		    double goal_ms, double goal_two_ms)
{
	struct steiner_options options = {0};
	struct steiner_stats stats = {0};
	struct arena *arena = arena_new(0);
	struct dual dual;
	struct flow *flow;
	uint32_t apart[2];
	char line[80];
	struct search search = {
		.graph = graph,
		.terminals = terminals,
		.terminal_count = terminal_count,
		.options = &options,
		.stats = &stats,
		.arena = arena,
		.best_weight = UINT64_MAX,
		.best_fine = FINE_MAX,
		.assumed = FINE_MAX,
		.best_edges = ARENA_ARRAY(arena, graph->vertex_count, uint32_t),
		.stage = "bench",
	};
	expect(instance_init(&search.instance, arena, graph, terminals, terminal_count, NULL, true, apart));
	expect(primal_first(&search));
	expect(reduce_instance(&search));
	expect(dual_ascend_best(&dual, &search, ASCENT_WORK));
	const size_t before = arena_used(arena);
	const double start_s = bench_wall_seconds();
	expect(flow_new(&flow, &search, &dual));
	snprintf(line, sizeof line, "flow.%s_set_up", name);
	bench_line(line, (bench_wall_seconds() - start_s) * 1e3, "ms", 0);
	snprintf(line, sizeof line, "flow.%s_memory", name);
	bench_line(line, (double)(arena_used(arena) - before) / 1048576, "MiB", 0);
	for (enum isa isa = ISA_BASE; isa < ISA_COUNT; isa++)
		for (unsigned threads = 1; threads <= 2 && isa_is_there(isa); threads++) {
			const double goal = isa != isa_best() ? 0 : threads == 1 ? goal_ms : goal_two_ms;
			flow->ldl.isa = isa;
			snprintf(line, sizeof line, "flow.%s_%s_%u", name, isa_name[isa], threads);
			bench_line(line, iteration_ms(flow, &search, &options, threads), "ms", goal);
		}
	arena_free(arena);
}

static void measure_file(const char *path)
{
	struct arena *arena = arena_new(0);
	FILE *file = fopen(path, "rb");
	if (!file || fseek(file, 0, SEEK_END))
		exit(1);
	const size_t size = (size_t)ftell(file);
	char *text = ARENA_ARRAY(arena, size + 1, char);
	rewind(file);
	if (!text || fread(text, 1, size, file) != size)
		exit(1);
	fclose(file);
	struct steiner_file read;
	expect(steiner_file_read(&read, arena, text, size, NULL));
	const char *name = strrchr(path, '/') ? strrchr(path, '/') + 1 : path;
	measure(name, &read.graph, read.terminals, read.terminal_count, 0, 0);
	arena_free(arena);
}

static void measure_suit(const char *set, double goal_ms, double goal_two_ms)
{
	struct arena *arena = arena_new(0);
	struct suit suit;
	struct graph graph;
	suit_make(&suit, arena, VERTICES, 0, set);
	expect(graph_build(&graph, arena, suit.garment.vertex_count, suit.topology.edge_count,
			   suit.topology.edge_vertex, suit.field.weight, NULL));
	measure(set, &graph, suit.terminal, suit.terminal_count, goal_ms, goal_two_ms);
	arena_free(arena);
}

int main(int argc, char **argv)
{
	for (int i = 1; i < argc; i++)
		measure_file(argv[i]);
	if (argc == 1) {
		measure_suit("muscles36", 5, 3);
		measure_suit("muscles80", 0, 0);
	}
	return 0;
}
