/* The api as a whole, one per daemon: its settings, its keys, and every thread's connection to the store. What it does
 * with a request is an exchange (api/exchange.h). */
#ifndef API_API_H
#define API_API_H

#include "tightwire.h"

#include <stdbool.h>

struct api;
struct store;

/* What the service around it does for the api. Functions may be NULL; they are called from any thread. */
struct api_hooks {
	void (*job_added)(void *context);                     /* there is work in the queue: wake a worker */
	char *(*metrics)(void *context);                      /* text for /metrics in the Prometheus format; malloc */
	bool (*ready)(void *context, char *why, size_t size); /* false, with a reason, while draining */
	void *context;
};

struct api_settings {
	const char *store_url;       /* borrowed for the life of the api, like all texts here */
	uint64_t upload_limit_bytes; /* of one upload */
	uint32_t wait_limit_s;       /* longest `Prefer: wait` that is honoured */
	const char *cors_origin;     /* "https://studio.example", "*", or empty for no CORS */
	const char *key_file;        /* file of API keys (api/key.h); empty for none */
	struct api_hooks hooks;
};

/* Opens the store once, to see that it works, and reads the key file. Free with api_close, after all exchanges. */
enum tw_status api_open(struct api **api, const struct api_settings *settings, struct tw_error *error) TW_NODISCARD;
void api_close(struct api *api); /* NULL is allowed */

/* Borrowed; the api's as long as it is open. */
const struct api_settings *api_settings_of(const struct api *api);

/* The calling thread's connection, opened when it is first asked for and closed when the thread ends. Borrowed. */
enum tw_status api_store(struct api *api, struct store **store, struct tw_error *error) TW_NODISCARD;

/* Whether the value of Authorization (NULL: none) opens the service: a valid key, or there are no keys. */
bool api_allows(const struct api *api, const char *authorization);

#endif
