#include "storage/key.h"

#include "storage/id.h"
#include "storage/job_state.h"
#include "storage/row.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>

/* --- words ------------------------------------------------------------------------------------------------------ */

static const struct {
	unsigned scope;
	const char *word;
} scopes_by_word[] = {{KEY_READ, "read"}, {KEY_SUBMIT, "submit"}, {KEY_RIG, "rig"}, {KEY_ADMIN, "admin"}};
enum { SCOPES = sizeof scopes_by_word / sizeof *scopes_by_word };

void key_print_scopes(unsigned scopes, char text[KEY_SCOPES_SIZE])
{
	size_t used = 0;
	text[0] = '\0';
	for (size_t i = 0; i < SCOPES; i++)
		if (scopes & scopes_by_word[i].scope)
			used += (size_t)snprintf(text + used, KEY_SCOPES_SIZE - used, "%s%s", used ? "," : "",
						 scopes_by_word[i].word);
}

static enum tw_status refuse_no_scope(struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_INPUT, "key-scope", NULL,
		       "a key without a scope is good for nothing; there are: " KEY_SCOPE_WORDS);
}

static unsigned scope_of(const char *word, size_t length)
{
	for (size_t i = 0; i < SCOPES; i++)
		if (strlen(scopes_by_word[i].word) == length && !strncmp(word, scopes_by_word[i].word, length))
			return scopes_by_word[i].scope;
	return 0;
}

enum tw_status key_parse_scopes(const char *text, unsigned *scopes, struct tw_error *error)
{
	*scopes = 0;
	while (*text) {
		size_t length = strcspn(text, ",");
		unsigned scope = scope_of(text, length);
		if (!scope)
			return tw_fail(error, TW_ERROR_INPUT, "key-scope", NULL,
				       "no scope \"%.*s\"; there are: " KEY_SCOPE_WORDS, length < 40 ? (int)length : 40,
				       text);
		*scopes |= scope;
		text += length + (text[length] == ',');
	}
	return *scopes ? TW_OK : refuse_no_scope(error);
}

/* So that nobody has to fear an overflow when he counts with them. */
#define COUNT_MAX 1000000000ll
#define BYTES_MAX (1ll << 53) /* every number up to here is one of JSON */

static bool is_limit(int64_t limit, int64_t most)
{
	return limit >= 0 && limit <= most;
}

enum tw_status key_check(const struct store *store, const struct key_draft *draft, struct tw_error *error)
{
	static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_.@";
	const struct key_limits *limits = &draft->limits;
	size_t length = strlen(draft->name);
	if (!length || length >= KEY_NAME_SIZE || strspn(draft->name, letters) != length)
		return tw_fail(error, TW_ERROR_INPUT, "key-name", NULL,
			       "a key's name has 1 to %d letters, digits, - _ . @", KEY_NAME_SIZE - 1);
	if (!draft->scopes || draft->scopes & ~(unsigned)KEY_SCOPES_ALL)
		return refuse_no_scope(error);
	if (draft->expires_ms && draft->expires_ms <= store_now_ms(store))
		return tw_fail(error, TW_ERROR_INPUT, "key-expiry", NULL, "the key would have expired already");
	if (draft->weight > JOB_WEIGHT_MAX)
		return tw_fail(error, TW_ERROR_INPUT, "key-weight", NULL, "a weight is a whole number from 1 to %d",
			       JOB_WEIGHT_MAX);
	if (!is_limit(limits->requests_per_s, COUNT_MAX) || !is_limit(limits->requests_per_min, COUNT_MAX) ||
	    !is_limit(limits->queued_jobs, COUNT_MAX) || !is_limit(limits->stored_bytes, BYTES_MAX))
		return tw_fail(error, TW_ERROR_INPUT, "key-limit", NULL,
			       "a limit is at least 0, which is none, and at most %lld (%lld bytes)",
			       (long long)COUNT_MAX, (long long)BYTES_MAX);
	return TW_OK;
}

static enum tw_status no_such_key(const char *name, struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-key", NULL, "there is no key %.64s", name);
}

/* --- reading ---------------------------------------------------------------------------------------------------- */

#define QUEUED_JOBS                                                                                                    \
	"(SELECT coalesce(sum(c.count), 0) FROM job_count c WHERE c.tenant = k.tenant AND c.client = k.number"         \
	" AND c.state = " SQL_QUEUED ")"
#define KEY_COLUMNS                                                                                                    \
	"k.number, k.id, coalesce(t.name, ''), k.name, k.scopes, k.weight, k.created_ms, k.expires_ms, k.revoked_ms,"  \
	" k.requests_per_s, k.requests_per_min, k.queued_jobs, k.stored_bytes, " QUEUED_JOBS ", u.stored_bytes,"       \
	" u.requests, u.last_used_ms, (SELECT coalesce(max(s.created_ms), 0) FROM api_key_secret s"                    \
	"  WHERE s.key = k.number), (SELECT coalesce(max(s.until_ms), 0) FROM api_key_secret s WHERE s.key = k.number" \
	"  AND s.until_ms > ?1) "
#define KEY_FROM                                                                                                       \
	"FROM api_key k JOIN tenant t ON t.number = k.tenant"                                                          \
	" JOIN api_key_usage u ON u.key = k.number "

static void read_key(struct sql *q, void *row)
{
	struct key *key = row;
	key->number = sql_int(q);
	sql_copy_text(q, key->id, sizeof key->id);
	sql_copy_text(q, key->tenant, sizeof key->tenant);
	sql_copy_text(q, key->name, sizeof key->name);
	key->scopes = (unsigned)sql_int(q);
	key->weight = (uint32_t)sql_int(q);
	key->created_ms = sql_int(q);
	key->expires_ms = sql_int(q);
	key->revoked_ms = sql_int(q);
	key->limits.requests_per_s = sql_int(q);
	key->limits.requests_per_min = sql_int(q);
	key->limits.queued_jobs = sql_int(q);
	key->limits.stored_bytes = sql_int(q);
	key->queued_jobs = sql_int(q);
	key->stored_bytes = sql_int(q);
	key->requests = sql_int(q);
	key->last_used_ms = sql_int(q);
	key->rotated_ms = sql_int(q);
	key->overlap_until_ms = sql_int(q);
}

static enum tw_status read_one(struct sql *q, const char *name, struct key *key, struct tw_error *error)
{
	bool found = sql_step(q);
	if (found)
		read_key(q, key);
	enum tw_status status = sql_end(q, error);
	return status == TW_OK && !found ? no_such_key(name, error) : status;
}

enum tw_status key_get(struct store *store, int64_t tenant, const char *id, struct key *key, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "SELECT " KEY_COLUMNS KEY_FROM "WHERE k.id = ?2 AND (?3 = -1 OR k.tenant = ?3)");
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_text(&q, id);
	sql_bind_int(&q, tenant);
	return read_one(&q, id, key, error);
}

enum tw_status key_get_number(struct store *store, int64_t number, struct key *key, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT " KEY_COLUMNS KEY_FROM "WHERE k.number = ?2");
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, number);
	return read_one(&q, "of this number", key, error);
}

enum tw_status key_find(struct store *store, int64_t tenant, const char *name, struct key *key, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT " KEY_COLUMNS KEY_FROM
					"WHERE k.tenant = ?2 AND k.name = ?3 AND k.revoked_ms = 0");
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, tenant);
	sql_bind_text(&q, name);
	return read_one(&q, name, key, error);
}

enum tw_status key_list(struct store *store, int64_t tenant, int64_t cursor, uint32_t limit, struct key_page *page,
			struct tw_error *error)
{
	struct row_page read;
	limit = row_page_limit(limit);
	struct sql q = sql_query(store, "SELECT k.number, " KEY_COLUMNS KEY_FROM
					"WHERE (?2 = -1 OR k.tenant = ?2) AND k.number > ?3"
					" ORDER BY k.number LIMIT ?4");
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, tenant);
	sql_bind_int(&q, cursor);
	sql_bind_int(&q, limit + 1);
	enum tw_status status = row_read_page(&q, limit, sizeof *page->keys, read_key, &read, error);
	*page = (struct key_page){read.rows, read.count, read.more ? read.last : 0};
	if (status != TW_OK)
		key_page_clear(page);
	return status;
}

void key_page_clear(struct key_page *page)
{
	free(page->keys);
	*page = (struct key_page){0};
}

/* --- changing, inside a transaction ----------------------------------------------------------------------------- */

/* For daemons, which keep all keys in memory. */
static enum tw_status tell_change(struct store *store, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE access SET change = change + 1, keys_needed = 1");
	return sql_run(&q, NULL, error);
}

static enum tw_status insert_key(struct store *store, const struct key_draft *draft, const char *id, int64_t *number,
				 struct tw_error *error)
{
	int64_t inserted = 0;
	struct sql q = sql_query(
		store, "INSERT INTO api_key(id, tenant, name, scopes, weight, created_ms, expires_ms, requests_per_s,"
		       " requests_per_min, queued_jobs, stored_bytes) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"
		       " ON CONFLICT DO NOTHING");
	sql_bind_text(&q, id);
	sql_bind_int(&q, draft->tenant);
	sql_bind_text(&q, draft->name);
	sql_bind_int(&q, draft->scopes);
	sql_bind_int(&q, draft->weight ? draft->weight : 1);
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, draft->expires_ms);
	sql_bind_int(&q, draft->limits.requests_per_s);
	sql_bind_int(&q, draft->limits.requests_per_min);
	sql_bind_int(&q, draft->limits.queued_jobs);
	sql_bind_int(&q, draft->limits.stored_bytes);
	enum tw_status status = sql_run(&q, &inserted, error);
	*number = sql_inserted(store);
	if (status == TW_OK && !inserted)
		status = tw_fail(error, TW_ERROR_CONFLICT, "key-exists", NULL,
				 "the tenant has a key %s already; rotate it, revoke it, or take another name",
				 draft->name);
	return status;
}

static enum tw_status insert_usage(struct store *store, int64_t key, struct tw_error *error)
{
	struct sql q = sql_query(store, "INSERT INTO api_key_usage(key) VALUES (?)");
	sql_bind_int(&q, key);
	return sql_run(&q, NULL, error);
}

static enum tw_status insert_secret(struct store *store, int64_t key, const char *secret, struct tw_error *error)
{
	uint8_t hash[SECRET_HASH_SIZE];
	secret_hash(secret, hash);
	struct sql q = sql_query(store, "INSERT INTO api_key_secret(hash, key, created_ms) VALUES (?, ?, ?)");
	sql_bind_bytes(&q, hash, sizeof hash);
	sql_bind_int(&q, key);
	sql_bind_int(&q, store_now_ms(store));
	return sql_run(&q, NULL, error);
}

static enum tw_status create(struct store *store, const struct key_draft *draft, const char *id, const char *secret,
			     struct key *key, struct tw_error *error)
{
	int64_t number = 0;
	enum tw_status status = tenant_check(store, draft->tenant, error);
	if (status == TW_OK)
		status = insert_key(store, draft, id, &number, error);
	if (status == TW_OK)
		status = insert_usage(store, number, error);
	if (status == TW_OK)
		status = insert_secret(store, number, secret, error);
	if (status == TW_OK)
		status = tell_change(store, error);
	return status == TW_OK ? key_get(store, draft->tenant, id, key, error) : status;
}

enum tw_status key_create(struct store *store, const struct key_draft *draft, struct key *key, char secret[SECRET_SIZE],
			  struct tw_error *error)
{
	char id[STORE_ID_SIZE];
	enum tw_status status = key_check(store, draft, error);
	if (status == TW_OK)
		status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	id_random(id, "key");
	secret_make(secret);
	status = create(store, draft, id, secret, key, error);
	return transaction_end(store, status, error);
}

/* What it shows now for a while more, and nothing that it showed before that. */
static enum tw_status end_secrets(struct store *store, int64_t key, int64_t until_ms, struct tw_error *error)
{
	struct sql q = sql_query(store, "DELETE FROM api_key_secret WHERE key = ? AND (until_ms > 0 OR ? <= ?)");
	sql_bind_int(&q, key);
	sql_bind_int(&q, until_ms);
	sql_bind_int(&q, store_now_ms(store));
	enum tw_status status = sql_run(&q, NULL, error);
	if (status != TW_OK)
		return status;
	q = sql_query(store, "UPDATE api_key_secret SET until_ms = ? WHERE key = ?");
	sql_bind_int(&q, until_ms);
	sql_bind_int(&q, key);
	return sql_run(&q, NULL, error);
}

static enum tw_status rotate(struct store *store, int64_t tenant, const char *id, int64_t overlap_ms,
			     const char *secret, struct key *key, struct tw_error *error)
{
	enum tw_status status = key_get(store, tenant, id, key, error);
	if (status == TW_OK && key->revoked_ms)
		status = tw_fail(error, TW_ERROR_CONFLICT, "key-revoked", NULL,
				 "the key %s has been revoked; make a new one", key->name);
	if (status == TW_OK)
		status = end_secrets(store, key->number, store_now_ms(store) + overlap_ms, error);
	if (status == TW_OK)
		status = insert_secret(store, key->number, secret, error);
	if (status == TW_OK)
		status = tell_change(store, error);
	return status == TW_OK ? key_get(store, tenant, id, key, error) : status;
}

enum tw_status key_rotate(struct store *store, int64_t tenant, const char *id, int64_t overlap_ms, struct key *key,
			  char secret[SECRET_SIZE], struct tw_error *error)
{
	if (overlap_ms < 0 || overlap_ms > INT64_C(1000) * KEY_OVERLAP_MAX_S)
		return tw_fail(error, TW_ERROR_INPUT, "key-overlap", NULL,
			       "the secret before is good for at most %d days more", KEY_OVERLAP_MAX_S / (24 * 3600));
	enum tw_status status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	secret_make(secret);
	status = rotate(store, tenant, id, overlap_ms, secret, key, error);
	return transaction_end(store, status, error);
}

static enum tw_status revoke(struct store *store, int64_t tenant, const char *id, struct key *key,
			     struct tw_error *error)
{
	enum tw_status status = key_get(store, tenant, id, key, error);
	if (status != TW_OK || key->revoked_ms)
		return status;
	struct sql q = sql_query(store, "UPDATE api_key SET revoked_ms = ? WHERE number = ?");
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, key->number);
	status = sql_run(&q, NULL, error);
	if (status == TW_OK) {
		q = sql_query(store, "DELETE FROM api_key_secret WHERE key = ?");
		sql_bind_int(&q, key->number);
		status = sql_run(&q, NULL, error);
	}
	if (status == TW_OK)
		status = tell_change(store, error);
	return status == TW_OK ? key_get(store, tenant, id, key, error) : status;
}

enum tw_status key_revoke(struct store *store, int64_t tenant, const char *id, struct key *key, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = revoke(store, tenant, id, key, error);
	return transaction_end(store, status, error);
}

/* --- limits ----------------------------------------------------------------------------------------------------- */

static enum tw_status compare(const struct key *key, bool jobs, uint64_t bytes, struct tw_error *error)
{
	const struct key_limits *limits = &key->limits;
	if (jobs && limits->queued_jobs && key->queued_jobs >= limits->queued_jobs)
		return tw_fail(error, TW_ERROR_LIMIT, "limit-queued-jobs", NULL,
			       "your key has %lld jobs in the queue and may have %lld; wait until some have started",
			       (long long)key->queued_jobs, (long long)limits->queued_jobs);
	int64_t left = limits->stored_bytes - key->stored_bytes;
	if (limits->stored_bytes && (left <= 0 || bytes > (uint64_t)left))
		return tw_fail(
			error, TW_ERROR_LIMIT, "limit-stored-bytes", NULL,
			"your key stores %lld bytes, with what has come of this, and may store %lld; this needs at "
			"least %llu more; delete what you do not need any more",
			(long long)key->stored_bytes, (long long)limits->stored_bytes,
			(unsigned long long)(bytes ? bytes : 1));
	return TW_OK;
}

enum tw_status key_check_limits(struct store *store, int64_t client, bool jobs, uint64_t bytes, struct tw_error *error)
{
	struct key key = {0};
	if (client <= 0)
		return TW_OK;
	struct sql q = sql_query(store, "SELECT k.queued_jobs, k.stored_bytes, " QUEUED_JOBS ", u.stored_bytes"
					" FROM api_key k JOIN api_key_usage u ON u.key = k.number WHERE k.number = ?");
	sql_bind_int(&q, client);
	if (sql_step(&q)) {
		key.limits.queued_jobs = sql_int(&q);
		key.limits.stored_bytes = sql_int(&q);
		key.queued_jobs = sql_int(&q);
		key.stored_bytes = sql_int(&q);
	}
	enum tw_status status = sql_end(&q, error);
	return status == TW_OK ? compare(&key, jobs, bytes, error) : status;
}
