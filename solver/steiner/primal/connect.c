/* Purpose: the exact step of the local search: k pieces of a broken tree are joined by a lightest forest between them.
 *
 * 1. A Dijkstra from all pieces at once finds the two nearest pieces of every vertex (d1 <= d2), and the radius of each
 *    piece: how far it is from it to a vertex that is nearer to another. A tree that uses a vertex v and weighs less
 * than `limit` has d1(v) + d2(v) + (sum of the k - 2 smallest radii) < limit (T. Polzin & S. Vahdati Daneshmand,
 * Improved algorithms for the Steiner problem in networks, Discrete Appl. Math. 112, 2001). The vertices that pass are
 * the region.
 * 2. In the region, the dynamic program of Erickson, Monma & Veinott (Send-and-split method for minimum-concave-cost
 *    network flows, Math. Oper. Res. 12, 1987) over sets of pieces. A label is dropped when its cost and the longest
 *    distance that it still has to bridge, or half the round trip through two missing pieces, reach the limit.
 *
 * The caller uses it as a heuristic and checks the result, so that nothing here need be proven. */
#include "solver/steiner/primal/connect.h"

#include "solver/steiner/stamp.h"

#include <string.h>

enum { HEAP_ENTRIES_MAX = 1 << 21, LABELS_MAX = 3 << 20 };

#define FAR FINE_MAX
#define FROM_NONE UINT32_MAX
#define FROM_SPLIT 0x80000000u /* with the set of one half; else the arc by which the label came */

enum tw_status primal_connect_init(struct primal_connect *connect, struct arena *arena, struct search *search)
{
	const struct instance *instance = &search->instance;
	const size_t n = instance->vertex_count, arcs = 2 * (size_t)instance->edge_count;
	const size_t heap = 2 * arcs + n < HEAP_ENTRIES_MAX ? 2 * arcs + n : HEAP_ENTRIES_MAX;
	const size_t labels = n << PRIMAL_PIECES_MAX < LABELS_MAX ? n << PRIMAL_PIECES_MAX : LABELS_MAX;
	*connect = (struct primal_connect){
		.search = search,
		.round = STAMP_FIRST,
		.seen = ARENA_ZEROED(arena, n, uint32_t),
		.nearest = ARENA_ARRAY(arena, n, struct primal_nearest),
		.touched = ARENA_ARRAY(arena, n, uint32_t),
		.heap = {.entry = ARENA_ARRAY(arena, heap, struct heap_entry), .capacity = heap},
		.vertex = ARENA_ARRAY(arena, n, uint32_t),
		.local = ARENA_ARRAY(arena, n, uint32_t),
		.first = ARENA_ARRAY(arena, n + 1, uint32_t),
		.arc = ARENA_ARRAY(arena, arcs, struct primal_arc),
		.cost = ARENA_ARRAY(arena, labels, fine_t),
		.from = ARENA_ARRAY(arena, labels, uint32_t),
		.label_capacity = labels,
	};
	return connect->seen && connect->nearest && connect->touched && connect->heap.entry && connect->vertex &&
			       connect->local && connect->first && connect->arc && connect->cost && connect->from
		       ? TW_OK
		       : TW_ERROR_MEMORY;
}

/* A path of this length from the piece reaches v. Keeps the two nearest of different pieces. */
static int offer_path(struct primal_connect *connect, uint32_t v, fine_t distance, uint8_t piece)
{
	struct primal_nearest *nearest = &connect->nearest[v];
	if (connect->seen[v] != connect->round) {
		connect->seen[v] = connect->round;
		connect->touched[connect->touched_count++] = v;
		*nearest = (struct primal_nearest){{FAR, FAR}, {UINT8_MAX, UINT8_MAX}, 0};
	}
	/* A settled place no longer changes: what comes later is not nearer. */
	if (nearest->settled > 1 || (nearest->settled && nearest->piece[0] == piece))
		return 0;
	if (!nearest->settled) {
		if (piece == nearest->piece[0]) {
			if (distance >= nearest->distance[0])
				return 0;
			nearest->distance[0] = distance;
			return 1;
		}
		if (distance < nearest->distance[0]) {
			nearest->distance[1] = nearest->distance[0];
			nearest->piece[1] = nearest->piece[0];
			nearest->distance[0] = distance;
			nearest->piece[0] = piece;
			return 1;
		}
	}
	if (distance >= nearest->distance[1])
		return 0;
	nearest->distance[1] = distance;
	nearest->piece[1] = piece;
	return 1;
}

/* False when the workspace is too small or the search stops. */
static int grow_pieces(struct primal_connect *connect, const uint32_t *members, const uint8_t *pieces,
		       uint32_t member_count, fine_t limit, uint32_t touched_max)
{
	const struct instance *instance = &connect->search->instance;
	struct heap *heap = &connect->heap;
	heap->count = 0;
	connect->round = stamp_next(connect->round, connect->seen, instance->vertex_count);
	connect->touched_count = 0;
	for (uint32_t i = 0; i < member_count; i++) {
		offer_path(connect, members[i], 0, pieces[i]);
		if (heap->count == heap->capacity)
			return 0;
		heap_push(heap, 0, members[i], pieces[i]);
	}
	uint64_t work = 0;
	while (heap->count) {
		const struct heap_entry top = heap_pop(heap);
		const uint32_t v = top.item;
		struct primal_nearest *nearest = &connect->nearest[v];
		const unsigned place = nearest->settled;
		if (place > 1 || nearest->piece[place] != top.extra || nearest->distance[place] != top.key)
			continue;
		nearest->settled++;
		const fine_t before = place ? nearest->distance[0] : top.key;
		if (before >= limit - top.key || connect->touched_count > touched_max)
			continue;
		const uint32_t end = instance->first[v + 1];
		work += end - instance->first[v];
		if (heap->count + (end - instance->first[v]) > heap->capacity)
			return 0;
		for (uint32_t a = instance->first[v]; a < end; a++) {
			const uint32_t u = instance->head[a];
			const fine_t distance = top.key + instance->weight[instance->edge[a]];
			if (distance < limit && (!connect->allowed || connect->allowed[u]) &&
			    offer_path(connect, u, distance, (uint8_t)top.extra))
				heap_push(heap, distance, u, top.extra);
		}
	}
	return search_spend(connect->search, work) && connect->touched_count <= touched_max;
}

/* The sum of the k - 2 smallest radii. */
static fine_t sum_radii(const struct primal_connect *connect, uint32_t piece_count, fine_t limit)
{
	const struct instance *instance = &connect->search->instance;
	fine_t radius[PRIMAL_PIECES_MAX], sum = 0;
	for (uint32_t i = 0; i < piece_count; i++)
		radius[i] = limit / 2;
	for (uint32_t i = 0; i < connect->touched_count; i++) {
		const uint32_t v = connect->touched[i];
		const struct primal_nearest *nearest = &connect->nearest[v];
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t u = instance->head[a];
			if (connect->seen[u] != connect->round || connect->nearest[u].piece[0] == nearest->piece[0])
				continue;
			const fine_t out = nearest->distance[0] + instance->weight[instance->edge[a]];
			if (out < radius[nearest->piece[0]])
				radius[nearest->piece[0]] = out;
		}
	}
	fine_t largest[2] = {0, 0};
	for (uint32_t i = 0; i < piece_count; i++) {
		sum += radius[i];
		if (radius[i] > largest[0]) {
			largest[1] = largest[0];
			largest[0] = radius[i];
		} else if (radius[i] > largest[1]) {
			largest[1] = radius[i];
		}
	}
	return sum - largest[0] - largest[1];
}

static int choose_region(struct primal_connect *connect, fine_t limit, uint32_t region_max)
{
	const struct instance *instance = &connect->search->instance;
	connect->region_count = 0;
	for (uint32_t i = 0; i < connect->touched_count; i++) {
		const uint32_t v = connect->touched[i];
		const struct primal_nearest *nearest = &connect->nearest[v];
		connect->local[v] = FROM_NONE;
		if (nearest->settled < 2 || nearest->distance[0] >= limit ||
		    nearest->distance[1] >= limit - nearest->distance[0])
			continue;
		if (connect->region_count == region_max)
			return 0;
		connect->local[v] = connect->region_count;
		connect->vertex[connect->region_count++] = v;
	}
	uint32_t count = 0;
	for (uint32_t i = 0; i < connect->region_count; i++) {
		const uint32_t v = connect->vertex[i];
		connect->first[i] = count;
		for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
			const uint32_t u = instance->head[a];
			if (connect->seen[u] == connect->round && connect->local[u] != FROM_NONE)
				connect->arc[count++] = (struct primal_arc){connect->local[u], i, instance->edge[a]};
		}
	}
	connect->first[connect->region_count] = count;
	return count + connect->region_count <= connect->heap.capacity;
}

/* What a label of a set at v must still bridge at least; `distance` is by piece. */
static fine_t future_cost(const fine_t *distance, uint32_t region_count, fine_t (*between)[PRIMAL_PIECES_MAX],
			  uint32_t missing, uint32_t v)
{
	fine_t most = 0;
	for (uint32_t left = missing; left; left &= left - 1) {
		const uint32_t i = (uint32_t)__builtin_ctz(left);
		const fine_t to_i = distance[(size_t)i * region_count + v];
		if (to_i == FAR)
			return FAR;
		if (to_i > most)
			most = to_i;
		for (uint32_t other = left & (left - 1); other; other &= other - 1) {
			const uint32_t j = (uint32_t)__builtin_ctz(other);
			const fine_t to_j = distance[(size_t)j * region_count + v];
			if (to_j == FAR)
				return FAR;
			const fine_t round_trip = (to_i + to_j + between[i][j]) / 2;
			if (round_trip > most)
				most = round_trip;
		}
	}
	return most;
}

/* Dijkstra in the region from the labels that `cost` holds. `missing` 0: no future cost. */
static int spread(struct primal_connect *connect, fine_t *cost, uint32_t *from, fine_t (*between)[PRIMAL_PIECES_MAX],
		  uint32_t missing, fine_t limit)
{
	const uint32_t r = connect->region_count;
	const struct instance *instance = &connect->search->instance;
	struct heap *heap = &connect->heap;
	uint64_t work = r;
	heap->count = 0;
	for (uint32_t v = 0; v < r; v++)
		if (cost[v] != FAR)
			heap_push(heap, cost[v], v, 0);
	while (heap->count) {
		const struct heap_entry top = heap_pop(heap);
		if (top.key != cost[top.item])
			continue;
		const uint32_t end = connect->first[top.item + 1];
		work += end - connect->first[top.item];
		for (uint32_t a = connect->first[top.item]; a < end; a++) {
			const struct primal_arc *arc = &connect->arc[a];
			const fine_t distance = top.key + instance->weight[arc->edge];
			if (distance >= cost[arc->head] || distance >= limit)
				continue;
			if (missing) {
				const fine_t future = future_cost(connect->distance, r, between, missing, arc->head);
				if (future >= limit - distance)
					continue;
			}
			cost[arc->head] = distance;
			from[arc->head] = a;
			heap_push(heap, distance, arc->head, 0);
		}
	}
	return search_spend(connect->search, work);
}

/* Distances from every piece, and between the pieces. The root piece's stand in the rows of `spare`. */
static int measure(struct primal_connect *connect, const uint32_t *members, const uint8_t *pieces,
		   uint32_t member_count, uint32_t piece_count, uint32_t *from, fine_t limit,
		   fine_t (*between)[PRIMAL_PIECES_MAX])
{
	const uint32_t r = connect->region_count;
	memset(connect->distance, 0xff, (size_t)piece_count * r * sizeof(fine_t));
	memset(from, 0xff, (size_t)piece_count * r * sizeof *from);
	for (uint32_t i = 0; i < member_count; i++)
		if (connect->local[members[i]] != FROM_NONE)
			connect->distance[(size_t)pieces[i] * r + connect->local[members[i]]] = 0;
	for (uint32_t i = 0; i < piece_count; i++)
		if (!spread(connect, connect->distance + (size_t)i * r, from + (size_t)i * r, NULL, 0, limit))
			return 0;
	for (uint32_t i = 0; i < piece_count; i++)
		for (uint32_t j = 0; j < piece_count; j++)
			between[i][j] = FAR;
	for (uint32_t m = 0; m < member_count; m++) {
		const uint32_t v = connect->local[members[m]];
		if (v == FROM_NONE)
			continue;
		for (uint32_t i = 0; i < piece_count; i++)
			if (connect->distance[(size_t)i * r + v] < between[i][pieces[m]])
				between[i][pieces[m]] = connect->distance[(size_t)i * r + v];
	}
	for (uint32_t i = 0; i < piece_count; i++)
		for (uint32_t j = 0; j < piece_count; j++)
			if (between[i][j] == FAR)
				return 0;
	return 1;
}

/* The labels of `set` from the halves of it. */
static uint64_t split(struct primal_connect *connect, uint32_t set, uint32_t missing,
		      fine_t (*between)[PRIMAL_PIECES_MAX], fine_t limit)
{
	const uint32_t r = connect->region_count, lowest = set & (0u - set);
	fine_t *cost = connect->cost + (size_t)set * r;
	uint32_t *from = connect->from + (size_t)set * r;
	uint64_t work = 0;
	memset(cost, 0xff, r * sizeof *cost);
	memset(from, 0xff, r * sizeof *from);
	for (uint32_t half = (set - 1) & set; half; half = (half - 1) & set) {
		if (!(half & lowest))
			continue;
		const fine_t *a = connect->cost + (size_t)half * r, *b = connect->cost + (size_t)(set ^ half) * r;
		work += r / 4;
		for (uint32_t v = 0; v < r; v++) {
			if (a[v] == FAR || b[v] == FAR || a[v] + b[v] >= cost[v])
				continue;
			cost[v] = a[v] + b[v];
			from[v] = FROM_SPLIT | half;
		}
	}
	for (uint32_t v = 0; v < r; v++)
		if (cost[v] != FAR &&
		    (cost[v] >= limit || future_cost(connect->distance, r, between, missing, v) >= limit - cost[v]))
			cost[v] = FAR;
	return work;
}

/* Follows the labels back from (set, v) and writes their edges. A set's lowest piece leads each step, so that the
 * stack of open halves stays below the number of pieces. */
static uint32_t trace(const struct primal_connect *connect, uint32_t set, uint32_t v, uint32_t *edges, uint32_t count)
{
	struct {
		uint32_t set, v;
	} open[PRIMAL_PIECES_MAX + 1];
	uint32_t top = 0;
	const uint32_t room = connect->search->instance.vertex_count;
	open[top].set = set;
	open[top++].v = v;
	while (top) {
		top--;
		set = open[top].set;
		v = open[top].v;
		for (;;) {
			const uint32_t from = connect->from[(size_t)set * connect->region_count + v];
			if (from == FROM_NONE)
				break;
			if (from & FROM_SPLIT) {
				open[top].set = set ^ (from & ~FROM_SPLIT);
				open[top++].v = v;
				set = from & ~FROM_SPLIT;
				continue;
			}
			if (count == room)
				return 0;
			edges[count++] = connect->arc[from].edge;
			v = connect->arc[from].tail;
		}
	}
	return count;
}

uint32_t primal_connect_pieces(struct primal_connect *connect, const uint32_t *members, const uint8_t *pieces,
			       uint32_t member_count, uint32_t piece_count, fine_t limit, uint32_t region_max,
			       uint32_t *edges)
{
	fine_t between[PRIMAL_PIECES_MAX][PRIMAL_PIECES_MAX];
	const uint32_t root = piece_count - 1, sets = 1u << root;
	if (!grow_pieces(connect, members, pieces, member_count, limit, 8 * region_max))
		return 0;
	const fine_t radii = sum_radii(connect, piece_count, limit);
	if (radii >= limit || !choose_region(connect, limit - radii, region_max))
		return 0;
	const uint32_t r = connect->region_count;
	if (!r || (size_t)r * (sets + piece_count) > connect->label_capacity)
		return 0;
	/* The sets' labels come first, the distances from single pieces behind them. */
	connect->distance = connect->cost + (size_t)sets * r;
	uint32_t *from = connect->from + (size_t)sets * r;
	if (!measure(connect, members, pieces, member_count, piece_count, from, limit, between))
		return 0;
	uint64_t work = 0;
	for (uint32_t set = 1; set < sets; set++) {
		fine_t *cost = connect->cost + (size_t)set * r;
		if (!(set & (set - 1))) {
			const size_t piece = (size_t)__builtin_ctz(set);
			memcpy(cost, connect->distance + piece * r, r * sizeof *cost);
			memcpy(connect->from + (size_t)set * r, from + piece * r, r * sizeof *from);
			continue;
		}
		const uint32_t missing = (2 * sets - 1) & ~set;
		work += split(connect, set, missing, between, limit);
		if (set + 1 < sets && !spread(connect, cost, connect->from + (size_t)set * r, between, missing, limit))
			return 0;
	}
	fine_t best = limit;
	uint32_t at = FROM_NONE;
	const fine_t *all = connect->cost + (size_t)(sets - 1) * r, *home = connect->distance + (size_t)root * r;
	for (uint32_t v = 0; v < r; v++)
		if (all[v] != FAR && home[v] != FAR && all[v] + home[v] < best) {
			best = all[v] + home[v];
			at = v;
		}
	if (!search_spend(connect->search, work) || at == FROM_NONE)
		return 0;
	const uint32_t count = trace(connect, sets - 1, at, edges, 0);
	/* The root's path stands behind the sets: give it a set number of its own. */
	return trace(connect, sets + root, at, edges, count);
}
