/* `tightwire key`: API keys in a store, while daemons use it; and the line for a key file. */
#include "storage/key.h"
#include "service/command/amount.h"
#include "service/command/command.h"
#include "solver/names.h"

#include <jansson.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { VERB_CREATE, VERB_LIST, VERB_ROTATE, VERB_REVOKE };
static const char *const verbs[] = {"create", "list", "rotate", "revoke", NULL};

struct request {
	int verb; /* -1: none */
	/* Flags, borrowed; NULL where they are not given. */
	const char *url, *tenant, *name, *scopes, *expires, *overlap;
	const char *weight, *requests_per_s, *requests_per_min, *queued_jobs, *stored_bytes;
	bool as_json;
	struct store *store; /* owned */
};

/* --- what is printed -------------------------------------------------------------------------------------------- */

static json_t *json_of_time(int64_t time_ms)
{
	return time_ms ? json_integer(time_ms) : json_null();
}

static json_t *show(const struct key *key, const char *secret)
{
	char scopes[KEY_SCOPES_SIZE];
	json_t *json = json_object();
	key_print_scopes(key->scopes, scopes);
	json_object_set_new(json, "id", json_string(key->id));
	json_object_set_new(json, "tenant", json_string(key->tenant));
	json_object_set_new(json, "name", json_string(key->name));
	json_object_set_new(json, "scopes", json_string(scopes));
	json_object_set_new(json, "created_ms", json_integer(key->created_ms));
	json_object_set_new(json, "expires_ms", json_of_time(key->expires_ms));
	json_object_set_new(json, "revoked_ms", json_of_time(key->revoked_ms));
	json_object_set_new(json, "rotated_ms", json_of_time(key->rotated_ms));
	json_object_set_new(json, "overlap_until_ms", json_of_time(key->overlap_until_ms));
	json_object_set_new(json, "weight", json_integer(key->weight));
	json_object_set_new(json, "requests_per_s", json_integer(key->limits.requests_per_s));
	json_object_set_new(json, "requests_per_min", json_integer(key->limits.requests_per_min));
	json_object_set_new(json, "queued_jobs_max", json_integer(key->limits.queued_jobs));
	json_object_set_new(json, "stored_bytes_max", json_integer(key->limits.stored_bytes));
	json_object_set_new(json, "queued_jobs", json_integer(key->queued_jobs));
	json_object_set_new(json, "stored_bytes", json_integer(key->stored_bytes));
	json_object_set_new(json, "requests", json_integer(key->requests));
	json_object_set_new(json, "last_used_ms", json_of_time(key->last_used_ms));
	if (secret)
		json_object_set_new(json, "secret", json_string(secret));
	return json;
}

static enum tw_status print_json(json_t *json, struct tw_error *error)
{
	bool printed = json && json_dumpf(json, stdout, JSON_COMPACT) == 0;
	json_decref(json);
	printf("\n");
	return printed ? TW_OK : tw_fail_memory(error);
}

static const char *print_time(int64_t time_ms, const char *format, char text[32])
{
	struct tm parts;
	time_t seconds = (time_t)(time_ms / 1000);
	gmtime_r(&seconds, &parts);
	if (!time_ms || !strftime(text, 32, format, &parts))
		snprintf(text, 32, "never");
	return text;
}

#define DAY "%Y-%m-%d"
#define MINUTE "%Y-%m-%dT%H:%MZ"

/* The secret alone on standard output, so that a script can take it. */
static enum tw_status print_made(const struct request *request, const struct key *key, const char *secret,
				 struct tw_error *error)
{
	char scopes[KEY_SCOPES_SIZE], expires[32];
	if (request->as_json)
		return print_json(show(key, secret), error);
	key_print_scopes(key->scopes, scopes);
	fprintf(stderr, "key %s of the tenant %s (%s), which expires: %s. It is shown only now:\n", key->name,
		key->tenant, scopes, print_time(key->expires_ms, MINUTE, expires));
	printf("%s\n", secret);
	return TW_OK;
}

/* As the flags of create. */
static void print_limits(const struct key *key)
{
	const struct {
		const char *name;
		int64_t value;
	} rows[] = {
		{"weight", key->weight > 1 ? key->weight : 0},      {"requests-per-s", key->limits.requests_per_s},
		{"requests-per-min", key->limits.requests_per_min}, {"queued-jobs", key->limits.queued_jobs},
		{"stored-bytes", key->limits.stored_bytes},
	};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
		if (rows[i].value)
			printf(" %s=%lld", rows[i].name, (long long)rows[i].value);
}

static void print_row(const struct key *key)
{
	char scopes[KEY_SCOPES_SIZE], expires[32], used[32];
	key_print_scopes(key->scopes, scopes);
	printf("%-20s %-20s %-22s %-17s %-10s %10lld %8lld %14lld%s", key->tenant[0] ? key->tenant : "(deleted)",
	       key->name, scopes, print_time(key->expires_ms, MINUTE, expires),
	       print_time(key->last_used_ms, DAY, used), (long long)key->requests, (long long)key->queued_jobs,
	       (long long)key->stored_bytes, key->revoked_ms ? " revoked" : "");
	print_limits(key);
	printf("\n");
}

/* --- verbs ------------------------------------------------------------------------------------------------------ */

/* "default" where no tenant is given. One that is new is made. */
static enum tw_status take_tenant(struct request *request, bool makes, int64_t *tenant, struct tw_error *error)
{
	const char *name = request->tenant ? request->tenant : "default";
	enum tw_status status = tenant_find(request->store, name, tenant, error);
	if (status != TW_ERROR_NOT_FOUND || !makes)
		return status;
	status = tenant_create(request->store, name, tenant, error);
	if (status == TW_OK && !request->as_json)
		fprintf(stderr, "the tenant %s is new\n", name);
	return status;
}

static enum tw_status take_limits(const struct request *request, struct key_limits *limits, struct tw_error *error)
{
	const struct {
		const char *flag, *text;
		bool binary;
		int64_t *value;
	} rows[] = {
		{"--requests-per-s", request->requests_per_s, false, &limits->requests_per_s},
		{"--requests-per-min", request->requests_per_min, false, &limits->requests_per_min},
		{"--queued-jobs", request->queued_jobs, false, &limits->queued_jobs},
		{"--stored-bytes", request->stored_bytes, true, &limits->stored_bytes},
	};
	enum tw_status status = TW_OK;
	for (size_t i = 0; status == TW_OK && i < sizeof rows / sizeof *rows; i++)
		if (rows[i].text)
			status = amount_parse_count(rows[i].flag, rows[i].text, rows[i].binary, rows[i].value, error);
	return status;
}

static enum tw_status create(struct request *request, struct tw_error *error)
{
	char secret[SECRET_SIZE];
	struct key key = {0};
	struct key_draft draft = {.name = request->name};
	int64_t weight = 1;
	enum tw_status status =
		key_parse_scopes(request->scopes ? request->scopes : "read,submit", &draft.scopes, error);
	if (status == TW_OK && request->expires)
		status = amount_parse_time("--expires", request->expires, store_now_ms(request->store),
					   &draft.expires_ms, error);
	if (status == TW_OK && request->weight)
		status = amount_parse_count("--weight", request->weight, false, &weight, error);
	/* What does not fit is refused with the rest. */
	draft.weight = weight <= JOB_WEIGHT_MAX ? (uint32_t)weight : JOB_WEIGHT_MAX + 1;
	if (status == TW_OK)
		status = take_limits(request, &draft.limits, error);
	if (status == TW_OK)
		status = key_check(request->store, &draft, error);
	if (status == TW_OK)
		status = take_tenant(request, true, &draft.tenant, error);
	if (status == TW_OK)
		status = key_create(request->store, &draft, &key, secret, error);
	return status == TW_OK ? print_made(request, &key, secret, error) : status;
}

static enum tw_status find(struct request *request, struct key *key, int64_t *tenant, struct tw_error *error)
{
	enum tw_status status = take_tenant(request, false, tenant, error);
	return status == TW_OK ? key_find(request->store, *tenant, request->name, key, error) : status;
}

static enum tw_status rotate(struct request *request, struct tw_error *error)
{
	char secret[SECRET_SIZE];
	struct key key = {0};
	int64_t tenant = 0, overlap_ms = 0;
	enum tw_status status =
		amount_parse_duration("--overlap", request->overlap ? request->overlap : "24h", &overlap_ms, error);
	if (status == TW_OK)
		status = find(request, &key, &tenant, error);
	if (status == TW_OK)
		status = key_rotate(request->store, tenant, key.id, overlap_ms, &key, secret, error);
	return status == TW_OK ? print_made(request, &key, secret, error) : status;
}

static enum tw_status revoke(struct request *request, struct tw_error *error)
{
	struct key key = {0};
	int64_t tenant = 0;
	enum tw_status status = find(request, &key, &tenant, error);
	if (status == TW_OK)
		status = key_revoke(request->store, tenant, key.id, &key, error);
	if (status != TW_OK)
		return status;
	if (request->as_json)
		return print_json(show(&key, NULL), error);
	fprintf(stderr, "key %s of the tenant %s lets nobody in any more\n", key.name, key.tenant);
	return TW_OK;
}

static enum tw_status list(struct request *request, struct tw_error *error)
{
	int64_t tenant = TENANT_ANY, cursor = 0;
	json_t *all = json_array();
	enum tw_status status = request->tenant ? take_tenant(request, false, &tenant, error) : TW_OK;
	if (status == TW_OK && !request->as_json)
		printf("%-20s %-20s %-22s %-17s %-10s %10s %8s %14s %s\n", "tenant", "name", "scopes", "expires",
		       "used", "requests", "queued", "bytes", "limits");
	do {
		struct key_page page = {0};
		if (status == TW_OK)
			status = key_list(request->store, tenant, cursor, 100, &page, error);
		for (size_t i = 0; status == TW_OK && i < page.count; i++)
			if (request->as_json)
				json_array_append_new(all, show(&page.keys[i], NULL));
			else
				print_row(&page.keys[i]);
		cursor = page.next;
		key_page_clear(&page);
	} while (status == TW_OK && cursor);
	if (status == TW_OK && request->as_json)
		return print_json(all, error);
	json_decref(all);
	return status;
}

/* --- arguments -------------------------------------------------------------------------------------------------- */

static void print_help(void)
{
	printf("usage: tightwire key create --store sqlite:PATH --name NAME [flags]\n"
	       "       tightwire key list   --store sqlite:PATH [--tenant TENANT]\n"
	       "       tightwire key rotate --store sqlite:PATH --name NAME [--tenant TENANT] [--overlap 24h]\n"
	       "       tightwire key revoke --store sqlite:PATH --name NAME [--tenant TENANT]\n"
	       "       tightwire key NAME >> KEY_FILE\n\n"
	       "API keys in a store. Services that run on it know within a second; once there is a key, nobody is let\n"
	       "in without one. A key is shown only by what makes it: on standard output, alone. Clients send it as\n"
	       "Authorization: Bearer KEY. The store may also stand in TIGHTWIRE_STORE. The last form makes a key and\n"
	       "the line for a key file, of the tenant default and with all scopes: the line on standard output, the\n"
	       "key on standard error.\n\n"
	       "  --tenant TENANT         whose key it is (default); create makes a tenant that is new\n"
	       "  --name NAME             what you call it; unique within its tenant\n"
	       "  --scopes LIST           what it may do: " KEY_SCOPE_WORDS " (read,submit)\n"
	       "  --expires WHEN          a day as in 2027-01-31, or a time as in 90d (never)\n"
	       "  --overlap TIME          for how long rotate leaves the key before good, up to 90d (24h)\n"
	       "  --weight N              turns of its jobs in the queue for one of another key's (1)\n"
	       "  --requests-per-s N, --requests-per-min N\n"
	       "                          what each service answers it; beyond that 429\n"
	       "  --queued-jobs N         how many of its jobs may wait in the queue\n"
	       "  --stored-bytes N        what its uploads, requests and results may take, as in 10G\n"
	       "  --json                  JSON on standard output\n");
}

/* What the verb has no use for would be ignored. */
static enum tw_status check_flags(const struct request *request, struct tw_error *error)
{
	bool makes = request->verb == VERB_CREATE;
	bool has_draft = request->scopes || request->weight || request->expires || request->requests_per_s ||
			 request->requests_per_min || request->queued_jobs || request->stored_bytes;
	if (has_draft && !makes)
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL,
			       "scopes, expiry, weight and limits are given to create; a key keeps them");
	if (request->overlap && request->verb != VERB_ROTATE)
		return tw_fail(error, TW_ERROR_INPUT, "usage", "--overlap", "is a flag of rotate");
	if (request->name && request->verb == VERB_LIST)
		return tw_fail(error, TW_ERROR_INPUT, "usage", "--name", "is no flag of list");
	if (!request->name && request->verb != VERB_LIST)
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL, "--name is needed; see --help");
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
		{"--tenant", "a tenant", &request->tenant, NULL},
		{"--name", "a name", &request->name, NULL},
		{"--scopes", "a list of scopes", &request->scopes, NULL},
		{"--expires", "a day or a time", &request->expires, NULL},
		{"--overlap", "a time", &request->overlap, NULL},
		{"--weight", "a number", &request->weight, NULL},
		{"--requests-per-s", "a number", &request->requests_per_s, NULL},
		{"--requests-per-min", "a number", &request->requests_per_min, NULL},
		{"--queued-jobs", "a number", &request->queued_jobs, NULL},
		{"--stored-bytes", "a number", &request->stored_bytes, NULL},
		{"--json", NULL, NULL, &request->as_json},
		{NULL, NULL, NULL, NULL},
	};
	const enum tw_status status = command_take_all(flags, verbs, &request->verb, argc, argv, help, error);
	if (status != TW_OK || *help)
		return status;
	if (request->verb < 0)
		return tw_fail(error, TW_ERROR_INPUT, "usage", NULL, "say create, list, rotate or revoke; see --help");
	return check_flags(request, error);
}

static enum tw_status run(void *context, struct tw_error *error)
{
	static enum tw_status (*const works[])(struct request *, struct tw_error *) = {create, list, rotate, revoke};
	struct request *request = context;
	enum tw_status status = store_open_existing(&request->store, request->url, error);
	/* A new store may get its keys before the first service listens to others. */
	if (status == TW_ERROR_NOT_FOUND && request->verb == VERB_CREATE) {
		status = store_open(&request->store, request->url, error);
		if (status == TW_OK)
			fprintf(stderr, "the store %s is new\n", request->url);
	}
	return status == TW_OK ? works[request->verb](request, error) : status;
}

static void clear(void *context)
{
	struct request *request = context;
	store_close(request->store);
}

/* --- the key file ----------------------------------------------------------------------------------------------- */

static bool is_verb(const char *word)
{
	for (const char *const *verb = verbs; *verb; verb++)
		if (!strcmp(*verb, word))
			return true;
	return false;
}

static bool is_file_name(const char *word)
{
	return word[0] && word[0] != '-' && word[0] != '#' && !strpbrk(word, " \t\r\n") && !is_verb(word);
}

static int print_line(const char *name)
{
	char secret[SECRET_SIZE], text[2 * SECRET_HASH_SIZE + 1];
	uint8_t hash[SECRET_HASH_SIZE];
	if (sodium_init() < 0) {
		fprintf(stderr, "tightwire key: libsodium cannot be initialised\n");
		return COMMAND_FAILED;
	}
	secret_make(secret);
	secret_hash(secret, hash);
	sodium_bin2hex(text, sizeof text, hash, sizeof hash);
	fprintf(stderr, "%s\n", secret);
	printf("%s %s\n", name, text);
	return COMMAND_DONE;
}

int command_key(int argc, char **argv)
{
	static const struct command_steps steps = {"key", print_help, parse, run, clear};
	struct request request = {.verb = -1};
	return argc == 2 && is_file_name(argv[1]) ? print_line(argv[1]) : command_run(&steps, &request, argc, argv);
}
