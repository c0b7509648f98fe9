/* The heartbeat thread: see pulse.h. It sleeps between jobs. While a job runs it beats a few times a second, which is
 * also how it learns of a cancel that was asked for on another machine; of one that was asked for here it is woken, and
 * reads only whether it is its own job that is meant. */
#include "service/worker/pulse.h"

#include "service/clock.h"
#include "service/log.h"

#include <poll.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

enum { BEAT_MS = 300 };

struct pulse {
	struct store *store; /* owned; used by the thread alone */
	int64_t stall_ms;    /* 0: never */
	int asked_fd;        /* borrowed; the thread's; -1 for none */
	int wake;            /* owned eventfd: what follows has changed */
	pthread_t thread;
	pthread_mutex_t mutex; /* guards all that follows */
	pthread_cond_t quiet;  /* `beating` has become false */
	bool quit;
	bool running; /* a job is under way */
	bool beating; /* the thread uses the store for it */
	bool cancelled;
	bool lease_lost;
	int64_t beat_at_ms;      /* by the monotonic clock */
	int64_t sign_of_life_ms; /* by the monotonic clock: when the computation told or asked something */
	struct job_ticket ticket;
	double share;
	const char *stage; /* borrowed, static */
	char *partial;     /* owned; taken by the thread */
};

static void exit_if_stalled(const struct pulse *pulse)
{
	int64_t silent_ms = monotonic_ms() - pulse->sign_of_life_ms;
	if (pulse->stall_ms == 0 || silent_ms < pulse->stall_ms)
		return;
	log_event(LOG_LEVEL_ERROR, "worker-stalled", "job=%s silent_s=%lld", pulse->ticket.job_id,
		  (long long)(silent_ms / 1000));
	_exit(PULSE_STALLED);
}

static void wake(struct pulse *pulse)
{
	/* A full counter wakes too. */
	if (write(pulse->wake, &(uint64_t){1}, sizeof(uint64_t)) < 0)
		return;
}

/* Whether there was a byte. At its end the pipe says nothing any more: the worker itself sees that it is alone. */
static bool take_bytes(struct pulse *pulse)
{
	char bytes[256];
	ssize_t got = read(pulse->asked_fd, bytes, sizeof bytes);
	if (got == 0)
		pulse->asked_fd = -1;
	return got > 0;
}

/* Waits, without the mutex, until something changes, for at most `timeout_ms` (-1: for ever). True when somebody has
 * asked for some job to stop. */
static bool rest(struct pulse *pulse, int64_t timeout_ms)
{
	uint64_t count = 0;
	struct pollfd files[] = {{pulse->wake, POLLIN, 0}, {pulse->asked_fd, POLLIN, 0}};
	pthread_mutex_unlock(&pulse->mutex);
	bool asked = poll(files, 2, (int)timeout_ms) > 0 && files[1].revents && take_bytes(pulse);
	if (files[0].revents && read(pulse->wake, &count, sizeof count) < 0)
		asked = true; /* cannot be; and to look once more does no harm */
	pthread_mutex_lock(&pulse->mutex);
	return asked;
}

static void begin_use(struct pulse *pulse)
{
	pulse->beating = true;
	pthread_mutex_unlock(&pulse->mutex);
}

static void end_use(struct pulse *pulse, enum tw_status status, bool cancel)
{
	pthread_mutex_lock(&pulse->mutex);
	pulse->beating = false;
	pulse->cancelled |= status == TW_OK && cancel;
	pulse->lease_lost |= status == TW_ERROR_CONFLICT;
	pthread_cond_broadcast(&pulse->quiet);
}

/* Both are called with the mutex held, which is let go while the store is used. A busy store is no reason to stop: the
 * next beat comes before the lease runs out. */
static void beat(struct pulse *pulse)
{
	struct tw_error error = {0};
	bool cancel = false;
	struct job_ticket ticket = pulse->ticket;
	double share = pulse->share;
	const char *stage = pulse->stage;
	char *partial = pulse->partial;
	pulse->partial = NULL;
	pulse->beat_at_ms = monotonic_ms() + BEAT_MS;
	begin_use(pulse);
	enum tw_status status = job_heartbeat(pulse->store, &ticket, share, stage, partial, &cancel, &error);
	free(partial);
	end_use(pulse, status, cancel);
}

static void look(struct pulse *pulse)
{
	struct tw_error error = {0};
	bool cancel = false;
	struct job_ticket ticket = pulse->ticket;
	begin_use(pulse);
	enum tw_status status = job_is_cancelled(pulse->store, &ticket, &cancel, &error);
	end_use(pulse, status, cancel);
}

static bool has_job(const struct pulse *pulse)
{
	return pulse->running && !pulse->lease_lost && !pulse->quit;
}

static void *run(void *context)
{
	struct pulse *pulse = context;
	pthread_mutex_lock(&pulse->mutex);
	while (!pulse->quit) {
		int64_t left_ms = has_job(pulse) ? pulse->beat_at_ms - monotonic_ms() : -1;
		if (has_job(pulse) && left_ms <= 0) {
			exit_if_stalled(pulse);
			beat(pulse);
		} else if (rest(pulse, left_ms) && has_job(pulse)) {
			look(pulse);
		}
	}
	pthread_mutex_unlock(&pulse->mutex);
	return NULL;
}

static bool start(struct pulse *pulse)
{
	pulse->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
	pthread_mutex_init(&pulse->mutex, NULL);
	pthread_cond_init(&pulse->quiet, NULL);
	if (pulse->wake >= 0 && pthread_create(&pulse->thread, NULL, run, pulse) == 0)
		return true;
	if (pulse->wake >= 0)
		close(pulse->wake);
	pthread_cond_destroy(&pulse->quiet);
	pthread_mutex_destroy(&pulse->mutex);
	return false;
}

enum tw_status pulse_new(struct pulse **pulse, const struct pulse_settings *settings, struct tw_error *error)
{
	struct pulse *made = calloc(1, sizeof *made);
	if (!made)
		return tw_fail_memory(error);
	made->stall_ms = settings->stall_ms;
	made->asked_fd = settings->asked_fd;
	enum tw_status status = store_open(&made->store, settings->store_url, error);
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
	pthread_mutex_unlock(&pulse->mutex);
	wake(pulse);
	pthread_join(pulse->thread, NULL);
	close(pulse->wake);
	pthread_cond_destroy(&pulse->quiet);
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
	pulse->beat_at_ms = pulse->sign_of_life_ms + BEAT_MS;
	pthread_mutex_unlock(&pulse->mutex);
	wake(pulse);
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
		pthread_cond_wait(&pulse->quiet, &pulse->mutex);
	free(pulse->partial);
	pulse->partial = NULL;
	pthread_mutex_unlock(&pulse->mutex);
}
