/* The rig process's loop against a box of its own making: a Modbus TCP server (MODBUS Messaging on TCP/IP 1.0b) without
 * libmodbus. The store's clock, which is the wall's, is moved while it records. */
#include "service/rig/clock.h"
#include "service/rig/reader.h"

#include "tests/unit/storage/fixture.h"

#include "storage/recording.h"

#include <arpa/inet.h>
#include <jansson.h>
#include <netinet/in.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <sys/socket.h>
#include <time.h>

enum { DAY_MS = 86400000, REQUEST_BYTES = 12 };

struct box {
	int socket;
	uint16_t port;
	atomic_bool closing;
	pthread_t thread;
};

static bool receive(int connection, uint8_t *bytes, size_t size)
{
	size_t got = 0;
	ssize_t part = 1;
	for (; got < size && part > 0; got += part > 0 ? (size_t)part : 0)
		part = recv(connection, bytes + got, size - got, 0);
	return got == size;
}

/* Read input registers: a head of 7 bytes, then function, first register and count. */
static void serve(int connection)
{
	uint8_t request[REQUEST_BYTES];
	while (receive(connection, request, sizeof request)) {
		unsigned count = request[11];
		uint8_t answer[9 + 2 * 125] = {request[0], request[1], 0,
					       0,          0,          (uint8_t)(3 + 2 * count),
					       request[6], request[7], (uint8_t)(2 * count)};
		if (send(connection, answer, 9 + 2 * count, MSG_NOSIGNAL) < 0)
			break;
	}
	close(connection);
}

static void *run_box(void *context)
{
	struct box *box = context;
	while (!atomic_load(&box->closing)) {
		int connection = accept(box->socket, NULL, NULL);
		if (connection >= 0)
			serve(connection);
	}
	return NULL;
}

static void box_start(struct box *box)
{
	struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
	socklen_t size = sizeof address;
	box->socket = socket(AF_INET, SOCK_STREAM, 0);
	assert_int_equal(bind(box->socket, (struct sockaddr *)&address, sizeof address), 0);
	assert_int_equal(listen(box->socket, 4), 0);
	assert_int_equal(getsockname(box->socket, (struct sockaddr *)&address, &size), 0);
	box->port = ntohs(address.sin_port);
	atomic_store(&box->closing, false);
	assert_int_equal(pthread_create(&box->thread, NULL, run_box, box), 0);
}

static void box_stop(struct box *box)
{
	atomic_store(&box->closing, true);
	shutdown(box->socket, SHUT_RDWR);
	pthread_join(box->thread, NULL);
	close(box->socket);
}

/* --- a rig in a thread -------------------------------------------------------------------------------------------- */

static _Atomic int64_t moved_ms;

static int64_t moved_clock(void *context)
{
	struct timespec now;
	(void)context;
	clock_gettime(CLOCK_REALTIME, &now);
	return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000 + atomic_load(&moved_ms);
}

struct rig_thread {
	const char *store_url;
	char device_url[64];
	volatile sig_atomic_t stop;
	enum tw_status status;
	pthread_t thread;
};

static void *run_rig(void *context)
{
	struct rig_thread *rig = context;
	struct store *store = NULL;
	struct rig_device *device = NULL;
	struct rig_scanner *scanner = NULL;
	struct rig_device_options options = {.url = rig->device_url, .unit = 1, .timeout_ms = 500};
	rig->status = store_open(&store, rig->store_url, NULL);
	if (rig->status == TW_OK)
		store_set_clock(store, moved_clock, NULL);
	if (rig->status == TW_OK)
		rig->status = rig_device_new(&device, &options, NULL);
	if (rig->status == TW_OK)
		rig->status = rig_scanner_start(&scanner, device, 50, NULL);
	if (rig->status == TW_OK)
		rig->status = rig_run(store, scanner, rig->device_url, &rig->stop, NULL);
	rig_scanner_stop(scanner);
	rig_device_free(device);
	store_close(store);
	return NULL;
}

static void nap_ms(long ms)
{
	nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000}, NULL);
}

static void check_samples(struct fixture *f, const char *id, const struct rig_sample *samples, size_t count)
{
	struct recording_extent extent;
	ok(f, recording_extent(f->store, id, &extent, &f->error));
	assert_int_equal(extent.sample_count, count);
	for (size_t i = 1; i < count; i++)
		assert_true(samples[i].at_us > samples[i - 1].at_us);
	assert_true(samples[count - 1].at_us - samples[0].at_us < 2600000);
}

static void a_wall_clock_that_jumps_neither_ends_nor_prolongs_a_recording(void **state)
{
	struct fixture *f = *state;
	struct box box;
	struct rig_thread rig = {.store_url = f->url};
	struct resource recording;
	enum resource_outcome outcome;
	struct resource_draft draft = {.owner = OWNER_DEFAULT,
				       .kind = RESOURCE_RECORDING,
				       .options = "{\"duration_s\":2.0,\"tolerance\":0.9}"};
	struct rig_sample samples[200];
	size_t got = 0;
	char id[STORE_ID_SIZE];
	box_start(&box);
	store_set_clock(f->store, moved_clock, NULL);
	ok(f, resource_create(f->store, &draft, &recording, &outcome, &f->error));
	memcpy(id, recording.id, sizeof id);
	resource_clear(&recording);
	snprintf(rig.device_url, sizeof rig.device_url, "tcp://127.0.0.1:%u", box.port);
	assert_int_equal(pthread_create(&rig.thread, NULL, run_rig, &rig), 0);
	int64_t start_us = rig_clock_us();
	for (int i = 0; i < 200; i++) {
		nap_ms(100);
		int64_t past_ms = (rig_clock_us() - start_us) / 1000;
		atomic_store(&moved_ms, past_ms < 600 ? 0 : past_ms < 1200 ? DAY_MS : -DAY_MS);
		ok(f, resource_get(f->store, TENANT_DEFAULT, RESOURCE_RECORDING, id, &recording, &f->error));
		bool ended = job_state_is_final(recording.job.state);
		if (ended) {
			assert_int_equal(recording.job.state, JOB_SUCCEEDED);
			json_t *summary = json_loads(recording.summary, 0, NULL);
			assert_int_equal(json_integer_value(json_object_get(summary, "expected_count")), 100);
			json_decref(summary);
		}
		resource_clear(&recording);
		if (ended)
			break;
	}
	assert_true(rig_clock_us() - start_us >= 2000000);
	rig.stop = 1;
	pthread_join(rig.thread, NULL);
	box_stop(&box);
	assert_int_equal(rig.status, TW_OK);
	ok(f, recording_read(f->store, id, 0, samples, 200, &got, &f->error));
	assert_true(got >= 10 && got <= 100);
	check_samples(f, id, samples, got);
}

/* What nobody takes in time is counted as dropped: the newest stay, in order. */
static void scans_that_nobody_takes_are_counted_as_dropped(void **state)
{
	(void)state;
	enum { RATE_HZ = 1000, ENOUGH = 4500 };
	struct box box;
	char url[64];
	struct tw_error error;
	struct rig_device *device = NULL;
	struct rig_scanner *scanner = NULL;
	struct rig_scanner_state now = {0};
	box_start(&box);
	snprintf(url, sizeof url, "tcp://127.0.0.1:%u", box.port);
	struct rig_device_options options = {.url = url, .unit = 1, .timeout_ms = 500};
	assert_int_equal(rig_device_new(&device, &options, &error), TW_OK);
	assert_int_equal(rig_scanner_start(&scanner, device, RATE_HZ, &error), TW_OK);
	for (int i = 0; i < 600 && now.counts.scans < ENOUGH; i++) {
		nap_ms(100);
		rig_scanner_state(scanner, &now);
	}
	assert_true(now.counts.scans >= ENOUGH);
	struct rig_scan *scans = calloc(2 * ENOUGH, sizeof *scans);
	size_t got = rig_scanner_take(scanner, scans, 2 * ENOUGH);
	rig_scanner_state(scanner, &now);
	assert_true(now.counts.dropped > 0);
	/* One may have come between the two. */
	assert_in_range(now.counts.scans - now.counts.dropped, got, got + RATE_HZ);
	for (size_t i = 1; i < got; i++)
		assert_true(scans[i].slot > scans[i - 1].slot);
	free(scans);
	rig_scanner_stop(scanner);
	rig_device_free(device);
	box_stop(&box);
}

static void slots_follow_from_the_clock_alone(void **state)
{
	(void)state;
	for (uint32_t rate = 1; rate <= 200; rate++) {
		for (int64_t at_us = 123456789; at_us < 123456789 + 3000000; at_us += 77777) {
			int64_t slot = rig_slot_after(rate, at_us);
			assert_true(rig_slot_due_us(rate, slot) >= at_us);
			assert_true(rig_slot_due_us(rate, slot - 1) <= at_us);
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(a_wall_clock_that_jumps_neither_ends_nor_prolongs_a_recording),
		cmocka_unit_test(scans_that_nobody_takes_are_counted_as_dropped),
		cmocka_unit_test(slots_follow_from_the_clock_alone),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
