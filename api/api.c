#include "api/api.h"

#include "api/key.h"
#include "storage/jobs.h"
#include "storage/store.h"

#include <pthread.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>

struct api_policy {
	struct api_settings settings; /* owned texts */
	struct key_list *keys;        /* owned; NULL: every request is allowed */
	unsigned users;               /* guarded by the api's lock; the api itself is one */
};

struct api {
	pthread_mutex_t lock;
	struct api_policy *policy; /* guarded by `lock` */
	char *store_url;           /* owned */
	pthread_key_t store;       /* struct store * of each thread */
	struct store_place place;  /* of all of them */
};

/* --- policies -------------------------------------------------------------------------------------------------------
 */

static void policy_free(struct api_policy *policy)
{
	if (!policy)
		return;
	free((char *)policy->settings.cors_origin);
	free((char *)policy->settings.host_names);
	key_list_free(policy->keys);
	free(policy);
}

static char *copy_of(const char *text)
{
	return strdup(text ? text : "");
}

static enum tw_status policy_new(struct api_policy **policy, const struct api_settings *settings,
				 struct tw_error *error)
{
	struct api_policy *made = calloc(1, sizeof *made);
	*policy = NULL;
	if (!made)
		return tw_fail_memory(error);
	made->settings = *settings;
	made->settings.store_url = made->settings.key_file = NULL;
	made->settings.cors_origin = copy_of(settings->cors_origin);
	made->settings.host_names = copy_of(settings->host_names);
	made->users = 1;
	enum tw_status status = made->settings.cors_origin && made->settings.host_names ? TW_OK : tw_fail_memory(error);
	if (status == TW_OK && settings->key_file && settings->key_file[0])
		status = key_list_read(&made->keys, settings->key_file, error);
	if (status == TW_OK)
		*policy = made;
	else
		policy_free(made);
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

bool api_policy_has_keys(const struct api_policy *policy)
{
	return policy->keys != NULL;
}

bool api_policy_allows(const struct api_policy *policy, const char *authorization)
{
	return !policy->keys || key_list_allows(policy->keys, authorization);
}

/* --- stores ---------------------------------------------------------------------------------------------------------
 */

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

/* --- life -----------------------------------------------------------------------------------------------------------
 */

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
	made->store_url = strdup(settings->store_url);
	enum tw_status status = made->store_url ? open_first(made, error) : tw_fail_memory(error);
	if (status == TW_OK)
		status = policy_new(&made->policy, settings, error);
	if (status != TW_OK) {
		api_close(made);
		return status;
	}
	*api = made;
	return TW_OK;
}

enum tw_status api_reload(struct api *api, const struct api_settings *settings, struct tw_error *error)
{
	struct api_policy *next = NULL;
	enum tw_status status = policy_new(&next, settings, error);
	if (status != TW_OK)
		return status;
	pthread_mutex_lock(&api->lock);
	struct api_policy *old = api->policy;
	bool fits = (old->keys != NULL) == (next->keys != NULL);
	if (fits)
		api->policy = next;
	pthread_mutex_unlock(&api->lock);
	api_return_policy(api, fits ? old : next);
	return fits ? TW_OK
		    : tw_fail(error, TW_ERROR_CONFLICT, "keys-needed", "key-file",
			      "whether keys are needed at all is decided at the start; restart the service");
}

void api_close(struct api *api)
{
	if (!api)
		return;
	store_close(pthread_getspecific(api->store));
	pthread_key_delete(api->store);
	pthread_mutex_destroy(&api->lock);
	policy_free(api->policy);
	free(api->store_url);
	free(api);
}
