/* Purpose: grow one terminal set, and keep the labels that an optimum could use.
 *
 * Y. Iwata & T. Shigemura, Separator-based pruned dynamic programming for Steiner tree (AAAI 2019). Let T be an optimum
 * that falls apart at v into a part that spans the set I, of weight cost(I, v), and the rest R. Then R has no vertex x
 * with cost(I, x) < cost(I, v): R and x's tree together would span everything for less. So v reaches all other
 * terminals without the *obstacles* {x: cost(I, x) < cost(I, v)}. Any subset of them will do, and any x whose cost is
 * that of a real tree, also where its label is pruned for other reasons. The comparison is strict, so that ties do no
 * harm.
 *
 * Here this is local. Vertices are settled outward; the ball grows. Now and then, whenever it is half as large again,
 * the *outside* is searched from the ball's neighbours: a search from all of them at once, which merges what meets,
 * closes what has been seen to its end, and stops as soon as at most one component is open. Around a ball on a mesh the
 * neighbours are connected among themselves, so that this costs little more than the perimeter; no embedding is needed.
 * Every component of the outside touches the ball, as the graph is connected; so the one left open holds all terminals
 * that were not seen.
 *   - Two components with terminals: no larger label is of use. The growth ends.
 *   - A component without: its vertices are dead.
 *   - An outside terminal was settled: it is an obstacle to all larger labels. The growth ends.
 * In the end the ball's vertices are given back, largest cost first, to a union-find of the components, which tells for
 * each label exactly whether v reached everything. The work is proportional to the balls and their surroundings; arrays
 * are stamped, never cleared.
 *
 * Future costs. S. Hougardy, J. Silvanus & J. Vygen, Dijkstra meets Steiner (Math. Program. Comput. 9, 2017), with
 * bounds from the dual. Write y for the cuts' values. T - the part, R, is a tree that spans the root, v and the other
 * terminals: it enters all cuts of the other terminals and, where v lies in it, a cut of a terminal in I. What it pays
 * beyond that is at least the reduced length of its path from the root to v. So R weighs at least sum of y over cuts of
 * terminals not in I  +  sum of y over cuts of terminals in I that hold v  +  from_root(v), and the whole exceeds the
 * bound by at least from_root(v) and what is here called the label's reduced cost. That is no less than the sum of the
 * arcs' reduced costs, and more where the part enters a cut twice. */
#include "solver/steiner/program/grow.h"

#include "solver/steiner/reduce/fix.h"
#include "solver/steiner/stamp.h"

#include <assert.h>
#include <string.h>

/* A cell's stamp holds epoch and state; with asserts on, the epochs begin near their end (stamp.h). */
#define EPOCH_LAST (STAMP_LAST >> 2)
#define EPOCH_FIRST (STAMP_FIRST >> 2)

static enum tw_status fill_depth(struct dp_grower *grower)
{
	const struct dual *dual = grower->dual;
	size_t n = grower->search->instance.vertex_count, k = grower->search->instance.terminal_count;
	grower->depth = ARENA_ZEROED(grower->search->arena, n * k, uint32_t);
	grower->from_root = ARENA_ARRAY(grower->search->arena, n, uint32_t);
	if (!grower->depth || !grower->from_root)
		return TW_ERROR_MEMORY;
	for (uint32_t b = 0; b < dual->ball_count; b++) {
		const struct dual_ball *ball = &dual->ball[b];
		const struct dual_member *member = dual->member + ball->start;
		if (!ball->applied)
			continue;
		for (uint32_t i = 0; i < ball->count; i++)
			grower->depth[member[i].vertex * k + ball->terminal] += ball->radius - member[i].distance;
	}
	dual_from_root(dual, grower->search, DUAL_FAR, grower->from_root);
	return TW_OK;
}

/* What a grower writes to. */
static enum tw_status allocate_scratch(struct dp_grower *grower, struct arena *arena)
{
	const struct instance *instance = &grower->search->instance;
	const size_t n = instance->vertex_count, labels = 2 * (size_t)instance->edge_count + n;
	grower->cell = ARENA_ZEROED(arena, n, struct dp_cell);
	grower->heap = (struct heap){.entry = ARENA_ARRAY(arena, labels, struct heap_entry), .capacity = labels};
	grower->start = ARENA_ARRAY(arena, n, uint32_t);
	grower->epoch = EPOCH_FIRST;
	grower->outside_epoch = STAMP_FIRST;
	grower->ball = ARENA_ARRAY(arena, n, uint32_t);
	grower->needed = ARENA_ZEROED(arena, n, uint8_t);
	grower->outside = ARENA_ZEROED(arena, n, struct dp_outside);
	grower->component = ARENA_ARRAY(arena, n + 1, struct dp_component);
	grower->frontier = ARENA_ARRAY(arena, n, uint32_t);
	return grower->cell && grower->heap.entry && grower->start && grower->ball && grower->needed &&
			       grower->outside && grower->component && grower->frontier
		       ? TW_OK
		       : TW_ERROR_MEMORY;
}

enum tw_status dp_grower_init(struct dp_grower *grower, struct search *search, const struct dual *dual, fine_t cutoff)
{
	const struct instance *instance = &search->instance;
	*grower = (struct dp_grower){
		.search = search,
		.dual = search_uses(search, STEINER_FUTURE_COST) ? dual : NULL,
		.cutoff = cutoff,
		.room = dual ? fix_room(dual, cutoff) : 0,
		.root = dual ? dual->root : 0,
	};
	struct dp_arc *arc = ARENA_ARRAY(search->arena, 2 * (size_t)instance->edge_count, struct dp_arc);
	if (!arc)
		return TW_ERROR_MEMORY;
	for (uint32_t a = 0; a < 2 * instance->edge_count; a++)
		arc[a] = (struct dp_arc){instance->head[a], instance->edge[a], instance->weight[instance->edge[a]]};
	grower->arc = arc;
	const enum tw_status status = allocate_scratch(grower, search->arena);
	return status == TW_OK && grower->dual ? fill_depth(grower) : status;
}

enum tw_status dp_grower_share(struct dp_grower *grower, struct arena *arena, const struct dp_grower *from,
			       struct search *counters)
{
	*grower = *from;
	grower->search = counters;
	return allocate_scratch(grower, arena);
}

/* --- the outside -------------------------------------------------------------------------------------------------- */

static inline uint32_t stamp_of(const struct dp_grower *grower, enum dp_state state)
{
	return grower->epoch << 2 | state;
}

static inline int in_ball(const struct dp_grower *grower, uint32_t v)
{
	uint32_t stamp = grower->cell[v].stamp;
	return stamp == stamp_of(grower, DP_SETTLED) || stamp == stamp_of(grower, DP_OBSTACLE);
}

static inline int is_outside_terminal(const struct dp_grower *grower, uint32_t v)
{
	uint32_t t = grower->search->instance.terminal_at[v];
	return t != INSTANCE_NONE && !(grower->bits[t / 64] >> (t % 64) & 1);
}

static uint32_t find(struct dp_component *component, uint32_t c)
{
	while (component[c].parent != c)
		c = component[c].parent = component[component[c].parent].parent;
	return c;
}

static uint32_t unite(struct dp_component *component, uint32_t a, uint32_t b)
{
	if (b < a) {
		uint32_t c = a;
		a = b;
		b = c;
	}
	component[b].parent = a;
	component[a].pending += component[b].pending;
	component[a].terminals += component[b].terminals;
	return a;
}

static void enter_outside(struct dp_grower *grower, uint32_t v, uint32_t component)
{
	assert(grower->outside[v].stamp != grower->outside_epoch);
	grower->outside[v] = (struct dp_outside){grower->outside_epoch, component};
	grower->component[component].pending++;
	grower->component[component].terminals += (uint32_t)is_outside_terminal(grower, v);
}

static uint32_t open_component(struct dp_grower *grower)
{
	uint32_t c = grower->component_count++;
	assert(c <= grower->search->instance.vertex_count); /* a vertex opens one at most */
	grower->component[c] = (struct dp_component){.parent = c};
	return c;
}

static void next_outside_epoch(struct dp_grower *grower)
{
	if (grower->outside_epoch >= STAMP_LAST) {
		memset(grower->outside, 0, grower->search->instance.vertex_count * sizeof *grower->outside);
		grower->outside_epoch = 0;
	}
	grower->outside_epoch++;
}

/* Puts every neighbour of the ball into a component of its own; returns how many there are. */
static uint32_t list_neighbours(struct dp_grower *grower)
{
	const struct instance *instance = &grower->search->instance;
	uint32_t count = 0;
	grower->component_count = 0;
	next_outside_epoch(grower);
	for (uint32_t i = 0; i < grower->ball_count; i++) {
		uint32_t v = grower->ball[i];
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			uint32_t u = instance->head[a];
			if (grower->outside[u].stamp == grower->outside_epoch || in_ball(grower, u))
				continue;
			grower->frontier[count++] = u;
			enter_outside(grower, u, open_component(grower));
		}
	}
	return count;
}

/* Searches the outside until at most one component is open, and gives that one the terminals that were not seen. */
static void search_outside(struct dp_grower *grower)
{
	const struct instance *instance = &grower->search->instance;
	struct dp_component *component = grower->component;
	uint32_t tail = list_neighbours(grower), open = tail, arcs = 0;
	for (uint32_t head = 0; head < tail && open > 1; head++) {
		uint32_t v = grower->frontier[head], c = find(component, grower->outside[v].component);
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			uint32_t u = instance->head[a];
			if (grower->outside[u].stamp == grower->outside_epoch) {
				uint32_t other = find(component, grower->outside[u].component);
				if (other != c) {
					c = unite(component, c, other);
					open--;
				}
			} else if (!in_ball(grower, u)) {
				grower->frontier[tail++] = u;
				enter_outside(grower, u, c);
			}
		}
		arcs += instance->first[v + 1] - instance->first[v];
		if (!--component[c].pending)
			open--;
	}
	grower->frontier_count = tail;
	uint32_t closed_terminals = 0, last = INSTANCE_NONE;
	for (uint32_t c = 0; c < grower->component_count; c++)
		if (component[c].parent == c) {
			if (component[c].pending)
				last = c;
			else
				closed_terminals += component[c].terminals;
		}
	if (last != INSTANCE_NONE)
		component[last].terminals = grower->outside_terminals - grower->ball_terminals - closed_terminals;
	grower->search->work += arcs;
}

/* What the outside says about labels larger than all in the ball: false when none is of use. Marks the dead. */
static int outside_holds(struct dp_grower *grower)
{
	search_outside(grower);
	struct dp_component *component = grower->component;
	for (uint32_t c = 0; c < grower->component_count; c++)
		if (component[c].parent == c && component[c].terminals &&
		    component[c].terminals != grower->outside_terminals)
			return 0;
	for (uint32_t i = 0; i < grower->frontier_count; i++) {
		uint32_t v = grower->frontier[i];
		if (!component[find(component, grower->outside[v].component)].terminals)
			grower->cell[v].stamp = stamp_of(grower, DP_DEAD);
	}
	return 1;
}

/* --- future costs ------------------------------------------------------------------------------------------------- */

/* What a label's tree weighs beyond its share of the bound: its cost, less the values of its terminals' cuts that do
 * not hold v. */
static inline uint32_t reduced_cost(const struct dp_grower *grower, uint32_t v, fine_t cost)
{
	if (!grower->dual)
		return 0;
	const uint32_t *depth = grower->depth + (size_t)v * grower->search->instance.terminal_count;
	uint64_t reduced = (uint64_t)(cost >> grower->dual->coarse_shift);
	for (uint32_t i = 0; i < grower->member_count; i++)
		reduced += depth[grower->member[i]];
	/* Rounding of cost may bring it one below. */
	return reduced > grower->value ? (uint32_t)(reduced - grower->value) : 0;
}

/* Whether a tree below the cutoff may hold the label. */
static inline int is_affordable(const struct dp_grower *grower, uint32_t v, fine_t cost)
{
	if (!grower->dual)
		return 1;
	return (uint64_t)reduced_cost(grower, v, cost) + grower->from_root[v] < grower->room;
}

static void next_epoch(struct dp_grower *grower)
{
	if (grower->epoch >= EPOCH_LAST) {
		memset(grower->cell, 0, grower->search->instance.vertex_count * sizeof *grower->cell);
		grower->epoch = 0;
	}
	grower->epoch++;
}

/* --- growth ------------------------------------------------------------------------------------------------------- */

void dp_grow_start(struct dp_grower *grower, const uint32_t *members, uint32_t member_count, const uint64_t *bits)
{
	const struct instance *instance = &grower->search->instance;
	grower->member = members;
	grower->member_count = member_count;
	grower->bits = bits;
	grower->outside_terminals = instance->terminal_count - member_count;
	grower->value = 0;
	for (uint32_t i = 0; i < member_count && grower->dual; i++)
		grower->value += grower->dual->value[members[i]];
	next_epoch(grower);
	grower->ball_count = grower->ball_terminals = grower->start_count = 0;
	grower->heap.count = 0;
}

void dp_grow_add(struct dp_grower *grower, uint32_t vertex, fine_t cost, uint32_t from)
{
	struct dp_cell *cell = &grower->cell[vertex];
	const bool is_new = cell->stamp != stamp_of(grower, DP_REACHED);
	if (!is_new && cell->cost <= cost)
		return;
	if (is_new)
		grower->start[grower->start_count++] = vertex;
	*cell = (struct dp_cell){cost, from, stamp_of(grower, DP_REACHED)};
}

static void relax(struct dp_grower *grower, uint32_t v, fine_t cost)
{
	const struct instance *instance = &grower->search->instance;
	const struct dp_arc *arc = grower->arc;
	uint32_t reached = stamp_of(grower, DP_REACHED);
	for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
		uint32_t u = arc[a].head;
		fine_t longer = cost + arc[a].weight;
		struct dp_cell *cell = &grower->cell[u];
		if (longer >= grower->cutoff || (cell->stamp == reached && cell->cost <= longer) ||
		    (cell->stamp > reached && cell->stamp <= (reached | 3)))
			continue;
		*cell = (struct dp_cell){longer, arc[a].edge, reached};
		heap_push(&grower->heap, longer, u, 0);
	}
	grower->search->work += instance->first[v + 1] - instance->first[v];
}

enum { FIRST_CHECK = 12 };

/* Settles vertices outward until no larger label can be of use. */
static void settle(struct dp_grower *grower)
{
	int separators = search_uses(grower->search, STEINER_SEPARATORS);
	uint32_t next_check = FIRST_CHECK;
	fine_t last = 0, end = FINE_MAX; /* labels above `end` are of no use */
	for (uint32_t i = 0; i < grower->start_count; i++)
		heap_push(&grower->heap, grower->cell[grower->start[i]].cost, grower->start[i], 0);
	while (grower->heap.count) {
		struct heap_entry top = heap_pop(&grower->heap);
		uint32_t v = top.item;
		struct dp_cell *cell = &grower->cell[v];
		if (top.key > end)
			break;
		if (cell->stamp != stamp_of(grower, DP_REACHED) || cell->cost != top.key)
			continue;
		if (separators && grower->ball_count >= next_check && top.key > last) {
			if (!outside_holds(grower))
				break;
			next_check = grower->ball_count + grower->ball_count / 2;
			if (cell->stamp == stamp_of(grower, DP_DEAD))
				continue;
		}
		assert(top.key >= last && grower->ball_count < grower->search->instance.vertex_count);
		last = top.key;
		grower->ball[grower->ball_count++] = v;
		if (separators && is_outside_terminal(grower, v)) {
			grower->ball_terminals++;
			end = top.key;
		}
		if (!is_affordable(grower, v, top.key)) {
			cell->stamp = stamp_of(grower, DP_OBSTACLE);
			continue;
		}
		cell->stamp = stamp_of(grower, DP_SETTLED);
		relax(grower, v, top.key);
	}
	grower->heap.count = 0;
}

/* Gives v back to the outside: it becomes a component together with its outside neighbours. */
static void give_back(struct dp_grower *grower, uint32_t v)
{
	const struct instance *instance = &grower->search->instance;
	uint32_t c = open_component(grower);
	enter_outside(grower, v, c);
	for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
		uint32_t u = instance->head[a];
		if (grower->outside[u].stamp != grower->outside_epoch)
			continue;
		uint32_t other = find(grower->component, grower->outside[u].component);
		if (other != c)
			c = unite(grower->component, c, other);
	}
}

static int reaches_all(struct dp_grower *grower, uint32_t v)
{
	uint32_t c = find(grower->component, grower->outside[v].component);
	return grower->component[c].terminals == grower->outside_terminals;
}

enum { LEADS = 1, USEFUL = 2 };

/* Marks in grower->needed which labels an optimum could use, and which lead to them. */
static void mark_useful(struct dp_grower *grower)
{
	const struct instance *instance = &grower->search->instance;
	int separators = search_uses(grower->search, STEINER_SEPARATORS);
	if (separators)
		search_outside(grower);
	for (uint32_t end = grower->ball_count, begin; end; end = begin) {
		fine_t cost = grower->cell[grower->ball[end - 1]].cost;
		for (begin = end; begin && grower->cell[grower->ball[begin - 1]].cost == cost; begin--)
			if (separators)
				give_back(grower, grower->ball[begin - 1]);
		for (uint32_t i = end; i-- > begin;) {
			uint32_t v = grower->ball[i], from = grower->cell[v].from;
			assert(!(grower->needed[v] & USEFUL));
			if (grower->cell[v].stamp != stamp_of(grower, DP_SETTLED))
				continue;
			if (!separators || reaches_all(grower, v))
				grower->needed[v] = USEFUL;
			if (grower->needed[v] && from != INSTANCE_NONE && !(from & DP_MERGED)) {
				uint32_t u = instance->ends[2 * from] ^ instance->ends[2 * from + 1] ^ v;
				grower->needed[u] |= LEADS;
			}
		}
	}
}

uint32_t dp_grow(struct dp_grower *grower, struct dp_label *labels, uint32_t *useful, struct dp_trail *trails)
{
	settle(grower);
	mark_useful(grower);
	uint32_t count = 0, kept = 0;
	for (uint32_t i = 0; i < grower->ball_count; i++) {
		uint32_t v = grower->ball[i];
		assert(grower->cell[v].stamp != stamp_of(grower, DP_REACHED));
		if (grower->needed[v])
			trails[kept++] = (struct dp_trail){v, grower->cell[v].from};
		if (grower->needed[v] & USEFUL)
			labels[count++] = (struct dp_label){
				.cost = grower->cell[v].cost,
				.vertex = v,
				.reduced = reduced_cost(grower, v, grower->cell[v].cost),
			};
		grower->needed[v] = 0;
	}
	*useful = count;
	return kept;
}
