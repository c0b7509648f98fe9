/* tightwire rig: the process that reads the acquisition box. */
#include "service/command/command.h"
#include "service/rig/reader.h"
#include "solver/option.h"
#include "storage/queue.h"
#include "storage/role.h"

#include <stdlib.h>
#include <unistd.h>

static const char *const register_kinds[] = {"input", "holding", NULL};

struct rig_options {
	uint32_t rate_hz, unit, address, timeout_ms;
	int registers;
	bool help;
	const char *device, *store; /* borrowed; NULL where not given */
	struct rig_device *opened;  /* owned */
};

static const struct option rows[] = {
	{"rate_hz", OPTION_INTEGER, offsetof(struct rig_options, rate_hz), "Hz", 50, 1, 200, NULL, "scans a second"},
	{"registers", OPTION_CHOICE, offsetof(struct rig_options, registers), NULL, 0, 0, 0, register_kinds,
	 "where the counts are: input registers (function 4) or holding registers (3)"},
	{"address", OPTION_INTEGER, offsetof(struct rig_options, address), NULL, 0, 0, 65535 - RIG_CHANNELS, NULL,
	 "first register, counted from 0"},
	{"unit", OPTION_INTEGER, offsetof(struct rig_options, unit), NULL, 1, 0, 255, NULL,
	 "Modbus unit address: 1 to 247; over TCP also 0 or 255, the device itself"},
	{"timeout_ms", OPTION_INTEGER, offsetof(struct rig_options, timeout_ms), "ms", 500, 10, 10000, NULL,
	 "how long to wait for a connection and for an answer"},
	{"help", OPTION_FLAG, offsetof(struct rig_options, help), NULL, 0, 0, 0, NULL, "this text"},
};
static const struct option_table table = {rows, sizeof rows / sizeof *rows};

static volatile sig_atomic_t stop;

static void on_signal(int number)
{
	(void)number;
	stop = 1;
}

static void print_help(void)
{
	printf("usage: tightwire rig --device tcp://HOST:PORT [--store sqlite:PATH] [options]\n\n"
	       "Scans %d registers of the acquisition box, keeps /v1/rig current and makes the recordings that are "
	       "queued.\n"
	       "Connects again by itself. Ends on SIGTERM or SIGINT; an unfinished recording goes back to the "
	       "queue.\n\n"
	       "  --device URL\n      tcp://HOST:PORT, or a serial line, "
	       "rtu:/dev/NAME?baud=115200&parity=even&data=8&stop=1: "
	       "what is left out is as here\n"
	       "      parity none, even or odd; 7 or 8 data bits; 1 or 2 stop bits (environment TIGHTWIRE_DEVICE)\n"
	       "  --store URL\n      the service's store (environment TIGHTWIRE_STORE; default sqlite:tightwire.db)\n",
	       RIG_CHANNELS);
	option_print_help(&table, stdout);
}

static enum tw_status take_argument(struct rig_options *options, int argc, char **argv, int *index, bool *taken,
				    struct tw_error *error)
{
	enum tw_status status =
		command_take_text("--device", "a device", &options->device, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = command_take_text("--store", "a store", &options->store, argc, argv, index, taken, error);
	if (status == TW_OK && !*taken)
		status = option_from_arguments(&table, options, argc, argv, index, taken, error);
	return status;
}

static enum tw_status parse(void *context, int argc, char **argv, bool *help, struct tw_error *error)
{
	struct rig_options *options = context;
	option_defaults(&table, options);
	options->device = getenv("TIGHTWIRE_DEVICE");
	options->store = getenv("TIGHTWIRE_STORE");
	for (int i = 1; i < argc; i++) {
		bool taken = false;
		enum tw_status status = take_argument(options, argc, argv, &i, &taken, error);
		if (status != TW_OK)
			return status;
		if (!taken)
			return command_refuse(argv[i], (const char *const[]){"--device", "--store", NULL},
					      (const struct option_table *const[]){&table, NULL}, error);
	}
	*help = options->help;
	if (*help)
		return TW_OK;
	if (!options->device)
		return tw_fail(error, TW_ERROR_INPUT, "usage", "--device", "is missing: say --device tcp://HOST:PORT");
	return rig_device_new(&options->opened,
			      &(struct rig_device_options){.url = options->device,
							   .unit = options->unit,
							   .address = options->address,
							   .holding = options->registers,
							   .timeout_ms = options->timeout_ms},
			      error);
}

/* The one before may be about to end. */
static enum tw_status take_role(struct role **role, struct store *store, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	for (int i = 0; status == TW_OK && !*role && !stop && i < 30; i++) {
		usleep(i > 0 ? 100000 : 0);
		status = role_take(role, store, ROLE_RIG, error);
	}
	if (status != TW_OK || *role)
		return status;
	return tw_fail(error, TW_ERROR_CONFLICT, "rig-running", NULL,
		       "another tightwire rig reads for this store already; stop it, or name another store");
}

/* What a rig process before this one had is ours: it is gone, for we have its role. */
static enum tw_status read_rig(const struct rig_options *options, struct store *store, struct tw_error *error)
{
	struct role *role = NULL;
	struct rig_scanner *scanner = NULL;
	enum tw_status status = take_role(&role, store, error);
	if (status == TW_OK)
		status = job_abandon(store, RIG_WORKER, false, error);
	if (status == TW_OK)
		status = rig_scanner_start(&scanner, options->opened, options->rate_hz, error);
	if (status == TW_OK)
		status = rig_run(store, scanner, options->device, &stop, error);
	rig_scanner_stop(scanner);
	role_release(role);
	return status;
}

static enum tw_status run(void *context, struct tw_error *error)
{
	const struct rig_options *options = context;
	struct store *store = NULL;
	signal(SIGTERM, on_signal);
	signal(SIGINT, on_signal);
	signal(SIGPIPE, SIG_IGN);
	enum tw_status status = store_open(&store, options->store ? options->store : "sqlite:tightwire.db", error);
	if (status == TW_OK)
		status = read_rig(options, store, error);
	store_close(store);
	return status;
}

static void clear(void *context)
{
	struct rig_options *options = context;
	rig_device_free(options->opened);
}

int command_rig(int argc, char **argv)
{
	static const struct command_steps steps = {"rig", print_help, parse, run, clear};
	struct rig_options options = {0};
	return command_run(&steps, &options, argc, argv);
}
