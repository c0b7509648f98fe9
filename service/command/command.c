/* What the commands have in common. */
#include "service/command/command.h"

#include "service/command/progress.h"

#include <string.h>

static int fail(const struct command_steps *steps, const struct tw_error *error, int code)
{
	progress_clear();
	fprintf(stderr, "tightwire %s: %s%s%s\n", steps->name, error->where, *error->where ? ": " : "", error->text);
	return code;
}

int command_run(const struct command_steps *steps, void *session, int argc, char **argv)
{
	struct tw_error error = {0};
	bool help = false;
	int code = COMMAND_DONE;
	if (steps->parse(session, argc, argv, &help, &error))
		code = fail(steps, &error, COMMAND_USAGE);
	else if (help)
		steps->print_help();
	else if (steps->run(session, &error))
		code = fail(steps, &error, COMMAND_FAILED);
	if (steps->clear)
		steps->clear(session);
	return code;
}

enum tw_status command_take_text(const char *flag, const char *what, const char **value, int argc, char **argv,
				 int *index, bool *taken, struct tw_error *error)
{
	size_t length = strlen(flag);
	const char *argument = argv[*index];
	*taken = !strncmp(argument, flag, length) && (!argument[length] || argument[length] == '=');
	if (!*taken)
		return TW_OK;
	bool inside = argument[length] == '=';
	if (!inside && *index + 1 >= argc)
		return tw_fail(error, TW_ERROR_INPUT, "usage", argument, "needs %s", what);
	*value = inside ? argument + length + 1 : argv[++*index];
	return TW_OK;
}

enum tw_status command_refuse(const char *argument, struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_INPUT, "usage", argument, "is not understood; see --help");
}
