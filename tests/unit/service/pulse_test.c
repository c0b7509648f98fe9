/* The heartbeat thread, on a store of its own. */
#include "tests/unit/storage/fixture.h"

#include "service/worker/pulse.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static void sleep_ms(long ms)
{
	struct timespec pause = {ms / 1000, ms % 1000 * 1000000};
	nanosleep(&pause, NULL);
}

static int set_up(void **state)
{
	fixture_new(state);
	struct fixture *f = *state;
	store_set_clock(f->store, NULL, NULL);
	return 0;
}

static struct job_ticket claim_layout(struct fixture *f)
{
	char id[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	return fixture_claim(f);
}

static void wait_for(struct fixture *f, const char *sql)
{
	for (int i = 0; i < 2500 && fixture_ask(f, sql) != 1; i++)
		sleep_ms(2);
	assert_int_equal(fixture_ask(f, sql), 1);
}

static void the_pulse_keeps_the_lease_and_tells_progress(void **state)
{
	struct fixture *f = *state;
	struct pulse *pulse = NULL;
	ok(f, pulse_new(&pulse, &(struct pulse_settings){f->url, 0, -1}, &f->error));
	struct job_ticket ticket = claim_layout(f);
	int64_t lease_ms = fixture_ask(f, "SELECT lease_until_ms FROM job");
	pulse_begin(pulse, &ticket);
	pulse_tell(pulse, 0.25, "tree", "{\"gap\":0.5}");
	pulse_tell(pulse, 0.5, NULL, NULL);
	wait_for(f, "SELECT progress = 0.5 AND stage = 'tree' AND partial = '{\"gap\":0.5}' FROM job");
	assert_true(fixture_ask(f, "SELECT lease_until_ms FROM job") > lease_ms);
	assert_false(pulse_says_stop(pulse));
	pulse_end(pulse);
	pulse_free(pulse);
}

static void the_pulse_hears_of_a_cancel_and_of_a_lost_lease(void **state)
{
	struct fixture *f = *state;
	struct pulse *pulse = NULL;
	enum job_state after;
	ok(f, pulse_new(&pulse, &(struct pulse_settings){f->url, 0, -1}, &f->error));
	struct job_ticket ticket = claim_layout(f);
	pulse_begin(pulse, &ticket);
	ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error));
	for (int i = 0; i < 2500 && !pulse_says_stop(pulse); i++)
		sleep_ms(2);
	assert_true(pulse_says_cancelled(pulse));
	pulse_end(pulse);

	ticket = claim_layout(f);
	pulse_begin(pulse, &ticket);
	ok(f, job_release(f->store, &ticket, &f->error));
	for (int i = 0; i < 2500 && !pulse_says_stop(pulse); i++)
		sleep_ms(2);
	assert_true(pulse_says_stop(pulse));
	assert_false(pulse_says_cancelled(pulse));
	pulse_end(pulse);
	pulse_free(pulse);
}

static int64_t since_ms(const struct timespec *start)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (now.tv_sec - start->tv_sec) * 1000 + (now.tv_nsec - start->tv_nsec) / 1000000;
}

/* Of several cancels at least one is heard of within a tenth of the time between two beats, where a byte comes with
 * it: on a machine that is busy one or the other may take longer. */
static void the_pulse_looks_at_once_when_it_is_told_to(void **state)
{
	struct fixture *f = *state;
	struct pulse *pulse = NULL;
	int asked[2];
	int64_t best_ms = 1000;
	enum job_state after;
	assert_int_equal(pipe2(asked, O_NONBLOCK | O_CLOEXEC), 0);
	ok(f, pulse_new(&pulse, &(struct pulse_settings){f->url, 0, asked[0]}, &f->error));
	for (int i = 0; i < 10; i++) {
		struct timespec start;
		struct job_ticket ticket = claim_layout(f);
		pulse_begin(pulse, &ticket);
		ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error));
		clock_gettime(CLOCK_MONOTONIC, &start);
		assert_int_equal(write(asked[1], "", 1), 1);
		while (!pulse_says_cancelled(pulse) && since_ms(&start) < 5000)
			sleep_ms(1);
		assert_true(pulse_says_cancelled(pulse));
		best_ms = since_ms(&start) < best_ms ? since_ms(&start) : best_ms;
		pulse_end(pulse);
		ok(f, job_fail(f->store, &ticket, &(struct tw_error){.status = TW_ERROR_CANCELLED}, false, &f->error));
	}
	assert_true(best_ms <= 30);
	close(asked[1]); /* the daemon is gone: the pulse goes on without it */
	struct job_ticket ticket = claim_layout(f);
	pulse_begin(pulse, &ticket);
	ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error));
	for (int i = 0; i < 2500 && !pulse_says_cancelled(pulse); i++)
		sleep_ms(2);
	assert_true(pulse_says_cancelled(pulse));
	pulse_end(pulse);
	pulse_free(pulse);
	close(asked[0]);
}

/* A process that hangs must not keep its job for ever by a thread that still beats. */
static void a_silent_computation_ends_the_process(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket = claim_layout(f);
	int code = 0;
	pid_t child = fork();
	if (child == 0) {
		struct pulse *pulse = NULL;
		if (pulse_new(&pulse, &(struct pulse_settings){f->url, 700, -1}, NULL))
			_exit(1);
		pulse_begin(pulse, &ticket);
		for (int i = 0; i < 100; i++) { /* alive for a second */
			sleep_ms(10);
			pulse_says_stop(pulse);
		}
		sleep_ms(20000);
		_exit(2);
	}
	waitpid(child, &code, 0);
	assert_true(WIFEXITED(code));
	assert_int_equal(WEXITSTATUS(code), PULSE_STALLED);
}

#define PULSE_TEST(name) cmocka_unit_test_setup_teardown(name, set_up, fixture_free)

int main(void)
{
	const struct CMUnitTest tests[] = {
		PULSE_TEST(the_pulse_keeps_the_lease_and_tells_progress),
		PULSE_TEST(the_pulse_hears_of_a_cancel_and_of_a_lost_lease),
		PULSE_TEST(the_pulse_looks_at_once_when_it_is_told_to),
		PULSE_TEST(a_silent_computation_ends_the_process),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
