/* tightwire: the table of subcommands, from which the usage text is printed too. */
#include "service/command/command.h"

#include "solver/names.h"
#include "tightwire.h"

#include <stdio.h>
#include <string.h>

static const struct command commands[] = {
	{"serve", command_serve, "the HTTP service with its worker processes"},
	{"worker", command_worker, "one worker process on a store"},
	{"layout", command_layout, "the whole computation: garment, motions and terminals in, wiring out"},
	{"field", command_field, "the weight field of a garment for a set of motions"},
	{"steiner", command_steiner, "exact Steiner tree of a PACE or SteinLib file"},
	{"certificate", command_certificate, "check a certificate of an exact Steiner tree"},
	{"rig", command_rig, "read the acquisition box of the bench rig"},
	{"backup", command_backup, "copy a store that is in use"},
	{"key", command_key, "make, list, rotate and revoke API keys"},
	{"tenant", command_tenant, "list the tenants of a store, or delete one"},
	{"pack", command_pack, "a motion to about a quarter of its size"},
	{"sample", command_sample, "write a suit with motions and terminals to start with"},
	{NULL, NULL, NULL},
};

static void print_usage(FILE *out)
{
	fprintf(out,
		"tightwire " TW_VERSION ": lays the wires of smart clothing\n\nusage: tightwire COMMAND [options]\n\n");
	for (const struct command *c = commands; c->name; c++)
		fprintf(out, "  %-12s %s\n", c->name, c->summary);
	fprintf(out, "\n`tightwire COMMAND --help` explains each. Exit codes: 0 done, 1 failed, 2 usage.\n");
}

static int refuse_command(const char *given)
{
	const char *names[sizeof commands / sizeof *commands];
	size_t count = 0;
	struct tw_error error = {0};
	for (const struct command *c = commands; c->name; c++)
		names[count++] = c->name;
	(void)names_refuse(&(struct names){names, count}, "command", given, "usage", NULL, &error);
	fprintf(stderr, "tightwire: %s; see tightwire --help\n", error.text);
	return COMMAND_USAGE;
}

int main(int argc, char **argv)
{
	if (argc < 2) {
		print_usage(stderr);
		return COMMAND_USAGE;
	}
	if (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h") || !strcmp(argv[1], "help")) {
		print_usage(stdout);
		return COMMAND_DONE;
	}
	if (!strcmp(argv[1], "--version") || !strcmp(argv[1], "version")) {
		printf("tightwire " TW_VERSION "\n");
		return COMMAND_DONE;
	}
	for (const struct command *c = commands; c->name; c++)
		if (!strcmp(c->name, argv[1]))
			return c->run(argc - 1, argv + 1);
	return refuse_command(argv[1]);
}
