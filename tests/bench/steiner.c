/* Trees of the sample suit, its weights from its motions: how soon there is a first tree, and how soon a proof. The
 * goals are those of real suits of this size. */
#include "solver/steiner/steiner.h"

#include "tests/bench/bench.h"
#include "tests/bench/suit.h"

#include <math.h>

/* A cancelled job is to end within 50 ms: its worker hears of it within some milliseconds, and the search has the rest.
 */
enum { VERTICES = 23500, ROUNDS = 3, SILENCE_MS = 35 };
static const double limit_s = 10;

struct watch {
	double started_s, first_tree_s;
	double asked_s, silent_s; /* when it last asked whether it is cancelled, and the longest time between two */
};

static void watch_first_tree(void *context, const struct steiner_progress *progress)
{
	struct watch *watch = context;
	if (progress->weight != UINT64_MAX && watch->first_tree_s == 0)
		watch->first_tree_s = bench_seconds() - watch->started_s;
}

static bool watch_silence(void *context)
{
	struct watch *watch = context;
	double now_s = bench_seconds();
	watch->silent_s = fmax(watch->silent_s, now_s - watch->asked_s);
	watch->asked_s = now_s;
	return false;
}

static void solve(const char *set, double first_goal_ms, double proof_goal_s)
{
	struct arena *arena = arena_new(0);
	struct suit suit;
	struct graph graph;
	double first_s = INFINITY, proof_s = INFINITY, silent_s = INFINITY;
	char name[64];
	suit_make(&suit, arena, VERTICES, 0, set);
	if (graph_build(&graph, arena, suit.garment.vertex_count, suit.topology.edge_count, suit.topology.edge_vertex,
			suit.field.weight, NULL) != TW_OK)
		exit(1);
	for (int round = 0; round < (proof_goal_s > 0 ? ROUNDS : 1); round++) {
		struct watch watch = {.started_s = bench_seconds()};
		struct steiner_tree tree;
		watch.asked_s = watch.started_s;
		const struct steiner_options options = {.time_limit_s = limit_s,
							.progress = watch_first_tree,
							.cancelled = watch_silence,
							.context = &watch};
		if (steiner_solve(&graph, suit.terminal, suit.terminal_count, &options, arena, &tree, NULL) != TW_OK)
			exit(1);
		watch_silence(&watch);
		first_s = fmin(first_s, watch.first_tree_s);
		silent_s = fmin(silent_s, watch.silent_s);
		if (tree.outcome == STEINER_OPTIMAL)
			proof_s = fmin(proof_s, bench_seconds() - watch.started_s);
	}
	snprintf(name, sizeof name, "steiner.%s_first_tree", set);
	bench_line(name, first_s * 1e3, "ms", first_goal_ms);
	snprintf(name, sizeof name, "steiner.%s_proof", set);
	bench_line(name, proof_s, "s", proof_goal_s);
	snprintf(name, sizeof name, "steiner.%s_silence", set);
	bench_line(name, silent_s * 1e3, "ms", SILENCE_MS);
	arena_free(arena);
}

int main(void)
{
	solve("joints10", 50, 0.08);
	solve("segments17", 50, 0.25);
	solve("muscles36", 50, 1.5);
	solve("muscles80", 50, 0);
	return 0;
}
