#include "api/api.h"

#include "api/key_file.h"
#include "api/key_table.h"
#include "api/meter.h"
#include "api/waiting.h"
#include "api/wrong_keys.h"
#include "storage/jobs.h"
#include "storage/store.h"

#include <pthread.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>

struct api_policy {
	struct api_settings settings; /* owned texts */
	struct access_key *file_keys; /* owned; of the key file, their tenant filled in */
	size_t file_key_count;
	struct key_table *keys; /* owned; NULL: every request is allowed */
	int64_t default_tenant; /* whose is what comes without a key */
	uint8_t default_veil[ACCESS_VEIL_SIZE];
	int64_t change; /* the store's keys as they were at this access_change */
	unsigned users; /* guarded by the api's lock; the api itself is one */
};

struct api {
	pthread_mutex_t lock;
	pthread_mutex_t renewal;   /* held while another policy is made: one at a time */
	struct api_policy *policy; /* guarded by `lock`, and changed under both */
	uint64_t generation;       /* guarded by `lock`; grows with every policy */
	struct meter *meter;       /* owned */
	struct wrong_keys *wrong;  /* owned */
	char *store_url;           /* owned */
	pthread_key_t store;       /* struct store * of each thread */
	struct store_place place;  /* of all of them */
	struct waiting *waiting;   /* owned */
};

/* --- policies ----------------------------------------------------------------------------------------------------- */

static void policy_free(struct api_policy *policy)
{
	if (!policy)
		return;
	free((char *)policy->settings.cors_origin);
	free((char *)policy->settings.host_names);
	free(policy->file_keys);
	key_table_free(policy->keys);
	free(policy);
}

static char *copy_of(const char *text)
{
	return strdup(text ? text : "");
}

/* The keys of both, in one table; none where nobody needs one. */
static enum tw_status set_keys(struct api_policy *policy, const struct access *access, struct tw_error *error)
{
	size_t count = policy->file_key_count + access->count;
	policy->change = access->change;
	policy->default_tenant = access->default_tenant;
	memcpy(policy->default_veil, access->default_veil, ACCESS_VEIL_SIZE);
	for (size_t i = 0; i < policy->file_key_count; i++) {
		policy->file_keys[i].owner.tenant = access->default_tenant;
		memcpy(policy->file_keys[i].veil, access->default_veil, ACCESS_VEIL_SIZE);
	}
	if (!policy->file_key_count && !access->keys_needed)
		return TW_OK;
	struct access_key *all = calloc(count + 1, sizeof *all);
	if (!all)
		return tw_fail_memory(error);
	if (policy->file_key_count)
		memcpy(all, policy->file_keys, policy->file_key_count * sizeof *all);
	if (access->count)
		memcpy(all + policy->file_key_count, access->keys, access->count * sizeof *all);
	policy->keys = key_table_new(all, count);
	free(all);
	return policy->keys ? TW_OK : tw_fail_memory(error);
}

static enum tw_status read_keys(struct api *api, struct api_policy *policy, struct tw_error *error)
{
	struct store *store = NULL;
	struct access access = {0};
	enum tw_status status = api_store(api, &store, error);
	if (status == TW_OK)
		status = access_read(store, &access, error);
	if (status == TW_OK)
		status = set_keys(policy, &access, error);
	access_clear(&access);
	return status;
}

/* Without the store's keys yet, and without those of a file. */
static enum tw_status policy_alloc(struct api_policy **policy, const struct api_settings *settings,
				   struct tw_error *error)
{
	struct api_policy *made = calloc(1, sizeof *made);
	*policy = made;
	if (!made)
		return tw_fail_memory(error);
	made->settings = *settings;
	made->settings.store_url = made->settings.key_file = NULL;
	made->settings.cors_origin = copy_of(settings->cors_origin);
	made->settings.host_names = copy_of(settings->host_names);
	made->users = 1;
	return made->settings.cors_origin && made->settings.host_names ? TW_OK : tw_fail_memory(error);
}

static enum tw_status copy_file_keys(struct api_policy *policy, const struct api_policy *old, struct tw_error *error)
{
	if (!old->file_key_count)
		return TW_OK;
	policy->file_keys = calloc(old->file_key_count, sizeof *old->file_keys);
	if (!policy->file_keys)
		return tw_fail_memory(error);
	memcpy(policy->file_keys, old->file_keys, old->file_key_count * sizeof *old->file_keys);
	policy->file_key_count = old->file_key_count;
	return TW_OK;
}

/* With the store's keys of today. `old`: whose key file is taken over as it was read; NULL: it is read. */
static enum tw_status policy_new(struct api *api, struct api_policy **policy, const struct api_settings *settings,
				 const struct api_policy *old, struct tw_error *error)
{
	enum tw_status status = policy_alloc(policy, settings, error);
	if (status == TW_OK && old)
		status = copy_file_keys(*policy, old, error);
	else if (status == TW_OK && settings->key_file && settings->key_file[0])
		status = key_file_read(settings->key_file, &(*policy)->file_keys, &(*policy)->file_key_count, error);
	if (status == TW_OK)
		status = read_keys(api, *policy, error);
	if (status == TW_OK)
		return TW_OK;
	policy_free(*policy);
	*policy = NULL;
	return status;
}

struct api_policy *api_take_policy(struct api *api)
{
	pthread_mutex_lock(&api->lock);
	struct api_policy *policy = api->policy;
	policy->users++;
	pthread_mutex_unlock(&api->lock);
	return policy;
}

void api_return_policy(struct api *api, struct api_policy *policy)
{
	pthread_mutex_lock(&api->lock);
	bool is_last = --policy->users == 0;
	pthread_mutex_unlock(&api->lock);
	if (is_last)
		policy_free(policy);
}

const struct api_settings *api_policy_settings(const struct api_policy *policy)
{
	return &policy->settings;
}

bool api_policy_needs_key(const struct api_policy *policy)
{
	return policy->keys != NULL;
}

/* --- who comes in ------------------------------------------------------------------------------------------------- */

static int64_t clock_ms(clockid_t clock)
{
	struct timespec now;
	clock_gettime(clock, &now);
	return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static enum tw_status refuse_stranger(const char *secret, struct tw_error *error)
{
	if (secret && secret_is_damaged(secret))
		return tw_fail(error, TW_ERROR_INPUT, "unauthorized", "Authorization",
			       "this is no whole key: something of it is missing or wrong; send it as it was told, as "
			       "Authorization: Bearer KEY");
	return tw_fail(error, TW_ERROR_INPUT, "unauthorized", "Authorization",
		       "send a valid API key as Authorization: Bearer KEY");
}

enum tw_status api_admit(const struct api_policy *policy, const char *authorization, struct caller *caller,
			 struct tw_error *error)
{
	if (!policy->keys) {
		*caller = (struct caller){
			.owner = {policy->default_tenant, 0}, .scopes = KEY_SCOPES_ALL, .is_operator = true};
		memcpy(caller->veil, policy->default_veil, ACCESS_VEIL_SIZE);
		return TW_OK;
	}
	bool is_bearer = authorization && !strncasecmp(authorization, "Bearer ", 7);
	const char *secret = is_bearer ? authorization + 7 + strspn(authorization + 7, " ") : NULL;
	const struct access_key *key = secret ? key_table_find(policy->keys, secret, clock_ms(CLOCK_REALTIME)) : NULL;
	if (!key)
		return refuse_stranger(secret, error);
	*caller = (struct caller){.owner = key->owner,
				  .scopes = key->scopes,
				  .is_operator = key->owner.tenant == policy->default_tenant,
				  .key = key};
	memcpy(caller->veil, key->veil, ACCESS_VEIL_SIZE);
	return TW_OK;
}

struct api_pass api_pass_of(const struct caller *caller)
{
	struct api_pass pass = {.generation = UINT64_MAX};
	if (!caller->key)
		return pass;
	memcpy(pass.hash, caller->key->hash, sizeof pass.hash);
	pass.until_ms = caller->key->until_ms;
	return pass;
}

static bool find_pass(const struct api_policy *policy, struct api_pass *pass)
{
	size_t count = 0;
	if (!policy->keys)
		return sodium_is_zero(pass->hash, sizeof pass->hash);
	const struct access_key *keys = key_table_keys(policy->keys, &count);
	for (size_t i = 0; i < count; i++)
		if (!memcmp(keys[i].hash, pass->hash, sizeof pass->hash)) {
			pass->until_ms = keys[i].until_ms;
			return true;
		}
	return false;
}

bool api_pass_is_good(struct api *api, struct api_pass *pass)
{
	bool is_known = true;
	pthread_mutex_lock(&api->lock);
	if (pass->generation != api->generation)
		is_known = find_pass(api->policy, pass);
	pass->generation = api->generation;
	pthread_mutex_unlock(&api->lock);
	return is_known && (!pass->until_ms || clock_ms(CLOCK_REALTIME) < pass->until_ms);
}

enum tw_status api_count_request(struct api *api, const struct caller *caller, unsigned *retry_s,
				 struct tw_error *error)
{
	*retry_s = 0;
	return caller->key ? meter_take(api->meter, caller->key, clock_ms(CLOCK_MONOTONIC), retry_s, error) : TW_OK;
}

struct wrong_key_verdict api_count_wrong_key(struct api *api, uint64_t address)
{
	return wrong_keys_add(api->wrong, address, clock_ms(CLOCK_MONOTONIC));
}

uint64_t api_wrong_keys(struct api *api)
{
	return wrong_keys_count(api->wrong);
}

/* --- stores ------------------------------------------------------------------------------------------------------- */

static void close_store(void *store)
{
	store_close(store);
}

static enum tw_status keep_store(struct api *api, struct store *store, struct tw_error *error)
{
	if (pthread_setspecific(api->store, store) == 0)
		return TW_OK;
	store_close(store);
	return tw_fail_memory(error);
}

static enum tw_status fail_gone(struct tw_error *error)
{
	return tw_fail(
		error, TW_ERROR_IO, STORE_GONE, NULL,
		"the store was deleted, replaced or unmounted while the service ran; put it back, or restart the "
		"service");
}

/* Only the first one makes a store: a later one would serve an empty store where there was a full one. */
static enum tw_status open_first(struct api *api, struct tw_error *error)
{
	struct store *store = NULL;
	enum tw_status status = store_open(&store, api->store_url, error);
	if (status != TW_OK)
		return status;
	api->place = store_place(store);
	return keep_store(api, store, error);
}

static enum tw_status open_another(struct api *api, struct store **store, struct tw_error *error)
{
	enum tw_status status = store_open_existing(store, api->store_url, error);
	if (status == TW_ERROR_NOT_FOUND)
		return fail_gone(error);
	if (status != TW_OK)
		return status;
	struct store_place place = store_place(*store);
	if (place.device == api->place.device && place.file == api->place.file)
		return keep_store(api, *store, error);
	store_close(*store);
	return fail_gone(error);
}

enum tw_status api_store(struct api *api, struct store **store, struct tw_error *error)
{
	*store = pthread_getspecific(api->store);
	if (*store)
		return TW_OK;
	enum tw_status status = open_another(api, store, error);
	if (status != TW_OK)
		*store = NULL;
	return status;
}

struct waiting *api_waiting(struct api *api)
{
	return api->waiting;
}

bool api_change(struct api *api, int64_t *change)
{
	struct store *store = NULL;
	struct job_page page = {0};
	bool is_known = api_store(api, &store, NULL) == TW_OK && job_changes(store, -1, 1, &page, NULL) == TW_OK;
	if (is_known)
		*change = page.next;
	job_page_clear(&page);
	return is_known;
}

/* --- life --------------------------------------------------------------------------------------------------------- */

enum tw_status api_open(struct api **api, const struct api_settings *settings, struct tw_error *error)
{
	*api = NULL;
	if (sodium_init() < 0)
		return tw_fail(error, TW_ERROR_INTERNAL, "internal", NULL, "libsodium cannot be initialised");
	struct api *made = calloc(1, sizeof *made);
	if (!made || pthread_key_create(&made->store, close_store) != 0) {
		free(made);
		return tw_fail_memory(error);
	}
	pthread_mutex_init(&made->lock, NULL);
	pthread_mutex_init(&made->renewal, NULL);
	made->store_url = strdup(settings->store_url);
	made->meter = meter_new();
	made->wrong = wrong_keys_new();
	made->waiting = waiting_new();
	enum tw_status status = made->store_url && made->meter && made->wrong && made->waiting ? open_first(made, error)
											       : tw_fail_memory(error);
	if (status == TW_OK)
		status = policy_new(made, &made->policy, settings, NULL, error);
	if (status != TW_OK) {
		api_close(made);
		return status;
	}
	*api = made;
	return TW_OK;
}

/* Takes the place of the policy of today. Under the renewal's lock. */
static void put_policy(struct api *api, struct api_policy *next)
{
	pthread_mutex_lock(&api->lock);
	struct api_policy *old = api->policy;
	api->policy = next;
	api->generation++;
	pthread_mutex_unlock(&api->lock);
	api_return_policy(api, old);
}

/* Who is let in without a key today has been told so; nobody may find himself let in because a file was emptied. */
static enum tw_status check_reload(const struct api_policy *old, const struct api_policy *next, struct tw_error *error)
{
	if (!old->keys || next->keys)
		return TW_OK;
	return tw_fail(error, TW_ERROR_CONFLICT, "keys-needed", "key-file",
		       "this service needs keys, and there would be none; restart it if it should not");
}

enum tw_status api_reload(struct api *api, const struct api_settings *settings, struct tw_error *error)
{
	struct api_policy *next = NULL;
	pthread_mutex_lock(&api->renewal);
	enum tw_status status = policy_new(api, &next, settings, NULL, error);
	if (status == TW_OK)
		status = check_reload(api->policy, next, error);
	if (status == TW_OK)
		put_policy(api, next);
	else
		policy_free(next);
	pthread_mutex_unlock(&api->renewal);
	return status;
}

static enum tw_status refresh_keys(struct api *api, struct tw_error *error)
{
	struct store *store = NULL;
	struct api_policy *next = NULL;
	int64_t change = 0;
	enum tw_status status = api_store(api, &store, error);
	if (status == TW_OK)
		status = access_change(store, &change, error);
	if (status != TW_OK || change == api->policy->change)
		return status;
	status = policy_new(api, &next, &api->policy->settings, api->policy, error);
	if (status == TW_OK)
		put_policy(api, next);
	return status;
}

enum tw_status api_refresh_keys(struct api *api, struct tw_error *error)
{
	pthread_mutex_lock(&api->renewal);
	enum tw_status status = refresh_keys(api, error);
	pthread_mutex_unlock(&api->renewal);
	return status;
}

enum tw_status api_tell_uses(struct api *api, struct store *store, struct tw_error *error)
{
	struct access_use *uses = NULL;
	size_t count = 0;
	enum tw_status status =
		meter_drain(api->meter, clock_ms(CLOCK_MONOTONIC), clock_ms(CLOCK_REALTIME), &uses, &count, error);
	if (status == TW_OK)
		status = access_add_uses(store, uses, count, error);
	free(uses);
	return status;
}

void api_close(struct api *api)
{
	if (!api)
		return;
	store_close(pthread_getspecific(api->store));
	pthread_key_delete(api->store);
	pthread_mutex_destroy(&api->lock);
	pthread_mutex_destroy(&api->renewal);
	policy_free(api->policy);
	meter_free(api->meter);
	wrong_keys_free(api->wrong);
	waiting_free(api->waiting);
	free(api->store_url);
	free(api);
}
