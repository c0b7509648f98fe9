#include "storage/tenant.h"

#include "storage/sql.h"

#include <sodium.h>
#include <string.h>

enum { SALT_BYTES = 16 };

static enum tw_status check_name(const char *name, struct tw_error *error)
{
	static const char letters[] = "abcdefghijklmnopqrstuvwxyz0123456789-_.";
	size_t length = strlen(name);
	if (length && length < TENANT_NAME_SIZE && strspn(name, letters) == length && !strchr("-_.", name[0]))
		return TW_OK;
	return tw_fail(error, TW_ERROR_INPUT, "tenant-name", NULL,
		       "a tenant's name has 1 to %d of a-z 0-9 - _ . and begins with a letter or digit",
		       TENANT_NAME_SIZE - 1);
}

static enum tw_status insert(struct store *store, const char *name, int64_t *number, struct tw_error *error)
{
	int64_t inserted = 0;
	uint8_t salt[SALT_BYTES];
	randombytes_buf(salt, sizeof salt);
	struct sql q = sql_query(store, "INSERT INTO tenant(name, salt, created_ms) VALUES (?, ?, ?)"
					" ON CONFLICT DO NOTHING");
	sql_bind_text(&q, name);
	sql_bind_bytes(&q, salt, sizeof salt);
	sql_bind_int(&q, store_now_ms(store));
	enum tw_status status = sql_run(&q, &inserted, error);
	*number = sql_inserted(store);
	if (status == TW_OK && !inserted)
		status = tw_fail(error, TW_ERROR_CONFLICT, "tenant-exists", NULL, "there is a tenant %s already", name);
	return status;
}

enum tw_status tenant_create(struct store *store, const char *name, int64_t *number, struct tw_error *error)
{
	enum tw_status status = check_name(name, error);
	if (status == TW_OK)
		status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = insert(store, name, number, error);
	return transaction_end(store, status, error);
}

enum tw_status tenant_find(struct store *store, const char *name, int64_t *number, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number FROM tenant WHERE name = ?");
	sql_bind_text(&q, name);
	bool found = sql_step(&q);
	*number = found ? sql_int(&q) : 0;
	enum tw_status status = sql_end(&q, error);
	if (status == TW_OK && !found)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-tenant", NULL, "there is no tenant %.64s", name);
	return status;
}
