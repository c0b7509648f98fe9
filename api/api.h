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
	void (*job_added)(void *context); /* there is work in the queue: wake a worker */
	void (*job_asked)(void *context); /* a running job was asked to stop, or removed: tell the workers */
	char *(*metrics)(void *context);  /* text for /metrics in the Prometheus format; malloc */
	bool (*ready)(void *context, char *why, size_t size); /* false, with a reason, while draining */
	bool (*may_hold)(void *context); /* whether one more request, or stream of events, may wait for a job */
	/* The service itself failed (a status of 500 and above, but for a full store): for the log. `request_id` may be
	 * NULL. */
	void (*failed)(void *context, const char *request_id, const struct tw_error *error);
	void *context;
};

struct api_settings {
	const char *store_url;       /* copied, like all texts here */
	uint64_t upload_limit_bytes; /* of one upload */
	uint32_t wait_limit_s;       /* longest `Prefer: wait` that is honoured */
	const char *cors_origin;     /* "https://studio.example", "*", or empty for no CORS */
	const char *host_names; /* names, with commas, that Host may say of a service without keys (api/origin.h) */
	const char *key_file;   /* file of API keys (api/key.h); empty for none */
	struct api_hooks hooks;
};

/* Opens the store once, to see that it works, and reads the key file. Free with api_close, after all exchanges. */
enum tw_status api_open(struct api **api, const struct api_settings *settings, struct tw_error *error) TW_NODISCARD;
void api_close(struct api *api); /* NULL is allowed */

/* Takes other settings, and reads the key file again, for all requests that begin from now on. The store stays. After
 * an error everything is as before; TW_ERROR_CONFLICT "keys-needed" where the keys would go away or come. */
enum tw_status api_reload(struct api *api, const struct api_settings *settings, struct tw_error *error) TW_NODISCARD;

/* The settings and keys of one moment: a request keeps those that it began with. */
struct api_policy;
struct api_policy *api_take_policy(struct api *api);
void api_return_policy(struct api *api, struct api_policy *policy);
const struct api_settings *api_policy_settings(const struct api_policy *policy);

/* Whether it has keys at all, and whether the value of Authorization (NULL: none) is one of them. */
bool api_policy_has_keys(const struct api_policy *policy);
bool api_policy_allows(const struct api_policy *policy, const char *authorization);

/* The calling thread's connection, opened when it is first asked for and closed when the thread ends. Borrowed. */
enum tw_status api_store(struct api *api, struct store **store, struct tw_error *error) TW_NODISCARD;

/* A number that grows with every change of a job. False where the store does not tell. */
bool api_change(struct api *api, int64_t *change);

#endif
