/* The heartbeat thread, on a store of its own. */
#include "tests/unit/storage/fixture.h"

#include "service/worker/pulse.h"

#include <sys/wait.h>
#include <time.h>

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
	ok(f, pulse_new(&pulse, f->url, 0, &f->error));
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
	ok(f, pulse_new(&pulse, f->url, 0, &f->error));
	struct job_ticket ticket = claim_layout(f);
	pulse_begin(pulse, &ticket);
	ok(f, job_cancel(f->store, ticket.job_id, &after, &f->error));
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

/* A process that hangs must not keep its job for ever by a thread that still beats. */
static void a_silent_computation_ends_the_process(void **state)
{
	struct fixture *f = *state;
	struct job_ticket ticket = claim_layout(f);
	int code = 0;
	pid_t child = fork();
	if (child == 0) {
		struct pulse *pulse = NULL;
		if (pulse_new(&pulse, f->url, 700, NULL))
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
		PULSE_TEST(a_silent_computation_ends_the_process),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
