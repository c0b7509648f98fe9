/* `tightwire backup`: a consistent copy of a store, while daemon and workers go on using it. */
#include "service/command.h"
#include "storage/store.h"

#include <stdlib.h>
#include <string.h>

static const char usage[] = "usage: tightwire backup --store sqlite:PATH --out FILE\n";

static enum tw_status back_up(const char *url, const char *path, struct tw_error *error)
{
	struct store *store = NULL;
	enum tw_status status = store_open_existing(&store, url, error);
	if (status == TW_OK)
		status = store_backup(store, path, error);
	store_close(store);
	return status;
}

int command_backup(int argc, char **argv)
{
	struct tw_error error = {0};
	const char *url = getenv("TIGHTWIRE_STORE");
	const char *path = NULL;
	bool understood = true;
	for (int i = 1; i < argc; i += 2) {
		if (!strcmp(argv[i], "--help")) {
			printf("%s\nCopies the whole store into a new file, which can be used as a store in its place. "
			       "The store may "
			       "also\nstand in TIGHTWIRE_STORE.\n",
			       usage);
			return COMMAND_DONE;
		}
		if (!strcmp(argv[i], "--store") && i + 1 < argc)
			url = argv[i + 1];
		else if (!strcmp(argv[i], "--out") && i + 1 < argc)
			path = argv[i + 1];
		else
			understood = false;
	}
	if (!understood || !url || !path) {
		fputs(usage, stderr);
		return COMMAND_USAGE;
	}
	if (back_up(url, path, &error) == TW_OK)
		return COMMAND_DONE;
	fprintf(stderr, "tightwire backup: %s\n", error.text);
	return COMMAND_FAILED;
}
