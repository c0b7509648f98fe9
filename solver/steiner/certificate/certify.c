/* Purpose: make a certificate.
 *
 * The dual that the search ends with belongs to an instance from which reductions and fixing have deleted edges, and
 * with perturbed weights: it proves nothing on the caller's graph by itself. So a dual is grown anew on the whole graph
 * with the caller's weights, shifted up so that costs can be split finely. What its balls prove, the sum of the balls
 * of one terminal proves as well: max(0, a + b) <= max(0, a) + max(0, b). So each terminal gets one potential. */
#include "solver/steiner/certificate/certificate.h"
#include "solver/steiner/dual/dual.h"
#include "solver/steiner/flow/flow.h"
#include "solver/steiner/search.h"

#include <assert.h>
#include <string.h>

enum { ASCENT_SHARE = 30, IMPROVE_SHARE = 2200, LEAST_SHARE = 300 }; /* work units for each edge */

/* Iterations before a bound is looked at, and how often, as long as it is more than 1/10000 off. With 36 to 80
 * terminals on 23,500 vertices 150 iterations leave 0.002 to 0.013 per cent, but once 0.07; an iteration takes 2 to 5
 * ms. */
enum { FLOW_ITERATIONS = 150, FLOW_PARTS = 5, TIGHT_SHARE = 10000 };

/* Large graphs get less for each edge. */
static const uint64_t improve_work_most = 700000000;

/* The caller's graph as an instance without noise. */
static enum tw_status set_up(struct search *search)
{
	uint32_t apart[2];
	struct instance *instance = &search->instance;
	enum tw_status status = instance_init(instance, search->arena, search->graph, search->terminals,
					      search->terminal_count, NULL, true, apart);
	for (uint32_t e = 0; status == TW_OK && e < instance->edge_count; e++)
		instance->weight[e] = (fine_t)search->graph->weight[instance->origin[e]] << instance->shift;
	search->best_fine = (fine_t)search->best_weight << instance->shift;
	return status;
}

static enum tw_status improve_by_search(struct search *search, struct dual *dual)
{
	const uint64_t edges = search->instance.edge_count;
	uint64_t effort = IMPROVE_SHARE * edges < improve_work_most ? IMPROVE_SHARE * edges : improve_work_most;
	if (effort < LEAST_SHARE * edges)
		effort = LEAST_SHARE * edges;
	return dual_improve(dual, search, effort, search->best_fine);
}

static bool is_tight(const struct search *search, const struct dual *dual)
{
	return search->best_fine - dual_fine_bound(dual) <= search->best_fine / TIGHT_SHARE;
}

static enum tw_status improve(struct search *search, struct dual *dual)
{
	struct flow *flow;
	if (flow_new(&flow, search, dual) != TW_OK)
		return improve_by_search(search, dual);
	enum tw_status status = TW_OK;
	for (uint32_t part = 0; part < FLOW_PARTS && status == TW_OK && !is_tight(search, dual); part++) {
		status = flow_iterate(flow, search, FLOW_ITERATIONS);
		if (status == TW_OK)
			status = flow_raise_dual(flow, search, dual, NULL);
	}
	return status == TW_ERROR_MEMORY ? improve_by_search(search, dual) : status;
}

static enum tw_status grow_dual(struct search *search, struct dual *dual)
{
	const enum tw_status status =
		dual_ascend_best(dual, search, ASCENT_SHARE * (uint64_t)search->instance.edge_count);
	return status == TW_OK ? improve(search, dual) : status;
}

/* Instance vertices have no names of their own, but their edges have. */
static void name_vertices(const struct search *search, uint32_t *name)
{
	const struct instance *instance = &search->instance;
	for (uint32_t e = 0; e < instance->edge_count; e++)
		for (uint32_t side = 0; side < 2; side++)
			name[instance->ends[2 * e + side]] = search->graph->ends[2 * instance->origin[e] + side];
}

/* Sums the terminal's balls, which `ball` and `next` chain, to a potential. deficit[v], the radius minus the potential,
 * is zero between calls. */
static void sum_balls(const struct dual *dual, uint32_t ball, const uint32_t *next, const uint32_t *name,
		      uint64_t *deficit, uint64_t unit, struct steiner_certificate *certificate)
{
	struct certificate_potential *potential = &certificate->potential[certificate->potential_count++];
	struct certificate_member *member = certificate->member + certificate->member_count;
	*potential = (struct certificate_potential){
		.terminal = name[dual->instance->terminal[dual->ball[ball].terminal]],
		.start = certificate->member_count,
	};
	for (uint32_t b = ball; b != INSTANCE_NONE; b = next[b]) {
		const struct dual_member *inside = dual->member + dual->ball[b].start;
		potential->radius += dual->ball[b].radius * unit;
		for (uint32_t i = 0; i < dual->ball[b].count; i++) {
			const uint32_t v = inside[i].vertex;
			if (!deficit[v])
				member[potential->count++].vertex = v;
			deficit[v] += (dual->ball[b].radius - inside[i].distance) * unit;
		}
	}
	for (uint32_t i = 0; i < potential->count; i++) {
		const uint32_t v = member[i].vertex;
		member[i] = (struct certificate_member){.vertex = name[v], .value = potential->radius - deficit[v]};
		deficit[v] = 0;
	}
	certificate->member_count += potential->count;
	certificate->total += potential->radius;
}

static enum tw_status write_dual(const struct search *search, const struct dual *dual, struct arena *arena,
				 struct steiner_certificate *certificate)
{
	const unsigned shift = search->instance.shift, coarse = dual->coarse_shift;
	const uint32_t k = search->instance.terminal_count;
	const size_t n = search->instance.vertex_count;
	uint32_t *name = ARENA_ARRAY(search->arena, n, uint32_t);
	uint64_t *deficit = ARENA_ZEROED(search->arena, n, uint64_t);
	uint32_t *first = ARENA_ARRAY(search->arena, k, uint32_t);
	uint32_t *next = ARENA_ARRAY(search->arena, dual->ball_count, uint32_t);
	size_t members = 0;
	for (uint32_t b = 0; b < dual->ball_count; b++)
		members += dual->ball[b].applied ? dual->ball[b].count : 0;
	certificate->potential = ARENA_ARRAY(arena, k, struct certificate_potential);
	certificate->member = ARENA_ARRAY(arena, members, struct certificate_member);
	if (!name || !deficit || !first || !next || !certificate->potential || !certificate->member)
		return TW_ERROR_MEMORY;
	name_vertices(search, name);
	memset(first, 0xff, k * sizeof *first);
	for (uint32_t b = dual->ball_count; b-- > 0;) {
		const uint32_t t = dual->ball[b].terminal;
		if (!dual->ball[b].applied)
			continue;
		next[b] = first[t];
		first[t] = b;
	}
	certificate->root = name[search->instance.terminal[dual->root]];
	certificate->scale = coarse < shift ? (uint64_t)1 << (shift - coarse) : 1;
	const uint64_t unit = coarse > shift ? (uint64_t)1 << (coarse - shift) : 1;
	for (uint32_t t = 0; t < k; t++)
		if (first[t] != INSTANCE_NONE)
			sum_balls(dual, first[t], next, name, deficit, unit, certificate);
	for (size_t v = 0; v < n; v++)
		assert(!deficit[v]);
	certificate->certified =
		certificate->total / certificate->scale + (certificate->total % certificate->scale != 0);
	return TW_OK;
}

static enum tw_status write_tree(const struct graph *graph, const struct steiner_tree *tree, struct arena *arena,
				 struct steiner_certificate *certificate)
{
	certificate->tree = ARENA_ARRAY(arena, tree->edge_count, struct certificate_edge);
	if (!certificate->tree)
		return TW_ERROR_MEMORY;
	certificate->tree_count = tree->edge_count;
	for (uint32_t i = 0; i < tree->edge_count; i++) {
		const size_t e = tree->edges[i];
		certificate->tree[i] = (struct certificate_edge){
			.ends = {graph->ends[2 * e], graph->ends[2 * e + 1]},
			.weight = graph->weight[e],
		};
	}
	return TW_OK;
}

static enum tw_status certify_in(struct search *search, const struct steiner_tree *tree, struct arena *arena,
				 struct steiner_certificate *certificate)
{
	struct dual dual;
	enum tw_status status = write_tree(search->graph, tree, arena, certificate);
	if (status == TW_OK)
		status = set_up(search);
	if (status != TW_OK || search->instance.terminal_count == 1)
		return status;
	status = grow_dual(search, &dual);
	return status == TW_OK ? write_dual(search, &dual, arena, certificate) : status;
}

enum tw_status steiner_certify(const struct graph *graph, const uint32_t *terminals, uint32_t terminal_count,
			       const struct steiner_tree *tree, size_t memory_limit, struct arena *arena,
			       struct steiner_certificate *certificate, struct tw_error *error)
{
	if (tree->outcome == STEINER_INFEASIBLE)
		return tw_fail(error, TW_ERROR_INPUT, "steiner-infeasible", NULL,
			       "there is no tree to certify: the terminals are not connected");
	const struct steiner_options options = {.memory_limit = memory_limit};
	struct steiner_stats stats = {0};
	struct search search;
	search_init(&search, graph, terminals, terminal_count, &options, &stats, error);
	search.arena = arena_new(memory_limit);
	search.best_weight = tree->weight;
	search.best_edges = tree->edges;
	search.best_count = tree->edge_count;
	search.stage = "certificate";
	*certificate = (struct steiner_certificate){
		.vertex_count = graph->vertex_count,
		.edge_count = graph->edge_count,
		.terminal_count = terminal_count,
		.weight = tree->weight,
		.bound = tree->lower_bound,
		.root = terminals[0],
		.scale = 1,
	};
	enum tw_status status = search.arena ? certify_in(&search, tree, arena, certificate) : TW_ERROR_MEMORY;
	arena_free(search.arena);
	if (status == TW_ERROR_MEMORY)
		return tw_fail_memory(error);
	/* Of a search that was stopped early, the certificate may prove more than the search did. */
	if (certificate->bound < certificate->certified)
		certificate->bound = certificate->certified;
	return status;
}
