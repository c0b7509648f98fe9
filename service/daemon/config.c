#include "service/daemon/config.h"

#include "solver/names.h"

#include <ctype.h>
#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum setting_kind { SETTING_TEXT, SETTING_INTEGER, SETTING_CHOICE };

struct setting {
	const char *name;
	enum setting_kind kind;
	bool is_live; /* SIGHUP can change it */
	size_t offset;
	const char *fallback;
	int64_t minimum, maximum; /* of an integer */
	const char *choices;      /* of a choice: "a|b" */
	const char *help;
};

#define FIXED(field, kind, fallback, minimum, maximum, choices, help)                                                  \
	kind, false, offsetof(struct config, field), fallback, minimum, maximum, choices, help
#define LIVE(field, kind, fallback, minimum, maximum, choices, help)                                                   \
	kind, true, offsetof(struct config, field), fallback, minimum, maximum, choices, help
#define TEXT(when, field, fallback, help) when(field, SETTING_TEXT, fallback, 0, 0, NULL, help)
#define INTEGER(when, field, fallback, minimum, maximum, help)                                                         \
	when(field, SETTING_INTEGER, fallback, minimum, maximum, NULL, help)
#define CHOICE(when, field, fallback, choices, help) when(field, SETTING_CHOICE, fallback, 0, 0, choices, help)

static const struct setting settings[] = {
	{"listen", TEXT(FIXED, listen, "127.0.0.1:8080", "address and port; port 0 takes a free one")},
	{"store", TEXT(FIXED, store, "sqlite:tightwire.db",
		       "URL of the store; limits may follow the path, ?limit_bytes=N&reserve_bytes=N")},
	{"workers", INTEGER(FIXED, workers, "2", 0, 256, "worker processes")},
	{"interactive-workers",
	 INTEGER(FIXED, interactive_workers, "0", 0, 255, "of these, how many take interactive jobs only")},
	{"worker-threads",
	 INTEGER(FIXED, worker_threads, "1", 1, 256, "threads of one computation; never changes a result")},
	{"worker-memory-mib",
	 INTEGER(FIXED, worker_memory_mib, "4096", 0, 1 << 24,
		 "memory that a worker may take for its jobs and what it keeps between them, in MiB; 0: no limit")},
	{"lease-s",
	 INTEGER(FIXED, lease_s, "15", 1, 3600, "how long after a worker's last sign of life its job goes to another")},
	{"key-file",
	 TEXT(FIXED, key_file, "",
	      "file of API keys beside those of the store (tightwire key), read again on SIGHUP; chmod o= it")},
	{"cors-origin", TEXT(LIVE, cors_origin, "", "web origin that browsers may call from, or *; empty for none")},
	{"host-names", TEXT(LIVE, host_names, "",
			    "names besides localhost, with commas, that Host may say of a service without keys")},
	{"upload-limit-mib",
	 INTEGER(LIVE, upload_limit_mib, "4096", 1, TW_LIMIT_UPLOAD_BYTES >> 20, "largest upload in MiB")},
	{"wait-limit-s", INTEGER(LIVE, wait_limit_s, "60", 0, 600, "longest \"Prefer: wait\" that is honoured")},
	{"http-threads", INTEGER(FIXED, http_threads, "4", 1, 64, "threads that handle requests which only read")},
	{"connections", INTEGER(LIVE, connections, "1024", 4, 65536, "connections at once")},
	{"connections-per-address",
	 INTEGER(LIVE, connections_per_address, "512", 1, 65536, "of these, by one client address (IPv6: /64)")},
	{"held-requests", INTEGER(LIVE, held_requests, "512", 0, 65536,
				  "requests with \"Prefer: wait\", and streams of events, that wait at once")},
	{"idle-timeout-s", INTEGER(LIVE, idle_timeout_s, "30", 1, 3600,
				   "a connection that sends no request, or stalls, for so long is closed")},
	{"head-timeout-s",
	 INTEGER(LIVE, head_timeout_s, "10", 1, 3600, "for the head of a request, from its first byte")},
	{"request-timeout-s",
	 INTEGER(LIVE, request_timeout_s, "3600", 1, 86400, "for a request with its body, from its first byte")},
	{"least-rate-bytes-s", INTEGER(LIVE, least_rate_bytes_s, "1024", 0, 1 << 30,
				       "that a client must send or take on the average, after 5 s of waiting for it")},
	{"drain-s", INTEGER(LIVE, drain_s, "30", 1, 3600, "after SIGTERM, time for requests and jobs to end")},
	{"log-level", CHOICE(LIVE, log_level, "info", "error|warning|info|debug", "what is logged")},
};
#define SETTING_COUNT (sizeof settings / sizeof settings[0])

static bool is_choice(const char *choices, const char *text)
{
	size_t length = strlen(text);
	for (const char *p = choices; length; p++) {
		if (!strncmp(p, text, length) && (p[length] == '|' || !p[length]))
			return true;
		p = strchr(p, '|');
		if (!p)
			break;
	}
	return false;
}

static enum tw_status set_integer(const struct setting *setting, void *place, const char *text, const char *where,
				  struct tw_error *error)
{
	char *end = NULL;
	errno = 0;
	long long number = strtoll(text, &end, 10);
	if (end == text || *end || errno || number < setting->minimum || number > setting->maximum)
		return tw_fail(error, TW_ERROR_INPUT, "setting", where, "%s is an integer from %lld to %lld",
			       setting->name, (long long)setting->minimum, (long long)setting->maximum);
	memcpy(place, &(int64_t){number}, sizeof(int64_t));
	return TW_OK;
}

static enum tw_status set(struct config *config, const struct setting *setting, const char *text, const char *where,
			  struct tw_error *error)
{
	char *place = (char *)config + setting->offset;
	if (setting->kind == SETTING_INTEGER)
		return set_integer(setting, place, text, where, error);
	if (setting->kind == SETTING_CHOICE && !is_choice(setting->choices, text))
		return tw_fail(error, TW_ERROR_INPUT, "setting", where, "%s is one of %s", setting->name,
			       setting->choices);
	if (strlen(text) >= CONFIG_TEXT_SIZE)
		return tw_fail(error, TW_ERROR_INPUT, "setting", where, "%s is longer than %d bytes", setting->name,
			       CONFIG_TEXT_SIZE - 1);
	memcpy(place, text, strlen(text) + 1);
	return TW_OK;
}

static const struct setting *find_setting(const char *name, size_t length)
{
	for (size_t i = 0; i < SETTING_COUNT; i++)
		if (strlen(settings[i].name) == length && !strncmp(settings[i].name, name, length))
			return &settings[i];
	return NULL;
}

static enum tw_status refuse_name(const char *what, const char *given, const char *type, const char *where,
				  struct tw_error *error)
{
	bool is_flag = !strncmp(given, "--", 2);
	char name[64];
	const char *names[SETTING_COUNT + 2];
	size_t count = 0;
	for (size_t i = 0; i < SETTING_COUNT; i++)
		names[count++] = settings[i].name;
	char flags[SETTING_COUNT][32];
	for (size_t i = 0; is_flag && i < SETTING_COUNT; i++) {
		snprintf(flags[i], sizeof flags[i], "--%s", settings[i].name);
		names[i] = flags[i];
	}
	if (is_flag) {
		names[count++] = "--config";
		names[count++] = "--help";
	}
	snprintf(name, sizeof name, "%.*s", (int)strcspn(given, "="), given);
	return names_refuse(&(struct names){names, count}, what, name, type, where, error);
}

/* --- the four sources, the weakest first ---------------------------------------------------------------------- */

static enum tw_status read_defaults(struct config *config, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	for (size_t i = 0; status == TW_OK && i < SETTING_COUNT; i++)
		status = set(config, &settings[i], settings[i].fallback, settings[i].name, error);
	return status;
}

static char *trim(char *text)
{
	text += strspn(text, " \t");
	size_t length = strlen(text);
	while (length && isspace((unsigned char)text[length - 1]))
		text[--length] = 0;
	return text;
}

static enum tw_status read_line(struct config *config, char *line, const char *where, struct tw_error *error)
{
	char *text = trim(line);
	if (!*text || *text == '#')
		return TW_OK;
	char *equals = strchr(text, '=');
	if (!equals)
		return tw_fail(error, TW_ERROR_INPUT, "setting", where, "a line reads NAME = VALUE");
	*equals = 0;
	const char *name = trim(text);
	const struct setting *setting = find_setting(name, strlen(name));
	if (!setting)
		return refuse_name("setting", name, "setting", where, error);
	return set(config, setting, trim(equals + 1), where, error);
}

static enum tw_status fail_to_read(const char *path, struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_IO, "setting", path, "the configuration file cannot be read: %s",
		       strerror(errno));
}

static enum tw_status read_file(struct config *config, const char *path, struct tw_error *error)
{
	FILE *file = fopen(path, "re");
	if (!file)
		return fail_to_read(path, error);
	enum tw_status status = TW_OK;
	char line[CONFIG_TEXT_SIZE + 64], where[128];
	for (int number = 1; status == TW_OK && fgets(line, sizeof line, file); number++) {
		snprintf(where, sizeof where, "%.90s line %d", path, number);
		bool whole = strchr(line, '\n') || feof(file);
		status = whole ? read_line(config, line, where, error)
			       : tw_fail(error, TW_ERROR_INPUT, "setting", where, "the line is too long");
	}
	if (status == TW_OK && ferror(file))
		status = fail_to_read(path, error);
	fclose(file);
	return status;
}

static const char *environment_name(const char *name, char *variable, size_t size)
{
	snprintf(variable, size, "TIGHTWIRE_%s", name);
	for (char *p = variable; *p; p++)
		*p = *p == '-' ? '_' : (char)toupper((unsigned char)*p);
	return variable;
}

static enum tw_status read_environment(struct config *config, struct tw_error *error)
{
	char variable[64];
	for (size_t i = 0; i < SETTING_COUNT; i++) {
		const char *text = getenv(environment_name(settings[i].name, variable, sizeof variable));
		enum tw_status status = text ? set(config, &settings[i], text, variable, error) : TW_OK;
		if (status != TW_OK)
			return status;
	}
	return TW_OK;
}

/* One flag at argv[*index], "--name value" or "--name=value"; *value NULL when it is --help. */
static enum tw_status split_flag(int argc, char **argv, int *index, const char **name, size_t *length,
				 const char **value, struct tw_error *error)
{
	const char *argument = argv[*index];
	if (strncmp(argument, "--", 2) != 0)
		return tw_fail(error, TW_ERROR_INPUT, "usage", argument, "a flag begins with --");
	*name = argument + 2;
	*length = strcspn(*name, "=");
	*value = NULL;
	if (!strcmp(argument, "--help"))
		return TW_OK;
	bool known = find_setting(*name, *length) || (*length == 6 && !strncmp(*name, "config", 6));
	if (!known)
		return refuse_name("flag", argument, "usage", NULL, error);
	if ((*name)[*length])
		*value = *name + *length + 1;
	else if (*index + 1 < argc)
		*value = argv[++*index];
	else
		return tw_fail(error, TW_ERROR_INPUT, "usage", argument, "the flag needs a value");
	return TW_OK;
}

/* With `config` sets its fields; without only looks for --config and --help. */
static enum tw_status read_flags(struct config *config, int argc, char **argv, const char **file,
				 enum config_outcome *outcome, struct tw_error *error)
{
	for (int i = 1; i < argc; i++) {
		const char *name = NULL, *value = NULL, *flag = argv[i];
		size_t length = 0;
		enum tw_status status = split_flag(argc, argv, &i, &name, &length, &value, error);
		if (status != TW_OK)
			return status;
		if (!value) {
			*outcome = CONFIG_HELP;
			return TW_OK;
		}
		const struct setting *setting = find_setting(name, length);
		if (!setting)
			*file = value;
		else if (config)
			status = set(config, setting, value, flag, error);
		if (status != TW_OK)
			return status;
	}
	return TW_OK;
}

/* What no setting can say alone. */
static enum tw_status check_together(const struct config *config, struct tw_error *error)
{
	if (config->interactive_workers == 0 || config->interactive_workers < config->workers)
		return TW_OK;
	return tw_fail(
		error, TW_ERROR_INPUT, "setting", "interactive-workers",
		"of %lld workers fewer than that can be kept for interactive jobs: somebody has to do the others",
		(long long)config->workers);
}

enum tw_status config_read(struct config *config, int argc, char **argv, enum config_outcome *outcome,
			   struct tw_error *error)
{
	const char *file = getenv("TIGHTWIRE_CONFIG");
	*outcome = CONFIG_READY;
	enum tw_status status = read_flags(NULL, argc, argv, &file, outcome, error);
	if (status != TW_OK || *outcome == CONFIG_HELP)
		return status;
	status = read_defaults(config, error);
	if (status == TW_OK && file && *file)
		status = read_file(config, file, error);
	if (status == TW_OK)
		status = read_environment(config, error);
	if (status == TW_OK)
		status = read_flags(config, argc, argv, &file, outcome, error);
	return status == TW_OK ? check_together(config, error) : status;
}

static bool is_equal(const struct setting *setting, const struct config *a, const struct config *b)
{
	const char *p = (const char *)a + setting->offset, *q = (const char *)b + setting->offset;
	return setting->kind == SETTING_INTEGER ? !memcmp(p, q, sizeof(int64_t)) : !strcmp(p, q);
}

static void copy(const struct setting *setting, struct config *to, const struct config *from)
{
	size_t size = setting->kind == SETTING_INTEGER ? sizeof(int64_t) : CONFIG_TEXT_SIZE;
	memcpy((char *)to + setting->offset, (const char *)from + setting->offset, size);
}

enum tw_status config_reload(struct config *config, int argc, char **argv, char kept[CONFIG_KEPT_SIZE],
			     struct tw_error *error)
{
	struct config *fresh = calloc(1, sizeof *fresh);
	enum config_outcome outcome = CONFIG_READY;
	size_t used = 0;
	kept[0] = 0;
	if (!fresh)
		return tw_fail_memory(error);
	enum tw_status status = config_read(fresh, argc, argv, &outcome, error);
	for (size_t i = 0; status == TW_OK && i < SETTING_COUNT; i++) {
		const struct setting *s = &settings[i];
		if (s->is_live)
			copy(s, config, fresh);
		else if (!is_equal(s, config, fresh) && used < CONFIG_KEPT_SIZE)
			used += (size_t)snprintf(kept + used, CONFIG_KEPT_SIZE - used, "%s%s", used ? ", " : "",
						 s->name);
	}
	free(fresh);
	return status;
}

void config_print_help(FILE *out)
{
	fprintf(out, "  --%-23s %s\n", "config FILE", "read settings from a file of lines NAME = VALUE");
	for (size_t i = 0; i < SETTING_COUNT; i++) {
		const struct setting *s = &settings[i];
		fprintf(out, "  --%-23s %s (", s->name, s->help);
		if (s->kind == SETTING_INTEGER)
			fprintf(out, "%lld to %lld, ", (long long)s->minimum, (long long)s->maximum);
		if (s->kind == SETTING_CHOICE)
			fprintf(out, "%s, ", s->choices);
		fprintf(out, "default %s%s)\n", s->fallback[0] ? s->fallback : "none", s->is_live ? "; reloads" : "");
	}
	fprintf(out,
		"\nSIGHUP reads the settings and the key file again; those that say \"reloads\" change at once.\n");
	fprintf(out, "\nA flag goes before the environment (TIGHTWIRE_LISTEN=…), that before the file, that before the "
		     "default.\n");
}
