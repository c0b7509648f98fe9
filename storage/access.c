#include "storage/access.h"

#include "storage/sql.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>

enum tw_status access_change(struct store *store, int64_t *change, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT change FROM access");
	*change = sql_step(&q) ? sql_int(&q) : 0;
	return sql_end(&q, error);
}

static void read_veil(struct sql *q, uint8_t veil[ACCESS_VEIL_SIZE])
{
	static const uint8_t purpose[16] = "cursors";
	size_t size = 0;
	const void *salt = sql_bytes(q, &size);
	crypto_generichash(veil, ACCESS_VEIL_SIZE, salt, size, purpose, sizeof purpose);
}

static enum tw_status read_state(struct store *store, struct access *access, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT change, keys_needed, t.number, t.salt FROM access, tenant t"
					" WHERE t.name = 'default'");
	if (sql_step(&q)) {
		access->change = sql_int(&q);
		access->keys_needed = sql_int(&q);
		access->default_tenant = sql_int(&q);
		read_veil(&q, access->default_veil);
	}
	return sql_end(&q, error);
}

/* The earlier of two ends, 0 being none. */
static int64_t earlier(int64_t a, int64_t b)
{
	return !a || (b && b < a) ? b : a;
}

static void read_key(struct sql *q, struct access_key *key)
{
	size_t size = 0;
	*key = (struct access_key){0};
	const void *hash = sql_bytes(q, &size);
	if (size == sizeof key->hash)
		memcpy(key->hash, hash, size);
	key->owner.tenant = sql_int(q);
	key->owner.client = sql_int(q);
	read_veil(q, key->veil);
	key->scopes = (unsigned)sql_int(q);
	key->weight = (uint32_t)sql_int(q);
	int64_t expires_ms = sql_int(q);
	key->until_ms = earlier(expires_ms, sql_int(q));
	key->limits.requests_per_s = sql_int(q);
	key->limits.requests_per_min = sql_int(q);
	key->limits.queued_jobs = sql_int(q);
	key->limits.stored_bytes = sql_int(q);
	sql_copy_text(q, key->tenant, sizeof key->tenant);
	sql_copy_text(q, key->name, sizeof key->name);
}

static enum tw_status read_keys(struct store *store, struct access *access, struct tw_error *error)
{
	size_t room = 0;
	struct sql q = sql_query(
		store,
		"SELECT secret.hash, k.tenant, k.number, t.salt, k.scopes, k.weight, k.expires_ms, secret.until_ms,"
		" k.requests_per_s, k.requests_per_min, k.queued_jobs, k.stored_bytes, t.name, k.name"
		" FROM api_key_secret secret JOIN api_key k ON k.number = secret.key"
		" JOIN tenant t ON t.number = k.tenant"
		" WHERE k.revoked_ms = 0 AND t.name IS NOT NULL ORDER BY secret.hash");
	while (sql_step(&q)) {
		if (access->count == room) {
			room = room ? 2 * room : 16;
			void *more = realloc(access->keys, room * sizeof *access->keys);
			if (!more) {
				q.code = SQLITE_NOMEM;
				break;
			}
			access->keys = more;
		}
		read_key(&q, &access->keys[access->count++]);
	}
	return sql_end(&q, error);
}

enum tw_status access_read(struct store *store, struct access *access, struct tw_error *error)
{
	*access = (struct access){0};
	enum tw_status status = snapshot_begin(store, error);
	if (status != TW_OK)
		return status;
	status = read_state(store, access, error);
	if (status == TW_OK)
		status = read_keys(store, access, error);
	status = transaction_end(store, status, error);
	if (status != TW_OK)
		access_clear(access);
	return status;
}

void access_clear(struct access *access)
{
	free(access->keys);
	*access = (struct access){0};
}

static enum tw_status add_use(struct store *store, const struct access_use *use, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE api_key_usage SET requests = requests + ?1,"
					" last_used_ms = CASE WHEN ?2 > last_used_ms THEN ?2 ELSE last_used_ms END"
					" WHERE key = ?3");
	sql_bind_int(&q, use->requests);
	sql_bind_int(&q, use->last_ms);
	sql_bind_int(&q, use->client);
	return sql_run(&q, NULL, error);
}

enum tw_status access_add_uses(struct store *store, const struct access_use *uses, size_t count, struct tw_error *error)
{
	enum tw_status status = count ? transaction_begin(store, false, error) : TW_OK;
	if (!count || status != TW_OK)
		return status;
	for (size_t i = 0; status == TW_OK && i < count; i++)
		status = add_use(store, &uses[i], error);
	return transaction_end(store, status, error);
}
