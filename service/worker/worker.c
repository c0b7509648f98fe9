/* The loop of a worker process: claim, compute, store.
 *
 * How a failure ends the job: what is wrong with the input will be wrong the next time too, so the job fails at once.
 * Too little memory may pass: the job goes back to the queue until its attempts are used. A full disk or an I/O error
 * is not its fault: it goes back until it can be done, and costs no attempt. When not even that can be written, the
 * worker tries until it can; a store that is not there any more ends the worker. */
#include "service/worker/worker.h"

#include "service/log.h"
#include "service/worker/work.h"
#include "storage/jobs.h"

#include <errno.h>
#include <limits.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum {
	IDLE_POLL_MS =
		50, /* between looks at an empty queue, where nobody wakes us: jobs that others added or put off */
	TROUBLE_PAUSE_MS = 1000, /* after the store has failed */
	WARM_MAX = 4,            /* drags that it takes for warm: as many as designers may share a worker */
};

static const struct handler {
	enum job_kind kind;
	enum tw_status (*run)(struct work *work, struct tw_error *error);
} handlers[] = {
	{JOB_IMPORT_MESH, job_import_mesh},
	{JOB_IMPORT_MOTION, job_import_motion},
	{JOB_COMPUTE_FIELD, job_compute_field},
	{JOB_COMPUTE_LAYOUT, job_compute_layout},
	{JOB_DRAW, job_draw},
};

/* How many times the process was asked to stop. */
static volatile sig_atomic_t stop_requests;

static void on_stop_signal(int number)
{
	(void)number;
	stop_requests = stop_requests + 1;
}

static bool stop_at_once(void)
{
	return stop_requests > 1;
}

struct worker {
	const struct worker_settings *settings;
	char name[WORKER_NAME_SIZE];
	unsigned kinds;
	bool orphaned; /* the supervisor is gone */
	struct store *store;
	struct pulse *pulse;
	struct cache *cache;
	struct warm_states *warm_states;
	int64_t warm[WARM_MAX]; /* affinities of the last jobs, the last one first */
	size_t warm_count;
};

void worker_name(char name[WORKER_NAME_SIZE], pid_t pid)
{
	struct stat own = {0};
	if (stat("/proc/self/ns/pid", &own))
		own.st_ino = 0;
	snprintf(name, WORKER_NAME_SIZE, "worker-%ld-%llu", (long)pid, (unsigned long long)own.st_ino);
}

/* A process that was killed but not yet waited for does nothing any more, either. */
static bool is_gone(pid_t pid)
{
	char path[32], text[512] = "";
	if (kill(pid, 0) != 0)
		return errno == ESRCH;
	snprintf(path, sizeof path, "/proc/%ld/stat", (long)pid);
	FILE *file = fopen(path, "re");
	if (!file)
		return false;
	const char *name_end = fgets(text, sizeof text, file) ? strrchr(text, ')') : NULL;
	fclose(file);
	return name_end && strchr("ZX", name_end[1] ? name_end[2] : ' ');
}

static bool is_dead(const char *name)
{
	static const char prefix[] = "worker-";
	char expected[WORKER_NAME_SIZE];
	if (strncmp(name, prefix, sizeof prefix - 1) != 0)
		return false;
	long pid = strtol(name + sizeof prefix - 1, NULL, 10);
	if (pid <= 0 || pid > INT_MAX)
		return false;
	worker_name(expected, (pid_t)pid);
	return !strcmp(name, expected) && is_gone((pid_t)pid);
}

enum tw_status worker_abandon_dead(struct store *store, struct tw_error *error)
{
	struct job_page page = {0};
	enum tw_status status = job_list_running(store, &page, error);
	for (size_t i = 0; status == TW_OK && i < page.count; i++)
		if (is_dead(page.jobs[i].worker))
			status = job_abandon(store, page.jobs[i].worker, false, error);
	job_page_clear(&page);
	return status;
}

static void complain(const char *event, const char *job, const struct tw_error *error)
{
	log_event(LOG_LEVEL_ERROR, event, "job=%s type=%s text=\"%s\"", *job ? job : "-",
		  error->type ? error->type : "-", error->text);
}

/* A full pipe is as good as one byte more. */
static void tell_done(const struct worker *worker)
{
	int fd = worker->settings->done_fd;
	while (fd >= 0 && write(fd, "", 1) < 0 && errno == EINTR)
		;
}

static void rest_for(int64_t pause_ms)
{
	struct timespec pause = {pause_ms / 1000, pause_ms % 1000 * 1000000};
	nanosleep(&pause, NULL);
}

/* To the moment when something is due; a moment at least, should there be nobody who can see to that. */
static int idle_ms(const struct worker *worker)
{
	int64_t due_ms = -1;
	if (job_next_due(worker->store, &due_ms, NULL) != TW_OK || due_ms < 0 || due_ms > IDLE_POLL_MS)
		return IDLE_POLL_MS;
	return due_ms > 0 ? (int)due_ms : 1;
}

/* One byte is one worker's: the others sleep on. */
static void wait_for_work(struct worker *worker)
{
	char byte;
	struct pollfd wake = {worker->settings->wake_fd, POLLIN, 0};
	if (poll(&wake, 1, idle_ms(worker)) > 0)
		worker->orphaned = read(wake.fd, &byte, 1) == 0;
}

/* --- one job ---------------------------------------------------------------------------------------------------- */

static enum tw_status compute(struct worker *worker, enum job_kind kind, struct work *work, struct tw_error *error)
{
	for (size_t i = 0; i < sizeof handlers / sizeof handlers[0]; i++)
		if (handlers[i].kind == kind)
			return handlers[i].run(work, error);
	return tw_fail(error, TW_ERROR_UNSUPPORTED, "job-kind", NULL, "this worker (%s) cannot do such a job",
		       worker->name);
}

/* The solver knows no flags. What the job would need is not known before it is tried. */
static void explain_memory(size_t memory_limit, struct tw_error *failure)
{
	if (memory_limit && failure->type && !strcmp(failure->type, "out-of-memory"))
		snprintf(failure->text, sizeof failure->text,
			 "the job does not fit into the %zu MiB that a worker may take; the service's operator can "
			 "allow more (--worker-memory-mib of serve, --memory-mib of worker)",
			 memory_limit >> 20);
}

/* The store, not the job. Bytes that are damaged will be so the next time. */
static bool is_the_stores(const struct tw_error *failure)
{
	bool lasting = failure->type && !strcmp(failure->type, BLOB_DAMAGED);
	return (failure->status == TW_ERROR_FULL || failure->status == TW_ERROR_IO) && !lasting;
}

static bool is_gone_store(const struct tw_error *error)
{
	return error->type && !strcmp(error->type, STORE_GONE);
}

static enum tw_status end_failed(struct worker *worker, const struct job_ticket *ticket,
				 const struct job_result *result, const struct tw_error *failure,
				 struct tw_error *error)
{
	bool cancelled = pulse_says_cancelled(worker->pulse);
	if (failure->status == TW_ERROR_CANCELLED && !cancelled)
		return job_release(worker->store, ticket, error);
	if (is_the_stores(failure))
		return job_put_off(worker->store, ticket, result_size(result), error);
	return job_fail(worker->store, ticket, failure, failure->status == TW_ERROR_MEMORY, error);
}

static bool must_leave(const struct worker *worker)
{
	struct pollfd wake = {worker->settings->wake_fd, POLLIN, 0};
	bool orphaned = poll(&wake, 1, 0) > 0 && !(wake.revents & POLLIN);
	return stop_requests || orphaned;
}

/* Until it is written, or nothing can come of it any more. */
static enum tw_status end_failed_for_sure(struct worker *worker, const struct job_ticket *ticket,
					  const struct job_result *result, const struct tw_error *failure,
					  struct tw_error *error)
{
	enum tw_status status = end_failed(worker, ticket, result, failure, error);
	while (status != TW_OK && is_the_stores(error) && !is_gone_store(error) && !must_leave(worker)) {
		complain("job-end", ticket->job_id, error);
		rest_for(TROUBLE_PAUSE_MS);
		status = end_failed(worker, ticket, result, failure, error);
	}
	return status;
}

/* Whose lease was lost has nothing to say any more: another worker does the job, or nobody wants it. */
static void end_job(struct worker *worker, const struct job_ticket *ticket, const struct job_result *result,
		    enum tw_status status, struct tw_error *failure)
{
	struct tw_error error = {0};
	pulse_end(worker->pulse);
	bool computed = status == TW_OK;
	if (computed)
		status = job_finish(worker->store, ticket, result, failure);
	if (status != TW_OK && is_the_stores(failure))
		complain("job-put-off", ticket->job_id, failure);
	if (status != TW_OK && !(computed && status == TW_ERROR_CONFLICT)) {
		status = end_failed_for_sure(worker, ticket, result, failure, &error);
		failure = &error;
	}
	if (status == TW_ERROR_CONFLICT)
		log_event(LOG_LEVEL_WARNING, "lease-lost", "job=%s", ticket->job_id);
	else if (status != TW_OK)
		complain("job-end", ticket->job_id, failure);
	tell_done(worker);
}

/* Where nobody wakes us, the queue is not looked at for this. */
static bool is_wanted(void *context)
{
	const struct worker *worker = context;
	struct pollfd wake = {worker->settings->wake_fd, POLLIN, 0};
	return stop_requests || poll(&wake, 1, 0) > 0;
}

static void run_job(struct worker *worker, const struct job_ticket *ticket)
{
	struct tw_error failure = {0};
	struct resource resource = {0};
	const struct work_shares shares = work_shares_of(worker->settings->memory_limit, ticket->kind);
	const struct job_kind_row *kind = job_kind_row(ticket->kind);
	const char *id = ticket->resource_id[0] ? ticket->resource_id : ticket->subject_id;
	struct work work = {
		.store = worker->store,
		.resource = *id ? &resource : NULL,
		.argument = ticket->argument,
		.cache = worker->cache,
		.pulse = worker->pulse,
		.arena = arena_new(shares.arena),
		.stop = stop_at_once,
		.threads = worker->settings->threads,
		.search_limit = shares.search,
		.warm_states = worker->warm_states,
		.affinity = ticket->session[0] ? ticket->affinity : 0,
		.is_wanted = is_wanted,
		.wanted_context = worker,
	};
	pulse_begin(worker->pulse, ticket);
	enum tw_status status = work.arena ? TW_OK : tw_fail_memory(&failure);
	if (status == TW_OK && work.resource)
		status = resource_get(worker->store, TENANT_ANY,
				      ticket->resource_id[0] ? kind->resource : kind->subject, id, &resource, &failure);
	if (status == TW_OK)
		status = compute(worker, ticket->kind, &work, &failure);
	if (status == TW_ERROR_MEMORY)
		explain_memory(worker->settings->memory_limit, &failure);
	end_job(worker, ticket, &work.result, status, &failure);
	if (work.later)
		work.later(&work);
	resource_clear(&resource);
	arena_free(work.arena);
}

/* --- the loop --------------------------------------------------------------------------------------------------- */

static enum tw_status claim(struct worker *worker, struct job_ticket *ticket, bool *found, struct tw_error *error)
{
	const struct claim_query query = {
		.kinds = worker->kinds,
		.classes = worker->settings->interactive_only ? JOB_CLASS_BIT(JOB_INTERACTIVE) : 0,
		.worker = worker->name,
		.lease_ms = worker->settings->lease_ms,
		.affinities = worker->warm,
		.affinity_count = worker->warm_count,
	};
	return job_claim(worker->store, &query, ticket, found, error);
}

/* What the last jobs were made from is in memory yet: the last one first. */
static void remember(struct worker *worker, int64_t affinity)
{
	size_t at = 0;
	if (!affinity)
		return;
	while (at < worker->warm_count && worker->warm[at] != affinity)
		at++;
	if (at == WARM_MAX)
		at--;
	else if (at == worker->warm_count)
		worker->warm_count++;
	memmove(worker->warm + 1, worker->warm, at * sizeof *worker->warm);
	worker->warm[0] = affinity;
}

/* The byte that came with a job is no news any more once the job is claimed. (One read too many only costs whoever
 * waits for it some milliseconds.) */
static void take_wake(const struct worker *worker)
{
	char byte;
	struct pollfd wake = {worker->settings->wake_fd, POLLIN, 0};
	if (poll(&wake, 1, 0) > 0 && wake.revents & POLLIN && read(wake.fd, &byte, 1) < 0)
		return;
}

static enum tw_status work_until_stopped(struct worker *worker, struct tw_error *error)
{
	while (!stop_requests && !worker->orphaned) {
		struct job_ticket ticket;
		bool found = false;
		*error = (struct tw_error){0};
		enum tw_status status = store_check_place(worker->store, error);
		if (status == TW_OK)
			status = claim(worker, &ticket, &found, error);
		if (status != TW_OK && is_gone_store(error))
			return status;
		if (status != TW_OK) {
			complain("job-claim", "", error);
			rest_for(TROUBLE_PAUSE_MS);
		} else if (found) {
			take_wake(worker);
			run_job(worker, &ticket);
			remember(worker, ticket.affinity);
		} else {
			wait_for_work(worker);
		}
	}
	return TW_OK;
}

static void install_signals(void)
{
	struct sigaction stop = {.sa_handler = on_stop_signal};
	struct sigaction ignore = {.sa_handler = SIG_IGN};
	sigaction(SIGTERM, &stop, NULL);
	sigaction(SIGINT, &stop, NULL);
	sigaction(SIGPIPE, &ignore, NULL);
	sigaction(SIGHUP, &ignore, NULL);  /* the daemon's: it reads its settings again */
	sigaction(SIGXFSZ, &ignore, NULL); /* a file size limit is an error of the store, not a reason to die */
}

/* The heartbeat thread must not take the signals, or the loop would sleep on. */
static enum tw_status start_pulse(struct worker *worker, struct tw_error *error)
{
	sigset_t all;
	sigset_t before;
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &before);
	const struct pulse_settings settings = {
		.store_url = worker->settings->store_url,
		.stall_ms = worker->settings->stall_ms,
		.asked_fd = worker->settings->asked_fd,
	};
	enum tw_status status = pulse_new(&worker->pulse, &settings, error);
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	return status;
}

enum tw_status worker_run(const struct worker_settings *settings, struct tw_error *error)
{
	struct worker worker = {.settings = settings};
	if (settings->name)
		snprintf(worker.name, sizeof worker.name, "%s", settings->name);
	else
		worker_name(worker.name, getpid());
	for (size_t i = 0; i < sizeof handlers / sizeof handlers[0]; i++)
		worker.kinds |= JOB_KIND_BIT(handlers[i].kind);
	install_signals();
	enum tw_status status = store_open_existing(&worker.store, settings->store_url, error);
	if (status == TW_OK)
		status = start_pulse(&worker, error);
	const struct work_shares shares = work_shares_of(settings->memory_limit, JOB_COMPUTE_LAYOUT);
	worker.cache = cache_new(shares.cache);
	worker.warm_states = warm_states_new(shares.warm);
	if (status == TW_OK && (!worker.cache || !worker.warm_states))
		status = tw_fail_memory(error);
	if (status == TW_OK)
		status = work_until_stopped(&worker, error);
	warm_states_free(worker.warm_states);
	cache_free(worker.cache);
	pulse_free(worker.pulse);
	store_close(worker.store);
	return status;
}
