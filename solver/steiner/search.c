/* Purpose: the books of a search: effort, limits, best tree, proven bound.
 *
 * A candidate is any set of edges that connects the terminals. It is made a tree on the caller's graph, not on the
 * instance, because edges of the instance may share the caller's edges: a minimum spanning tree of the candidate,
 * without its bare ends, can only be lighter. Nothing becomes the best tree that steiner_verify has not seen. */
#include "solver/steiner/search.h"

#include "solver/steiner/union_find.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { POLL_WORK = 200000 };
static const double progress_period_s = 0.1;

double search_clock_s(void)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void search_init(struct search *search, const struct graph *graph, const uint32_t *terminals, uint32_t terminal_count,
		 const struct steiner_options *options, struct steiner_stats *stats, struct tw_error *error)
{
	*search = (struct search){
		.graph = graph,
		.terminals = terminals,
		.terminal_count = terminal_count,
		.options = options,
		.stats = stats,
		.best_weight = UINT64_MAX,
		.best_fine = FINE_MAX,
		.assumed = FINE_MAX,
		.started_s = search_clock_s(),
		.stage = "start",
		.error = error,
	};
}

static void report(struct search *search, double now_s)
{
	search->last_progress_s = now_s;
	if (!search->options->progress || search->is_part)
		return;
	struct steiner_progress progress = {
		.weight = search->best_weight,
		.lower_bound = search->lower_bound,
		.edges = search->best_edges,
		.edge_count = search->best_count,
		.work = search->work,
		.stage = search->stage,
	};
	search->options->progress(search->options->context, &progress);
}

int search_poll(struct search *search)
{
	const struct steiner_options *options = search->options;
	if (search->stop)
		return 0;
	search->next_poll = search->work + POLL_WORK;
	if (options->work_limit) {
		if (search->work >= options->work_limit) {
			search->stop = SEARCH_LIMIT;
			search->next_poll = 0;
			return 0;
		}
		if (search->next_poll > options->work_limit)
			search->next_poll = options->work_limit;
	}
	if (search->budget_end && search->next_poll > search->budget_end)
		search->next_poll = search->budget_end;
	if (options->cancelled && options->cancelled(options->context))
		search->stop = SEARCH_CANCELLED;
	double now_s = search_clock_s();
	if (!search->stop && options->time_limit_s > 0 && now_s - search->started_s >= options->time_limit_s)
		search->stop = SEARCH_LIMIT;
	search->met_clock |= search->stop != SEARCH_GOES_ON;
	if (search->stop)
		search->next_poll = 0;
	else if (now_s - search->last_progress_s >= progress_period_s)
		report(search, now_s);
	return !search->stop && !(search->budget_end && search->work >= search->budget_end);
}

void search_enter(struct search *search, const char *stage)
{
	search->stage = stage;
	report(search, search_clock_s());
}

struct weighted {
	fine_t weight;
	uint32_t edge;
};

static int compare_weighted(const void *a, const void *b)
{
	const struct weighted *x = a, *y = b;
	if (x->weight != y->weight)
		return x->weight < y->weight ? -1 : 1;
	return (x->edge > y->edge) - (x->edge < y->edge);
}

static int compare_edges(const void *a, const void *b)
{
	uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
	return (x > y) - (x < y);
}

/* Kruskal on the candidate: returns the number of edges kept, at the front of `sorted`. `parent` is undefined outside
 * of the candidate's ends. */
static uint32_t span(const struct graph *graph, struct weighted *sorted, uint32_t count, uint32_t *parent)
{
	for (uint32_t i = 0; i < count; i++)
		for (uint32_t side = 0; side < 2; side++) {
			uint32_t v = graph->ends[2 * sorted[i].edge + side];
			parent[v] = v;
		}
	qsort(sorted, count, sizeof *sorted, compare_weighted);
	uint32_t kept = 0;
	for (uint32_t i = 0; i < count; i++) {
		uint32_t u = union_find(parent, graph->ends[2 * sorted[i].edge]);
		uint32_t v = union_find(parent, graph->ends[2 * sorted[i].edge + 1]);
		if (u == v)
			continue;
		parent[u] = v;
		sorted[kept++] = sorted[i];
	}
	return kept;
}

/* Removes leaves that are not terminals. degree and link (exclusive or of the incident positions) describe the forest;
 * gone edges get the edge number INSTANCE_NONE. */
static void cut_bare_ends(const struct graph *graph, struct weighted *tree, uint32_t count, const uint8_t *wanted,
			  uint32_t *degree, uint32_t *link)
{
	for (uint32_t i = 0; i < count; i++)
		for (uint32_t side = 0; side < 2; side++)
			degree[graph->ends[2 * tree[i].edge + side]] = link[graph->ends[2 * tree[i].edge + side]] = 0;
	for (uint32_t i = 0; i < count; i++)
		for (uint32_t side = 0; side < 2; side++) {
			uint32_t v = graph->ends[2 * tree[i].edge + side];
			degree[v]++;
			link[v] ^= i;
		}
	for (uint32_t i = 0; i < count; i++)
		for (uint32_t side = 0; side < 2; side++) {
			if (tree[i].edge == INSTANCE_NONE)
				break;
			uint32_t v = graph->ends[2 * tree[i].edge + side];
			while (degree[v] == 1 && !wanted[v]) {
				uint32_t gone = link[v], e = tree[gone].edge;
				uint32_t u = graph->ends[2 * e] ^ graph->ends[2 * e + 1] ^ v;
				tree[gone].edge = INSTANCE_NONE;
				degree[v] = 0;
				degree[u]--;
				link[u] ^= gone;
				v = u;
			}
		}
}

static enum tw_status keep_if_better(struct search *search, const struct weighted *tree, uint32_t count,
				     uint32_t *edges)
{
	uint32_t kept = 0;
	uint64_t weight = 0;
	fine_t fine = 0;
	for (uint32_t i = 0; i < count; i++)
		if (tree[i].edge != INSTANCE_NONE) {
			edges[kept++] = tree[i].edge;
			weight += search->graph->weight[tree[i].edge];
			fine += tree[i].weight;
		}
	if (!search_breaks_ties(search))
		fine = (fine_t)weight << search->instance.shift;
	if (fine >= search->best_fine)
		return TW_OK;
	qsort(edges, kept, sizeof *edges, compare_edges);
	enum tw_status status = steiner_verify(search->graph, search->terminals, search->terminal_count, edges, kept,
					       weight, search->error);
	if (status != TW_OK)
		return status;
	memcpy(search->best_edges, edges, kept * sizeof *edges);
	search->best_count = kept;
	assert(fine >= search->proven); /* else the bound was none */
	search->best_weight = weight;
	search->best_fine = fine;
	return TW_OK;
}

enum tw_status search_mark_best(struct search *search, uint8_t *is_best)
{
	const struct instance *instance = &search->instance;
	const struct arena_mark mark = arena_mark(search->arena);
	const size_t leaves = instance->origin_leaf_count;
	uint8_t *inside = ARENA_ZEROED(search->arena, leaves + instance->pair_count, uint8_t);
	if (!inside)
		return TW_ERROR_MEMORY;
	for (uint32_t i = 0; i < search->best_count; i++)
		inside[search->best_edges[i]] = 1;
	for (uint32_t p = 0; p < instance->pair_count; p++)
		inside[leaves + p] = inside[instance->pair[p][0]] && inside[instance->pair[p][1]];
	for (uint32_t e = 0; e < instance->edge_count; e++)
		is_best[e] = inside[instance->origin[e]];
	arena_release(search->arena, mark);
	return TW_OK;
}

enum tw_status search_offer_leaves(struct search *search, const uint32_t *edges, uint32_t edge_count)
{
	const struct graph *graph = search->graph;
	struct arena_mark mark = arena_mark(search->arena);
	size_t n = graph->vertex_count;
	struct weighted *sorted = ARENA_ARRAY(search->arena, edge_count, struct weighted);
	uint32_t *kept = ARENA_ARRAY(search->arena, edge_count, uint32_t);
	uint32_t *degree = ARENA_ARRAY(search->arena, n, uint32_t);
	uint32_t *link = ARENA_ARRAY(search->arena, n, uint32_t);
	uint8_t *wanted = ARENA_ZEROED(search->arena, n, uint8_t);
	enum tw_status status = sorted && kept && degree && link && wanted ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		for (uint32_t i = 0; i < search->terminal_count; i++)
			wanted[search->terminals[i]] = 1;
		for (uint32_t i = 0; i < edge_count; i++)
			sorted[i] = (struct weighted){.weight = instance_fine(&search->instance, graph, edges[i]),
						      .edge = edges[i]};
		uint32_t count = span(graph, sorted, edge_count, degree);
		cut_bare_ends(graph, sorted, count, wanted, degree, link);
		status = keep_if_better(search, sorted, count, kept);
	}
	arena_release(search->arena, mark);
	return status;
}

enum tw_status search_offer(struct search *search, const uint32_t *edges, uint32_t edge_count)
{
	struct arena_mark mark = arena_mark(search->arena);
	uint32_t count = 0, *leaves = ARENA_ARRAY(search->arena, search->graph->edge_count, uint32_t);
	enum tw_status status =
		leaves ? instance_expand(&search->instance, search->arena, edges, edge_count, leaves, &count)
		       : TW_ERROR_MEMORY;
	if (status == TW_OK)
		status = search_offer_leaves(search, leaves, count);
	arena_release(search->arena, mark);
	return status;
}

/* The least whole units that a tree of this fine weight, or of more, can weigh. Fine weights are whole units and less
 * than tie_limit. */
static fine_t round_up_to_units(const struct instance *instance, fine_t fine)
{
	const fine_t below = ((fine_t)1 << instance->shift) - 1,
		     least = fine < instance->tie_limit ? 0 : fine - (instance->tie_limit - 1);
	return (least + below) & ~below;
}

void search_bound(struct search *search, fine_t fine_bound)
{
	const fine_t with_base = fine_bound + search->instance.base;
	fine_t fine = with_base < search->assumed ? with_base : search->assumed;
	if (!search_breaks_ties(search))
		fine = round_up_to_units(&search->instance, fine);
	if (fine > search->proven)
		search->proven = fine;
	if (search->proven > search->best_fine)
		search->proven = search->best_fine;
	/* Tie-breaks are less than a unit, so a tree below the whole units of the bound would be below the bound. */
	search->lower_bound = (uint64_t)(search->proven >> search->instance.shift);
}

void search_close(struct search *search)
{
	assert(search->best_fine != FINE_MAX);
	search->proven = search->best_fine;
	search->lower_bound = search->best_weight;
}

fine_t search_cutoff(const struct search *search)
{
	if (search->best_fine == FINE_MAX)
		return FINE_MAX;
	/* A better tree is lighter by a unit, but for its tie-breaks. */
	const fine_t unit = (fine_t)1 << search->instance.shift;
	const fine_t less =
		search_breaks_ties(search) || search->best_fine < unit ? 0 : unit - search->instance.tie_limit;
	const fine_t better = search->best_fine - less;
	const fine_t fine = search->assumed < better ? search->assumed : better;
	return fine > search->instance.base ? fine - search->instance.base : 0;
}

fine_t search_proven(const struct search *search)
{
	return search->proven > search->instance.base ? search->proven - search->instance.base : 0;
}

bool search_is_proven(const struct search *search)
{
	return search->proven >= search->best_fine;
}

bool search_is_lightest(const struct search *search)
{
	return search->best_fine != FINE_MAX && search->lower_bound >= search->best_weight;
}

enum tw_status search_open_part(struct search *part, const struct search *whole, const uint8_t *keep,
				struct steiner_stats *stats)
{
	*part = *whole;
	part->is_part = true;
	part->stats = stats;
	part->best_edges = ARENA_ARRAY(whole->arena, whole->graph->vertex_count, uint32_t);
	if (!part->best_edges)
		return TW_ERROR_MEMORY;
	memcpy(part->best_edges, whole->best_edges, whole->best_count * sizeof *part->best_edges);
	return instance_part(&part->instance, &whole->instance, whole->arena, keep);
}

enum tw_status search_close_part(const struct search *part, struct search *whole)
{
	whole->work = part->work;
	whole->stop = part->stop;
	whole->met_clock |= part->met_clock;
	whole->last_progress_s = part->last_progress_s;
	whole->next_poll = whole->stop ? 0 : whole->work;
	if (part->best_fine >= whole->best_fine)
		return TW_OK;
	return search_offer_leaves(whole, part->best_edges, part->best_count);
}
