/* Loops shared by threads: whoever takes what, each item is done once, and all of a loop before the caller goes on. */
#include "solver/parallel.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

enum { ITEMS = 1000, LOOPS = 400, MOST_THREADS = 5 };

struct record {
	unsigned char done[ITEMS]; /* not atomic: items belong to one thread, and afterwards to the caller */
	uint32_t grain;
	unsigned threads;
	atomic_uint faults;
	atomic_bool busy[PARALLEL_THREADS];
};

static void note(void *context, unsigned thread, uint32_t first, uint32_t end)
{
	struct record *record = context;
	const bool is_fine = thread < record->threads && first < end && end - first <= record->grain;
	if (!is_fine || atomic_exchange(&record->busy[thread], true))
		atomic_fetch_add(&record->faults, 1);
	for (uint32_t i = first; i < end; i++)
		record->done[i]++;
	atomic_store(&record->busy[thread], false);
}

static void expect_done(const struct record *record, uint32_t count)
{
	assert_int_equal(atomic_load(&record->faults), 0);
	for (uint32_t i = 0; i < ITEMS; i++)
		assert_int_equal(record->done[i], i < count);
}

static void every_item_is_done_once_in_every_loop_of_a_team(void **state)
{
	(void)state;
	for (unsigned threads = 1; threads <= MOST_THREADS; threads++) {
		struct parallel_team *team = parallel_team_new(threads);
		for (uint32_t loop = 0; loop < LOOPS; loop++) {
			struct record record = {.grain = 1 + loop % 60, .threads = threads};
			const uint32_t count = loop * 37 % (ITEMS + 1);
			parallel_team_for(team, count, record.grain, note, &record);
			expect_done(&record, count);
		}
		parallel_team_free(team);
	}
}

/* Longer between loops than threads look for one before they sleep. */
static void a_team_that_has_gone_to_sleep_wakes_for_the_next_loop(void **state)
{
	(void)state;
	const struct timespec rest = {.tv_nsec = 3000000};
	struct parallel_team *team = parallel_team_new(3);
	for (uint32_t loop = 0; loop < 20; loop++) {
		struct record record = {.grain = 1, .threads = 3};
		nanosleep(&rest, NULL);
		parallel_team_for(team, ITEMS, 1, note, &record);
		expect_done(&record, ITEMS);
	}
	nanosleep(&rest, NULL);
	parallel_team_free(team);
}

static void sleep_once(void *context, unsigned thread, uint32_t first, uint32_t end)
{
	const struct timespec rest = {.tv_nsec = 2000000};
	(void)thread;
	nanosleep(&rest, NULL);
	for (uint32_t i = first; i < end; i++)
		((unsigned char *)context)[i] = 1;
}

/* The caller waits for the slowest, also where that takes so long that it sleeps itself. */
static void a_loop_ends_after_its_last_item(void **state)
{
	(void)state;
	struct parallel_team *team = parallel_team_new(4);
	for (uint32_t loop = 0; loop < 20; loop++) {
		unsigned char done[7] = {0}, all[7];
		memset(all, 1, sizeof all);
		parallel_team_for(team, sizeof done, 1, sleep_once, done);
		assert_memory_equal(done, all, sizeof all);
	}
	parallel_team_free(team);
}

static void no_team_is_the_caller_alone(void **state)
{
	(void)state;
	struct record record = {.grain = 7, .threads = 1};
	assert_null(parallel_team_new(1));
	assert_null(parallel_team_new(0));
	parallel_team_for(NULL, ITEMS, 7, note, &record);
	expect_done(&record, ITEMS);
	parallel_team_free(NULL);
}

static void a_single_loop_needs_no_team(void **state)
{
	(void)state;
	for (unsigned threads = 0; threads <= MOST_THREADS; threads++) {
		struct record record = {.grain = 10, .threads = threads ? threads : 1};
		parallel_for(threads, ITEMS - threads, 10, note, &record);
		expect_done(&record, ITEMS - threads);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_item_is_done_once_in_every_loop_of_a_team),
		cmocka_unit_test(a_team_that_has_gone_to_sleep_wakes_for_the_next_loop),
		cmocka_unit_test(a_loop_ends_after_its_last_item),
		cmocka_unit_test(no_team_is_the_caller_alone),
		cmocka_unit_test(a_single_loop_needs_no_team),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
