/* tightwire certificate: checks what `tightwire steiner --certificate` wrote. It needs the instance and the certificate
 * and runs no solver. */
#include "service/command.h"
#include "service/file.h"
#include "solver/graph/steiner_file.h"
#include "solver/steiner/certificate_file.h"

#include <stdlib.h>
#include <string.h>

static const size_t file_bytes_max = (size_t)2 << 30;

static void print_help(void)
{
	printf("usage: tightwire certificate INSTANCE CERTIFICATE\n\n"
	       "Checks a certificate of `tightwire steiner INSTANCE --certificate CERTIFICATE` without running the "
	       "solver:\n"
	       "its tree spans the terminals and weighs what it says, and no tree weighs less than CERTIFIED.\n"
	       "Exit code 0 when all of it holds; else 1, and what is wrong on stderr.\n\n"
	       "The certificate is text, for checkers in other languages (`#` opens a comment; vertices from 1):\n\n"
	       "  TIGHTWIRE STEINER CERTIFICATE 1\n"
	       "  INSTANCE vertices edges terminals\n"
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

static enum tw_status read_instance(const char *path, struct arena *arena, struct steiner_file *file,
				    struct tw_error *error)
{
	char *bytes;
	size_t length;
	enum tw_status status = file_read(path, file_bytes_max, &bytes, &length, error);
	if (status != TW_OK)
		return status;
	status = steiner_file_read(file, arena, bytes, length, error);
	free(bytes);
	return status;
}

static enum tw_status read_certificate(const char *path, struct arena *arena, struct steiner_certificate *certificate,
				       struct tw_error *error)
{
	char *bytes;
	size_t length;
	enum tw_status status = file_read(path, file_bytes_max, &bytes, &length, error);
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

/* *wrong: the path that an error is about. */
static enum tw_status check(const char *instance, const char *path, struct arena *arena, const char **wrong,
			    struct tw_error *error)
{
	struct steiner_file file;
	struct steiner_certificate certificate;
	*wrong = instance;
	enum tw_status status = read_instance(instance, arena, &file, error);
	if (status != TW_OK)
		return status;
	*wrong = path;
	status = read_certificate(path, arena, &certificate, error);
	if (status == TW_OK)
		status = certificate_check(&certificate, &file.graph, file.terminals, file.terminal_count, error);
	if (status == TW_OK)
		print_verdict(&certificate);
	return status;
}

int command_certificate(int argc, char **argv)
{
	if (argc == 2 && !strcmp(argv[1], "--help")) {
		print_help();
		return COMMAND_DONE;
	}
	if (argc != 3 || argv[1][0] == '-' || argv[2][0] == '-') {
		fprintf(stderr, "usage: tightwire certificate INSTANCE CERTIFICATE; see --help\n");
		return COMMAND_USAGE;
	}
	struct arena *arena = arena_new(0);
	struct tw_error error = {0};
	const char *wrong = argv[1];
	const enum tw_status status = arena ? check(argv[1], argv[2], arena, &wrong, &error) : tw_fail_memory(&error);
	arena_free(arena);
	if (status == TW_OK)
		return COMMAND_DONE;
	const int named = *error.where && strcmp(error.where, wrong) != 0;
	fprintf(stderr, "tightwire certificate: %s: %s%s%s\n", wrong, named ? error.where : "", named ? ": " : "",
		error.text);
	return COMMAND_FAILED;
}
