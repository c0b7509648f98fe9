/* The api as a whole, one per daemon: its settings, its keys, and every thread's connection to the store. What it does
 * with a request is an exchange (api/exchange.h). */
#ifndef API_API_H
#define API_API_H

#include "api/caller.h"
#include "api/wrong_keys.h"
#include "tightwire.h"

#include <stdbool.h>

struct api;
struct store;

/* What the service around it does for the api. Functions may be NULL; they are called from any thread. */
struct api_hooks {
	/* There is work in the queue: wake a worker. */
	void (*job_added)(void *context, bool is_interactive);
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
	const char *key_file;   /* file of API keys (api/key_file.h); empty for none */
	struct api_hooks hooks;
};

/* Opens the store once, to see that it works, and reads the keys. Free with api_close, after all exchanges. */
enum tw_status api_open(struct api **api, const struct api_settings *settings, struct tw_error *error) TW_NODISCARD;
void api_close(struct api *api); /* NULL is allowed */

/* Takes other settings, and reads the key file again, for all requests that begin from now on. The store stays. After
 * an error everything is as before; TW_ERROR_CONFLICT "keys-needed" where a service that needs keys would not any
 * more. */
enum tw_status api_reload(struct api *api, const struct api_settings *settings, struct tw_error *error) TW_NODISCARD;

/* The settings and keys of one moment: a request keeps those that it began with. */
struct api_policy;
struct api_policy *api_take_policy(struct api *api);
void api_return_policy(struct api *api, struct api_policy *policy);
const struct api_settings *api_policy_settings(const struct api_policy *policy);

/* Whether nobody is let in without a key: there is a key file, or has ever been a key in the store. */
bool api_policy_needs_key(const struct api_policy *policy);

/* Who it is that shows this value of Authorization (NULL: none). Where no key is needed, everybody is the operator.
 * `caller` borrows from the policy. TW_ERROR_INPUT "unauthorized". */
enum tw_status api_admit(const struct api_policy *policy, const char *authorization, struct caller *caller,
			 struct tw_error *error) TW_NODISCARD;

/* What somebody holds who was let in and stays: a stream looks now and then whether it is still good. */
struct api_pass {
	uint8_t hash[SECRET_HASH_SIZE]; /* of the secret that was shown; zero: none was */
	int64_t until_ms;               /* since 1970; 0: for ever */
	uint64_t generation;            /* of the keys that it was looked up in last */
};
struct api_pass api_pass_of(const struct caller *caller);

/* Whether the key is still one, and the secret: neither revoked nor rotated away nor expired since. Looked up only
 * where keys have changed. */
bool api_pass_is_good(struct api *api, struct api_pass *pass);

/* A request of the caller's: counted, and held to its limits (api/meter.h). */
enum tw_status api_count_request(struct api *api, const struct caller *caller, unsigned *retry_s,
				 struct tw_error *error) TW_NODISCARD;

/* A wrong key from this address (api/wrong_keys.h), and how many there were of all addresses. */
struct wrong_key_verdict api_count_wrong_key(struct api *api, uint64_t address);
uint64_t api_wrong_keys(struct api *api);

/* Takes the store's keys as they are now, where they have changed; a cheap read where not. For the service to call
 * several times a second, on one thread: so a key that was made or revoked, by whatever process, counts within a second
 * without a request ever reading it. */
enum tw_status api_refresh_keys(struct api *api, struct tw_error *error) TW_NODISCARD;

/* Tells the store how keys were used since the last call. For every few seconds; `store` is the calling thread's. */
enum tw_status api_tell_uses(struct api *api, struct store *store, struct tw_error *error) TW_NODISCARD;

/* The calling thread's connection, opened when it is first asked for and closed when the thread ends. Borrowed. */
enum tw_status api_store(struct api *api, struct store **store, struct tw_error *error) TW_NODISCARD;

/* Who waits for jobs. */
struct waiting;
struct waiting *api_waiting(struct api *api);

/* A number that grows with every change of a job. False where the store does not tell. */
bool api_change(struct api *api, int64_t *change);

#endif
