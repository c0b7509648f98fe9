#include "api/api.h"

#include "api/key.h"
#include "storage/store.h"

#include <pthread.h>
#include <sodium.h>
#include <stdlib.h>

struct api {
	struct api_settings settings;
	struct key_list *keys; /* owned; NULL: every request is allowed */
	pthread_key_t store;   /* struct store * of each thread */
};

static void close_store(void *store)
{
	store_close(store);
}

enum tw_status api_store(struct api *api, struct store **store, struct tw_error *error)
{
	*store = pthread_getspecific(api->store);
	if (*store)
		return TW_OK;
	enum tw_status status = store_open(store, api->settings.store_url, error);
	if (!status && pthread_setspecific(api->store, *store) != 0) {
		store_close(*store);
		return tw_fail_memory(error);
	}
	return status;
}

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
	made->settings = *settings;
	struct store *store = NULL;
	enum tw_status status = api_store(made, &store, error);
	if (!status && settings->key_file && settings->key_file[0])
		status = key_list_read(&made->keys, settings->key_file, error);
	if (status) {
		api_close(made);
		return status;
	}
	*api = made;
	return TW_OK;
}

void api_close(struct api *api)
{
	if (!api)
		return;
	store_close(pthread_getspecific(api->store));
	pthread_key_delete(api->store);
	key_list_free(api->keys);
	free(api);
}

const struct api_settings *api_settings_of(const struct api *api)
{
	return &api->settings;
}

bool api_allows(const struct api *api, const char *authorization)
{
	return !api->keys || key_list_allows(api->keys, authorization);
}
