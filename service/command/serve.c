/* `tightwire serve`: the daemon. Its main thread supervises and keeps time; the HTTP server has threads of its own; all
 * computation is done by worker processes.
 *
 * Signals come through a signalfd. SIGHUP reads settings and keys again. SIGTERM and SIGINT drain: not ready any more,
 * no new connections, held requests are answered with what is known, running jobs end or go back to the queue; at the
 * latest after --drain-s the rest is cut off, which loses nothing, because jobs whose worker dies are taken up again.
 */
#include "service/clock.h"
#include "service/command/command.h"
#include "service/daemon/config.h"
#include "service/daemon/http/server.h"
#include "service/daemon/keeper.h"
#include "service/daemon/listen.h"
#include "service/daemon/metrics.h"
#include "service/daemon/supervisor.h"
#include "service/log.h"
#include "service/worker/worker.h"
#include "storage/access.h"
#include "storage/queue.h"

#include <poll.h>
#include <signal.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <unistd.h>

#define TICK_MS 50
#define REFRESH_KEYS_MS 200
#define SPARE_FILES 256

struct daemon {
	struct config config;
	struct metrics *metrics; /* all owned */
	struct supervisor *supervisor;
	struct api *api;
	struct http_server *http;
	struct store *store; /* the main thread's */
	struct keeper *keeper;
	struct listener listener;
	int argc; /* of the command line, for SIGHUP */
	char **argv;
	int signals;
	int64_t refresh_keys_ms; /* when keys are looked at next */
	bool refresh_failed;     /* and that was told */
	atomic_bool draining;
	atomic_bool serves;                   /* supervisor and server are there */
	int64_t drain_until_ms, give_back_ms; /* while draining; the latter 0 once it is done */
};

/* --- what the api asks of us ------------------------------------------------------------------------------------ */

static void on_job_added(void *context, bool is_interactive)
{
	struct daemon *daemon = context;
	supervisor_wake(daemon->supervisor, is_interactive);
}

/* Whoever waits for a job that was queued sees its end, too. */
static void on_job_asked(void *context)
{
	struct daemon *daemon = context;
	supervisor_tell_asked(daemon->supervisor);
	http_jobs_changed(daemon->http);
}

static char *on_metrics(void *context)
{
	const struct daemon *daemon = context;
	return metrics_text(daemon->metrics);
}

static bool on_ready(void *context, char *why, size_t size)
{
	const struct daemon *daemon = context;
	if (!atomic_load(&daemon->draining))
		return true;
	snprintf(why, size, "the service is draining");
	return false;
}

static void on_failed(void *context, const char *request_id, const struct tw_error *error)
{
	(void)context;
	log_event(LOG_LEVEL_ERROR, "failed", "id=%s type=%s text=\"%s\"", request_id ? request_id : "-",
		  error->type ? error->type : "-", error->text);
}

/* --- start ------------------------------------------------------------------------------------------------------ */

/* Blocks the signals for this thread and all that it makes, and takes them from a descriptor instead. */
static enum tw_status open_signals(struct daemon *daemon, struct tw_error *error)
{
	sigset_t set;
	sigemptyset(&set);
	sigaddset(&set, SIGTERM);
	sigaddset(&set, SIGINT);
	sigaddset(&set, SIGCHLD);
	sigaddset(&set, SIGHUP);
	sigprocmask(SIG_BLOCK, &set, NULL);
	signal(SIGPIPE, SIG_IGN);
	/* Whoever started us may have ignored these: dead workers would vanish without a word, and a signal that is
	 * ignored comes through no descriptor. */
	static const int needed[] = {SIGTERM, SIGINT, SIGCHLD, SIGHUP};
	for (size_t i = 0; i < sizeof needed / sizeof *needed; i++)
		signal(needed[i], SIG_DFL);
	daemon->signals = signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
	return daemon->signals >= 0 ? TW_OK : tw_fail(error, TW_ERROR_IO, "signals", NULL, "signalfd failed");
}

/* Three descriptors for each connection (its own, and a pair while it is relayed), a pipe for each worker, and some for
 * the store and the other pipes; as many as the hard limit allows. */
static void raise_file_limit(const struct config *config)
{
	struct rlimit limit;
	int64_t connections = config->connections;
	rlim_t wanted = 3 * (rlim_t)connections + 2 * (rlim_t)config->workers + HTTP_RESERVE + SPARE_FILES;
	if (getrlimit(RLIMIT_NOFILE, &limit) || limit.rlim_cur >= wanted)
		return;
	limit.rlim_cur = limit.rlim_max < wanted ? limit.rlim_max : wanted;
	if (setrlimit(RLIMIT_NOFILE, &limit) || limit.rlim_cur < wanted)
		log_event(LOG_LEVEL_WARNING, "file-limit",
			  "text=\"too few open files are allowed for %lld connections\"", (long long)connections);
}

static bool on_may_hold(void *context)
{
	const struct daemon *daemon = context;
	return http_may_hold(daemon->http);
}

static struct api_settings api_settings_of(struct daemon *daemon)
{
	const struct config *config = &daemon->config;
	return (struct api_settings){
		.store_url = config->store,
		.upload_limit_bytes = (uint64_t)config->upload_limit_mib << 20,
		.wait_limit_s = (uint32_t)config->wait_limit_s,
		.cors_origin = config->cors_origin,
		.host_names = config->host_names,
		.key_file = config->key_file,
		.hooks = {on_job_added, on_job_asked, on_metrics, on_ready, on_may_hold, on_failed, daemon},
	};
}

static enum tw_status open_api(struct daemon *daemon, struct tw_error *error)
{
	const struct api_settings settings = api_settings_of(daemon);
	return api_open(&daemon->api, &settings, error);
}

/* Its lease would run out by itself; this only saves the wait. */
static void on_worker_ended(void *context, pid_t pid, bool crashed)
{
	struct daemon *daemon = context;
	struct tw_error error = {0};
	char name[WORKER_NAME_SIZE];
	worker_name(name, pid);
	if (job_abandon(daemon->store, name, crashed, &error) != TW_OK)
		log_error("abandon", &error);
	supervisor_wake(daemon->supervisor, true);
}

static enum tw_status start_workers(struct daemon *daemon, struct tw_error *error)
{
	struct supervisor_settings settings = {
		.program = "/proc/self/exe",
		.store_url = daemon->config.store,
		.metrics = daemon->metrics,
		.workers = (unsigned)daemon->config.workers,
		.interactive_workers = (unsigned)daemon->config.interactive_workers,
		.threads = (unsigned)daemon->config.worker_threads,
		.memory_mib = (uint64_t)daemon->config.worker_memory_mib,
		.lease_s = (unsigned)daemon->config.lease_s,
		.ended = on_worker_ended,
		.context = daemon,
	};
	return supervisor_start(&daemon->supervisor, &settings, error);
}

/* The keeper begins before them: it looks after the store alone. */
static void on_due(void *context)
{
	struct daemon *daemon = context;
	if (!atomic_load(&daemon->serves))
		return;
	supervisor_wake(daemon->supervisor, true);
	on_job_asked(daemon);
}

static enum tw_status start_keeper(struct daemon *daemon, struct tw_error *error)
{
	const struct keeper_settings settings = {
		.store_url = daemon->config.store, .api = daemon->api, .due = on_due, .context = daemon};
	return keeper_start(&daemon->keeper, &settings, error);
}

static struct http_limits http_limits_of(const struct config *config)
{
	return (struct http_limits){
		.connections = (unsigned)config->connections,
		.per_address = (unsigned)config->connections_per_address,
		.held = (unsigned)config->held_requests,
		.idle_s = (unsigned)config->idle_timeout_s,
		.head_s = (unsigned)config->head_timeout_s,
		.request_s = (unsigned)config->request_timeout_s,
		.rate_bytes_s = (unsigned)config->least_rate_bytes_s,
	};
}

static enum tw_status start_http(struct daemon *daemon, struct tw_error *error)
{
	const struct http_limits limits = http_limits_of(&daemon->config);
	struct http_settings settings = {
		.api = daemon->api,
		.metrics = daemon->metrics,
		.socket = daemon->listener.socket,
		.threads = (unsigned)daemon->config.http_threads,
		.limits = &limits,
	};
	return http_start(&daemon->http, &settings, error);
}

/* Whether nobody gets in without a key, as far as the store says that is there already. */
static bool store_needs_keys(const char *url)
{
	struct store *store = NULL;
	struct access access = {0};
	bool needs = store_open_existing(&store, url, NULL) == TW_OK && access_read(store, &access, NULL) == TW_OK &&
		     access.keys_needed;
	access_clear(&access);
	store_close(store);
	return needs;
}

static enum tw_status open_listener(struct daemon *daemon, struct tw_error *error)
{
	const struct config *config = &daemon->config;
	enum tw_status status = listen_open(&daemon->listener, config->listen, !config->key_file[0], error);
	bool wants_keys = status != TW_OK && !strcmp(error->type, "listen-unprotected");
	return wants_keys && store_needs_keys(config->store)
		       ? listen_open(&daemon->listener, config->listen, false, error)
		       : status;
}

/* The address first, so that a service which may not or cannot listen leaves the store alone; the store before the
 * workers, so that only one process creates it; the workers before the threads of HTTP, so that nobody asks for work
 * which nobody does. */
static enum tw_status start(struct daemon *daemon, struct tw_error *error)
{
	const struct config *config = &daemon->config;
	raise_file_limit(config);
	enum tw_status status = open_signals(daemon, error);
	daemon->metrics = metrics_new();
	if (status == TW_OK && !daemon->metrics)
		status = tw_fail_memory(error);
	if (status == TW_OK)
		status = open_listener(daemon, error);
	if (status == TW_OK)
		status = store_open(&daemon->store, config->store, error);
	if (status == TW_OK)
		status = worker_abandon_dead(daemon->store, error);
	if (status == TW_OK)
		status = open_api(daemon, error);
	if (status == TW_OK)
		status = start_keeper(daemon, error);
	if (status == TW_OK)
		status = start_workers(daemon, error);
	if (status == TW_OK)
		status = start_http(daemon, error);
	atomic_store(&daemon->serves, status == TW_OK);
	return status;
}

/* --- run -------------------------------------------------------------------------------------------------------- */

static void begin_drain(struct daemon *daemon)
{
	if (atomic_exchange(&daemon->draining, true))
		return;
	log_event(LOG_LEVEL_INFO, "draining", "active=%u", http_active(daemon->http));
	daemon->drain_until_ms = monotonic_ms() + 1000 * daemon->config.drain_s;
	daemon->give_back_ms = monotonic_ms() + 500 * daemon->config.drain_s;
	http_drain(daemon->http);
	supervisor_drain(daemon->supervisor);
}

/* Half of the time is for running jobs to end; then they go back to the queue. */
static void go_on_draining(struct daemon *daemon)
{
	if (!daemon->give_back_ms || monotonic_ms() < daemon->give_back_ms)
		return;
	daemon->give_back_ms = 0;
	supervisor_drain(daemon->supervisor);
}

static enum log_level parse_log_level(const char *name)
{
	static const char *const names[] = {"error", "warning", "info", "debug"};
	enum log_level level = LOG_LEVEL_ERROR;
	while (level < LOG_LEVEL_DEBUG && strcmp(names[level], name) != 0)
		level++;
	return level;
}

/* SIGHUP: keys, limits and the level of the log as they are now. What is wrong with them is logged, and nothing of it
 * taken. */
static void reload(struct daemon *daemon)
{
	char kept[CONFIG_KEPT_SIZE];
	struct tw_error error = {0};
	struct config before = daemon->config;
	enum tw_status status = config_reload(&daemon->config, daemon->argc, daemon->argv, kept, &error);
	const struct api_settings settings = api_settings_of(daemon);
	if (status == TW_OK)
		status = api_reload(daemon->api, &settings, &error);
	if (status != TW_OK) {
		daemon->config = before;
		log_error("reload", &error);
		return;
	}
	const struct http_limits limits = http_limits_of(&daemon->config);
	http_set_limits(daemon->http, &limits);
	raise_file_limit(&daemon->config);
	log_event(LOG_LEVEL_INFO, "reloaded", "restart_for=\"%s\"", kept);
	log_set_level(parse_log_level(daemon->config.log_level));
}

static void take_signals(struct daemon *daemon)
{
	struct signalfd_siginfo info;
	while (read(daemon->signals, &info, sizeof info) == (ssize_t)sizeof info) {
		if (info.ssi_signo == SIGHUP)
			reload(daemon);
		else if (info.ssi_signo != SIGCHLD)
			begin_drain(daemon);
	}
}

static bool is_over(const struct daemon *daemon)
{
	if (!atomic_load(&daemon->draining))
		return false;
	return monotonic_ms() >= daemon->drain_until_ms ||
	       (!http_active(daemon->http) && !supervisor_alive(daemon->supervisor));
}

/* Several times a second: a key that was revoked must not be good for longer than that. */
static void refresh_keys(struct daemon *daemon)
{
	struct tw_error error = {0};
	int64_t now = monotonic_ms();
	if (now < daemon->refresh_keys_ms)
		return;
	daemon->refresh_keys_ms = now + REFRESH_KEYS_MS;
	bool failed = api_refresh_keys(daemon->api, &error) != TW_OK;
	if (failed && !daemon->refresh_failed)
		log_error("keys", &error);
	daemon->refresh_failed = failed;
}

static void run(struct daemon *daemon)
{
	struct pollfd files[] = {{daemon->signals, POLLIN, 0}, {supervisor_done_fd(daemon->supervisor), POLLIN, 0}};
	while (!is_over(daemon)) {
		poll(files, sizeof files / sizeof files[0], TICK_MS);
		take_signals(daemon);
		go_on_draining(daemon);
		refresh_keys(daemon);
		supervisor_tick(daemon->supervisor);
		if (supervisor_take_done(daemon->supervisor))
			http_jobs_changed(daemon->http);
	}
}

/* Of keys, since the keeper has told them. */
static void tell_last_uses(struct daemon *daemon)
{
	struct tw_error error = {0};
	if (daemon->api && daemon->store && api_tell_uses(daemon->api, daemon->store, &error) != TW_OK)
		log_error("key-uses", &error);
}

static void stop(struct daemon *daemon)
{
	keeper_stop(daemon->keeper); /* first: it wakes the others */
	http_stop(daemon->http);
	tell_last_uses(daemon);
	supervisor_stop(daemon->supervisor);
	api_close(daemon->api);
	store_close(daemon->store);
	metrics_free(daemon->metrics);
	if (daemon->signals >= 0)
		close(daemon->signals);
}

static void print_help(void)
{
	printf("usage: tightwire serve [flags]\n\nThe HTTP service with its worker processes.\n\n");
	config_print_help(stdout);
}

int command_serve(int argc, char **argv)
{
	struct daemon daemon = {.argc = argc, .argv = argv, .signals = -1};
	struct tw_error error = {0};
	enum config_outcome outcome = CONFIG_READY;
	if (config_read(&daemon.config, argc, argv, &outcome, &error) != TW_OK) {
		fprintf(stderr, "tightwire serve: %s%s%s\n", error.where, error.where[0] ? ": " : "", error.text);
		return COMMAND_USAGE;
	}
	if (outcome == CONFIG_HELP) {
		print_help();
		return COMMAND_DONE;
	}
	log_set_level(parse_log_level(daemon.config.log_level));
	if (start(&daemon, &error) != TW_OK) {
		fprintf(stderr, "tightwire serve: %s%s%s\n", error.where, error.where[0] ? ": " : "", error.text);
		stop(&daemon);
		return COMMAND_FAILED;
	}
	printf("listening on %s\n", daemon.listener.url);
	fflush(stdout);
	log_event(LOG_LEVEL_INFO, "listening", "url=%s workers=%lld version=" TW_VERSION, daemon.listener.url,
		  (long long)daemon.config.workers);
	run(&daemon);
	log_event(LOG_LEVEL_INFO, "stopped", "cut_off=%u", http_active(daemon.http));
	stop(&daemon);
	return COMMAND_DONE;
}
