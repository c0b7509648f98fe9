/* Purpose: branch and cut, the stage that does not depend on how many terminals there are.
 *
 * A node of the search tree is a set of vertices that the tree must have and a set that it must not have. In a node the
 * linear program and the separation of cuts take turns (lp.c, flow.c, balance.c; the first cuts are those
 * of a dual ascent); every solution guides a shortest-path heuristic, and every proven bound deletes arcs by reduced
 * costs. A node is closed when its bound reaches the best tree; else a vertex is chosen that the solution has by half,
 * and the tree must have it in one child and not in the other (T. Koch & A. Martin, Solving Steiner tree problems in
 * graphs to optimality, Networks 32, 1998; branching on vertices: E. Álvarez-Miranda et al.). Depth first, and first
 * with the vertex: this finds trees, and closes soon. For the second child the program goes back to the basis of the
 * node above.
 *
 * The search can be interrupted anywhere and goes on at the current node: its decisions, rows and deletions stay.
 *
 * Sound because: bounds are proven in integers (lp.c); a row holds wherever its target must be reached, and names
 * all arcs but those deleted at the root of the search; every arc deleted by reduced costs is put back on leaving the
 * node. Weights are the caller's, whole numbers, so that a bound is rounded up. A node in which every vertex is decided
 * is a minimum spanning tree. */
#include "solver/steiner/cut/cut.h"

#include "solver/steiner/cut/ascent.h"
#include "solver/steiner/cut/balance.h"
#include "solver/steiner/cut/flow.h"
#include "solver/steiner/cut/lp.h"
#include "solver/steiner/primal/repeat.h"
#include "solver/steiner/primal/tree.h"

#include <assert.h>
#include <string.h>

enum { ROWS_MAX = 200000, ROW_ARCS_MAX = 24000000, ARCS_MAX = 2000000 };
enum { IDLE_ROUNDS = 3, FRACTION_BITS = 20, WEIGHT_BITS_MAX = 60, HEURISTIC_ROUNDS = 5, TREE_SHARE = 20 };
/* When rounds gain too little of the gap for too long: at the root of the search; below it. */
enum { GAIN_SHARE = 500, GAIN_SHARE_BELOW = 50, STALLED_ROUNDS = 60, STALLED_ROUNDS_BELOW = 4 };

static const double inward = 0.2; /* how far from the centre to the solution a point is that is cut off */

enum fate { FREE, IN, OUT };

struct decision {
	uint32_t vertex;
	enum fate fate;
	int is_second;         /* the other child is done */
	uint32_t fixed_before; /* length of the trail of fixed arcs */
};

struct cut_search {
	struct search *search;
	struct cut_problem problem;
	struct cut_pool pool;
	struct cut_lp lp;
	uint8_t *fate;   /* [vertex_count] enum fate */
	uint32_t *fixed; /* [arc_count] trail of arcs with allowed == 0 */
	uint32_t fixed_count;
	struct decision *decision; /* [vertex_count] */
	struct cut_basis *basis;   /* [vertex_count] of the node above each decision */
	uint32_t depth;
	uint64_t base;     /* the caller's units: instance.base */
	int64_t *reduced;  /* [arc_count] of the ascent */
	fine_t *path_cost; /* [edge_count] for the heuristic */
	uint8_t *drop;     /* [pool capacity] */
	double *centre;    /* [arc_count] the solutions of the node so far, the later the more */
	double *between;   /* [arc_count] on the way from there to the last one */
};

static unsigned count_bits(uint64_t x)
{
	return x ? 64u - (unsigned)__builtin_clzll(x) : 0u;
}

static enum tw_status problem_init(struct cut_problem *problem, struct search *search)
{
	struct arena *arena = search->arena;
	const struct instance *instance = &search->instance;
	const size_t arcs = 2 * (size_t)instance->edge_count;
	uint64_t total = 0;
	for (uint32_t e = 0; e < instance->edge_count; e++)
		total += (uint64_t)(instance->weight[e] >> instance->shift);
	const unsigned room = WEIGHT_BITS_MAX - count_bits(total);
	*problem = (struct cut_problem){
		.search = search,
		.instance = instance,
		.root = instance->terminal[0],
		.arc_count = (uint32_t)arcs,
		.fraction_bits = count_bits(total) > WEIGHT_BITS_MAX ? 0
				 : room < FRACTION_BITS              ? room
								     : FRACTION_BITS,
		.cost = ARENA_ARRAY(arena, arcs, int64_t),
		.allowed = ARENA_ARRAY(arena, arcs, uint8_t),
		.gone = ARENA_ZEROED(arena, arcs, uint8_t),
		.target = ARENA_ARRAY(arena, instance->vertex_count, uint32_t),
	};
	if (!problem->cost || !problem->allowed || !problem->gone || !problem->target)
		return TW_ERROR_MEMORY;
	for (uint32_t arc = 0; arc < arcs; arc++) {
		const uint64_t weight = (uint64_t)(instance->weight[arc / 2] >> instance->shift);
		problem->cost[arc] = (int64_t)(weight << problem->fraction_bits);
		problem->allowed[arc] = cut_head(problem, arc) != problem->root;
		problem->gone[arc] = !problem->allowed[arc];
	}
	for (uint32_t t = 1; t < instance->terminal_count; t++)
		problem->target[problem->target_count++] = instance->terminal[t];
	problem->terminal_target_count = problem->target_count;
	return TW_OK;
}

static enum tw_status cut_search_init(struct cut_search *cut, struct search *search)
{
	struct arena *arena = search->arena;
	const struct instance *instance = &search->instance;
	const size_t n = instance->vertex_count, m = instance->edge_count;
	*cut = (struct cut_search){.search = search, .base = (uint64_t)(instance->base >> instance->shift)};
	enum tw_status status = problem_init(&cut->problem, search);
	if (status != TW_OK)
		return status;
	const size_t rows = 50 * n + 10000 < ROWS_MAX ? 50 * n + 10000 : ROWS_MAX;
	const size_t row_arcs = 500 * m + 10000 < ROW_ARCS_MAX ? 500 * m + 10000 : ROW_ARCS_MAX;
	cut->pool = (struct cut_pool){
		.capacity = (uint32_t)rows,
		.start = ARENA_ZEROED(arena, rows + 1, size_t),
		.least = ARENA_ARRAY(arena, rows, uint8_t),
		.target = ARENA_ARRAY(arena, rows, uint32_t),
		.number = ARENA_ARRAY(arena, rows, uint32_t),
		.pins = ARENA_ARRAY(arena, rows, uint16_t),
		.basic = ARENA_ARRAY(arena, rows, uint32_t),
		.arc = ARENA_ARRAY(arena, row_arcs, uint32_t),
		.arc_capacity = row_arcs,
	};
	cut->fate = ARENA_ZEROED(arena, n, uint8_t);
	cut->fixed = ARENA_ARRAY(arena, 2 * m, uint32_t);
	cut->decision = ARENA_ARRAY(arena, n, struct decision);
	cut->basis = ARENA_ZEROED(arena, n, struct cut_basis);
	cut->reduced = ARENA_ARRAY(arena, 2 * m, int64_t);
	cut->path_cost = ARENA_ARRAY(arena, m, fine_t);
	cut->drop = ARENA_ARRAY(arena, rows, uint8_t);
	cut->centre = ARENA_ARRAY(arena, 2 * m, double);
	cut->between = ARENA_ARRAY(arena, 2 * m, double);
	if (!cut->pool.start || !cut->pool.least || !cut->pool.target || !cut->pool.number || !cut->pool.pins ||
	    !cut->pool.basic || !cut->pool.arc || !cut->fate || !cut->fixed || !cut->decision || !cut->basis ||
	    !cut->reduced || !cut->path_cost || !cut->drop || !cut->centre || !cut->between)
		return TW_ERROR_MEMORY;
	for (uint32_t t = 0; t < instance->terminal_count; t++)
		cut->fate[instance->terminal[t]] = IN;
	return TW_OK;
}

/* The least weight, without base and in fixed point, that is of no use any more; INT64_MAX for none. Trees of equal
 * weight are not told apart here: a linear program cannot see tie-breaks. */
static int64_t useless_from(const struct cut_search *cut)
{
	const uint64_t units = cut->search->best_weight;
	if (units == UINT64_MAX)
		return INT64_MAX;
	return units > cut->base ? (int64_t)((units - cut->base) << cut->problem.fraction_bits) : 0;
}

/* A bound rounded up to whole units of the caller's. */
static int64_t round_up(const struct cut_search *cut, int64_t bound)
{
	const int64_t below = (INT64_C(1) << cut->problem.fraction_bits) - 1;
	return bound > INT64_MAX - below ? bound : (bound + below) & ~below;
}

static int is_closed_by(const struct cut_search *cut, int64_t bound)
{
	return round_up(cut, bound) >= useless_from(cut);
}

static void report_bound(struct cut_search *cut, int64_t bound)
{
	const struct instance *instance = &cut->search->instance;
	if (cut->depth || bound == INT64_MAX)
		return;
	const uint64_t units = (uint64_t)(round_up(cut, bound) >> cut->problem.fraction_bits) + cut->base;
	const fine_t fine = (fine_t)units << instance->shift;
	search_bound(cut->search, fine > instance->base ? fine - instance->base : 0);
}

static void fix_arc(struct cut_search *cut, uint32_t arc)
{
	if (!cut->problem.allowed[arc])
		return;
	cut->problem.allowed[arc] = 0;
	if (cut->depth)
		cut->fixed[cut->fixed_count++] = arc;
	else
		cut->problem.gone[arc] = 1;
}

/* An arc whose reduced cost closes the gap is in no better tree of this node. */
static void fix_by_reduced_costs(struct cut_search *cut, int64_t bound, const int64_t *reduced)
{
	for (uint32_t arc = 0; arc < cut->problem.arc_count; arc++)
		if (cut->problem.allowed[arc] &&
		    (reduced[arc] > INT64_MAX - bound || is_closed_by(cut, bound + reduced[arc])))
			fix_arc(cut, arc);
}

/* A tree that follows the solution: the more an arc is used, the cheaper its edge. */
static enum tw_status find_tree(struct cut_search *cut)
{
	struct search *search = cut->search;
	const struct instance *instance = &search->instance;
	for (uint32_t e = 0; e < instance->edge_count; e++) {
		double used = cut->lp.x[2 * e] > cut->lp.x[2 * e + 1] ? cut->lp.x[2 * e] : cut->lp.x[2 * e + 1];
		used = used > 1 ? 1 : used < 0 ? 0 : used;
		cut->path_cost[e] = (uint64_t)cut->problem.cost[2 * e] / 1024 * (1024 - (uint64_t)(used * 1023)) + 1;
	}
	return primal_repeat(search, cut->path_cost, 0, TREE_SHARE * (uint64_t)instance->edge_count);
}

/* Drops rows that were slack for some rounds, and rows of targets that are not targets any more. */
static enum tw_status drop_rows(struct cut_search *cut, uint8_t idle_rounds)
{
	uint32_t count = 0;
	for (uint32_t i = 0; i < cut->pool.count; i++) {
		cut->drop[i] = cut->fate[cut->pool.target[i]] != IN ||
			       (i < cut->lp.row_count && !cut->pool.pins[i] && cut->lp.idle[i] >= idle_rounds);
		count += cut->drop[i];
	}
	return count ? cut_lp_drop(&cut->lp, cut->drop) : TW_OK;
}

/* Cuts off the program's solution. A corner of the program's polyhedron is violated by very many cuts, most of which
 * move it to the next corner and no further; so first a point between the corner and the middle of what came before is
 * cut off, which takes cuts that are deep (W. Ben-Ameur & J. Neto, Acceleration of cutting-plane and column generation
 * algorithms, Networks 49, 2007; M. Fischetti et al., Thinning out Steiner trees, Math. Program. Comput. 9, 2017). */
static enum tw_status separate(struct cut_search *cut, uint32_t round, int *full)
{
	const double *x = cut->lp.x;
	const uint32_t before = cut->pool.count;
	for (uint32_t arc = 0; arc < cut->problem.arc_count; arc++) {
		const double last = round ? cut->centre[arc] : 1;
		cut->centre[arc] = cut->problem.allowed[arc] ? (last + x[arc]) / 2 : 0;
		cut->between[arc] = cut->centre[arc] + inward * (x[arc] - cut->centre[arc]);
	}
	enum tw_status status = cut_separate_flow(&cut->problem, x, &cut->pool);
	if (status == TW_OK)
		status = cut_separate(&cut->problem, cut->between, &cut->pool, full);
	if (status == TW_OK && cut->pool.count == before)
		status = cut_separate(&cut->problem, x, &cut->pool, full);
	return status;
}

/* One round of program, bound and cuts. *closed: nothing better is in this node. *settled: no further cuts. */
static enum tw_status run_round(struct cut_search *cut, uint32_t round, int *closed, int *settled)
{
	/* More than a unit below what is useless is rounded up to it. */
	const int64_t useless = useless_from(cut), unit = INT64_C(1) << cut->problem.fraction_bits;
	enum tw_status status = cut_lp_solve(&cut->lp, useless == INT64_MAX ? useless : useless - unit + 1);
	if (status != TW_OK)
		return status;
	if (cut->lp.is_solved && round % HEURISTIC_ROUNDS == 0 && (status = find_tree(cut)) != TW_OK)
		return status;
	report_bound(cut, cut->lp.bound);
	*closed = is_closed_by(cut, cut->lp.bound);
	*settled = !cut->lp.is_solved;
	if (*closed || *settled)
		return TW_OK;
	fix_by_reduced_costs(cut, cut->lp.bound, cut->lp.reduced);
	status = drop_rows(cut, IDLE_ROUNDS);
	const uint32_t before = cut->pool.count;
	int full = 0;
	if (status == TW_OK)
		status = separate(cut, round, &full);
	if (status == TW_OK && full && cut->pool.count == before) {
		status = drop_rows(cut, 1);
		*settled = 1;
	}
	*settled |= cut->pool.count == before;
	return status;
}

/* The bound of the program alone leaves fractions of units on the table: an ascent on the reduced costs collects them.
 */
static enum tw_status ascend_on_reduced(struct cut_search *cut, int *closed)
{
	int64_t gain = 0;
	memcpy(cut->reduced, cut->lp.reduced, cut->problem.arc_count * sizeof *cut->reduced);
	const enum tw_status status = cut_ascend(&cut->problem, cut->reduced, NULL, &gain);
	if (status != TW_OK)
		return status;
	if (gain == INT64_MAX || gain > INT64_MAX - cut->lp.bound || is_closed_by(cut, cut->lp.bound + gain)) {
		*closed = 1;
		return TW_OK;
	}
	report_bound(cut, cut->lp.bound + gain);
	fix_by_reduced_costs(cut, cut->lp.bound + gain, cut->reduced);
	return TW_OK;
}

/* A first bound and, in the beginning, the first cuts. */
static enum tw_status ascend_on_costs(struct cut_search *cut, int *closed)
{
	int64_t gain = 0;
	memcpy(cut->reduced, cut->problem.cost, cut->problem.arc_count * sizeof *cut->reduced);
	const enum tw_status status =
		cut_ascend(&cut->problem, cut->reduced, cut->pool.count ? NULL : &cut->pool, &gain);
	if (status != TW_OK)
		return status;
	*closed = gain == INT64_MAX || is_closed_by(cut, gain);
	report_bound(cut, gain);
	if (!*closed)
		fix_by_reduced_costs(cut, gain, cut->reduced);
	return TW_OK;
}

static enum tw_status bound_node(struct cut_search *cut, int *closed)
{
	enum tw_status status = ascend_on_costs(cut, closed);
	int64_t best = 0;
	uint32_t stalled = 0;
	int settled = 0;
	cut->lp.bound = 0;
	assert(cut->lp.reduced);
	memset(cut->lp.reduced, 0, cut->problem.arc_count * sizeof *cut->lp.reduced);
	for (uint32_t round = 0; status == TW_OK && !*closed && !settled; round++) {
		status = run_round(cut, round, closed, &settled);
		const int64_t least = (useless_from(cut) - best) / (cut->depth ? GAIN_SHARE_BELOW : GAIN_SHARE);
		stalled = cut->lp.bound > best + least ? 0 : stalled + 1;
		best = cut->lp.bound > best ? cut->lp.bound : best;
		settled |= stalled >= (cut->depth ? STALLED_ROUNDS_BELOW : STALLED_ROUNDS);
	}
	if (status == TW_OK && !*closed && cut->lp.is_solved) {
		status = find_tree(cut);
		if (status == TW_OK)
			status = ascend_on_reduced(cut, closed);
	}
	return status;
}

/* The vertex that the solution has most nearly by half; INSTANCE_NONE when all are decided. */
static uint32_t choose_vertex(const struct cut_search *cut)
{
	const struct instance *instance = &cut->search->instance;
	uint32_t best = INSTANCE_NONE;
	double best_distance = 2;
	for (uint32_t v = 0; v < instance->vertex_count; v++) {
		double entering = 0;
		int reachable = 0;
		if (cut->fate[v] != FREE)
			continue;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t arc = cut_arc_out(&cut->problem, v, a) ^ 1;
			reachable |= cut->problem.allowed[arc];
			if (cut->lp.is_solved)
				entering += cut->lp.x[arc];
		}
		const double distance = entering > 0.5 ? entering - 0.5 : 0.5 - entering;
		if (!reachable || distance >= best_distance)
			continue;
		best = v;
		best_distance = distance;
	}
	return best;
}

/* A forest is a tree that spans the terminals if it touches one vertex more than it has edges, the terminals among
 * them. */
static int spans_terminals(const struct primal_tree *tree)
{
	const struct instance *instance = tree->instance;
	uint32_t touched = 0;
	for (uint32_t v = 0; v < instance->vertex_count; v++)
		touched += tree->degree[v] > 0;
	for (uint32_t t = 0; t < instance->terminal_count; t++)
		if (!tree->degree[instance->terminal[t]])
			return 0;
	return touched == tree->edge_count + 1;
}

/* All vertices are decided: a minimum spanning tree of those that are in. It is made here, of the instance's edges,
 * because search_offer spans the caller's edges behind them. Where deletion by reduced costs took the last way to a
 * terminal, the node has no better tree, and there is nothing to offer. */
static enum tw_status offer_spanning_tree(struct cut_search *cut)
{
	struct search *search = cut->search;
	const struct instance *instance = &search->instance;
	const struct arena_mark mark = arena_mark(search->arena);
	struct primal_tree tree;
	uint32_t *edges = ARENA_ARRAY(search->arena, instance->edge_count, uint32_t), count = 0;
	enum tw_status status = edges ? primal_tree_init(&tree, search->arena, instance) : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		for (uint32_t e = 0; e < instance->edge_count; e++)
			if (cut->fate[instance->ends[2 * e]] == IN && cut->fate[instance->ends[2 * e + 1]] == IN &&
			    (cut->problem.allowed[2 * e] || cut->problem.allowed[2 * e + 1]))
				edges[count++] = e;
		primal_tree_set(&tree, edges, count, 1);
		if (spans_terminals(&tree))
			status = search_offer(search, tree.edge, tree.edge_count);
	}
	arena_release(search->arena, mark);
	return status;
}

static void apply(struct cut_search *cut)
{
	const struct decision *decision = &cut->decision[cut->depth - 1];
	const struct instance *instance = &cut->search->instance;
	const uint32_t v = decision->vertex;
	cut->fate[v] = (uint8_t)decision->fate;
	if (decision->fate == IN) {
		cut->problem.target[cut->problem.target_count++] = v;
		return;
	}
	for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
		const uint32_t arc = cut_arc_out(&cut->problem, v, a);
		fix_arc(cut, arc);
		fix_arc(cut, arc ^ 1);
	}
}

static void undo(struct cut_search *cut)
{
	const struct decision *decision = &cut->decision[cut->depth - 1];
	if (decision->fate == IN)
		cut->problem.target_count--;
	cut->fate[decision->vertex] = FREE;
	while (cut->fixed_count > decision->fixed_before)
		cut->problem.allowed[cut->fixed[--cut->fixed_count]] = 1;
}

static void branch(struct cut_search *cut, uint32_t vertex)
{
	cut_lp_remember(&cut->lp, &cut->basis[cut->depth]);
	cut->decision[cut->depth++] = (struct decision){
		.vertex = vertex,
		.fate = IN,
		.fixed_before = cut->fixed_count,
	};
	apply(cut);
}

/* Turns to the next open node; false when there is none. */
static int backtrack(struct cut_search *cut)
{
	while (cut->depth && cut->decision[cut->depth - 1].is_second) {
		undo(cut);
		cut->depth--;
	}
	if (!cut->depth)
		return 0;
	undo(cut);
	struct decision *decision = &cut->decision[cut->depth - 1];
	cut_lp_recall(&cut->lp, &cut->basis[cut->depth - 1]);
	decision->fate = decision->fate == IN ? OUT : IN;
	decision->is_second = 1;
	apply(cut);
	return 1;
}

static enum tw_status explore(struct cut_search *cut)
{
	for (;;) {
		int closed = 0;
		cut->search->stats->branch_nodes++;
		enum tw_status status = drop_rows(cut, UINT8_MAX);
		if (status == TW_OK)
			status = bound_node(cut, &closed);
		if (status != TW_OK)
			return status;
		const uint32_t vertex = closed ? INSTANCE_NONE : choose_vertex(cut);
		if (vertex != INSTANCE_NONE) {
			branch(cut, vertex);
			continue;
		}
		if (!closed && (status = offer_spanning_tree(cut)) != TW_OK)
			return status;
		if (!backtrack(cut))
			return TW_OK;
	}
}

enum tw_status cut_open(struct cut_search **opened, struct search *search)
{
	*opened = NULL;
	if (!search_uses(search, STEINER_CUTS) || 2 * (uint64_t)search->instance.edge_count > ARCS_MAX)
		return TW_ERROR_UNSUPPORTED;
	struct cut_search *cut = ARENA_ARRAY(search->arena, 1, struct cut_search);
	search->has_pivoted = true;
	enum tw_status status = cut ? cut_search_init(cut, search) : TW_ERROR_MEMORY;
	if (status != TW_OK)
		return status;
	status = cut_lp_init(&cut->lp, &cut->problem, &cut->pool);
	if (status == TW_OK)
		*opened = cut;
	else
		cut_lp_free(&cut->lp);
	return status;
}

enum tw_status cut_run(struct cut_search *cut)
{
	search_enter(cut->search, "branch and cut");
	const enum tw_status status = explore(cut);
	if (status == TW_OK) {
		const struct instance *instance = &cut->search->instance;
		search_bound(cut->search, ((fine_t)cut->search->best_weight << instance->shift) - instance->base);
	}
	return status;
}

void cut_close(struct cut_search *cut)
{
	if (cut)
		cut_lp_free(&cut->lp);
}
