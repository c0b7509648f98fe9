/* The rig's state and recordings. */
#include "tests/unit/storage/fixture.h"

#include "storage/queue.h"
#include "storage/recording.h"
#include "storage/role.h"

static struct rig_sample sample(int64_t number)
{
	struct rig_sample s = {.at_us = 1700000000000000 + 20000 * number};
	for (int i = 0; i < RIG_CHANNELS; i++)
		s.counts[i] = (uint16_t)((number * 7 + i * 131) % 1024);
	return s;
}

static const struct recording_course course = {.boot = "b",
					       .rate_hz = 50,
					       .first_slot = 100,
					       .slot_count = 500,
					       .start_us = 1700000000000000,
					       .last_slot = 99};

static void the_state_is_replaced(void **state)
{
	struct fixture *f = *state;
	struct rig_state rig;
	ok(f, rig_get(f->store, &rig, &f->error));
	assert_string_equal(rig.device, "");
	assert_false(rig.has_sample);
	for (int i = 0; i < 3; i++) {
		struct rig_state put = {
			.device = "tcp://box:502",
			.status = "connected",
			.has_sample = i > 0,
			.latest = sample(i),
			.rate_hz = 50,
			.counts = {.scans = 1, .gaps = 2, .exceptions = 3, .dropped = 4, .connects = 5}};
		ok(f, rig_put(f->store, &put, &f->error));
		ok(f, rig_get(f->store, &rig, &f->error));
		assert_string_equal(rig.device, "tcp://box:502");
		assert_int_equal(rig.has_sample, i > 0);
		assert_int_equal(rig.rate_hz, 50);
		assert_memory_equal(&rig.counts, &put.counts, sizeof rig.counts);
		if (i > 0)
			assert_memory_equal(&rig.latest, &put.latest, sizeof rig.latest);
	}
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM rig"), 1);
}

static void a_recording_gives_its_samples_back_from_anywhere(void **state)
{
	struct fixture *f = *state;
	enum { COUNT = 9000 };
	struct rig_sample *samples = calloc(COUNT, sizeof *samples), back[100];
	char id[STORE_ID_SIZE];
	struct recording_extent extent;
	bool cancel;
	size_t got;
	for (int i = 0; i < COUNT; i++)
		samples[i] = sample(i);
	fixture_create(f, RESOURCE_RECORDING, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, recording_append(f->store, &ticket, samples, 50, &course, 0.1, &cancel, &f->error));
	ok(f, recording_append(f->store, &ticket, samples + 50, 0, &course, 0.1, &cancel, &f->error));
	ok(f, recording_append(f->store, &ticket, samples + 50, 8000, &course, 0.5, &cancel, &f->error));
	ok(f, recording_append(f->store, &ticket, samples + 8050, COUNT - 8050, &course, 0.9, &cancel, &f->error));
	for (uint64_t first = 0; first < COUNT; first += 37) {
		ok(f, recording_read(f->store, id, first, back, 100, &got, &f->error));
		assert_int_equal(got, COUNT - first < 100 ? COUNT - first : 100);
		assert_memory_equal(back, samples + first, got * sizeof back[0]);
	}
	ok(f, recording_read(f->store, id, COUNT, back, 100, &got, &f->error));
	assert_int_equal(got, 0);
	ok(f, recording_extent(f->store, id, &extent, &f->error));
	assert_int_equal(extent.sample_count, COUNT);
	assert_int_equal(extent.first_us, samples[0].at_us);
	assert_int_equal(extent.last_us, samples[COUNT - 1].at_us);
	fixture_finish(f, &ticket);
	refused(f, recording_append(f->store, &ticket, samples, 1, &course, 1, &cancel, &f->error), TW_ERROR_CONFLICT,
		"lease-lost");
	ok(f, recording_extent(f->store, id, &extent, &f->error));
	assert_int_equal(extent.sample_count, COUNT);
	free(samples);
}

static void appending_keeps_the_lease_and_hears_of_a_cancel(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	struct rig_sample s = sample(0);
	enum job_state after;
	bool cancel = true;
	fixture_create(f, RESOURCE_RECORDING, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	for (int i = 0; i < 5; i++) {
		f->now_ms += 4000;
		ok(f, recording_append(f->store, &ticket, &s, 1, &course, 0.2, &cancel, &f->error));
		assert_false(cancel);
		assert_true(fixture_nothing_to_claim(f));
	}
	ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error));
	ok(f, recording_append(f->store, &ticket, &s, 1, &course, 0.2, &cancel, &f->error));
	assert_true(cancel);
}

/* A recording that is made again begins anew; one that goes on after a crash keeps what it had. */
static void a_second_attempt_keeps_the_samples_and_a_redrive_drops_them(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	struct rig_sample s = sample(0);
	struct recording_extent extent;
	struct tw_error failure = {TW_ERROR_IO, "rig", "", "no box"};
	bool cancel;
	fixture_create(f, RESOURCE_RECORDING, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, recording_append(f->store, &ticket, &s, 1, &course, 0, &cancel, &f->error));
	f->now_ms += 5001;
	ticket = fixture_claim(f);
	ok(f, recording_append(f->store, &ticket, &s, 1, &course, 0, &cancel, &f->error));
	ok(f, recording_extent(f->store, id, &extent, &f->error));
	assert_int_equal(extent.sample_count, 2);
	ok(f, job_fail(f->store, &ticket, &failure, false, &f->error));
	ok(f, job_redrive(f->store, TENANT_DEFAULT, ticket.job_id, &f->error));
	ok(f, recording_extent(f->store, id, &extent, &f->error));
	assert_int_equal(extent.sample_count, 0);
}

static void another_process_goes_on_with_the_course_as_it_was_appended(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	struct rig_sample s = sample(0);
	struct recording_course mine = course, later;
	bool cancel, found = true, resumed = true;
	fixture_create(f, RESOURCE_RECORDING, NULL, NULL, NULL, id);
	ok(f, recording_find_course(f->store, id, &later, &found, &f->error));
	assert_false(found);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, recording_begin(f->store, &ticket, &mine, &resumed, &f->error));
	assert_false(resumed);
	mine.last_slot = 107;
	mine.longest_gap = 7;
	mine.exceptions = 2;
	mine.dropped = 1;
	ok(f, recording_append(f->store, &ticket, &s, 1, &mine, 0.1, &cancel, &f->error));
	f->now_ms += 5001;
	ticket = fixture_claim(f);
	memset(&later, 0, sizeof later);
	ok(f, recording_begin(f->store, &ticket, &later, &resumed, &f->error));
	assert_true(resumed);
	assert_memory_equal(&later, &mine, sizeof mine);
}

static void a_course_is_kept_while_its_recording_has_not_ended(void **state)
{
	struct fixture *f = *state;
	char ids[3][STORE_ID_SIZE], begun[4][STORE_ID_SIZE];
	size_t count = 0;
	struct job_ticket tickets[3];
	struct recording_course mine = course;
	struct tw_error failure = {TW_ERROR_IO, "rig", "", "no box"};
	bool resumed, found;
	for (int i = 0; i < 3; i++) {
		fixture_create(f, RESOURCE_RECORDING, (const char *const[]){"a", "b", "c"}[i], NULL, NULL, ids[i]);
		tickets[i] = fixture_claim(f);
		ok(f, recording_begin(f->store, &tickets[i], &mine, &resumed, &f->error));
	}
	ok(f, recording_list_begun(f->store, begun, 4, &count, &f->error));
	assert_int_equal(count, 3);
	for (int i = 0; i < 3; i++)
		assert_string_equal(begun[i], ids[i]);
	ok(f, job_finish(f->store, &tickets[0], &(struct job_result){.summary = "{}", .incomplete = true}, &f->error));
	ok(f, job_fail(f->store, &tickets[1], &failure, false, &f->error));
	ok(f, job_release(f->store, &tickets[2], &f->error));
	ok(f, recording_list_begun(f->store, begun, 4, &count, &f->error));
	assert_int_equal(count, 1);
	assert_string_equal(begun[0], ids[2]);
	struct job_ticket again;
	ok(f, job_claim_resource(f->store, ids[0], "daemon", 5000, &again, &found, &f->error));
	assert_false(found);
	ok(f, job_claim_resource(f->store, ids[2], "daemon", 5000, &again, &found, &f->error));
	assert_true(found);
	assert_string_equal(again.resource_id, ids[2]);
	ok(f, job_claim_resource(f->store, ids[2], "other", 5000, &again, &found, &f->error));
	assert_false(found);
}

static void the_role_of_the_rig_is_had_once_and_comes_back(void **state)
{
	struct fixture *f = *state;
	struct role *first = NULL, *second = NULL;
	ok(f, role_take(&first, f->store, ROLE_RIG, &f->error));
	assert_non_null(first);
	ok(f, role_take(&second, f->store, ROLE_RIG, &f->error));
	assert_null(second);
	role_release(first);
	ok(f, role_take(&second, f->store, ROLE_RIG, &f->error));
	assert_non_null(second);
	role_release(second);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(the_state_is_replaced),
		TEST(a_recording_gives_its_samples_back_from_anywhere),
		TEST(appending_keeps_the_lease_and_hears_of_a_cancel),
		TEST(a_second_attempt_keeps_the_samples_and_a_redrive_drops_them),
		TEST(another_process_goes_on_with_the_course_as_it_was_appended),
		TEST(a_course_is_kept_while_its_recording_has_not_ended),
		TEST(the_role_of_the_rig_is_had_once_and_comes_back),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
