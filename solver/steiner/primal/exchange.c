/* Purpose: one neighbourhood for all the classic moves on Steiner trees.
 *
 * A tree is a tree of *key vertices* (terminals and branching vertices) joined by *key paths*. Taking one key path out
 * and reconnecting the two pieces is key-path exchange; dissolving a branching vertex with all its key paths is
 * key-vertex elimination (E. Uchoa & R. F. Werneck, Fast local search for the Steiner problem in graphs, ACM JEA 17,
 * 2012). Here a whole connected group of key vertices is dissolved, as long as no more than k pieces are left, and the
 * pieces are joined anew by an exact program: with k = 3 that contains both moves, and larger k is exact search in
 * larger neighbourhoods. What is put in is never heavier than what was taken out. */
#include "solver/steiner/primal/exchange.h"

#include <assert.h>
#include <string.h>

enum { PIECE_NONE = UINT8_MAX };

enum tw_status primal_exchange_init(struct primal_exchange *exchange, struct arena *arena, struct primal_tree *tree,
				    struct primal_connect *connect)
{
	const size_t n = tree->instance->vertex_count;
	*exchange = (struct primal_exchange){
		.tree = tree,
		.connect = connect,
		.clock = 1,
		.changed = ARENA_ZEROED(arena, n, uint32_t),
		.tried = ARENA_ZEROED(arena, n, uint32_t),
		.piece = ARENA_ARRAY(arena, n, uint8_t),
		.cut = ARENA_ARRAY(arena, n, uint32_t),
		.member = ARENA_ARRAY(arena, n, uint32_t),
		.member_piece = ARENA_ARRAY(arena, n, uint8_t),
		.edges = ARENA_ARRAY(arena, 2 * n, uint32_t),
		.added = ARENA_ARRAY(arena, n, uint32_t),
	};
	if (!exchange->changed || !exchange->tried || !exchange->piece || !exchange->cut || !exchange->member ||
	    !exchange->member_piece || !exchange->edges || !exchange->added)
		return TW_ERROR_MEMORY;
	memset(exchange->piece, PIECE_NONE, n);
	return TW_OK;
}

/* A key vertex at the rim of the part that is taken out. */
struct rim {
	uint32_t vertex;
	uint32_t left; /* key paths of it that are still in the tree */
};

/* Takes the key path out that leaves v by the edge e, and returns its other end. */
static uint32_t take_path(struct primal_exchange *exchange, uint32_t v, uint32_t e)
{
	struct primal_tree *tree = exchange->tree;
	const struct instance *instance = tree->instance;
	for (;;) {
		tree->has[e] = 0;
		exchange->cut[exchange->cut_count++] = e;
		exchange->cut_weight += instance->weight[e];
		v ^= instance->ends[2 * e] ^ instance->ends[2 * e + 1];
		if (exchange->changed[v] > exchange->cut_changed)
			exchange->cut_changed = exchange->changed[v];
		if (primal_tree_is_key(tree, v))
			return v;
		uint32_t a = instance->first[v];
		while (!tree->has[instance->edge[a]])
			a++;
		e = instance->edge[a];
	}
}

/* Takes out all key paths that are left at v; their far ends go to the rim. */
static uint32_t dissolve(struct primal_exchange *exchange, uint32_t v, struct rim *rim, uint32_t rim_count)
{
	struct primal_tree *tree = exchange->tree;
	const struct instance *instance = tree->instance;
	for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++)
		if (tree->has[instance->edge[a]]) {
			const uint32_t u = take_path(exchange, v, instance->edge[a]);
			assert(rim_count < 2 * PRIMAL_PIECES_MAX + 2);
			rim[rim_count++] = (struct rim){u, tree->degree[u] - 1};
		}
	return rim_count;
}

/* Takes a part around `seed` out of the tree that leaves at most `most` pieces. Returns how many, and a vertex of each
 * in `pins`. The rim is a queue, so that the part grows evenly. */
static uint32_t take_part(struct primal_exchange *exchange, uint32_t seed, uint32_t most, uint32_t *pins)
{
	const struct primal_tree *tree = exchange->tree;
	struct rim rim[2 * PRIMAL_PIECES_MAX + 2];
	uint32_t count = 0, pin_count = 0;
	const int seed_stays = tree->instance->terminal_at[seed] != INSTANCE_NONE;
	exchange->cut_count = 0;
	exchange->cut_weight = 0;
	exchange->cut_changed = exchange->changed[seed];
	if (tree->degree[seed] + (uint32_t)seed_stays > most)
		return 0;
	count = dissolve(exchange, seed, rim, 0);
	if (seed_stays)
		pins[pin_count++] = seed;
	uint32_t pieces = count + pin_count;
	for (uint32_t i = 0; i < count; i++) {
		const uint32_t u = rim[i].vertex;
		const int stays = tree->instance->terminal_at[u] != INSTANCE_NONE;
		const uint32_t more = stays ? rim[i].left : rim[i].left - 1;
		if (!rim[i].left || pieces + more > most || count + rim[i].left > 2 * PRIMAL_PIECES_MAX) {
			pins[pin_count++] = u;
			continue;
		}
		count = dissolve(exchange, u, rim, count);
		if (stays)
			pins[pin_count++] = u;
		pieces += more;
	}
	return pin_count;
}

/* Lists the vertices that are left in the tree, piece by piece. */
static uint32_t list_members(struct primal_exchange *exchange, const uint32_t *pins, uint32_t pin_count)
{
	const struct primal_tree *tree = exchange->tree;
	const struct instance *instance = tree->instance;
	uint32_t count = 0;
	for (uint32_t p = 0; p < pin_count; p++) {
		uint32_t next = count;
		assert(exchange->piece[pins[p]] == PIECE_NONE);
		exchange->piece[pins[p]] = (uint8_t)p;
		exchange->member[count++] = pins[p];
		while (next < count) {
			const uint32_t v = exchange->member[next];
			exchange->member_piece[next++] = (uint8_t)p;
			for (uint32_t a = instance->first[v]; a < instance->first[v + 1]; a++) {
				const uint32_t u = instance->head[a];
				if (!tree->has[instance->edge[a]] || exchange->piece[u] != PIECE_NONE)
					continue;
				exchange->piece[u] = (uint8_t)p;
				exchange->member[count++] = u;
			}
		}
	}
	for (uint32_t i = 0; i < count; i++)
		exchange->piece[exchange->member[i]] = PIECE_NONE;
	return count;
}

static void touch(struct primal_exchange *exchange, const uint32_t *edges, uint32_t count)
{
	const struct instance *instance = exchange->tree->instance;
	for (uint32_t i = 0; i < count; i++)
		exchange->changed[instance->ends[2 * edges[i]]] = exchange->changed[instance->ends[2 * edges[i] + 1]] =
			exchange->clock;
}

static void put_back(struct primal_exchange *exchange)
{
	for (uint32_t i = 0; i < exchange->cut_count; i++)
		exchange->tree->has[exchange->cut[i]] = 1;
}

/* The tree becomes what is left of it and the added edges. */
static void adopt(struct primal_exchange *exchange, uint32_t added_count)
{
	struct primal_tree *tree = exchange->tree;
	uint32_t count = 0;
	for (uint32_t i = 0; i < tree->edge_count; i++)
		if (tree->has[tree->edge[i]])
			exchange->edges[count++] = tree->edge[i];
	assert(count + added_count <= 2 * (size_t)tree->instance->vertex_count);
	memcpy(exchange->edges + count, exchange->added, added_count * sizeof(uint32_t));
	primal_tree_set(tree, exchange->edges, count + added_count, 0);
	touch(exchange, exchange->cut, exchange->cut_count);
	touch(exchange, exchange->added, added_count);
}

/* When the clock has used up its numbers, everything counts as changed and nothing as tried. */
static void tick(struct primal_exchange *exchange)
{
	const size_t n = exchange->tree->instance->vertex_count;
	if (++exchange->clock)
		return;
	exchange->clock = 1;
	memset(exchange->changed, 0, n * sizeof *exchange->changed);
	memset(exchange->tried, 0, n * sizeof *exchange->tried);
}

static int try_seed(struct primal_exchange *exchange, uint32_t seed, uint32_t pieces, uint32_t region_max)
{
	uint32_t pins[PRIMAL_PIECES_MAX];
	const uint32_t pin_count = take_part(exchange, seed, pieces, pins);
	uint32_t added = 0;
	tick(exchange);
	if (pin_count > 1 && exchange->cut_changed >= exchange->tried[seed]) {
		const uint32_t count = list_members(exchange, pins, pin_count);
		added = primal_connect_pieces(exchange->connect, exchange->member, exchange->member_piece, count,
					      pin_count, exchange->cut_weight, region_max, exchange->added);
	}
	exchange->tried[seed] = exchange->clock;
	if (added)
		adopt(exchange, added);
	else
		put_back(exchange);
	return added > 0;
}

void primal_exchange_all(struct primal_exchange *exchange, uint32_t pieces, uint32_t region_max, uint64_t work_end)
{
	struct search *search = exchange->connect->search;
	const struct instance *instance = exchange->tree->instance;
	memset(exchange->tried, 0, (size_t)instance->vertex_count * sizeof *exchange->tried);
	for (int gained = 1; gained;) {
		gained = 0;
		for (uint32_t v = 0; v < instance->vertex_count; v++) {
			if (!exchange->tree->degree[v] || !primal_tree_is_key(exchange->tree, v))
				continue;
			gained |= try_seed(exchange, v, pieces, region_max);
			if (search->stop || search->work >= work_end)
				return;
		}
	}
}
