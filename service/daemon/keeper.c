#include "service/daemon/keeper.h"

#include "service/clock.h"
#include "service/log.h"
#include "service/rig/ending.h"
#include "storage/queue.h"
#include "storage/sweep.h"
#include "storage/task.h"
#include "storage/tenant.h"

#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <time.h>

#define STEP_MS 1000
#define LEAST_MS 5                        /* between two looks at what is due */
#define USES_STEPS 5                      /* between two times that the use of keys is written down */
#define SHRINK_STEPS 60                   /* between two times that pages go back to the file system */
#define SHORT_OF_ROOM_BYTES (64ull << 20) /* some layouts' worth: what takes the place of drawings */
#define UPLOAD_AGE_MS (60ll * 60 * 1000)  /* an upload that nobody has finished for so long is removed */

struct keeper {
	struct store *store; /* owned; the thread's */
	struct keeper_settings settings;
	pthread_t thread;
	pthread_mutex_t mutex;
	pthread_cond_t changed;
	bool stop;
};

/* The same trouble every second is told once. */
static void note(const char *event, enum tw_status status, struct tw_error *error, bool *told)
{
	if (status != TW_OK && !*told)
		log_error(event, error);
	*told = status != TW_OK;
	*error = (struct tw_error){0};
}

static bool is_stopping(struct keeper *keeper)
{
	pthread_mutex_lock(&keeper->mutex);
	bool stop = keeper->stop;
	pthread_mutex_unlock(&keeper->mutex);
	return stop;
}

static enum tw_status sweep_tenants(struct keeper *keeper, struct tw_error *error)
{
	bool more = true;
	enum tw_status status = TW_OK;
	while (status == TW_OK && more && !is_stopping(keeper))
		status = tenant_sweep(keeper->store, &more, error);
	return status;
}

static enum tw_status sweep_all(struct keeper *keeper, struct tw_error *error)
{
	bool more = true;
	enum tw_status status = TW_OK;
	while (status == TW_OK && more && !is_stopping(keeper))
		status = store_sweep(keeper->store, UPLOAD_AGE_MS, &more, error);
	return status;
}

/* What was told of each kind of trouble. */
struct told {
	bool due, recordings, tenants, files, sweep, uses, shrink;
};

/* Milliseconds until something is due, STEP_MS at most. */
static int64_t next_due_ms(struct keeper *keeper)
{
	int64_t due_ms = -1;
	if (job_next_due(keeper->store, &due_ms, NULL) != TW_OK || due_ms < 0 || due_ms > STEP_MS)
		return STEP_MS;
	return due_ms;
}

static void end_what_is_due(struct keeper *keeper, struct told *told)
{
	struct tw_error error = {0};
	if (next_due_ms(keeper) > 0)
		return;
	note("due", job_expire(keeper->store, &error), &error, &told->due);
	keeper->settings.due(keeper->settings.context);
}

static void take_step(struct keeper *keeper, unsigned step, struct told *told)
{
	struct tw_error error = {0};
	note("recordings", recording_end_abandoned(keeper->store, &error), &error, &told->recordings);
	if (step % USES_STEPS == USES_STEPS - 1)
		note("key-uses", api_tell_uses(keeper->settings.api, keeper->store, &error), &error, &told->uses);
	note("tenants", sweep_tenants(keeper, &error), &error, &told->tenants);
	note("drawings", task_drop_files(keeper->store, SHORT_OF_ROOM_BYTES, &error), &error, &told->files);
	note("sweep", sweep_all(keeper, &error), &error, &told->sweep);
	if (step % SHRINK_STEPS == SHRINK_STEPS - 1)
		note("shrink", store_shrink(keeper->store, &error), &error, &told->shrink);
}

static bool wait_for_next(struct keeper *keeper, int64_t wait_ms)
{
	struct timespec until;
	clock_gettime(CLOCK_MONOTONIC, &until);
	until.tv_sec += wait_ms / 1000;
	until.tv_nsec += wait_ms % 1000 * 1000000;
	until.tv_sec += until.tv_nsec / 1000000000;
	until.tv_nsec %= 1000000000;
	pthread_mutex_lock(&keeper->mutex);
	int code = 0;
	while (!keeper->stop && code == 0)
		code = pthread_cond_timedwait(&keeper->changed, &keeper->mutex, &until);
	bool stop = keeper->stop;
	pthread_mutex_unlock(&keeper->mutex);
	return !stop;
}

static void *run(void *context)
{
	struct keeper *keeper = context;
	struct told told = {false};
	unsigned step = 0;
	int64_t step_at_ms = monotonic_ms(), wait_ms = 0;
	do {
		end_what_is_due(keeper, &told);
		if (monotonic_ms() >= step_at_ms) {
			take_step(keeper, step++, &told);
			step_at_ms = monotonic_ms() + STEP_MS;
		}
		wait_ms = next_due_ms(keeper);
		wait_ms = wait_ms > LEAST_MS ? wait_ms : LEAST_MS;
	} while (wait_for_next(keeper, wait_ms));
	return NULL;
}

/* Its thread takes no signals: they are the main thread's. */
static bool start(struct keeper *keeper)
{
	pthread_condattr_t monotonic;
	sigset_t all, before;
	pthread_mutex_init(&keeper->mutex, NULL);
	pthread_condattr_init(&monotonic);
	pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
	pthread_cond_init(&keeper->changed, &monotonic);
	pthread_condattr_destroy(&monotonic);
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &before);
	bool started = pthread_create(&keeper->thread, NULL, run, keeper) == 0;
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	return started;
}

static void destroy(struct keeper *keeper)
{
	store_close(keeper->store);
	pthread_cond_destroy(&keeper->changed);
	pthread_mutex_destroy(&keeper->mutex);
	free(keeper);
}

enum tw_status keeper_start(struct keeper **keeper, const struct keeper_settings *settings, struct tw_error *error)
{
	struct keeper *made = calloc(1, sizeof *made);
	if (!made)
		return tw_fail_memory(error);
	made->settings = *settings;
	enum tw_status status = store_open_existing(&made->store, settings->store_url, error);
	if (status != TW_OK) {
		free(made);
		return status;
	}
	if (!start(made)) {
		destroy(made);
		return tw_fail(error, TW_ERROR_MEMORY, "no-thread", NULL,
			       "the thread that looks after the store cannot be started");
	}
	*keeper = made;
	return TW_OK;
}

void keeper_stop(struct keeper *keeper)
{
	if (!keeper)
		return;
	pthread_mutex_lock(&keeper->mutex);
	keeper->stop = true;
	pthread_cond_broadcast(&keeper->changed);
	pthread_mutex_unlock(&keeper->mutex);
	pthread_join(keeper->thread, NULL);
	destroy(keeper);
}
