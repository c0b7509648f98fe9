/* The slots are those of a timerfd on the monotonic clock: when a scan outlasts its slot, the timer tells how many
 * slots went by, and each of them counts as a gap. After a lost connection the wait before the next attempt doubles
 * from BACKOFF_FIRST_US to BACKOFF_LAST_US; slots meanwhile are gaps. */
#include "service/rig/scanner.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

enum { RING_SAMPLES = 4096, BACKOFF_FIRST_US = 250000, BACKOFF_LAST_US = 5000000 };

struct rig_scanner {
	struct rig_device *device; /* borrowed */
	int timer;                 /* owned */
	atomic_bool stopping;
	pthread_t thread;

	/* Of the thread alone. */
	int64_t next_attempt_us, backoff_us; /* monotonic */

	pthread_mutex_t lock; /* guards all below */
	struct rig_scanner_state state;
	uint64_t written, taken; /* samples ever; ring place is the remainder */
	struct rig_sample ring[RING_SAMPLES];
};

static int64_t now_us(clockid_t clock)
{
	struct timespec t;
	clock_gettime(clock, &t);
	return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

static void note_problem(struct rig_scanner *scanner, const struct tw_error *error, uint64_t gaps)
{
	pthread_mutex_lock(&scanner->lock);
	scanner->state.connected = rig_device_is_connected(scanner->device);
	scanner->state.gaps += gaps;
	scanner->state.exceptions += error->status == TW_ERROR_UNSUPPORTED;
	snprintf(scanner->state.problem, sizeof scanner->state.problem, "%.255s", error->text);
	pthread_mutex_unlock(&scanner->lock);
}

static void note_gaps(struct rig_scanner *scanner, uint64_t gaps)
{
	pthread_mutex_lock(&scanner->lock);
	scanner->state.gaps += gaps;
	pthread_mutex_unlock(&scanner->lock);
}

static void put_sample(struct rig_scanner *scanner, const struct rig_sample *sample)
{
	pthread_mutex_lock(&scanner->lock);
	scanner->ring[scanner->written++ % RING_SAMPLES] = *sample;
	if (scanner->written - scanner->taken > RING_SAMPLES) {
		scanner->taken++;
		scanner->state.dropped++;
	}
	scanner->state.scans++;
	scanner->state.connected = true;
	scanner->state.problem[0] = 0;
	pthread_mutex_unlock(&scanner->lock);
}

static void back_off(struct rig_scanner *scanner)
{
	scanner->next_attempt_us = now_us(CLOCK_MONOTONIC) + scanner->backoff_us;
	scanner->backoff_us = scanner->backoff_us * 2 > BACKOFF_LAST_US ? BACKOFF_LAST_US : scanner->backoff_us * 2;
}

/* True when connected. Waits out the back-off by returning false. */
static bool ensure_connected(struct rig_scanner *scanner)
{
	if (rig_device_is_connected(scanner->device))
		return true;
	int64_t now = now_us(CLOCK_MONOTONIC);
	if (now < scanner->next_attempt_us) {
		note_gaps(scanner, 1);
		return false;
	}
	struct tw_error error;
	if (rig_device_connect(scanner->device, &error)) {
		back_off(scanner);
		note_problem(scanner, &error, 1);
		return false;
	}
	pthread_mutex_lock(&scanner->lock);
	scanner->state.connects++;
	scanner->state.connected = true;
	pthread_mutex_unlock(&scanner->lock);
	return true;
}

static void scan_once(struct rig_scanner *scanner)
{
	struct rig_sample sample = {0};
	struct tw_error error;
	if (!ensure_connected(scanner))
		return;
	enum tw_status status = rig_device_scan(scanner->device, sample.counts, &error);
	if (status) {
		if (!rig_device_is_connected(scanner->device))
			back_off(scanner);
		note_problem(scanner, &error, 1);
		return;
	}
	/* Only an answer proves that the peer is alive: a peer that accepts and hangs up at once keeps the back-off
	 * growing. */
	scanner->backoff_us = BACKOFF_FIRST_US;
	sample.at_us = now_us(CLOCK_REALTIME);
	put_sample(scanner, &sample);
}

static void *run(void *argument)
{
	struct rig_scanner *scanner = argument;
	while (!atomic_load(&scanner->stopping)) {
		uint64_t slots = 0;
		if (read(scanner->timer, &slots, sizeof slots) != (ssize_t)sizeof slots)
			continue;
		if (slots > 1)
			note_gaps(scanner, slots - 1);
		scan_once(scanner);
	}
	return NULL;
}

static int start_timer(uint32_t rate_hz)
{
	int timer = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC);
	long period_ns = 1000000000L / (long)rate_hz;
	struct timespec period = {.tv_sec = period_ns / 1000000000L, .tv_nsec = period_ns % 1000000000L};
	struct itimerspec every = {.it_interval = period, .it_value = period};
	if (timer >= 0)
		timerfd_settime(timer, 0, &every, NULL);
	return timer;
}

enum tw_status rig_scanner_start(struct rig_scanner **scanner, struct rig_device *device, uint32_t rate_hz,
				 struct tw_error *error)
{
	struct rig_scanner *made = calloc(1, sizeof *made);
	if (!made)
		return tw_fail_memory(error);
	made->device = device;
	made->backoff_us = BACKOFF_FIRST_US;
	pthread_mutex_init(&made->lock, NULL);
	made->timer = start_timer(rate_hz);
	if (made->timer < 0 || pthread_create(&made->thread, NULL, run, made)) {
		if (made->timer >= 0)
			close(made->timer);
		pthread_mutex_destroy(&made->lock);
		free(made);
		return tw_fail(error, TW_ERROR_IO, "rig-thread", NULL, "cannot start the scanner's thread or timer");
	}
	*scanner = made;
	return TW_OK;
}

void rig_scanner_stop(struct rig_scanner *scanner)
{
	if (!scanner)
		return;
	atomic_store(&scanner->stopping, true);
	pthread_join(scanner->thread, NULL);
	close(scanner->timer);
	pthread_mutex_destroy(&scanner->lock);
	free(scanner);
}

size_t rig_scanner_take(struct rig_scanner *scanner, struct rig_sample *samples, size_t most)
{
	size_t count = 0;
	pthread_mutex_lock(&scanner->lock);
	while (count < most && scanner->taken < scanner->written)
		samples[count++] = scanner->ring[scanner->taken++ % RING_SAMPLES];
	pthread_mutex_unlock(&scanner->lock);
	return count;
}

void rig_scanner_state(struct rig_scanner *scanner, struct rig_scanner_state *state)
{
	pthread_mutex_lock(&scanner->lock);
	*state = scanner->state;
	pthread_mutex_unlock(&scanner->lock);
}
