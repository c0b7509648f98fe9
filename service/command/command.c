/* What the commands have in common. */
#include "service/command/command.h"

#include "service/command/progress.h"
#include "solver/names.h"
#include "solver/option.h"

#include <assert.h>
#include <string.h>

static int fail(const struct command_steps *steps, const struct tw_error *error, int code)
{
	progress_clear();
	fprintf(stderr, "tightwire %s: %s%s%s\n", steps->name, error->where, *error->where ? ": " : "", error->text);
	return code;
}

/* Up to "=", and with _ for -, as options take them. */
static bool same_flag(const char *a, const char *b)
{
	const size_t length = strcspn(a, "=");
	if (strcspn(b, "=") != length)
		return false;
	for (size_t i = 0; i < length; i++)
		if ((a[i] == '_' ? '-' : a[i]) != (b[i] == '_' ? '-' : b[i]))
			return false;
	return true;
}

/* A flag that is given twice would mean one of the two, silently; only motions are a list. What follows a flag may be
 * its value, but none looks like a flag that was given before. */
static enum tw_status refuse_repeated(int argc, char **argv, struct tw_error *error)
{
	for (int i = 1; i < argc; i++) {
		if (strncmp(argv[i], "--", 2) != 0 || same_flag(argv[i], "--motion"))
			continue;
		for (int k = 1; k < i; k++)
			if (same_flag(argv[k], argv[i]))
				return tw_fail(error, TW_ERROR_INPUT, "usage", NULL,
					       "%.*s is given twice; leave one out", (int)strcspn(argv[i], "="),
					       argv[i]);
	}
	return TW_OK;
}

int command_run(const struct command_steps *steps, void *session, int argc, char **argv)
{
	struct tw_error error = {0};
	bool help = false;
	int code = COMMAND_DONE;
	if (argc == 2 && !strcmp(argv[1], "-h"))
		help = true;
	else if (steps->parse(session, argc, argv, &help, &error) || (!help && refuse_repeated(argc, argv, &error)))
		code = fail(steps, &error, COMMAND_USAGE);
	if (code == COMMAND_DONE && help)
		steps->print_help();
	else if (code == COMMAND_DONE && steps->run(session, &error))
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

/* "--strip-width-mm" for strip_width_mm. */
static const char *flag_of(const char *option, char *flag, size_t size)
{
	snprintf(flag, size, "--%s", option);
	for (char *p = flag; *p; p++)
		*p = *p == '_' ? '-' : *p;
	return flag;
}

enum tw_status command_refuse(const char *argument, const char *const *texts, const struct option_table *const *tables,
			      struct tw_error *error)
{
	const char *names[OPTION_NAMES_MAX], *flags[2 * OPTION_NAMES_MAX];
	char text[OPTION_NAMES_MAX][48], given[64];
	size_t options = 0, count = 0;
	if (!strcmp(argument, "true") || !strcmp(argument, "false"))
		return tw_fail(error, TW_ERROR_INPUT, "usage", argument,
			       "is one argument too many; a flag takes it with =, as --json=%s; see --help", argument);
	if (argument[0] != '-')
		return tw_fail(error, TW_ERROR_INPUT, "usage", argument,
			       "is one argument too many; files are given with flags; see --help");
	for (; *texts; texts++)
		flags[count++] = *texts;
	for (; *tables; tables++)
		option_add_names(*tables, names, &options);
	for (size_t i = 0; i < options; i++)
		flags[count++] = flag_of(names[i], text[i], sizeof text[i]);
	snprintf(given, sizeof given, "%.*s", (int)strcspn(argument, "="), argument);
	return names_refuse(&(struct names){flags, count}, "flag", given, "usage", NULL, error);
}

static enum tw_status take_flag(const struct command_flag *flags, int argc, char **argv, int *i, bool *taken,
				struct tw_error *error)
{
	for (; flags->name; flags++) {
		enum tw_status status = TW_OK;
		if (flags->text)
			status = command_take_text(flags->name, flags->what, flags->text, argc, argv, i, taken, error);
		else
			*taken = !strcmp(argv[*i], flags->name);
		if (*taken && flags->is_given)
			*flags->is_given = true;
		if (*taken || status != TW_OK)
			return status;
	}
	return TW_OK;
}

/* Where the word stands in the list, -1: nowhere. */
static int find_word(const char *const *list, const char *word)
{
	for (int i = 0; list[i]; i++)
		if (!strcmp(list[i], word))
			return i;
	return -1;
}

static enum tw_status refuse_argument(const struct command_flag *flags, const char *argument, struct tw_error *error)
{
	const char *names[COMMAND_FLAGS_MAX + 2];
	size_t count = 0;
	for (; flags->name; flags++) {
		assert(count < COMMAND_FLAGS_MAX);
		names[count++] = flags->name;
	}
	names[count++] = "--help";
	names[count] = NULL;
	return command_refuse(argument, names, (const struct option_table *const[]){NULL}, error);
}

enum tw_status command_take_all(const struct command_flag *flags, const char *const *verbs, int *verb, int argc,
				char **argv, bool *help, struct tw_error *error)
{
	bool has_verb = false;
	for (int i = 1; i < argc; i++) {
		bool taken = false;
		const int word = has_verb ? -1 : find_word(verbs, argv[i]);
		if (word >= 0) {
			has_verb = true;
			*verb = word;
			continue;
		}
		const enum tw_status status = take_flag(flags, argc, argv, &i, &taken, error);
		if (status != TW_OK)
			return status;
		*help = *help || !strcmp(argv[i], "--help");
		if (!taken && !*help)
			return refuse_argument(flags, argv[i], error);
	}
	return TW_OK;
}
