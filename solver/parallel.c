/* A loop begins when `turn` is raised and ends when `busy` is 0. Who waits for either first looks again and again for a
 * short while, since loops follow one another within microseconds, then sleeps on a condition; whoever changes one of
 * them wakes only those that said before that they would sleep. The order of sequentially consistent operations makes
 * that safe: the sleeper says so before it looks for the last time, the other looks for sleepers after its change. */
#include "solver/parallel.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>

/* Some 30 us. */
enum { LOOKS = 1000 };

struct loop {
	parallel_work *work;
	void *context;
	uint32_t count, grain;
};

struct hand {
	struct parallel_team *team; /* borrowed */
	unsigned number;
	pthread_t thread;
};

struct parallel_team {
	struct loop loop;      /* the current one; stays as it is while threads are busy */
	bool ends;             /* likewise: no more loops */
	_Atomic uint64_t next; /* first item that nobody has taken */
	atomic_uint turn;      /* of loops begun */
	atomic_uint busy;      /* threads that have not ended the current loop, the caller not counted */
	atomic_uint sleepers;  /* threads that wait for a loop on `begun` */
	atomic_bool caller_sleeps;
	pthread_mutex_t mutex;
	pthread_cond_t begun, ended;
	unsigned started; /* threads, the caller not counted */
	struct hand hand[PARALLEL_THREADS];
};

static inline void rest(void)
{
#ifdef __x86_64__
	__builtin_ia32_pause();
#elif defined(__aarch64__)
	__asm__ volatile("yield");
#endif
}

static void take_parts(_Atomic uint64_t *next, const struct loop *loop, unsigned thread)
{
	for (;;) {
		const uint64_t first = atomic_fetch_add(next, loop->grain);
		if (first >= loop->count)
			return;
		const uint64_t end = first + loop->grain < loop->count ? first + loop->grain : loop->count;
		loop->work(loop->context, thread, (uint32_t)first, (uint32_t)end);
	}
}

static void await_turn(struct parallel_team *team, unsigned last)
{
	for (unsigned i = 0; i < LOOKS; i++) {
		if (atomic_load(&team->turn) != last)
			return;
		rest();
	}
	pthread_mutex_lock(&team->mutex);
	atomic_fetch_add(&team->sleepers, 1);
	while (atomic_load(&team->turn) == last)
		pthread_cond_wait(&team->begun, &team->mutex);
	atomic_fetch_sub(&team->sleepers, 1);
	pthread_mutex_unlock(&team->mutex);
}

static void await_end(struct parallel_team *team)
{
	for (unsigned i = 0; i < LOOKS; i++) {
		if (!atomic_load(&team->busy))
			return;
		rest();
	}
	pthread_mutex_lock(&team->mutex);
	atomic_store(&team->caller_sleeps, true);
	while (atomic_load(&team->busy))
		pthread_cond_wait(&team->ended, &team->mutex);
	atomic_store(&team->caller_sleeps, false);
	pthread_mutex_unlock(&team->mutex);
}

static void begin_turn(struct parallel_team *team)
{
	atomic_store(&team->busy, team->started);
	atomic_fetch_add(&team->turn, 1);
	if (!atomic_load(&team->sleepers))
		return;
	pthread_mutex_lock(&team->mutex);
	pthread_cond_broadcast(&team->begun);
	pthread_mutex_unlock(&team->mutex);
}

static void end_turn(struct parallel_team *team)
{
	if (atomic_fetch_sub(&team->busy, 1) != 1 || !atomic_load(&team->caller_sleeps))
		return;
	pthread_mutex_lock(&team->mutex);
	pthread_cond_signal(&team->ended);
	pthread_mutex_unlock(&team->mutex);
}

static void *serve(void *argument)
{
	const struct hand *const hand = argument;
	struct parallel_team *const team = hand->team;
	for (unsigned turn = 0;; turn++) {
		await_turn(team, turn);
		if (team->ends)
			return NULL;
		take_parts(&team->next, &team->loop, hand->number);
		end_turn(team);
	}
}

struct parallel_team *parallel_team_new(unsigned threads)
{
	struct parallel_team *const team = threads > 1 ? calloc(1, sizeof *team) : NULL;
	if (!team)
		return NULL;
	pthread_mutex_init(&team->mutex, NULL);
	pthread_cond_init(&team->begun, NULL);
	pthread_cond_init(&team->ended, NULL);
	for (; team->started + 1 < threads && team->started + 1 < PARALLEL_THREADS; team->started++) {
		struct hand *const hand = &team->hand[team->started];
		*hand = (struct hand){.team = team, .number = team->started + 1};
		if (pthread_create(&hand->thread, NULL, serve, hand))
			break;
	}
	return team;
}

void parallel_team_for(struct parallel_team *team, uint32_t count, uint32_t grain, parallel_work *work, void *context)
{
	const struct loop loop = {.work = work, .context = context, .count = count, .grain = grain ? grain : 1};
	if (!team || !team->started) {
		_Atomic uint64_t next = 0;
		take_parts(&next, &loop, 0);
		return;
	}
	team->loop = loop;
	atomic_store(&team->next, 0);
	begin_turn(team);
	take_parts(&team->next, &team->loop, 0);
	await_end(team);
}

void parallel_team_free(struct parallel_team *team)
{
	if (!team)
		return;
	team->ends = true;
	begin_turn(team);
	for (unsigned t = 0; t < team->started; t++)
		pthread_join(team->hand[t].thread, NULL);
	pthread_cond_destroy(&team->ended);
	pthread_cond_destroy(&team->begun);
	pthread_mutex_destroy(&team->mutex);
	free(team);
}

void parallel_for(unsigned threads, uint32_t count, uint32_t grain, parallel_work *work, void *context)
{
	struct parallel_team *const team = parallel_team_new(threads);
	parallel_team_for(team, count, grain, work, context);
	parallel_team_free(team);
}
