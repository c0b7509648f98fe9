/* tightwire worker: one worker process on a store. `tightwire serve` starts these by itself; further ones may be
 * started by hand. */
#include "service/worker/worker.h"
#include "service/command/command.h"
#include "solver/option.h"

#include <stdlib.h>

struct flags {
	const char *store; /* borrowed */
	const char *name;  /* borrowed; NULL for none */
	uint32_t wake_fd;  /* UINT32_MAX for none, as the next two */
	uint32_t done_fd;
	uint32_t asked_fd;
	uint32_t threads;
	uint32_t memory_mib;
	double lease_s;
	double stall_s;
	bool interactive_only;
	bool help;
};

static const struct option rows[] = {
	{.name = "threads",
	 .kind = OPTION_INTEGER,
	 .offset = offsetof(struct flags, threads),
	 .fallback = 1,
	 .minimum = 1,
	 .maximum = 256,
	 .help = "threads of one computation; never changes a result"},
	{.name = "memory_mib",
	 .kind = OPTION_INTEGER,
	 .offset = offsetof(struct flags, memory_mib),
	 .unit = "MiB",
	 .fallback = 4096,
	 .maximum = 1 << 24,
	 .help = "memory that jobs and what is kept between them may take; 0: no limit"},
	{.name = "lease_s",
	 .kind = OPTION_NUMBER,
	 .offset = offsetof(struct flags, lease_s),
	 .unit = "s",
	 .fallback = 15,
	 .minimum = 1,
	 .maximum = 3600,
	 .help = "how long after its last sign of life a worker's job goes to another"},
	{.name = "stall_s",
	 .kind = OPTION_NUMBER,
	 .offset = offsetof(struct flags, stall_s),
	 .unit = "s",
	 .fallback = 1800,
	 .maximum = 1e6,
	 .help = "a computation that is silent for so long hangs, and the process exits with 70; 0: never"},
	{.name = "wake_fd",
	 .kind = OPTION_INTEGER,
	 .offset = offsetof(struct flags, wake_fd),
	 .fallback = UINT32_MAX,
	 .maximum = UINT32_MAX,
	 .help = "inherited pipe that gets a byte when there is work (used by serve)"},
	{.name = "done_fd",
	 .kind = OPTION_INTEGER,
	 .offset = offsetof(struct flags, done_fd),
	 .fallback = UINT32_MAX,
	 .maximum = UINT32_MAX,
	 .help = "inherited pipe to write a byte to when a job has ended (used by serve)"},
	{.name = "asked_fd",
	 .kind = OPTION_INTEGER,
	 .offset = offsetof(struct flags, asked_fd),
	 .fallback = UINT32_MAX,
	 .maximum = UINT32_MAX,
	 .help = "inherited pipe that gets a byte when a running job was asked to stop (used by serve)"},
	{.name = "interactive_only",
	 .kind = OPTION_FLAG,
	 .offset = offsetof(struct flags, interactive_only),
	 .help = "takes interactive jobs, and leaves all others"},
	{.name = "help", .kind = OPTION_FLAG, .offset = offsetof(struct flags, help), .help = "this text"},
};

static const struct option_table table = {rows, sizeof rows / sizeof *rows};

static void print_help(void)
{
	printf("usage: tightwire worker --store sqlite:PATH [--name NAME] [options]\n\n"
	       "Takes jobs from the store's queue and computes them, until it gets SIGTERM (ends after the running "
	       "job) or\n"
	       "a second SIGTERM (gives the running job back). The store may also stand in TIGHTWIRE_STORE.\n\n");
	option_print_help(&table, stdout);
}

static enum tw_status take_argument(struct flags *flags, int argc, char **argv, int *index, bool *taken,
				    struct tw_error *error)
{
	enum tw_status status = command_take_text("--store", "a store", &flags->store, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = command_take_text("--name", "a name", &flags->name, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = option_from_arguments(&table, flags, argc, argv, index, taken, error);
	return status;
}

static enum tw_status parse(void *context, int argc, char **argv, bool *help, struct tw_error *error)
{
	struct flags *flags = context;
	option_defaults(&table, flags);
	flags->store = getenv("TIGHTWIRE_STORE");
	for (int i = 1; i < argc; i++) {
		bool taken = false;
		enum tw_status status = take_argument(flags, argc, argv, &i, &taken, error);
		if (status != TW_OK)
			return status;
		if (!taken)
			return command_refuse(argv[i], (const char *const[]){"--store", "--name", NULL},
					      (const struct option_table *const[]){&table, NULL}, error);
	}
	*help = flags->help;
	if (!flags->store && !*help)
		return tw_fail(error, TW_ERROR_INPUT, "usage", "--store", "name the store: --store sqlite:PATH");
	return TW_OK;
}

static enum tw_status run(void *context, struct tw_error *error)
{
	const struct flags *flags = context;
	struct worker_settings settings = {
		.store_url = flags->store,
		.name = flags->name,
		.wake_fd = flags->wake_fd == UINT32_MAX ? -1 : (int)flags->wake_fd,
		.done_fd = flags->done_fd == UINT32_MAX ? -1 : (int)flags->done_fd,
		.asked_fd = flags->asked_fd == UINT32_MAX ? -1 : (int)flags->asked_fd,
		.interactive_only = flags->interactive_only,
		.threads = flags->threads,
		.memory_limit = (size_t)flags->memory_mib << 20,
		.lease_ms = (int64_t)(flags->lease_s * 1000),
		.stall_ms = (int64_t)(flags->stall_s * 1000),
	};
	return worker_run(&settings, error);
}

int command_worker(int argc, char **argv)
{
	static const struct command_steps steps = {"worker", print_help, parse, run, NULL};
	struct flags flags = {0};
	return command_run(&steps, &flags, argc, argv);
}
