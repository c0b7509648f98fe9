/* The tree's edges are sorted by node, which makes rows of them; every branch is walked from its lower end. At every
 * junction the pair of branches that is nearest to a straight line is linked; chains of links are the strands. */
#include "solver/layout/branches.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* One end of a tree edge. */
struct half {
	uint32_t node, edge;
};

struct cutter {
	struct branch_set *set;
	struct arena *arena;
	const struct network *network;
	struct half *half; /* [half_count], by node, then edge */
	uint32_t half_count;
	uint32_t *end_of; /* [node_count] index of the end at a node; GARMENT_NONE */
	/* [branch_count][2]: which branch, and which end of it, the strand goes on with; GARMENT_NONE */
	uint32_t (*link)[2];
	double reach_mm;
};

static int compare_halves(const void *a, const void *b)
{
	const struct half *p = a, *q = b;
	if (p->node != q->node)
		return p->node < q->node ? -1 : 1;
	return p->edge < q->edge ? -1 : p->edge > q->edge;
}

/* The first half-edge at `node` or behind it. */
static uint32_t row_of(const struct cutter *cutter, uint32_t node)
{
	uint32_t low = 0, high = cutter->half_count;
	while (low < high) {
		uint32_t middle = (low + high) / 2;
		if (cutter->half[middle].node < node)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

static uint32_t degree_of(const struct cutter *cutter, uint32_t row)
{
	uint32_t next = row;
	while (next < cutter->half_count && cutter->half[next].node == cutter->half[row].node)
		next++;
	return next - row;
}

static void add_end(struct cutter *cutter, uint32_t node, uint32_t site, uint32_t degree)
{
	struct branch_set *set = cutter->set;
	cutter->end_of[node] = set->end_count;
	set->end[set->end_count++] = (struct branch_end){node, site, degree};
}

static void find_ends(struct cutter *cutter)
{
	const struct network *network = cutter->network;
	for (uint32_t s = 0; s < network->sites->count; s++) {
		uint32_t row = row_of(cutter, network->terminal[s]);
		bool there = row < cutter->half_count && cutter->half[row].node == network->terminal[s];
		add_end(cutter, network->terminal[s], s, there ? degree_of(cutter, row) : 0);
	}
	for (uint32_t row = 0, degree; row < cutter->half_count; row += degree) {
		degree = degree_of(cutter, row);
		uint32_t node = cutter->half[row].node;
		if (degree < 3 || cutter->end_of[node] != GARMENT_NONE)
			continue;
		add_end(cutter, node, GARMENT_NONE, degree);
		cutter->set->junction_count++;
	}
}

static uint32_t other_end(const struct network *network, uint32_t edge, uint32_t node)
{
	const uint32_t *end = network->graph.ends + 2 * (size_t)edge;
	return end[0] == node ? end[1] : end[0];
}

/* Walks from an end along `edge`. The nodes and edges are written where there is room for all of the tree. */
static void walk(const struct cutter *cutter, uint32_t end, uint32_t edge, struct branch *branch)
{
	uint32_t node = cutter->set->end[end].node;
	branch->edge_count = 0;
	branch->node[0] = node;
	for (;;) {
		node = other_end(cutter->network, edge, node);
		assert(branch->edge_count < cutter->half_count / 2); /* a tree's walk ends */
		branch->edge[branch->edge_count++] = edge;
		branch->node[branch->edge_count] = node;
		if (cutter->end_of[node] != GARMENT_NONE)
			break;
		uint32_t row = row_of(cutter, node);
		/* A node that ends no branch has two edges. */
		assert(row + 1 < cutter->half_count && cutter->half[row + 1].node == node);
		edge = cutter->half[row].edge == edge ? cutter->half[row + 1].edge : cutter->half[row].edge;
	}
	branch->end[0] = end;
	branch->end[1] = cutter->end_of[node];
}

/* The branches share two arrays: each edge once, a node more per branch, and room to walk one that was there before. */
static enum tw_status cut(struct cutter *cutter, uint32_t edge_count, struct tw_error *error)
{
	struct branch_set *set = cutter->set;
	uint32_t *nodes = ARENA_ARRAY(cutter->arena, 3 * (size_t)edge_count + 3, uint32_t);
	uint32_t *edges = ARENA_ARRAY(cutter->arena, 3 * (size_t)edge_count + 3, uint32_t);
	if (!nodes || !edges)
		return tw_fail_memory(error);
	for (uint32_t e = 0; e < set->end_count; e++) {
		uint32_t row = row_of(cutter, set->end[e].node);
		for (uint32_t d = 0; d < set->end[e].degree; d++) {
			struct branch branch = {.node = nodes, .edge = edges};
			walk(cutter, e, cutter->half[row + d].edge, &branch);
			if (branch.end[1] < e)
				continue;
			nodes += branch.edge_count + 1;
			edges += branch.edge_count;
			set->branch[set->branch_count++] = branch;
		}
	}
	return TW_OK;
}

/* The direction in which a branch leaves its end, on the worn mesh. */
static void leaving(const struct cutter *cutter, const struct branch *branch, uint32_t which, double direction[3])
{
	double start[3], here[3], last[3], run = 0;
	struct place place = network_place(cutter->network, branch->node[which ? branch->edge_count : 0]);
	place_on_worn(cutter->network->garment, &place, start);
	memcpy(last, start, sizeof last);
	for (uint32_t i = 1; i <= branch->edge_count && run < cutter->reach_mm; i++) {
		place = network_place(cutter->network, branch->node[which ? branch->edge_count - i : i]);
		place_on_worn(cutter->network->garment, &place, here);
		double square = 0;
		for (int k = 0; k < 3; k++)
			square += (here[k] - last[k]) * (here[k] - last[k]);
		run += sqrt(square);
		memcpy(last, here, sizeof last);
	}
	double square = 0;
	for (int k = 0; k < 3; k++) {
		direction[k] = last[k] - start[k];
		square += direction[k] * direction[k];
	}
	for (int k = 0; k < 3; k++)
		direction[k] = square > 0 ? direction[k] / sqrt(square) : 0;
}

/* Links the two straightest branches of a junction. `at`: the branch ends there, as branch * 2 + which. */
static enum tw_status link_junction(struct cutter *cutter, const uint32_t *at, uint32_t count, struct tw_error *error)
{
	struct arena_mark mark = arena_mark(cutter->arena);
	double(*direction)[3] = arena_array(cutter->arena, count, sizeof *direction);
	if (!direction)
		return tw_fail_memory(error);
	for (uint32_t i = 0; i < count; i++)
		leaving(cutter, &cutter->set->branch[at[i] / 2], at[i] % 2, direction[i]);
	double best = 2;
	uint32_t a = 0, b = 1;
	for (uint32_t i = 0; i < count; i++) {
		for (uint32_t j = i + 1; j < count; j++) {
			double cosine = 0;
			for (int k = 0; k < 3; k++)
				cosine += direction[i][k] * direction[j][k];
			if (cosine < best - 1e-12) {
				best = cosine;
				a = i, b = j;
			}
		}
	}
	cutter->link[at[a] / 2][at[a] % 2] = at[b];
	cutter->link[at[b] / 2][at[b] % 2] = at[a];
	arena_release(cutter->arena, mark);
	return TW_OK;
}

static enum tw_status link_all(struct cutter *cutter, struct tw_error *error)
{
	struct branch_set *set = cutter->set;
	uint32_t *at = ARENA_ARRAY(cutter->arena, 2 * (size_t)set->branch_count + 1, uint32_t);
	cutter->link = arena_array(cutter->arena, set->branch_count, sizeof *cutter->link);
	if (!at || !cutter->link)
		return tw_fail_memory(error);
	memset(cutter->link, 0xff, set->branch_count * sizeof *cutter->link);
	for (uint32_t e = 0; e < set->end_count; e++) {
		if (set->end[e].site != GARMENT_NONE)
			continue;
		uint32_t count = 0;
		for (uint32_t b = 0; b < set->branch_count; b++)
			for (uint32_t which = 0; which < 2; which++)
				if (set->branch[b].end[which] == e)
					at[count++] = 2 * b + which;
		enum tw_status status = link_junction(cutter, at, count, error);
		if (status != TW_OK)
			return status;
	}
	return TW_OK;
}

/* The strand that leaves its first end by `branch` at end `which`. */
static void chain(struct cutter *cutter, uint32_t branch, uint32_t which, bool *used)
{
	struct branch_set *set = cutter->set;
	struct strand *strand = &set->strand[set->strand_count++];
	*strand = (struct strand){.first = 0};
	if (set->strand_count > 1)
		strand->first = strand[-1].first + strand[-1].count;
	strand->end[0] = set->branch[branch].end[which];
	for (;;) {
		set->step[strand->first + strand->count++] = (struct strand_step){branch, which == 1};
		used[branch] = true;
		uint32_t next = cutter->link[branch][1 - which];
		strand->end[1] = set->branch[branch].end[1 - which];
		if (next == GARMENT_NONE)
			break;
		branch = next / 2;
		which = next % 2;
	}
}

static enum tw_status make_strands(struct cutter *cutter, struct tw_error *error)
{
	struct branch_set *set = cutter->set;
	bool *used = ARENA_ZEROED(cutter->arena, set->branch_count, bool);
	if (!used)
		return tw_fail_memory(error);
	for (uint32_t b = 0; b < set->branch_count; b++)
		for (uint32_t which = 0; which < 2; which++)
			if (!used[b] && cutter->link[b][which] == GARMENT_NONE)
				chain(cutter, b, which, used);
	return TW_OK;
}

/* A strand may stand when the strands through its ends stand already. There is always one, as the tree has no cycle. */
static enum tw_status order_strands(struct cutter *cutter, struct tw_error *error)
{
	struct branch_set *set = cutter->set;
	bool *ready = ARENA_ZEROED(cutter->arena, set->end_count, bool);
	struct strand *ordered = ARENA_ARRAY(cutter->arena, set->strand_count, struct strand);
	bool *placed = ARENA_ZEROED(cutter->arena, set->strand_count, bool);
	if (!ready || !ordered || !placed)
		return tw_fail_memory(error);
	for (uint32_t e = 0; e < set->end_count; e++)
		ready[e] = set->end[e].site != GARMENT_NONE;
	uint32_t count = 0;
	for (bool moved = true; moved;) {
		moved = false;
		for (uint32_t s = 0; s < set->strand_count; s++) {
			const struct strand *strand = &set->strand[s];
			if (placed[s] || !ready[strand->end[0]] || !ready[strand->end[1]])
				continue;
			placed[s] = moved = true;
			ordered[count++] = *strand;
			for (uint32_t i = 0; i + 1 < strand->count; i++) {
				const struct strand_step *step = &set->step[strand->first + i];
				ready[set->branch[step->branch].end[!step->reversed]] = true;
			}
		}
	}
	assert(count == set->strand_count);
	set->strand = ordered;
	return TW_OK;
}

enum tw_status branches_cut(struct branch_set *set, struct arena *arena, const struct network *network,
			    const uint32_t *edges, uint32_t edge_count, double reach_mm, struct tw_error *error)
{
	*set = (struct branch_set){0};
	struct cutter cutter = {.set = set, .arena = arena, .network = network, .reach_mm = reach_mm};
	uint32_t ends = network->sites->count + edge_count + 1;
	cutter.half = ARENA_ARRAY(arena, 2 * (size_t)edge_count, struct half);
	cutter.end_of = ARENA_ARRAY(arena, network->graph.vertex_count, uint32_t);
	set->end = ARENA_ARRAY(arena, ends, struct branch_end);
	set->branch = ARENA_ARRAY(arena, ends, struct branch);
	set->strand = ARENA_ARRAY(arena, ends, struct strand);
	set->step = ARENA_ARRAY(arena, ends, struct strand_step);
	if (!cutter.half || !cutter.end_of || !set->end || !set->branch || !set->strand || !set->step)
		return tw_fail_memory(error);
	memset(cutter.end_of, 0xff, network->graph.vertex_count * sizeof *cutter.end_of);
	for (uint32_t i = 0; i < edge_count; i++)
		for (uint32_t k = 0; k < 2; k++)
			cutter.half[cutter.half_count++] =
				(struct half){network->graph.ends[2 * (size_t)edges[i] + k], edges[i]};
	qsort(cutter.half, cutter.half_count, sizeof *cutter.half, compare_halves);
	find_ends(&cutter);
	enum tw_status status = cut(&cutter, edge_count, error);
	if (status == TW_OK)
		status = link_all(&cutter, error);
	if (status == TW_OK)
		status = make_strands(&cutter, error);
	return status != TW_OK ? status : order_strands(&cutter, error);
}
