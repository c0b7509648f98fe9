/* tightwire certificate: checks what `tightwire steiner --certificate` wrote. It needs the instance and the certificate
 * and runs no solver. */
#include "service/command/command.h"
#include "service/command/file.h"
#include "service/command/instance.h"
#include "solver/steiner/certificate/file.h"

#include <stdlib.h>
#include <string.h>

static void print_help(void)
{
	printf("usage: tightwire certificate INSTANCE CERTIFICATE\n\n"
	       "Checks a certificate of `tightwire steiner INSTANCE --certificate CERTIFICATE` without running the "
	       "solver:\n"
	       "its tree spans the terminals and weighs what it says, and no tree weighs less than CERTIFIED.\n"
	       "Exit code 0 when all of it holds; else 1, and what is wrong on stderr.\n\n"
	       "The certificate is text, for checkers in other languages (`#` opens a comment; vertices from 1):\n\n"
	       "  TIGHTWIRE STEINER CERTIFICATE 1\n"
	       "  INSTANCE vertices edges terminals      edges without those from a vertex to itself\n"
	       "  WEIGHT weight\n"
	       "  BOUND bound                            what the solver claims; may rest on enumeration\n"
	       "  CERTIFIED certified                    what the rest of the file proves\n"
	       "  TREE edges                             then a line `u v weight` for each\n"
	       "  DUAL root scale total potentials members\n"
	       "  POTENTIAL terminal radius members      then a line `v value` for each\n"
	       "  END\n\n"
	       "A potential is `value` at its members and `radius` at all other vertices, the root among them, and 0 "
	       "at\n"
	       "its terminal. It takes max(0, p(u) - p(v)) from the arc u -> v. For every arc, the sum over all "
	       "potentials\n"
	       "must not exceed weight * scale. Every tree, directed away from the root, then weighs at least the sum "
	       "of the\n"
	       "radii over the scale: on its path to a terminal that potential falls from `radius` to 0. Weights are "
	       "whole,\n"
	       "so CERTIFIED is total / scale rounded up.\n");
}

static enum tw_status read_certificate(const char *path, struct arena *arena, struct steiner_certificate *certificate,
				       struct tw_error *error)
{
	char *bytes;
	size_t length;
	enum tw_status status = file_read(path, INSTANCE_BYTES_MAX, &bytes, &length, error);
	if (status != TW_OK)
		return status;
	status = certificate_read(certificate, arena, bytes, length, error);
	free(bytes);
	return status;
}

static void print_verdict(const struct steiner_certificate *certificate)
{
	const double gap = certificate->weight ? 100.0 * (double)(certificate->weight - certificate->certified) /
							 (double)certificate->weight
					       : 0;
	printf("tree       holds, weight %llu\n"
	       "certified  no tree weighs less than %llu (gap %.4f %%)\n"
	       "bound      %llu is the solver's claim\n",
	       (unsigned long long)certificate->weight, (unsigned long long)certificate->certified, gap,
	       (unsigned long long)certificate->bound);
}

struct request {
	const char *instance, *certificate; /* borrowed */
};

static enum tw_status check(const struct request *request, struct arena *arena, struct tw_error *error)
{
	struct steiner_file file;
	struct steiner_certificate certificate;
	enum tw_status status = instance_read(request->instance, arena, &file, error);
	if (status != TW_OK)
		return status;
	status = read_certificate(request->certificate, arena, &certificate, error);
	if (status == TW_OK)
		status = certificate_check(&certificate, &file.graph, file.terminals, file.terminal_count, error);
	if (status == TW_OK)
		print_verdict(&certificate);
	return file_blame(status, request->certificate, error);
}

static enum tw_status parse(void *context, int argc, char **argv, bool *help, struct tw_error *error)
{
	struct request *request = context;
	*help = argc == 2 && !strcmp(argv[1], "--help");
	if (*help)
		return TW_OK;
	for (int i = 1; i < argc; i++)
		if (argv[i][0] == '-' && argv[i][1])
			return command_refuse(argv[i], (const char *const[]){"--help", NULL},
					      (const struct option_table *const[]){NULL}, error);
	if (argc != 3)
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL,
			       "an instance and a certificate are needed; see --help");
	*request = (struct request){argv[1], argv[2]};
	return TW_OK;
}

static enum tw_status run(void *context, struct tw_error *error)
{
	struct arena *arena = arena_new(0);
	const enum tw_status status = arena ? check(context, arena, error) : tw_fail_memory(error);
	arena_free(arena);
	return status;
}

int command_certificate(int argc, char **argv)
{
	static const struct command_steps steps = {"certificate", print_help, parse, run, NULL};
	struct request request = {0};
	return command_run(&steps, &request, argc, argv);
}
