/* Purpose: grow terminal sets ahead of their turn.
 *
 * A batch of sets is shared by parallel_for. Each hand has a grower and books of its own, the instance and the dual are
 * only read. How many sets make a batch follows from the work of the one before: enough that starting threads costs
 * little, and few enough that an interrupt is noticed soon and little is thrown away when a budget ends. */
#include "solver/steiner/program/ahead.h"

#include "solver/parallel.h"

#include <stdlib.h>
#include <string.h>

enum { HANDS_MAX = 16, BATCH_FIRST = 16, BATCH_MAX = 4096, BATCH_WORK = 3000000 };

/* What one thread works with. */
struct hand {
	struct search books; /* counts the work */
	struct dp_grower grower;
	struct arena *store; /* owned: what came of the batch's sets */
	uint32_t *member;    /* [terminal_count] */
	struct dp_label *labels;
	struct dp_trail *trails; /* [vertex_count] both */
};

struct dp_ahead {
	struct arena *arena; /* owned: of the hands */
	struct hand hand[HANDS_MAX];
	unsigned hand_count;
	uint32_t batch; /* sets to grow at once */
	uint32_t count, taken;
	uint32_t set[BATCH_MAX];
	struct dp_grown grown[BATCH_MAX];
	dp_ahead_start *start; /* of the batch in hand */
	void *context;
};

static int add_hand(struct dp_ahead *ahead, const struct dp_grower *grower, size_t memory_limit)
{
	struct hand *hand = &ahead->hand[ahead->hand_count];
	const size_t n = grower->search->instance.vertex_count, k = grower->search->instance.terminal_count;
	hand->books = *grower->search;
	hand->member = ARENA_ARRAY(ahead->arena, k, uint32_t);
	hand->labels = ARENA_ARRAY(ahead->arena, n, struct dp_label);
	hand->trails = ARENA_ARRAY(ahead->arena, n, struct dp_trail);
	if (!hand->member || !hand->labels || !hand->trails ||
	    dp_grower_share(&hand->grower, ahead->arena, grower, &hand->books) != TW_OK)
		return 0;
	hand->store = arena_new(memory_limit);
	ahead->hand_count += hand->store != NULL;
	return hand->store != NULL;
}

void dp_ahead_new(struct dp_ahead **ahead, struct dp_grower *grower, unsigned threads, size_t memory_limit)
{
	*ahead = NULL;
	if (threads < 2)
		return;
	struct dp_ahead *new = calloc(1, sizeof *new);
	if (!new)
		return;
	new->batch = BATCH_FIRST;
	/* Half for the hands, half for what they find. */
	new->arena = arena_new(memory_limit / 8);
	while (new->arena &&new->hand_count < threads &&new->hand_count < HANDS_MAX &&
	       add_hand(new, grower, memory_limit / 8 / HANDS_MAX))
		;
	if (new->hand_count < 2)
		dp_ahead_free(new);
	else
		*ahead = new;
}

void dp_ahead_free(struct dp_ahead *ahead)
{
	if (!ahead)
		return;
	for (unsigned i = 0; i < ahead->hand_count; i++)
		arena_free(ahead->hand[i].store);
	arena_free(ahead->arena);
	free(ahead);
}

/* Without room for what came of it, the set counts as not grown. */
static void grow_one(struct dp_ahead *ahead, struct hand *hand, uint32_t i)
{
	struct dp_grown *grown = &ahead->grown[i];
	uint32_t useful;
	hand->books.work = 0;
	ahead->start(ahead->context, &hand->grower, ahead->set[i], hand->member);
	const uint32_t count = dp_grow(&hand->grower, hand->labels, &useful, hand->trails);
	struct dp_label *labels = ARENA_ARRAY(hand->store, useful, struct dp_label);
	struct dp_trail *trails = ARENA_ARRAY(hand->store, count, struct dp_trail);
	if (!labels || !trails)
		return;
	memcpy(labels, hand->labels, useful * sizeof *labels);
	memcpy(trails, hand->trails, count * sizeof *trails);
	*grown = (struct dp_grown){hand->books.work, labels, trails, useful, count};
}

static void grow_part(void *context, unsigned thread, uint32_t first, uint32_t end)
{
	struct dp_ahead *ahead = context;
	for (uint32_t i = first; i < end; i++)
		grow_one(ahead, &ahead->hand[thread], i);
}

static void choose_batch(struct dp_ahead *ahead)
{
	uint64_t work = 1;
	for (uint32_t i = 0; i < ahead->count; i++)
		work += ahead->grown[i].work;
	const uint64_t fit = BATCH_WORK * (uint64_t)ahead->count / work, least = 2 * ahead->hand_count;
	ahead->batch = (uint32_t)(fit < least ? least : fit > BATCH_MAX ? BATCH_MAX : fit);
}

void dp_ahead_grow(struct dp_ahead *ahead, uint32_t first, dp_ahead_next *next, dp_ahead_start *start, void *context)
{
	if (ahead->count)
		choose_batch(ahead);
	ahead->count = ahead->taken = 0;
	for (uint32_t s = first; s != INSTANCE_NONE && ahead->count < ahead->batch; s = next(context, s))
		ahead->set[ahead->count++] = s;
	memset(ahead->grown, 0, ahead->count * sizeof *ahead->grown);
	for (unsigned i = 0; i < ahead->hand_count; i++)
		arena_release(ahead->hand[i].store, (struct arena_mark){0});
	ahead->start = start;
	ahead->context = context;
	parallel_for(ahead->hand_count, ahead->count, 1, grow_part, ahead);
}

const struct dp_grown *dp_ahead_take(struct dp_ahead *ahead, uint32_t set)
{
	if (ahead->taken == ahead->count || ahead->set[ahead->taken] != set)
		return NULL;
	const struct dp_grown *grown = &ahead->grown[ahead->taken++];
	return grown->trails ? grown : NULL;
}

int dp_ahead_is_empty(const struct dp_ahead *ahead)
{
	return ahead->taken == ahead->count;
}
