/* Purpose: grow and merge terminal sets ahead of their turn.
 *
 * A batch of sets is shared by parallel_for: first all are grown, then all are compared with what they could be merged
 * with, the sets before them in the batch among it. Each thread has a grower and counters of its own, the instance, the
 * dual and the finished sets are only read. How many sets make a batch follows from the work of the one before: enough
 * that starting threads costs little, and few enough that an interrupt is noticed soon and little is thrown away when a
 * budget ends. */
#include "solver/steiner/program/ahead.h"

#include "solver/parallel.h"

#include <stdlib.h>
#include <string.h>

/* A batch of 3,000,000 units takes some 10 ms; a thread that starts takes 20 us. */
enum { THREADS_MAX = 16, BATCH_FIRST = 16, BATCH_MAX = 4096, BATCH_WORK = 3000000 };

/* A set has some hundred joints; one that has more waits for its turn. */
enum { JOINTS_MAX = 1 << 17 };

/* What one thread works with. */
struct dp_thread {
	struct search counters; /* counts the work */
	struct dp_grower grower;
	struct arena *store; /* owned: what came of the batch's sets */
	uint32_t *member;    /* [terminal_count] */
	struct dp_label *labels;
	struct dp_trail *trails; /* [vertex_count] both */
	struct dp_label *at;     /* [vertex_count] scratch of comparing; no costs between calls */
	struct dp_joint *joint;  /* [JOINTS_MAX] of one set */
	uint32_t joint_count;
};

struct dp_ahead {
	struct arena *arena; /* owned: of the threads */
	struct dp_thread thread[THREADS_MAX];
	unsigned thread_count;
	uint32_t batch; /* sets to grow at once */
	uint32_t count, taken;
	uint32_t set[BATCH_MAX];
	struct dp_grown grown[BATCH_MAX];
	uint32_t compared; /* the first sets of the batch that others can be compared with: all are grown */
	const struct dp_ahead_work *work; /* borrowed */
	const void *context;              /* borrowed */
};

static int add_thread(struct dp_ahead *ahead, const struct dp_grower *grower, size_t memory_limit)
{
	struct dp_thread *thread = &ahead->thread[ahead->thread_count];
	const size_t n = grower->search->instance.vertex_count, k = grower->search->instance.terminal_count;
	thread->counters = *grower->search;
	thread->member = ARENA_ARRAY(ahead->arena, k, uint32_t);
	thread->labels = ARENA_ARRAY(ahead->arena, n, struct dp_label);
	thread->trails = ARENA_ARRAY(ahead->arena, n, struct dp_trail);
	thread->at = ARENA_ARRAY(ahead->arena, n, struct dp_label);
	thread->joint = ARENA_ARRAY(ahead->arena, JOINTS_MAX, struct dp_joint);
	if (!thread->member || !thread->labels || !thread->trails || !thread->at || !thread->joint ||
	    dp_grower_share(&thread->grower, ahead->arena, grower, &thread->counters) != TW_OK)
		return 0;
	memset(thread->at, 0xff, n * sizeof *thread->at);
	thread->store = arena_new(memory_limit);
	ahead->thread_count += thread->store != NULL;
	return thread->store != NULL;
}

void dp_ahead_new(struct dp_ahead **ahead, struct dp_grower *grower, unsigned threads, size_t memory_limit,
		  const struct dp_ahead_work *work, const void *context)
{
	*ahead = NULL;
	if (threads < 2)
		return;
	struct dp_ahead *new = calloc(1, sizeof *new);
	if (!new)
		return;
	new->batch = BATCH_FIRST;
	new->work = work;
	new->context = context;
	/* Half for the threads, half for what they find. */
	new->arena = arena_new(memory_limit / 8);
	while (new->arena &&new->thread_count < threads &&new->thread_count < THREADS_MAX &&
	       add_thread(new, grower, memory_limit / 8 / THREADS_MAX))
		;
	if (new->thread_count < 2)
		dp_ahead_free(new);
	else
		*ahead = new;
}

void dp_ahead_free(struct dp_ahead *ahead)
{
	if (!ahead)
		return;
	for (unsigned i = 0; i < ahead->thread_count; i++)
		arena_free(ahead->thread[i].store);
	arena_free(ahead->arena);
	free(ahead);
}

/* Without room for what came of it, the set counts as not grown. */
static void grow_one(struct dp_ahead *ahead, struct dp_thread *thread, uint32_t i)
{
	struct dp_grown *grown = &ahead->grown[i];
	uint32_t useful;
	thread->counters.work = 0;
	ahead->work->start(ahead->context, &thread->grower, ahead->set[i], thread->member);
	const uint32_t count = dp_grow(&thread->grower, thread->labels, &useful, thread->trails);
	struct dp_label *labels = ARENA_ARRAY(thread->store, useful, struct dp_label);
	struct dp_trail *trails = ARENA_ARRAY(thread->store, count, struct dp_trail);
	if (!labels || !trails)
		return;
	memcpy(labels, thread->labels, useful * sizeof *labels);
	memcpy(trails, thread->trails, count * sizeof *trails);
	*grown = (struct dp_grown){.work = thread->counters.work,
				   .signature = ahead->work->sign(ahead->context, labels, useful),
				   .labels = labels,
				   .trails = trails,
				   .useful = useful,
				   .count = count};
}

static bool keep_joint(void *taker, const struct dp_joint *joint)
{
	struct dp_thread *thread = taker;
	if (thread->joint_count == JOINTS_MAX)
		return false;
	thread->joint[thread->joint_count++] = *joint;
	return true;
}

/* Without room for the joints, the set counts as not compared. */
static void merge_one(struct dp_ahead *ahead, struct dp_thread *thread, uint32_t i)
{
	struct dp_grown *grown = &ahead->grown[i];
	const struct dp_batch batch = {ahead->set, ahead->grown, ahead->count};
	thread->joint_count = 0;
	const uint64_t work = ahead->work->merge(ahead->context, thread->at, &batch, i, keep_joint, thread);
	struct dp_joint *joints = work ? ARENA_ARRAY(thread->store, thread->joint_count, struct dp_joint) : NULL;
	if (!joints)
		return;
	memcpy(joints, thread->joint, thread->joint_count * sizeof *joints);
	grown->joints = joints;
	grown->joint_count = thread->joint_count;
	grown->merge_work = work;
}

static void grow_part(void *context, unsigned thread, uint32_t first, uint32_t end)
{
	struct dp_ahead *ahead = context;
	for (uint32_t i = first; i < end; i++)
		grow_one(ahead, &ahead->thread[thread], i);
}

static void merge_part(void *context, unsigned thread, uint32_t first, uint32_t end)
{
	struct dp_ahead *ahead = context;
	for (uint32_t i = first; i < end; i++)
		if (ahead->grown[i].useful)
			merge_one(ahead, &ahead->thread[thread], i);
}

static void choose_batch(struct dp_ahead *ahead)
{
	uint64_t work = 1;
	for (uint32_t i = 0; i < ahead->count; i++)
		work += ahead->grown[i].work + ahead->grown[i].merge_work;
	const uint64_t fit = BATCH_WORK * (uint64_t)ahead->count / work, least = 2 * ahead->thread_count;
	ahead->batch = (uint32_t)(fit < least ? least : fit > BATCH_MAX ? BATCH_MAX : fit);
}

void dp_ahead_grow(struct dp_ahead *ahead, uint32_t first)
{
	if (ahead->count)
		choose_batch(ahead);
	ahead->count = ahead->taken = ahead->compared = 0;
	for (uint32_t s = first; s != INSTANCE_NONE && ahead->count < ahead->batch;
	     s = ahead->work->next(ahead->context, s))
		ahead->set[ahead->count++] = s;
	memset(ahead->grown, 0, ahead->count * sizeof *ahead->grown);
	for (unsigned i = 0; i < ahead->thread_count; i++)
		arena_release(ahead->thread[i].store, (struct arena_mark){0});
	parallel_for(ahead->thread_count, ahead->count, 1, grow_part, ahead);
	while (ahead->compared < ahead->count && ahead->grown[ahead->compared].trails)
		ahead->compared++;
	parallel_for(ahead->thread_count, ahead->compared, 1, merge_part, ahead);
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
