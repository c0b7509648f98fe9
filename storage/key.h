/* API keys: who may use the service, for which tenant, what it may do, and how much. People name a key, everything
 * else goes by its number, which stays through rotation; what a client shows (secret.h) is hashed, and told only by
 * the call that makes it. */
#ifndef STORAGE_KEY_H
#define STORAGE_KEY_H

#include "storage/job_request.h"
#include "storage/secret.h"
#include "storage/tenant.h"

/* What a key may do. The numbers stand in the store. */
enum {
	KEY_READ = 1,   /* read everything of its tenant */
	KEY_SUBMIT = 2, /* upload, ask for computations, cancel and delete them */
	KEY_RIG = 4,    /* see and use the bench rig */
	KEY_ADMIN = 8,  /* make and revoke keys of its tenant, and delete the tenant */
	KEY_SCOPES_ALL = 15,
};
#define KEY_SCOPE_WORDS "read, submit, rig, admin" /* for messages */

/* "read,submit"; every list has one order. Returns the length. */
enum { KEY_SCOPES_SIZE = 32 };
void key_print_scopes(unsigned scopes, char text[KEY_SCOPES_SIZE]);

/* The words of a list with commas. TW_ERROR_INPUT "key-scope". */
enum tw_status key_parse_scopes(const char *text, unsigned *scopes, struct tw_error *error) TW_NODISCARD;

/* 0: no limit. At most 10⁹, and 2⁵³ bytes. */
struct key_limits {
	int64_t requests_per_s, requests_per_min; /* of each daemon */
	int64_t queued_jobs;
	int64_t stored_bytes;
};

enum { KEY_NAME_SIZE = 65 };

struct key_draft {
	int64_t tenant;
	const char *name; /* borrowed; 1 to 64 letters, digits, - _ . @ */
	unsigned scopes;
	int64_t expires_ms; /* since 1970; 0: never */
	uint32_t weight;    /* of its jobs in the queue, up to JOB_WEIGHT_MAX; 0: 1, as usual */
	struct key_limits limits;
};

struct key {
	int64_t number; /* struct owner's client */
	char id[STORE_ID_SIZE];
	char tenant[TENANT_NAME_SIZE]; /* its name */
	char name[KEY_NAME_SIZE];
	unsigned scopes;
	int64_t created_ms, expires_ms, revoked_ms; /* 0: never */
	int64_t rotated_ms;                         /* when what it shows now was made */
	uint32_t weight;
	int64_t overlap_until_ms; /* until when it may show what it showed before; 0: it may not */
	struct key_limits limits;
	int64_t queued_jobs, stored_bytes; /* now */
	int64_t requests, last_used_ms;    /* as the daemons told last: some seconds ago */
};

/* What can be said of a key before its tenant is there: TW_ERROR_INPUT "key-name" | "key-scope" (none) | "key-expiry"
 * (over already) | "key-weight" | "key-limit". */
enum tw_status key_check(const struct store *store, const struct key_draft *draft, struct tw_error *error) TW_NODISCARD;

/* Makes a key. From then on nobody is let in without one, on any daemon of this store. As key_check, and
 * TW_ERROR_CONFLICT "key-exists", TW_ERROR_NOT_FOUND "no-such-tenant". */
enum tw_status key_create(struct store *store, const struct key_draft *draft, struct key *key, char secret[SECRET_SIZE],
			  struct tw_error *error) TW_NODISCARD;

/* Below: TW_ERROR_NOT_FOUND "no-such-key", also where it is another tenant's. */
enum tw_status key_get(struct store *store, int64_t tenant, const char *id, struct key *key,
		       struct tw_error *error) TW_NODISCARD;

/* By its number. */
enum tw_status key_get_number(struct store *store, int64_t number, struct key *key,
			      struct tw_error *error) TW_NODISCARD;

/* The key of this name that is not revoked. */
enum tw_status key_find(struct store *store, int64_t tenant, const char *name, struct key *key,
			struct tw_error *error) TW_NODISCARD;

/* A new secret; what the key showed before is good for `overlap_ms` more, what it showed before that is not.
 * TW_ERROR_CONFLICT "key-revoked"; TW_ERROR_INPUT "key-overlap" (not from 0 to KEY_OVERLAP_MAX_S). */
enum { KEY_OVERLAP_MAX_S = 90 * 24 * 3600 };
enum tw_status key_rotate(struct store *store, int64_t tenant, const char *id, int64_t overlap_ms, struct key *key,
			  char secret[SECRET_SIZE], struct tw_error *error) TW_NODISCARD;

/* From now on it lets nobody in. Twice is once. */
enum tw_status key_revoke(struct store *store, int64_t tenant, const char *id, struct key *key,
			  struct tw_error *error) TW_NODISCARD;

/* Oldest first, revoked ones too; of all tenants for TENANT_ANY. */
struct key_page {
	struct key *keys; /* owned */
	size_t count;
	int64_t next; /* cursor of the following page, 0 after the last */
};
enum tw_status key_list(struct store *store, int64_t tenant, int64_t cursor, uint32_t limit, struct key_page *page,
			struct tw_error *error) TW_NODISCARD;
void key_page_clear(struct key_page *page);

/* Fails with "limit-queued-jobs" where the client may not queue one more (`jobs`), and "limit-stored-bytes" where it
 * may not store `bytes` more. Only keys have limits, and what jobs leave behind is stored whatever it takes. */
enum tw_status key_check_limits(struct store *store, int64_t client, bool jobs, uint64_t bytes,
				struct tw_error *error) TW_NODISCARD;

#endif
