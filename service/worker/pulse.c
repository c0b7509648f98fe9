/* The heartbeat thread: see pulse.h. It sleeps between jobs; while a job runs it beats a few times a second, because
 * that is also how it learns that somebody cancelled. */
#include "service/worker/pulse.h"

#include "service/log.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { BEAT_MS = 300 };

struct pulse {
	struct store *store; /* owned; used by the thread alone */
	int64_t stall_ms;    /* 0: never */
	pthread_t thread;
	pthread_mutex_t mutex; /* guards all that follows */
	pthread_cond_t changed;
	bool quit;
	bool running; /* a job is under way */
	bool beating; /* the thread is writing for it */
	bool cancelled;
	bool lease_lost;
	int64_t sign_of_life_ms; /* by the monotonic clock: when the computation told or asked something */
	struct job_ticket ticket;
	double share;
	const char *stage; /* borrowed, static */
	char *partial;     /* owned; taken by the thread */
};

static int64_t monotonic_ms(void)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static void exit_if_stalled(const struct pulse *pulse)
{
	int64_t silent_ms = monotonic_ms() - pulse->sign_of_life_ms;
	if (pulse->stall_ms == 0 || silent_ms < pulse->stall_ms)
		return;
	log_event(LOG_LEVEL_ERROR, "worker-stalled", "job=%s silent_s=%lld", pulse->ticket.job_id,
		  (long long)(silent_ms / 1000));
	_exit(PULSE_STALLED);
}

static void wait_a_beat(struct pulse *pulse)
{
	struct timespec until;
	clock_gettime(CLOCK_MONOTONIC, &until);
	until.tv_nsec += BEAT_MS * 1000000L;
	until.tv_sec += until.tv_nsec / 1000000000L;
	until.tv_nsec %= 1000000000L;
	pthread_cond_timedwait(&pulse->changed, &pulse->mutex, &until);
}

/* Called with the mutex held, which is let go while the store is written. A busy store is no reason to stop: the next
 * beat comes before the lease runs out. */
static void beat(struct pulse *pulse)
{
	struct tw_error error = {0};
	bool cancel = false;
	struct job_ticket ticket = pulse->ticket;
	double share = pulse->share;
	const char *stage = pulse->stage;
	char *partial = pulse->partial;
	pulse->partial = NULL;
	pulse->beating = true;
	pthread_mutex_unlock(&pulse->mutex);
	enum tw_status status = job_heartbeat(pulse->store, &ticket, share, stage, partial, &cancel, &error);
	free(partial);
	pthread_mutex_lock(&pulse->mutex);
	pulse->beating = false;
	pulse->cancelled |= status == TW_OK && cancel;
	pulse->lease_lost |= status == TW_ERROR_CONFLICT;
	pthread_cond_broadcast(&pulse->changed);
}

static void *run(void *context)
{
	struct pulse *pulse = context;
	pthread_mutex_lock(&pulse->mutex);
	while (!pulse->quit) {
		if (!pulse->running || pulse->lease_lost) {
			pthread_cond_wait(&pulse->changed, &pulse->mutex);
			continue;
		}
		wait_a_beat(pulse);
		if (!pulse->running || pulse->lease_lost || pulse->quit)
			continue;
		exit_if_stalled(pulse);
		beat(pulse);
	}
	pthread_mutex_unlock(&pulse->mutex);
	return NULL;
}

static bool start(struct pulse *pulse)
{
	pthread_condattr_t monotonic;
	pthread_mutex_init(&pulse->mutex, NULL);
	pthread_condattr_init(&monotonic);
	pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
	pthread_cond_init(&pulse->changed, &monotonic);
	pthread_condattr_destroy(&monotonic);
	if (pthread_create(&pulse->thread, NULL, run, pulse) == 0)
		return true;
	pthread_cond_destroy(&pulse->changed);
	pthread_mutex_destroy(&pulse->mutex);
	return false;
}

enum tw_status pulse_new(struct pulse **pulse, const char *store_url, int64_t stall_ms, struct tw_error *error)
{
	struct pulse *made = calloc(1, sizeof *made);
	if (!made)
		return tw_fail_memory(error);
	made->stall_ms = stall_ms;
	enum tw_status status = store_open(&made->store, store_url, error);
	if (status == TW_OK && !start(made))
		status = tw_fail(error, TW_ERROR_MEMORY, "no-thread", NULL, "the heartbeat thread cannot be started");
	if (status != TW_OK) {
		store_close(made->store);
		free(made);
		return status;
	}
	*pulse = made;
	return TW_OK;
}

void pulse_free(struct pulse *pulse)
{
	if (!pulse)
		return;
	pthread_mutex_lock(&pulse->mutex);
	pulse->quit = true;
	pthread_cond_broadcast(&pulse->changed);
	pthread_mutex_unlock(&pulse->mutex);
	pthread_join(pulse->thread, NULL);
	pthread_cond_destroy(&pulse->changed);
	pthread_mutex_destroy(&pulse->mutex);
	store_close(pulse->store);
	free(pulse->partial);
	free(pulse);
}

void pulse_begin(struct pulse *pulse, const struct job_ticket *ticket)
{
	pthread_mutex_lock(&pulse->mutex);
	pulse->ticket = *ticket;
	pulse->sign_of_life_ms = monotonic_ms();
	pulse->share = 0;
	pulse->stage = NULL;
	pulse->cancelled = false;
	pulse->lease_lost = false;
	pulse->running = true;
	pthread_cond_broadcast(&pulse->changed);
	pthread_mutex_unlock(&pulse->mutex);
}

void pulse_tell(struct pulse *pulse, double share, const char *stage, const char *partial)
{
	char *copy = partial ? strdup(partial) : NULL;
	pthread_mutex_lock(&pulse->mutex);
	pulse->sign_of_life_ms = monotonic_ms();
	pulse->share = share;
	if (stage)
		pulse->stage = stage;
	if (copy) {
		free(pulse->partial);
		pulse->partial = copy;
	}
	pthread_mutex_unlock(&pulse->mutex);
}

bool pulse_says_stop(struct pulse *pulse)
{
	pthread_mutex_lock(&pulse->mutex);
	pulse->sign_of_life_ms = monotonic_ms();
	bool stop = pulse->cancelled || pulse->lease_lost;
	pthread_mutex_unlock(&pulse->mutex);
	return stop;
}

bool pulse_says_cancelled(struct pulse *pulse)
{
	pthread_mutex_lock(&pulse->mutex);
	bool cancelled = pulse->cancelled;
	pthread_mutex_unlock(&pulse->mutex);
	return cancelled;
}

void pulse_end(struct pulse *pulse)
{
	pthread_mutex_lock(&pulse->mutex);
	pulse->running = false;
	while (pulse->beating)
		pthread_cond_wait(&pulse->changed, &pulse->mutex);
	free(pulse->partial);
	pulse->partial = NULL;
	pthread_mutex_unlock(&pulse->mutex);
}
