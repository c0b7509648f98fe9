/* The slots are those of a timerfd on the rig's clock: when a scan outlasts its slot, or the machine sleeps, the timer
 * tells how many slots went by, and each of them counts as a gap. After a lost connection the wait before the next
 * attempt doubles from BACKOFF_FIRST_US to BACKOFF_LAST_US; slots meanwhile are gaps. */
#include "service/rig/scanner.h"

#include "service/rig/clock.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/timerfd.h>
#include <unistd.h>

enum { RING_SAMPLES = 4096, BACKOFF_FIRST_US = 250000, BACKOFF_LAST_US = 5000000 };

struct rig_scanner {
	struct rig_device *device; /* borrowed */
	uint32_t rate_hz;
	int timer; /* owned */
	atomic_bool stopping;
	pthread_t thread;

	/* Of the thread alone. */
	int64_t slot; /* the one that is due */
	int64_t next_attempt_us, backoff_us;

	pthread_mutex_t lock; /* guards all below */
	struct rig_scanner_state state;
	uint64_t written, taken; /* samples ever; ring place is the remainder */
	struct rig_scan ring[RING_SAMPLES];
};

static int64_t period_ns(uint32_t rate_hz)
{
	return 1000000000 / (int64_t)rate_hz;
}

int64_t rig_slot_after(uint32_t rate_hz, int64_t now_us)
{
	return now_us * 1000 / period_ns(rate_hz) + 1;
}

int64_t rig_slot_due_us(uint32_t rate_hz, int64_t slot)
{
	return slot * period_ns(rate_hz) / 1000;
}

static void note_problem(struct rig_scanner *scanner, const struct tw_error *error, uint64_t gaps)
{
	pthread_mutex_lock(&scanner->lock);
	scanner->state.connected = rig_device_is_connected(scanner->device);
	scanner->state.counts.gaps += gaps;
	scanner->state.counts.exceptions += error->status == TW_ERROR_UNSUPPORTED;
	snprintf(scanner->state.problem, sizeof scanner->state.problem, "%.255s", error->text);
	pthread_mutex_unlock(&scanner->lock);
}

static void note_gaps(struct rig_scanner *scanner, uint64_t gaps)
{
	pthread_mutex_lock(&scanner->lock);
	scanner->state.counts.gaps += gaps;
	pthread_mutex_unlock(&scanner->lock);
}

/* The slot that has come due, after `slots` expirations of the timer: those before the last went by. */
static void next_slot(struct rig_scanner *scanner, uint64_t slots)
{
	scanner->slot += (int64_t)slots;
	pthread_mutex_lock(&scanner->lock);
	scanner->state.slot = scanner->slot;
	scanner->state.counts.gaps += slots - 1;
	pthread_mutex_unlock(&scanner->lock);
}

static void put_scan(struct rig_scanner *scanner, const struct rig_scan *scan)
{
	pthread_mutex_lock(&scanner->lock);
	scanner->ring[scanner->written++ % RING_SAMPLES] = *scan;
	if (scanner->written - scanner->taken > RING_SAMPLES) {
		scanner->taken++;
		scanner->state.counts.dropped++;
	}
	scanner->state.counts.scans++;
	scanner->state.connected = true;
	scanner->state.problem[0] = 0;
	pthread_mutex_unlock(&scanner->lock);
}

static void back_off(struct rig_scanner *scanner)
{
	scanner->next_attempt_us = rig_clock_us() + scanner->backoff_us;
	scanner->backoff_us = scanner->backoff_us * 2 > BACKOFF_LAST_US ? BACKOFF_LAST_US : scanner->backoff_us * 2;
}

/* True when connected. Waits out the back-off by returning false. */
static bool ensure_connected(struct rig_scanner *scanner)
{
	if (rig_device_is_connected(scanner->device))
		return true;
	int64_t now = rig_clock_us();
	if (now < scanner->next_attempt_us) {
		note_gaps(scanner, 1);
		return false;
	}
	struct tw_error error;
	if (rig_device_connect(scanner->device, &error) != TW_OK) {
		back_off(scanner);
		note_problem(scanner, &error, 1);
		return false;
	}
	pthread_mutex_lock(&scanner->lock);
	scanner->state.counts.connects++;
	scanner->state.connected = true;
	pthread_mutex_unlock(&scanner->lock);
	return true;
}

static void scan_once(struct rig_scanner *scanner)
{
	struct rig_scan scan = {.slot = scanner->slot};
	struct tw_error error;
	if (!ensure_connected(scanner))
		return;
	enum tw_status status = rig_device_scan(scanner->device, scan.sample.counts, &error);
	if (status != TW_OK) {
		if (!rig_device_is_connected(scanner->device))
			back_off(scanner);
		note_problem(scanner, &error, 1);
		return;
	}
	/* Only an answer proves that the peer is alive: a peer that accepts and hangs up at once keeps the back-off
	 * growing. */
	scanner->backoff_us = BACKOFF_FIRST_US;
	scan.sample.at_us = rig_clock_us();
	put_scan(scanner, &scan);
}

static void *run(void *argument)
{
	struct rig_scanner *scanner = argument;
	while (!atomic_load(&scanner->stopping)) {
		uint64_t slots = 0;
		if (read(scanner->timer, &slots, sizeof slots) != (ssize_t)sizeof slots)
			continue;
		next_slot(scanner, slots);
		scan_once(scanner);
	}
	return NULL;
}

static struct timespec time_of_ns(int64_t ns)
{
	return (struct timespec){.tv_sec = ns / 1000000000, .tv_nsec = ns % 1000000000};
}

/* The timer first fires at the slot behind scanner->slot, and then at every one. */
static int start_timer(const struct rig_scanner *scanner)
{
	int timer = timerfd_create(CLOCK_BOOTTIME, TFD_CLOEXEC);
	int64_t period = period_ns(scanner->rate_hz);
	struct itimerspec every = {.it_interval = time_of_ns(period),
				   .it_value = time_of_ns((scanner->slot + 1) * period)};
	if (timer >= 0)
		timerfd_settime(timer, TFD_TIMER_ABSTIME, &every, NULL);
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
	made->rate_hz = rate_hz;
	made->slot = rig_slot_after(rate_hz, rig_clock_us());
	made->timer = start_timer(made);
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

uint32_t rig_scanner_rate_hz(const struct rig_scanner *scanner)
{
	return scanner->rate_hz;
}

size_t rig_scanner_take(struct rig_scanner *scanner, struct rig_scan *scans, size_t most)
{
	size_t count = 0;
	pthread_mutex_lock(&scanner->lock);
	while (count < most && scanner->taken < scanner->written)
		scans[count++] = scanner->ring[scanner->taken++ % RING_SAMPLES];
	pthread_mutex_unlock(&scanner->lock);
	return count;
}

void rig_scanner_state(struct rig_scanner *scanner, struct rig_scanner_state *state)
{
	pthread_mutex_lock(&scanner->lock);
	*state = scanner->state;
	pthread_mutex_unlock(&scanner->lock);
}
