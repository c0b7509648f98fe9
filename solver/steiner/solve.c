/* Purpose: the solver's table of contents: the stages in their order, and how their outcomes become an answer. */
#include "solver/steiner/primal/primal.h"
#include "solver/steiner/prove.h"
#include "solver/steiner/reduce/bound.h"
#include "solver/steiner/reduce/reduce.h"
#include "solver/steiner/search.h"
#include "solver/steiner/warm/attempt.h"

#include <string.h>

/* Work units for each edge. Ten meshes with 10 to 17 terminals were proven in 1.21 s in all with 30 and 1500000,
 * in 1.03 with these. */
enum { ASCENT_SHARE = 15, ASCENT_LEAST = 800000 };

static enum tw_status run_stages(struct search *search)
{
	search_enter(search, "first tree");
	enum tw_status status = primal_first(search);
	if (status != TW_OK)
		return status;
	search_enter(search, "reductions");
	double started_s = search_clock_s();
	status = reduce_instance(search);
	int empty = 0;
	if (status == TW_OK && search->instance.terminal_count > 1)
		status = reduce_by_bounds(search, &empty);
	search->stats->seconds_reduce = search_clock_s() - started_s;
	if (status == TW_OK && (empty || search->instance.terminal_count == 1)) {
		status = empty ? TW_OK : search_offer(search, NULL, 0);
		if (status == TW_OK)
			search_close(search);
		return status;
	}
	if (status != TW_OK)
		return status;
	search_enter(search, "dual ascent");
	started_s = search_clock_s();
	struct dual dual;
	const uint64_t share = ASCENT_SHARE * (uint64_t)search->instance.edge_count;
	status = dual_ascend_best(&dual, search, share > ASCENT_LEAST ? share : ASCENT_LEAST);
	search->stats->seconds_dual = search_clock_s() - started_s;
	return status == TW_OK ? prove_optimum(search, &dual) : status;
}

/* TW_ERROR_MEMORY and TW_ERROR_CANCELLED are outcomes as soon as there is a tree. */
static enum tw_status conclude(struct search *search, enum tw_status status, struct arena *arena,
			       struct steiner_tree *tree)
{
	if (search->best_weight == UINT64_MAX)
		return status == TW_OK ? TW_ERROR_INTERNAL : status;
	if (status == TW_ERROR_INTERNAL || status == TW_ERROR_INPUT)
		return status;
	tree->outcome = search_is_lightest(search)         ? STEINER_OPTIMAL
			: search->stop == SEARCH_CANCELLED ? STEINER_CANCELLED
							   : STEINER_LIMIT;
	tree->weight = search->best_weight;
	tree->lower_bound = search->lower_bound;
	tree->is_unique = search_breaks_ties(search) && search_is_proven(search);
	tree->is_reproducible = tree->is_unique || (!search->has_pivoted && !search->met_clock);
	tree->edge_count = search->best_count;
	tree->edges = ARENA_ARRAY(arena, search->best_count, uint32_t);
	if (!tree->edges)
		return TW_ERROR_MEMORY;
	memcpy(tree->edges, search->best_edges, search->best_count * sizeof *tree->edges);
	return TW_OK;
}

static enum tw_status begin(struct search *search, uint32_t apart[2])
{
	search->arena = arena_new(search->options->memory_limit);
	if (!search->arena)
		return TW_ERROR_MEMORY;
	search->best_edges = ARENA_ARRAY(search->arena, search->graph->vertex_count, uint32_t);
	if (!search->best_edges)
		return TW_ERROR_MEMORY;
	return instance_init(&search->instance, search->arena, search->graph, search->terminals, search->terminal_count,
			     search->options->ties, search_uses(search, STEINER_PERTURBATION), apart);
}

static void end(struct search *search, struct steiner_tree *tree)
{
	tree->stats.work = search->work;
	tree->stats.memory_peak = search->arena ? arena_peak(search->arena) : 0;
	tree->stats.seconds_total = search_clock_s() - search->started_s;
	arena_free(search->arena);
}

static enum tw_status solve_from_scratch(struct search *search, struct arena *arena, struct steiner_tree *tree)
{
	uint32_t apart[2];
	enum tw_status status = begin(search, apart);
	if (status == TW_ERROR_NOT_FOUND) {
		tree->outcome = STEINER_INFEASIBLE;
		tree->terminal_a = apart[0];
		tree->terminal_b = apart[1];
		return TW_OK;
	}
	if (status == TW_OK)
		status = run_stages(search);
	return conclude(search, status, arena, tree);
}

/* *solved: there is a proof. Otherwise, whatever the reason, the search from scratch is to begin. */
static enum tw_status solve_from_warm(struct search *search, struct arena *arena, struct steiner_tree *tree,
				      bool *solved)
{
	uint32_t apart[2];
	*solved = false;
	enum tw_status status = begin(search, apart);
	if (status == TW_OK)
		status = warm_attempt(search->options->warm, search, solved);
	tree->stats.is_from_warm = *solved;
	if (*solved)
		return conclude(search, TW_OK, arena, tree);
	return status == TW_ERROR_INTERNAL ? status : TW_OK;
}

enum tw_status steiner_solve(const struct graph *graph, const uint32_t *terminals, uint32_t terminal_count,
			     const struct steiner_options *options, struct arena *arena, struct steiner_tree *tree,
			     struct tw_error *error)
{
	static const struct steiner_options defaults = {0};
	*tree = (struct steiner_tree){0};
	if (!terminal_count)
		return tw_fail(error, TW_ERROR_INPUT, "steiner-no-terminals", NULL,
			       "there are no terminals to connect");
	for (uint32_t i = 0; i < terminal_count; i++)
		if (terminals[i] >= graph->vertex_count)
			return tw_fail(error, TW_ERROR_INPUT, "steiner-terminal-range", NULL,
				       "terminal %u is vertex %u, but the graph has %u vertices", i, terminals[i],
				       graph->vertex_count);
	options = options ? options : &defaults;
	struct search search;
	enum tw_status status = TW_OK;
	bool solved = false;
	if (options->warm) {
		search_init(&search, graph, terminals, terminal_count, options, &tree->stats, error);
		status = solve_from_warm(&search, arena, tree, &solved);
		end(&search, tree);
	}
	if (status == TW_OK && !solved) {
		*tree = (struct steiner_tree){0};
		search_init(&search, graph, terminals, terminal_count, options, &tree->stats, error);
		status = solve_from_scratch(&search, arena, tree);
		if (options->warm)
			warm_missed(options->warm, tree);
		end(&search, tree);
	}
	if (status == TW_ERROR_MEMORY)
		return tw_fail_memory(error);
	return status;
}
