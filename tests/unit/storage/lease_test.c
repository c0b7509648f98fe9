/* Leases and attempts: by which clock a lease runs out, and what costs a job an attempt. */
#include "tests/unit/storage/fixture.h"

#include "storage/sql.h"

#include <signal.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>

/* The machine's clocks, which a test may set: this takes the place of the C library's. */
static int64_t wall_jump_s;

int clock_gettime(clockid_t clock, struct timespec *now)
{
	long code = syscall(SYS_clock_gettime, clock, now);
	if (clock == CLOCK_REALTIME)
		now->tv_sec += wall_jump_s;
	return (int)code;
}

enum { DAY_S = 86400 };

static int any_clock(void **state)
{
	int code = fixture_new(state);
	store_set_clock(((struct fixture *)*state)->store, NULL, NULL);
	wall_jump_s = 0;
	return code;
}

static struct job_ticket claim(struct fixture *f, const char *worker, int64_t lease_ms, bool *found)
{
	struct job_ticket ticket;
	ok(f, job_claim(f->store, &(struct claim_query){.kinds = JOB_KINDS_ALL, .worker = worker, .lease_ms = lease_ms},
			&ticket, found, &f->error));
	return ticket;
}

static void a_jump_of_the_wall_clock_ends_no_lease_and_prolongs_none(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	bool found = false, cancel = false;
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket ticket = claim(f, "first", 30000, &found);
	assert_true(found);
	static const int64_t jumps_s[] = {DAY_S, -DAY_S, 365 * DAY_S, 0};
	for (size_t i = 0; i < sizeof jumps_s / sizeof *jumps_s; i++) {
		wall_jump_s = jumps_s[i];
		claim(f, "second", 30000, &found);
		assert_false(found);
		ok(f, job_heartbeat(f->store, &ticket, 0.5, "solving", NULL, &cancel, &f->error));
	}
	/* A short one, and the clock goes back a day: it runs out all the same. */
	ticket.lease_ms = 50;
	ok(f, job_heartbeat(f->store, &ticket, 0.5, NULL, NULL, &cancel, &f->error));
	wall_jump_s = -DAY_S;
	usleep(120000);
	struct job_ticket again = claim(f, "second", 30000, &found);
	assert_true(found);
	assert_int_equal(again.attempt, 2);
}

static void a_jump_of_the_wall_clock_changes_no_pause_and_sweeps_no_upload(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	bool found = false, more = false;
	struct tw_error failure = {TW_ERROR_MEMORY, "out-of-memory", "", "too little"};
	struct upload *upload = NULL;
	struct blob blob;
	bool sealed;
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket ticket = claim(f, "first", 30000, &found);
	ok(f, job_fail(f->store, &ticket, &failure, true, &f->error)); /* a pause of a second */
	ok(f, upload_begin(&upload, f->store, OWNER_DEFAULT, "worn", "a.obj", "model/obj", 1000, &f->error));
	wall_jump_s = DAY_S;
	claim(f, "second", 30000, &found);
	assert_false(found);
	ok(f, store_sweep(f->store, 3600 * 1000, &more, &f->error));
	ok(f, upload_find(f->store, TENANT_DEFAULT, upload_id(upload), &blob, &sealed, &f->error));
	upload_free(upload);
	wall_jump_s = -DAY_S;
	usleep(1700000);
	ticket = claim(f, "second", 30000, &found);
	assert_true(found);
	assert_int_equal(ticket.attempt, 2);
}

/* As if the machine had been started anew: the id of its start is another. */
static void start_machine_again(struct fixture *f)
{
	assert_int_equal(sqlite3_exec(f->oracle, "UPDATE boot SET id = 'another'", NULL, NULL, NULL), SQLITE_OK);
	store_close(f->store);
	ok(f, store_open(&f->store, f->url, &f->error));
}

static void a_start_of_the_machine_ends_all_leases_and_costs_no_attempt(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	bool found = false;
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	for (int i = 0; i < 10; i++) {
		struct job_ticket ticket = claim(f, "worker", 3600 * 1000, &found);
		assert_true(found);
		assert_int_equal(ticket.attempt, 1);
		start_machine_again(f);
	}
	/* Ten times is no accident any more: this job may be what brings the machine down. */
	for (uint32_t attempt = 1; attempt <= 3; attempt++) {
		struct job_ticket ticket = claim(f, "worker", 3600 * 1000, &found);
		assert_true(found);
		assert_int_equal(ticket.attempt, attempt);
		start_machine_again(f);
	}
	claim(f, "worker", 1000, &found);
	assert_false(found);
	assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, id), JOB_FAILED);
}

static void an_upload_outlives_a_start_of_the_machine(void **state)
{
	struct fixture *f = *state;
	struct upload *upload = NULL;
	struct blob blob;
	bool sealed, more;
	char id[STORE_ID_SIZE];
	ok(f, upload_begin(&upload, f->store, OWNER_DEFAULT, "worn", "a.obj", "model/obj", 1000, &f->error));
	snprintf(id, sizeof id, "%s", upload_id(upload));
	upload_free(upload);
	start_machine_again(f);
	ok(f, store_sweep(f->store, INT64_C(1) << 39, &more, &f->error)); /* longer than any machine runs */
	ok(f, upload_find(f->store, TENANT_DEFAULT, id, &blob, &sealed, &f->error));
}

/* --- what costs an attempt -------------------------------------------------------------------------------------- */

static uint32_t attempts_of(struct fixture *f, const char *id)
{
	struct resource resource;
	ok(f, resource_get(f->store, TENANT_DEFAULT, RESOURCE_LAYOUT, id, &resource, &f->error));
	uint32_t attempts = resource.job.attempts;
	resource_clear(&resource);
	return attempts;
}

static void a_crash_costs_an_attempt_and_an_end_of_the_service_none(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket late = fixture_claim(f);
	ok(f, job_abandon(f->store, "tester", false, &f->error));
	assert_int_equal(attempts_of(f, id), 0);
	refused(f, job_release(f->store, &late, &f->error), TW_ERROR_CONFLICT, "lease-lost");
	fixture_claim(f);
	ok(f, job_abandon(f->store, "another", true, &f->error));
	assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, id), JOB_RUNNING);
	ok(f, job_abandon(f->store, "tester", true, &f->error));
	assert_int_equal(attempts_of(f, id), 1);
	for (int i = 0; i < 2; i++) {
		fixture_claim(f);
		f->now_ms += 5001; /* nobody knows why: it may have hung */
	}
	assert_true(fixture_nothing_to_claim(f));
	assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, id), JOB_FAILED);
}

static void a_lease_runs_out_though_no_worker_asks(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	fixture_claim(f);
	ok(f, job_expire(f->store, &f->error));
	assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, id), JOB_RUNNING);
	f->now_ms += 5001;
	ok(f, job_expire(f->store, &f->error));
	assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, id), JOB_QUEUED);
}

static void a_store_that_fails_costs_no_attempt_however_often(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	for (int i = 0; i < 50; i++) {
		struct job_ticket ticket = fixture_claim(f);
		assert_int_equal(ticket.attempt, 1);
		ok(f, job_put_off(f->store, &ticket, 0, &f->error));
		assert_true(fixture_nothing_to_claim(f));
		f->now_ms += 1001;
	}
	assert_int_equal(attempts_of(f, id), 0);
}

/* The worker could not renew its lease, because nothing could be written. */
static void a_lease_that_ran_out_while_the_disk_was_full_costs_no_attempt(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	fixture_claim(f);
	ok(f, transaction_begin(f->store, false, &f->error));
	assert_int_equal(transaction_end(f->store, connection_fail_full(&f->error), &f->error), TW_ERROR_FULL);
	f->now_ms += 5001;
	assert_int_equal(fixture_claim(f).attempt, 1);
}

/* --- room ------------------------------------------------------------------------------------------------------- */

static void a_job_is_claimed_when_there_is_room_for_its_result(void **state)
{
	struct fixture *f = *state;
	char url[256], large[STORE_ID_SIZE], small[STORE_ID_SIZE], filler[STORE_ID_SIZE];
	char *bytes = malloc(24u << 20);
	memset(bytes, 'v', 24u << 20);
	bytes[(24u << 20) - 1] = '\0';
	struct store *usual = f->store;
	fixture_upload(f, "worn", "filler.obj", bytes, filler);
	fixture_create(f, RESOURCE_MESH, bytes, NULL, NULL, large);
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, small);
	snprintf(url, sizeof url, "%s?limit_bytes=%u", f->url, 68u << 20); /* 48 of them are in use */
	ok(f, store_open(&f->store, url, &f->error));
	store_set_clock(f->store, fixture_clock, f);
	/* The mesh came first, but what will be made of it does not fit; the layout does. */
	struct job_ticket ticket = fixture_claim(f);
	assert_string_equal(ticket.resource_id, small);
	fixture_finish(f, &ticket);
	assert_true(fixture_nothing_to_claim(f));
	ok(f, upload_discard(f->store, TENANT_DEFAULT, filler, &f->error));
	fixture_sweep(f, INT64_C(1) << 39);
	assert_string_equal(fixture_claim(f).resource_id, large);
	store_close(f->store);
	f->store = usual;
	free(bytes);
}

static void a_result_that_did_not_fit_is_not_computed_again_before_it_does(void **state)
{
	struct fixture *f = *state;
	char url[256], id[STORE_ID_SIZE];
	struct store *usual = f->store;
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	snprintf(url, sizeof url, "%s?limit_bytes=%u", f->url, 32u << 20);
	ok(f, store_open(&f->store, url, &f->error));
	store_set_clock(f->store, fixture_clock, f);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, job_put_off(f->store, &ticket, 64u << 20, &f->error));
	f->now_ms += 3600 * 1000;
	assert_true(fixture_nothing_to_claim(f));
	store_close(f->store);
	f->store = usual;
	assert_int_equal(fixture_claim(f).attempt, 1);
}

#define ANY_CLOCK(name) cmocka_unit_test_setup_teardown(name, any_clock, fixture_free)

int main(void)
{
	const struct CMUnitTest tests[] = {
		ANY_CLOCK(a_jump_of_the_wall_clock_ends_no_lease_and_prolongs_none),
		ANY_CLOCK(a_jump_of_the_wall_clock_changes_no_pause_and_sweeps_no_upload),
		ANY_CLOCK(a_start_of_the_machine_ends_all_leases_and_costs_no_attempt),
		ANY_CLOCK(an_upload_outlives_a_start_of_the_machine),
		TEST(a_crash_costs_an_attempt_and_an_end_of_the_service_none),
		TEST(a_lease_runs_out_though_no_worker_asks),
		TEST(a_store_that_fails_costs_no_attempt_however_often),
		TEST(a_lease_that_ran_out_while_the_disk_was_full_costs_no_attempt),
		TEST(a_job_is_claimed_when_there_is_room_for_its_result),
		TEST(a_result_that_did_not_fit_is_not_computed_again_before_it_does),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
