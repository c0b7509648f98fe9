/* `tightwire backup`: a consistent copy of a store, while daemon and workers go on using it. */
#include "service/command/command.h"
#include "storage/store.h"

#include <stdlib.h>
#include <string.h>

struct request {
	const char *url, *path; /* borrowed */
};

static void print_help(void)
{
	printf("usage: tightwire backup --store sqlite:PATH --out FILE\n\n"
	       "Copies the whole store into a new file, which can be used as a store in its place. The store may also\n"
	       "stand in TIGHTWIRE_STORE.\n");
}

static enum tw_status parse(void *context, int argc, char **argv, bool *help, struct tw_error *error)
{
	struct request *request = context;
	request->url = getenv("TIGHTWIRE_STORE");
	const struct command_flag flags[] = {
		{"--store", "a store", &request->url, NULL},
		{"--out", "a file", &request->path, NULL},
		{NULL, NULL, NULL, NULL},
	};
	const enum tw_status status =
		command_take_all(flags, (const char *const[]){NULL}, NULL, argc, argv, help, error);
	if (status != TW_OK)
		return status;
	if (!*help && (!request->url || !request->path))
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL, "--store and --out are needed; see --help");
	return TW_OK;
}

static enum tw_status run(void *context, struct tw_error *error)
{
	const struct request *request = context;
	struct store *store = NULL;
	enum tw_status status = store_open_existing(&store, request->url, error);
	if (status == TW_OK)
		status = store_backup(store, request->path, error);
	store_close(store);
	return status;
}

int command_backup(int argc, char **argv)
{
	static const struct command_steps steps = {"backup", print_help, parse, run, NULL};
	struct request request = {0};
	return command_run(&steps, &request, argc, argv);
}
