/* tightwire rig: the process that reads the acquisition box. */
#include "service/command.h"
#include "service/rig.h"
#include "solver/option.h"

#include <stdlib.h>
#include <string.h>

static const char *const register_kinds[] = {"input", "holding", NULL};

struct rig_options {
	uint32_t rate_hz, unit, address, timeout_ms;
	int registers;
};

static const struct option rows[] = {
	{"rate_hz", OPTION_INTEGER, offsetof(struct rig_options, rate_hz), "Hz", 50, 1, 200, NULL, "scans a second"},
	{"registers", OPTION_CHOICE, offsetof(struct rig_options, registers), NULL, 0, 0, 0, register_kinds,
	 "where the counts are: input registers (function 4) or holding registers (3)"},
	{"address", OPTION_INTEGER, offsetof(struct rig_options, address), NULL, 0, 0, 65535 - RIG_CHANNELS, NULL,
	 "first register, counted from 0"},
	{"unit", OPTION_INTEGER, offsetof(struct rig_options, unit), NULL, 1, 0, 255, NULL, "Modbus unit address"},
	{"timeout_ms", OPTION_INTEGER, offsetof(struct rig_options, timeout_ms), "ms", 500, 10, 10000, NULL,
	 "how long to wait for a connection and for an answer"},
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
	       "  --device URL\n      tcp://HOST:PORT, or rtu:/dev/NAME?baud=N (environment TIGHTWIRE_DEVICE)\n"
	       "  --store URL\n      the service's store (environment TIGHTWIRE_STORE; default sqlite:tightwire.db)\n",
	       RIG_CHANNELS);
	option_print_help(&table, stdout);
}

static int fail(const struct tw_error *error, int code)
{
	fprintf(stderr, "tightwire rig: %s%s%s\n", error->where, error->where[0] ? ": " : "", error->text);
	return code;
}

static int run(const char *store_url, const struct rig_device_options *device_options, uint32_t rate_hz)
{
	struct tw_error error;
	struct rig_device *device = NULL;
	struct store *store = NULL;
	struct rig_scanner *scanner = NULL;
	enum tw_status status = rig_device_new(&device, device_options, &error);
	if (status)
		return fail(&error, COMMAND_USAGE);
	status = store_open(&store, store_url, &error);
	if (!status)
		status = rig_scanner_start(&scanner, device, rate_hz, &error);
	if (!status)
		status = rig_run(store, scanner, device_options->url, &stop, &error);
	rig_scanner_stop(scanner);
	store_close(store);
	rig_device_free(device);
	return status ? fail(&error, COMMAND_FAILED) : COMMAND_DONE;
}

int command_rig(int argc, char **argv)
{
	const char *device = getenv("TIGHTWIRE_DEVICE"), *store = getenv("TIGHTWIRE_STORE");
	struct rig_options options;
	struct tw_error error;
	option_defaults(&table, &options);
	for (int i = 1; i < argc; i++) {
		bool taken = false;
		if (!strcmp(argv[i], "--help")) {
			print_help();
			return COMMAND_DONE;
		}
		if (option_from_arguments(&table, &options, argc, argv, &i, &taken, &error))
			return fail(&error, COMMAND_USAGE);
		if (taken)
			continue;
		if (!strcmp(argv[i], "--device") && i + 1 < argc)
			device = argv[++i];
		else if (!strcmp(argv[i], "--store") && i + 1 < argc)
			store = argv[++i];
		else {
			fprintf(stderr, "tightwire rig: \"%s\" is not understood; see tightwire rig --help\n", argv[i]);
			return COMMAND_USAGE;
		}
	}
	if (!device) {
		fprintf(stderr, "tightwire rig: --device tcp://HOST:PORT is missing\n");
		return COMMAND_USAGE;
	}
	signal(SIGTERM, on_signal);
	signal(SIGINT, on_signal);
	signal(SIGPIPE, SIG_IGN);
	return run(store ? store : "sqlite:tightwire.db",
		   &(struct rig_device_options){.url = device,
						.unit = options.unit,
						.address = options.address,
						.holding = options.registers,
						.timeout_ms = options.timeout_ms},
		   options.rate_hz);
}
