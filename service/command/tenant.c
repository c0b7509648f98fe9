/* `tightwire tenant`: the tenants of a store, and the deletion of one. */
#include "storage/tenant.h"
#include "service/command/command.h"
#include "storage/sweep.h"

#include <stdlib.h>

enum { UPLOAD_AGE_MS = 3600000 }; /* as the daemon: what is being uploaded to others stays */

enum { VERB_LIST, VERB_DELETE };
static const char *const verbs[] = {"list", "delete", NULL};

struct request {
	const char *url, *name; /* borrowed */
	int verb;               /* -1: none */
	bool is_sure;
	struct store *store; /* owned */
};

static void print_help(void)
{
	printf("usage: tightwire tenant list   --store sqlite:PATH\n"
	       "       tightwire tenant delete --store sqlite:PATH --tenant TENANT --yes\n\n"
	       "A tenant is made with its first key (tightwire key create --tenant TENANT). delete takes all that it "
	       "has:\n"
	       "keys, uploads, resources, results and jobs. From then on nothing of it can be seen; the bytes go bit "
	       "by\n"
	       "bit, by this command and by services that run on the store, and whoever is stopped, the next goes on.\n"
	       "The tenant default is there again at once, and empty. The store may also stand in TIGHTWIRE_STORE.\n");
}

static enum tw_status list(struct request *request, struct tw_error *error)
{
	struct tenant tenants[100];
	size_t count = 0;
	int64_t after = 0;
	printf("%-40s %8s\n", "tenant", "keys");
	do {
		enum tw_status status =
			tenant_list(request->store, after, tenants, sizeof tenants / sizeof *tenants, &count, error);
		if (status != TW_OK)
			return status;
		for (size_t i = 0; i < count; i++)
			printf("%-40s %8lld\n", tenants[i].name[0] ? tenants[i].name : "(being deleted)",
			       (long long)tenants[i].keys);
		after = count ? tenants[count - 1].number : after;
	} while (count);
	return TW_OK;
}

static enum tw_status sweep(struct store *store, struct tw_error *error)
{
	bool more = true;
	enum tw_status status = TW_OK;
	while (status == TW_OK && more)
		status = tenant_sweep(store, &more, error);
	for (more = true; status == TW_OK && more;)
		status = store_sweep(store, UPLOAD_AGE_MS, &more, error);
	return status;
}

static enum tw_status delete_tenant(struct request *request, struct tw_error *error)
{
	if (!request->is_sure)
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL,
			       "this deletes all that the tenant %s has, for ever; say --yes", request->name);
	const enum tw_status status = tenant_delete(request->store, request->name, error);
	if (status != TW_OK)
		return status;
	fprintf(stderr, "the tenant %s cannot be seen any more; removing its data\n", request->name);
	return sweep(request->store, error);
}

static enum tw_status check(const struct request *request, struct tw_error *error)
{
	if (request->verb < 0)
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL, "say list or delete; see --help");
	if ((request->verb == VERB_DELETE) != (request->name != NULL))
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL,
			       "delete, and nothing else, is told a tenant with --tenant; see --help");
	if (!request->url)
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL, "--store is needed; see --help");
	return TW_OK;
}

static enum tw_status parse(void *context, int argc, char **argv, bool *help, struct tw_error *error)
{
	struct request *request = context;
	request->url = getenv("TIGHTWIRE_STORE");
	const struct command_flag flags[] = {
		{"--store", "a store", &request->url, NULL},
		{"--tenant", "a tenant", &request->name, NULL},
		{"--yes", NULL, NULL, &request->is_sure},
		{NULL, NULL, NULL, NULL},
	};
	const enum tw_status status = command_take_all(flags, verbs, &request->verb, argc, argv, help, error);
	return status != TW_OK || *help ? status : check(request, error);
}

static enum tw_status run(void *context, struct tw_error *error)
{
	struct request *request = context;
	enum tw_status status = store_open_existing(&request->store, request->url, error);
	if (status != TW_OK)
		return status;
	return request->verb == VERB_DELETE ? delete_tenant(request, error) : list(request, error);
}

static void clear(void *context)
{
	struct request *request = context;
	store_close(request->store);
}

int command_tenant(int argc, char **argv)
{
	static const struct command_steps steps = {"tenant", print_help, parse, run, clear};
	struct request request = {.verb = -1};
	return command_run(&steps, &request, argc, argv);
}
