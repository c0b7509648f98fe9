#include "solver/parallel.h"

#include <pthread.h>
#include <stdatomic.h>

struct loop {
	parallel_work *work;
	void *context;
	uint32_t count, grain;
	_Atomic uint64_t next; /* first item that nobody has taken */
};

struct hand {
	struct loop *loop;
	unsigned number;
	pthread_t thread;
};

static void *take_parts(void *argument)
{
	const struct hand *hand = argument;
	struct loop *loop = hand->loop;
	for (;;) {
		uint64_t first = atomic_fetch_add(&loop->next, loop->grain);
		if (first >= loop->count)
			return NULL;
		uint64_t end = first + loop->grain < loop->count ? first + loop->grain : loop->count;
		loop->work(loop->context, hand->number, (uint32_t)first, (uint32_t)end);
	}
}

void parallel_for(unsigned threads, uint32_t count, uint32_t grain, parallel_work *work, void *context)
{
	struct loop loop = {.work = work, .context = context, .count = count, .grain = grain ? grain : 1};
	struct hand hand[PARALLEL_THREADS];
	unsigned started = 1;
	hand[0] = (struct hand){.loop = &loop};
	for (; started < threads && started < PARALLEL_THREADS; started++) {
		hand[started] = (struct hand){.loop = &loop, .number = started};
		if (pthread_create(&hand[started].thread, NULL, take_parts, &hand[started]))
			break;
	}
	take_parts(&hand[0]);
	for (unsigned t = 1; t < started; t++)
		pthread_join(hand[t].thread, NULL);
}
