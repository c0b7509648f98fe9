#include "service/daemon/supervisor.h"

#include "service/clock.h"
#include "service/log.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define PAUSE_FIRST_MS 100
#define PAUSE_LAST_MS 30000
#define STEADY_MS 10000 /* a worker that lived that long did not die of its start */
/* The ends of the pipes as a worker finds them. Ours lie above, so that they are never in the way. */
#define WORKER_WAKE_FD 3
#define WORKER_DONE_FD 4
#define WORKER_ASKED_FD 5
#define OWN_FD_MIN 10

struct child {
	pid_t pid; /* 0: none */
	int64_t started_ms;
	int64_t start_at_ms; /* where there is none */
	int64_t pause_ms;    /* before the next start */
	int asked[2];        /* pipe; both ends stay ours too, so that any thread may write whoever lives */
};

struct supervisor {
	struct supervisor_settings settings;
	int wake[2], wake_interactive[2], done[2]; /* pipes: [0] to read, [1] to write */
	bool draining;
	struct child workers[]; /* [settings.workers] */
};

/* --- pipes ------------------------------------------------------------------------------------------------------ */

static void close_pipe(int ends[2])
{
	for (int i = 0; i < 2; i++)
		if (ends[i] >= 0)
			close(ends[i]);
}

static enum tw_status open_pipe(int ends[2], struct tw_error *error)
{
	int low[2];
	if (pipe2(low, O_CLOEXEC | O_NONBLOCK))
		return tw_fail(error, TW_ERROR_IO, "pipe", NULL, "no pipe for the workers: %s", strerror(errno));
	for (int i = 0; i < 2; i++)
		ends[i] = fcntl(low[i], F_DUPFD_CLOEXEC, OWN_FD_MIN);
	close_pipe(low);
	if (ends[0] < 0 || ends[1] < 0)
		return tw_fail(error, TW_ERROR_IO, "pipe", NULL, "no pipe for the workers: %s", strerror(errno));
	return TW_OK;
}

/* A full pipe holds more wakes than there are workers: one more would change nothing. */
static void add_byte(int pipe)
{
	if (write(pipe, "", 1) < 0)
		return;
}

void supervisor_wake(struct supervisor *supervisor, bool is_interactive)
{
	add_byte(supervisor->wake[1]);
	if (is_interactive && supervisor->settings.interactive_workers > 0)
		add_byte(supervisor->wake_interactive[1]);
}

void supervisor_tell_asked(struct supervisor *supervisor)
{
	for (unsigned i = 0; i < supervisor->settings.workers; i++)
		add_byte(supervisor->workers[i].asked[1]);
}

int supervisor_done_fd(const struct supervisor *supervisor)
{
	return supervisor->done[0];
}

bool supervisor_take_done(struct supervisor *supervisor)
{
	char bytes[256];
	bool any = false;
	while (read(supervisor->done[0], bytes, sizeof bytes) > 0)
		any = true;
	return any;
}

/* --- processes -------------------------------------------------------------------------------------------------- */

/* The first ones are. */
static bool is_for_interactive(const struct supervisor *supervisor, const struct child *worker)
{
	return worker - supervisor->workers < (ptrdiff_t)supervisor->settings.interactive_workers;
}

static int spawn_worker(const struct supervisor *supervisor, struct child *worker)
{
	const struct supervisor_settings *settings = &supervisor->settings;
	char threads[32], memory[32], lease[32], wake[32], done[32], asked[32];
	snprintf(threads, sizeof threads, "--threads=%u", settings->threads);
	snprintf(memory, sizeof memory, "--memory-mib=%llu", (unsigned long long)settings->memory_mib);
	snprintf(lease, sizeof lease, "--lease-s=%u", settings->lease_s);
	snprintf(wake, sizeof wake, "--wake-fd=%d", WORKER_WAKE_FD);
	snprintf(done, sizeof done, "--done-fd=%d", WORKER_DONE_FD);
	snprintf(asked, sizeof asked, "--asked-fd=%d", WORKER_ASKED_FD);
	char *arguments[] = {"tightwire", "worker", "--store", (char *)settings->store_url,
			     threads,     memory,   lease,     wake,
			     done,        asked,    NULL,      NULL};
	bool is_interactive = is_for_interactive(supervisor, worker);
	if (is_interactive)
		arguments[sizeof arguments / sizeof *arguments - 2] = "--interactive-only";
	static const int inherited[] = {SIGPIPE, SIGCHLD, SIGHUP, SIGTERM, SIGINT};
	posix_spawn_file_actions_t files;
	posix_spawnattr_t attributes;
	sigset_t none, defaults;
	sigemptyset(&none);
	sigemptyset(&defaults);
	/* Not what the daemon has set or was started with. */
	for (size_t i = 0; i < sizeof inherited / sizeof *inherited; i++)
		sigaddset(&defaults, inherited[i]);
	posix_spawn_file_actions_init(&files);
	posix_spawn_file_actions_adddup2(&files, is_interactive ? supervisor->wake_interactive[0] : supervisor->wake[0],
					 WORKER_WAKE_FD);
	posix_spawn_file_actions_adddup2(&files, supervisor->done[1], WORKER_DONE_FD);
	posix_spawn_file_actions_adddup2(&files, worker->asked[0], WORKER_ASKED_FD);
	posix_spawnattr_init(&attributes);
	posix_spawnattr_setsigmask(&attributes, &none);
	posix_spawnattr_setsigdefault(&attributes, &defaults);
	posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
	int code = posix_spawn(&worker->pid, supervisor->settings.program, &files, &attributes, arguments, environ);
	posix_spawnattr_destroy(&attributes);
	posix_spawn_file_actions_destroy(&files);
	return code;
}

static void put_off(struct child *worker, int64_t lived_ms)
{
	if (lived_ms >= STEADY_MS)
		worker->pause_ms = PAUSE_FIRST_MS;
	worker->start_at_ms = monotonic_ms() + worker->pause_ms;
	worker->pause_ms = worker->pause_ms * 2 < PAUSE_LAST_MS ? worker->pause_ms * 2 : PAUSE_LAST_MS;
}

static void start_worker(struct supervisor *supervisor, struct child *worker)
{
	int code = spawn_worker(supervisor, worker);
	worker->started_ms = monotonic_ms();
	if (!code) {
		log_event(LOG_LEVEL_INFO, "worker-started", "pid=%d%s", (int)worker->pid,
			  is_for_interactive(supervisor, worker) ? " jobs=interactive" : "");
		return;
	}
	worker->pid = 0;
	log_event(LOG_LEVEL_ERROR, "worker-start", "text=\"%s\"", strerror(code));
	put_off(worker, 0);
}

static void note_end(struct supervisor *supervisor, struct child *worker, int status)
{
	int64_t lived_ms = monotonic_ms() - worker->started_ms;
	bool signalled = WIFSIGNALED(status);
	log_event(supervisor->draining ? LOG_LEVEL_INFO : LOG_LEVEL_WARNING, "worker-ended",
		  "pid=%d %s=%d lived_s=%.1f", (int)worker->pid, signalled ? "signal" : "code",
		  signalled ? WTERMSIG(status) : WEXITSTATUS(status), (double)lived_ms / 1000);
	if (supervisor->settings.ended)
		supervisor->settings.ended(supervisor->settings.context, worker->pid,
					   !supervisor->draining && (signalled || WEXITSTATUS(status) != 0));
	worker->pid = 0;
	put_off(worker, lived_ms);
	if (!supervisor->draining && supervisor->settings.metrics)
		metrics_count_restart(supervisor->settings.metrics);
}

void supervisor_tick(struct supervisor *supervisor)
{
	for (unsigned i = 0; i < supervisor->settings.workers; i++) {
		struct child *worker = &supervisor->workers[i];
		int status = 0;
		if (worker->pid && waitpid(worker->pid, &status, WNOHANG) == worker->pid)
			note_end(supervisor, worker, status);
		if (!worker->pid && !supervisor->draining && monotonic_ms() >= worker->start_at_ms)
			start_worker(supervisor, worker);
	}
	if (supervisor->settings.metrics)
		metrics_set_workers(supervisor->settings.metrics, supervisor_alive(supervisor));
}

enum tw_status supervisor_start(struct supervisor **supervisor, const struct supervisor_settings *settings,
				struct tw_error *error)
{
	*supervisor = NULL;
	struct supervisor *made = calloc(1, sizeof *made + settings->workers * sizeof made->workers[0]);
	if (!made)
		return tw_fail_memory(error);
	made->settings = *settings;
	memset(made->wake, -1, sizeof made->wake);
	memset(made->wake_interactive, -1, sizeof made->wake_interactive);
	memset(made->done, -1, sizeof made->done);
	for (unsigned i = 0; i < settings->workers; i++)
		made->workers[i] = (struct child){.pause_ms = PAUSE_FIRST_MS, .asked = {-1, -1}};
	enum tw_status status = open_pipe(made->wake, error);
	if (status == TW_OK)
		status = open_pipe(made->wake_interactive, error);
	if (status == TW_OK)
		status = open_pipe(made->done, error);
	for (unsigned i = 0; status == TW_OK && i < settings->workers; i++)
		status = open_pipe(made->workers[i].asked, error);
	if (status != TW_OK) {
		supervisor_stop(made);
		return status;
	}
	supervisor_tick(made);
	*supervisor = made;
	return TW_OK;
}

static void signal_all(const struct supervisor *supervisor, int signal)
{
	for (unsigned i = 0; i < supervisor->settings.workers; i++)
		if (supervisor->workers[i].pid)
			kill(supervisor->workers[i].pid, signal);
}

void supervisor_drain(struct supervisor *supervisor)
{
	supervisor->draining = true;
	signal_all(supervisor, SIGTERM);
}

unsigned supervisor_alive(const struct supervisor *supervisor)
{
	unsigned alive = 0;
	for (unsigned i = 0; i < supervisor->settings.workers; i++)
		alive += supervisor->workers[i].pid != 0;
	return alive;
}

/* It was killed by us, not by its job. */
static void bury(const struct supervisor *supervisor, const struct child *worker)
{
	waitpid(worker->pid, NULL, 0);
	if (supervisor->settings.ended)
		supervisor->settings.ended(supervisor->settings.context, worker->pid, false);
}

void supervisor_stop(struct supervisor *supervisor)
{
	if (!supervisor)
		return;
	signal_all(supervisor, SIGKILL);
	for (unsigned i = 0; i < supervisor->settings.workers; i++)
		if (supervisor->workers[i].pid)
			bury(supervisor, &supervisor->workers[i]);
	for (unsigned i = 0; i < supervisor->settings.workers; i++)
		close_pipe(supervisor->workers[i].asked);
	close_pipe(supervisor->wake);
	close_pipe(supervisor->wake_interactive);
	close_pipe(supervisor->done);
	free(supervisor);
}
