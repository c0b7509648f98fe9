/* Purpose: the dynamic program over terminal sets, pruned.
 *
 * The tree hangs from a root terminal. For a set I of other terminals and a vertex v, cost(I, v) is the weight of the
 * lightest tree that spans them (Erickson, Monma & Veinott, Send-and-split, Math. of OR 12, 1987). Here only sets and
 * labels exist that an optimum could use; grow.c says how that is known. Sets are handled by the number of their
 * terminals. A finished set is merged at once with every disjoint one that was finished before it, at the vertices
 * where both have useful labels: this makes the start labels of larger sets, which are complete when their turn comes,
 * because both parts of a merge are smaller. So sets of one size can be grown ahead of their turn by other threads
 * (ahead.c); what they are merged to stays in order.
 *
 * Which finished sets could share a vertex is told by a *signature*: a bit for each of 64 groups of Voronoi regions. */
#include "solver/steiner/program/dp.h"

#include "solver/steiner/program/ahead.h"
#include "solver/steiner/program/grow.h"

#include <assert.h>
#include <string.h>

struct set {
	uint32_t size;           /* terminals */
	uint32_t next;           /* of the same size, or INSTANCE_NONE */
	uint32_t start;          /* first start label, or INSTANCE_NONE */
	uint32_t useful;         /* labels that an optimum may use */
	uint32_t count;          /* trails in all */
	struct dp_label *labels; /* [useful] */
	struct dp_trail *trails; /* [count] */
};

struct start {
	fine_t cost;
	uint32_t vertex;
	uint32_t part; /* one of the two merged sets */
	uint32_t next;
};

struct dp {
	struct search *search;
	struct arena *arena;
	struct dp_grower grower;
	struct dp_ahead *ahead; /* owned; NULL without helper threads */
	uint32_t root;          /* index of the root terminal */
	size_t words;           /* of a bit set of terminals */

	struct set *set; /* [set_count] */
	uint64_t *bits;  /* [set_count * words] */
	size_t set_count, set_capacity, bits_capacity;
	uint32_t *slot; /* [slot_count] hash table of set numbers, a power of two */
	size_t slot_count;
	uint32_t *by_size; /* [terminal_count + 1] list heads */

	uint32_t *done;      /* [done_count] finished sets with useful labels */
	uint64_t *done_bits; /* [done_count * words] */
	uint64_t *done_signature;
	size_t done_count, done_capacity, done_bits_capacity, done_signature_capacity;

	struct start *starts;
	size_t start_count, start_capacity;
	uint32_t free_start; /* list of starts to use again */

	uint64_t *region;        /* [vertex_count] bit of the vertex's region */
	struct dp_label *labels; /* [vertex_count] of the current set */
	struct dp_trail *trails; /* [vertex_count] likewise */
	struct dp_label *at; /* [vertex_count] of the set that is being merged, by vertex; `reduced` counts from_root;
				elsewhere the cost is FINE_MAX */
	uint32_t *member;    /* [terminal_count] */
};

/* A growing array on the arena: doubles, and leaves the old one behind. False without memory. */
static int reserve(struct arena *arena, void *array, size_t used, size_t wanted, size_t *capacity, size_t size)
{
	if (wanted <= *capacity)
		return 1;
	size_t larger = *capacity ? *capacity : 1024;
	while (larger < wanted)
		larger *= 2;
	void *old, *new = arena_array(arena, larger, size);
	if (!new)
		return 0;
	memcpy(&old, array, sizeof old);
	if (used)
		memcpy(new, old, used * size);
	memcpy(array, &new, sizeof new);
	*capacity = larger;
	return 1;
}

static uint64_t hash_bits(const uint64_t *bits, size_t words)
{
	uint64_t h = 0x9e3779b97f4a7c15u;
	for (size_t i = 0; i < words; i++) {
		h = (h ^ bits[i]) * 0xff51afd7ed558ccdu;
		h ^= h >> 32;
	}
	return h;
}

static size_t find_slot(const struct dp *dp, const uint64_t *bits)
{
	size_t i = (size_t)hash_bits(bits, dp->words) & (dp->slot_count - 1);
	while (dp->slot[i] != INSTANCE_NONE &&
	       memcmp(dp->bits + dp->slot[i] * dp->words, bits, dp->words * sizeof *bits) != 0)
		i = (i + 1) & (dp->slot_count - 1);
	return i;
}

static int rehash(struct dp *dp)
{
	size_t larger = dp->slot_count ? 2 * dp->slot_count : 4096;
	uint32_t *slot = ARENA_ARRAY(dp->arena, larger, uint32_t);
	if (!slot)
		return 0;
	memset(slot, 0xff, larger * sizeof *slot);
	dp->slot = slot;
	dp->slot_count = larger;
	for (uint32_t s = 0; s < dp->set_count; s++)
		slot[find_slot(dp, dp->bits + s * dp->words)] = s;
	return 1;
}

/* The number of the set, new where it has to be; INSTANCE_NONE without memory. */
static uint32_t number_set(struct dp *dp, const uint64_t *bits)
{
	if (2 * (dp->set_count + 1) > dp->slot_count && !rehash(dp))
		return INSTANCE_NONE;
	size_t slot = find_slot(dp, bits);
	if (dp->slot[slot] != INSTANCE_NONE)
		return dp->slot[slot];
	size_t s = dp->set_count;
	if (!reserve(dp->arena, &dp->set, s, s + 1, &dp->set_capacity, sizeof *dp->set) ||
	    !reserve(dp->arena, &dp->bits, s * dp->words, (s + 1) * dp->words, &dp->bits_capacity, sizeof *dp->bits))
		return INSTANCE_NONE;
	memcpy(dp->bits + s * dp->words, bits, dp->words * sizeof *bits);
	uint32_t size = 0;
	for (size_t i = 0; i < dp->words; i++)
		size += (uint32_t)__builtin_popcountll(bits[i]);
	dp->set[s] = (struct set){.size = size, .next = dp->by_size[size], .start = INSTANCE_NONE};
	dp->by_size[size] = dp->slot[slot] = (uint32_t)s;
	dp->set_count++;
	return (uint32_t)s;
}

static int add_start(struct dp *dp, uint32_t set, uint32_t vertex, fine_t cost, uint32_t part)
{
	uint32_t i = dp->free_start;
	if (i != INSTANCE_NONE) {
		dp->free_start = dp->starts[i].next;
	} else {
		if (!reserve(dp->arena, &dp->starts, dp->start_count, dp->start_count + 1, &dp->start_capacity,
			     sizeof *dp->starts))
			return 0;
		i = (uint32_t)dp->start_count++;
	}
	dp->starts[i] = (struct start){cost, vertex, part, dp->set[set].start};
	dp->set[set].start = i;
	return 1;
}

/* A set whose labels are laid out in `at`, while it is compared with others. */
struct subject {
	const struct dp *dp;
	const struct dp_label *at; /* as in struct dp */
	const uint64_t *bits;
	uint64_t signature;
	uint64_t scanned; /* labels of others that were looked at */
	dp_take_joint *take;
	void *taker;
};

static bool is_disjoint(const uint64_t *a, const uint64_t *b, size_t words)
{
	uint64_t common = 0;
	for (size_t w = 0; w < words; w++)
		common |= a[w] & b[w];
	return !common;
}

/* Where an earlier set with these labels can be merged with the subject. False when a joint was not taken. */
static bool compare(const struct subject *subject, uint32_t other, const struct dp_label *labels, uint32_t useful)
{
	const struct dp_grower *grower = &subject->dp->grower;
	const uint64_t room = grower->dual ? grower->room : UINT64_MAX;
	const fine_t cutoff = grower->cutoff;
	for (uint32_t i = 0; i < useful; i++) {
		const struct dp_label *at = &subject->at[labels[i].vertex];
		if (at->cost == FINE_MAX || (uint64_t)at->reduced + labels[i].reduced >= room ||
		    at->cost + labels[i].cost >= cutoff)
			continue;
		const struct dp_joint joint = {at->cost + labels[i].cost, labels[i].vertex, other};
		if (!subject->take(subject->taker, &joint))
			return false;
	}
	return true;
}

static void lay_out(const struct dp *dp, struct dp_label *at, const struct dp_label *labels, uint32_t useful)
{
	for (uint32_t i = 0; i < useful; i++)
		at[labels[i].vertex] = (struct dp_label){
			.cost = labels[i].cost,
			.reduced = labels[i].reduced + (dp->grower.dual ? dp->grower.from_root[labels[i].vertex] : 0),
		};
}

static void take_up(struct dp_label *at, const struct dp_label *labels, uint32_t useful)
{
	for (uint32_t i = 0; i < useful; i++)
		at[labels[i].vertex].cost = FINE_MAX;
}

static bool compare_with_finished(struct subject *subject)
{
	const struct dp *dp = subject->dp;
	bool goes_on = true;
	for (size_t j = 0; j < dp->done_count && goes_on; j++) {
		if (!(dp->done_signature[j] & subject->signature) ||
		    !is_disjoint(dp->done_bits + j * dp->words, subject->bits, dp->words))
			continue;
		const struct set *other = &dp->set[dp->done[j]];
		subject->scanned += other->useful;
		goes_on = compare(subject, dp->done[j], other->labels, other->useful);
	}
	return goes_on;
}

/* Those before it in the batch, which will be finished when its turn comes. */
static bool compare_with_batch(struct subject *subject, const struct dp_batch *batch, uint32_t i, uint32_t *finished)
{
	const struct dp *dp = subject->dp;
	bool goes_on = true;
	for (uint32_t j = 0; j < i && goes_on; j++) {
		const struct dp_grown *other = &batch->grown[j];
		*finished += other->useful > 0;
		if (!(other->signature & subject->signature) ||
		    !is_disjoint(dp->bits + batch->set[j] * dp->words, subject->bits, dp->words))
			continue;
		subject->scanned += other->useful;
		goes_on = compare(subject, batch->set[j], other->labels, other->useful);
	}
	return goes_on;
}

static uint64_t merge_work(uint32_t useful, uint64_t scanned, size_t finished)
{
	return useful + scanned / 2 + finished / 16;
}

/* Only reads what threads share. */
static uint64_t merge_in_batch(const void *context, struct dp_label *at, const struct dp_batch *batch, uint32_t i,
			       dp_take_joint *take, void *taker)
{
	const struct dp *dp = context;
	const struct dp_grown *grown = &batch->grown[i];
	struct subject subject = {dp, at, dp->bits + batch->set[i] * dp->words, grown->signature, 0, take, taker};
	uint32_t finished = (uint32_t)dp->done_count;
	lay_out(dp, at, grown->labels, grown->useful);
	const bool is_complete = compare_with_finished(&subject) && compare_with_batch(&subject, batch, i, &finished);
	take_up(at, grown->labels, grown->useful);
	return is_complete ? merge_work(grown->useful, subject.scanned, finished) : 0;
}

/* Joints become start labels, which come in runs of one other set each. */
struct joiner {
	struct dp *dp;
	uint32_t set;
	uint32_t other, union_set; /* of the last joint */
};

static bool add_joint(void *taker, const struct dp_joint *joint)
{
	struct joiner *joiner = taker;
	struct dp *dp = joiner->dp;
	if (joint->other != joiner->other) {
		uint64_t bits[64]; /* TW_LIMIT_TERMINALS / 64 */
		for (size_t w = 0; w < dp->words; w++)
			bits[w] = dp->bits[joiner->set * dp->words + w] | dp->bits[joint->other * dp->words + w];
		joiner->other = joint->other;
		joiner->union_set = number_set(dp, bits);
	}
	return joiner->union_set != INSTANCE_NONE &&
	       add_start(dp, joiner->union_set, joint->vertex, joint->cost, joiner->set);
}

static enum tw_status merge_with_finished(struct dp *dp, uint32_t s, const struct dp_grown *grown)
{
	const struct set *set = &dp->set[s];
	struct joiner joiner = {dp, s, INSTANCE_NONE, INSTANCE_NONE};
	uint64_t work = grown->merge_work;
	bool is_complete = true;
	if (grown->joints) {
		for (uint32_t i = 0; i < grown->joint_count && is_complete; i++)
			is_complete = add_joint(&joiner, &grown->joints[i]);
	} else {
		const struct dp_label *labels = set->labels;
		const uint32_t useful = set->useful;
		uint64_t bits[64];
		/* The sets' own may move. */
		memcpy(bits, dp->bits + s * dp->words, dp->words * sizeof *bits);
		struct subject subject = {dp, dp->at, bits, grown->signature, 0, add_joint, &joiner};
		lay_out(dp, dp->at, labels, useful);
		is_complete = compare_with_finished(&subject);
		take_up(dp->at, labels, useful);
		work = merge_work(useful, subject.scanned, dp->done_count);
	}
	if (!is_complete)
		return TW_ERROR_MEMORY;
	return search_spend(dp->search, work) ? TW_OK : TW_ERROR_CANCELLED;
}

static uint64_t sign(const void *context, const struct dp_label *labels, uint32_t useful)
{
	const struct dp *dp = context;
	uint64_t signature = 0;
	for (uint32_t i = 0; i < useful; i++)
		signature |= dp->region[labels[i].vertex];
	return signature;
}

static enum tw_status finish(struct dp *dp, uint32_t s, const struct dp_grown *grown)
{
	enum tw_status status = merge_with_finished(dp, s, grown);
	if (status != TW_OK)
		return status;
	size_t j = dp->done_count, words = dp->words;
	if (!reserve(dp->arena, &dp->done, j, j + 1, &dp->done_capacity, sizeof *dp->done) ||
	    !reserve(dp->arena, &dp->done_bits, j * words, (j + 1) * words, &dp->done_bits_capacity,
		     sizeof *dp->done_bits) ||
	    !reserve(dp->arena, &dp->done_signature, j, j + 1, &dp->done_signature_capacity,
		     sizeof *dp->done_signature))
		return TW_ERROR_MEMORY;
	dp->done[j] = s;
	memcpy(dp->done_bits + j * words, dp->bits + s * words, words * sizeof *dp->bits);
	dp->done_signature[j] = grown->signature;
	dp->done_count++;
	return TW_OK;
}

static uint32_t list_members(const struct dp *dp, uint32_t s, uint32_t *member)
{
	uint32_t count = 0;
	for (size_t w = 0; w < dp->words; w++)
		for (uint64_t rest = dp->bits[s * dp->words + w]; rest; rest &= rest - 1)
			member[count++] = (uint32_t)(64 * w + (size_t)__builtin_ctzll(rest));
	return count;
}

/* Only reads what threads share. */
static void start_set(const void *context, struct dp_grower *grower, uint32_t s, uint32_t *member)
{
	const struct dp *dp = context;
	const uint32_t count = list_members(dp, s, member);
	dp_grow_start(grower, member, count, dp->bits + s * dp->words);
	if (count == 1)
		dp_grow_add(grower, dp->search->instance.terminal[member[0]], 0, INSTANCE_NONE);
	for (uint32_t i = dp->set[s].start; i != INSTANCE_NONE; i = dp->starts[i].next)
		dp_grow_add(grower, dp->starts[i].vertex, dp->starts[i].cost, DP_MERGED | dp->starts[i].part);
}

static uint32_t next_set(const void *context, uint32_t s)
{
	const struct dp *dp = context;
	return dp->set[s].next;
}

static const struct dp_ahead_work ahead_work = {next_set, start_set, sign, merge_in_batch};

/* From here on the calling thread works alone. */
static void stop_helpers(struct dp *dp)
{
	dp_ahead_free(dp->ahead);
	dp->ahead = NULL;
}

/* What comes of a set; borrowed until the next. */
static struct dp_grown grow_set(struct dp *dp, uint32_t s)
{
	const size_t limit = dp->search->options->memory_limit;
	if (dp->ahead && limit && arena_used(dp->arena) > limit / 2)
		stop_helpers(dp);
	if (dp->ahead && dp_ahead_is_empty(dp->ahead))
		dp_ahead_grow(dp->ahead, s);
	const struct dp_grown *ahead = dp->ahead ? dp_ahead_take(dp->ahead, s) : NULL;
	if (ahead) {
		dp->search->work += ahead->work;
		return *ahead;
	}
	struct dp_grown grown = {.labels = dp->labels, .trails = dp->trails};
	start_set(dp, &dp->grower, s, dp->member);
	grown.count = dp_grow(&dp->grower, dp->labels, &grown.useful, dp->trails);
	grown.signature = sign(dp, dp->labels, grown.useful);
	return grown;
}

/* Start labels are of no more use; others may take their place. */
static void forget_starts(struct dp *dp, uint32_t s)
{
	uint32_t last = dp->set[s].start;
	if (last == INSTANCE_NONE)
		return;
	while (dp->starts[last].next != INSTANCE_NONE)
		last = dp->starts[last].next;
	dp->starts[last].next = dp->free_start;
	dp->free_start = dp->set[s].start;
}

static enum tw_status handle_set(struct dp *dp, uint32_t s)
{
	const struct dp_grown grown = grow_set(dp, s);
	forget_starts(dp, s);
	dp->search->stats->sets++;
	dp->search->stats->labels += grown.count;
	if (!grown.useful)
		return search_spend(dp->search, 1) ? TW_OK : TW_ERROR_CANCELLED;
	struct set *set = &dp->set[s];
	set->useful = grown.useful;
	set->count = grown.count;
	set->labels = ARENA_ARRAY(dp->arena, grown.useful, struct dp_label);
	set->trails = ARENA_ARRAY(dp->arena, grown.count, struct dp_trail);
	if (!set->labels || !set->trails)
		return TW_ERROR_MEMORY;
	memcpy(set->labels, grown.labels, grown.useful * sizeof *set->labels);
	memcpy(set->trails, grown.trails, grown.count * sizeof *set->trails);
	return finish(dp, s, &grown);
}

static const struct dp_trail *trail_at(const struct dp *dp, uint32_t s, uint32_t v)
{
	for (uint32_t i = 0; i < dp->set[s].count; i++)
		if (dp->set[s].trails[i].vertex == v)
			return &dp->set[s].trails[i];
	return NULL;
}

static uint32_t trace(const struct dp *dp, uint32_t s, uint32_t v, uint32_t *edges, uint32_t count)
{
	const struct instance *instance = &dp->search->instance;
	for (;;) {
		const struct dp_trail *trail = trail_at(dp, s, v);
		assert(trail);
		const uint32_t from = trail->from;
		if (from == INSTANCE_NONE)
			return count;
		if (!(from & DP_MERGED)) {
			assert(count < instance->vertex_count);
			edges[count++] = from;
			v ^= instance->ends[2 * from] ^ instance->ends[2 * from + 1];
			continue;
		}
		uint64_t bits[64];
		uint32_t part = from & ~DP_MERGED;
		for (size_t w = 0; w < dp->words; w++)
			bits[w] = dp->bits[s * dp->words + w] & ~dp->bits[part * dp->words + w];
		count = trace(dp, part, v, edges, count);
		s = dp->slot[find_slot(dp, bits)];
		assert(s != INSTANCE_NONE);
	}
}

static enum tw_status run(struct dp *dp, int *found)
{
	const struct instance *instance = &dp->search->instance;
	uint32_t k = instance->terminal_count;
	uint64_t bits[64] = {0};
	for (uint32_t t = k; t-- > 0;) {
		if (t == dp->root)
			continue;
		bits[t / 64] = 1ull << (t % 64);
		if (number_set(dp, bits) == INSTANCE_NONE)
			return TW_ERROR_MEMORY;
		bits[t / 64] = 0;
	}
	for (uint32_t size = 1; size < k; size++)
		for (uint32_t s = dp->by_size[size]; s != INSTANCE_NONE; s = dp->set[s].next) {
			enum tw_status status = handle_set(dp, s);
			if (status != TW_OK)
				return status;
		}
	uint32_t all = dp->by_size[k - 1];
	const struct dp_trail *answer = all == INSTANCE_NONE ? NULL : trail_at(dp, all, instance->terminal[dp->root]);
	*found = answer != NULL;
	if (!answer)
		return TW_OK;
	uint32_t *edges = ARENA_ARRAY(dp->arena, instance->vertex_count, uint32_t);
	if (!edges)
		return TW_ERROR_MEMORY;
	uint32_t count = trace(dp, all, instance->terminal[dp->root], edges, 0);
	return search_offer(dp->search, edges, count);
}

/* Bits of Voronoi regions, by the terminals' order, by a breadth-first search: only a hint, so that hops will do. */
static void color_regions(struct dp *dp, uint32_t *queue)
{
	const struct instance *instance = &dp->search->instance;
	uint32_t count = 0;
	memset(dp->region, 0, instance->vertex_count * sizeof *dp->region);
	for (uint32_t t = 0; t < instance->terminal_count; t++) {
		dp->region[instance->terminal[t]] = 1ull << (t % 64);
		queue[count++] = instance->terminal[t];
	}
	for (uint32_t i = 0; i < count; i++)
		for (uint32_t a = instance->first[queue[i]]; a < instance->first[queue[i] + 1]; a++)
			if (!dp->region[instance->head[a]]) {
				dp->region[instance->head[a]] = dp->region[queue[i]];
				queue[count++] = instance->head[a];
			}
}

enum tw_status dp_solve(struct search *search, const struct dual *dual, fine_t cutoff, int *found)
{
	const struct instance *instance = &search->instance;
	size_t n = instance->vertex_count, k = instance->terminal_count;
	struct arena_mark mark = arena_mark(search->arena);
	*found = 0;
	if (k > TW_LIMIT_TERMINALS)
		return TW_ERROR_UNSUPPORTED;
	struct dp dp = {
		.search = search,
		.arena = search->arena,
		.root = dual ? dual->root : 0,
		.words = (k + 63) / 64,
		.by_size = ARENA_ARRAY(search->arena, k + 1, uint32_t),
		.free_start = INSTANCE_NONE,
		.region = ARENA_ARRAY(search->arena, n, uint64_t),
		.labels = ARENA_ARRAY(search->arena, n, struct dp_label),
		.trails = ARENA_ARRAY(search->arena, n, struct dp_trail),
		.at = ARENA_ARRAY(search->arena, n, struct dp_label),
		.member = ARENA_ARRAY(search->arena, k, uint32_t),
	};
	enum tw_status status = TW_ERROR_MEMORY;
	if (dp.by_size && dp.region && dp.labels && dp.trails && dp.at && dp.member)
		status = dp_grower_init(&dp.grower, search, dual, cutoff);
	if (status == TW_OK) {
		memset(dp.by_size, 0xff, (k + 1) * sizeof *dp.by_size);
		memset(dp.at, 0xff, n * sizeof *dp.at);
		color_regions(&dp, dp.grower.frontier);
		dp_ahead_new(&dp.ahead, &dp.grower, search->options->threads, search->options->memory_limit,
			     &ahead_work, &dp);
		status = run(&dp, found);
		dp_ahead_free(dp.ahead);
	}
	arena_release(search->arena, mark);
	return status;
}
