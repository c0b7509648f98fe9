#include "storage/tenant.h"

#include "storage/chunk.h"
#include "storage/lane.h"
#include "storage/remove.h"
#include "storage/sql.h"

#include <sodium.h>
#include <string.h>

enum {
	SALT_BYTES = 16,
	STEP_ROWS = 32, /* removed at once: a write lock of some milliseconds */
};

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

enum tw_status tenant_list(struct store *store, int64_t after, struct tenant *tenants, size_t limit, size_t *count,
			   struct tw_error *error)
{
	*count = 0;
	struct sql q =
		sql_query(store, "SELECT t.number, coalesce(t.name, ''), t.created_ms, (SELECT count(*) FROM api_key k"
				 " WHERE k.tenant = t.number AND k.revoked_ms = 0) FROM tenant t"
				 " WHERE t.number > ? ORDER BY t.number LIMIT ?");
	sql_bind_int(&q, after);
	sql_bind_int(&q, (int64_t)limit);
	while (sql_step(&q)) {
		struct tenant *tenant = &tenants[(*count)++];
		tenant->number = sql_int(&q);
		sql_copy_text(&q, tenant->name, sizeof tenant->name);
		tenant->created_ms = sql_int(&q);
		tenant->keys = sql_int(&q);
	}
	return sql_end(&q, error);
}

static enum tw_status fail_deleted(struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-tenant", NULL, "the tenant has been deleted");
}

enum tw_status tenant_name(struct store *store, int64_t number, char name[TENANT_NAME_SIZE], struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT name FROM tenant WHERE number = ? AND name IS NOT NULL");
	sql_bind_int(&q, number);
	bool found = sql_step(&q);
	if (found)
		sql_copy_text(&q, name, TENANT_NAME_SIZE);
	enum tw_status status = sql_end(&q, error);
	return status == TW_OK && !found ? fail_deleted(error) : status;
}

enum tw_status tenant_check(struct store *store, int64_t tenant, struct tw_error *error)
{
	char name[TENANT_NAME_SIZE];
	return tenant_name(store, tenant, name, error);
}

/* --- deleting --------------------------------------------------------------------------------------------------- */

static enum tw_status take_name(struct store *store, const char *name, struct tw_error *error)
{
	int64_t taken = 0, number = 0;
	struct sql q = sql_query(store, "UPDATE tenant SET name = NULL WHERE name = ?");
	sql_bind_text(&q, name);
	enum tw_status status = sql_run(&q, &taken, error);
	if (status == TW_OK && !taken)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-tenant", NULL, "there is no tenant %.64s", name);
	if (status == TW_OK && !strcmp(name, "default"))
		status = insert(store, name, &number, error);
	if (status != TW_OK)
		return status;
	q = sql_query(store, "UPDATE access SET change = change + 1");
	return sql_run(&q, NULL, error);
}

enum tw_status tenant_delete(struct store *store, const char *name, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = take_name(store, name, error);
	return transaction_end(store, status, error);
}

static enum tw_status remove_job(struct store *store, int64_t job, struct tw_error *error)
{
	enum tw_status status = lane_leave(store, job, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, "DELETE FROM job WHERE number = ?");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

/* Removes each of some rows that the tenant has; *removed: how many there were. */
static enum tw_status remove_rows(struct store *store, const char *select,
				  enum tw_status (*remove)(struct store *, int64_t, struct tw_error *), int64_t tenant,
				  int64_t *removed, struct tw_error *error)
{
	int64_t numbers[STEP_ROWS];
	*removed = 0;
	struct sql q = sql_query(store, select);
	sql_bind_int(&q, tenant);
	sql_bind_int(&q, STEP_ROWS);
	while (sql_step(&q))
		numbers[(*removed)++] = sql_int(&q);
	enum tw_status status = sql_end(&q, error);
	for (int64_t i = 0; status == TW_OK && i < *removed; i++)
		status = remove(store, numbers[i], error);
	return status;
}

/* The newest first: nothing is made from them that is still there. */
static enum tw_status remove_resources(struct store *store, int64_t tenant, int64_t *removed, struct tw_error *error)
{
	return remove_rows(store, "SELECT number FROM resource WHERE tenant = ? ORDER BY number DESC LIMIT ?",
			   resource_remove, tenant, removed, error);
}

/* Those that made no resource. */
static enum tw_status remove_jobs(struct store *store, int64_t tenant, int64_t *removed, struct tw_error *error)
{
	return remove_rows(store, "SELECT number FROM job WHERE tenant = ? LIMIT ?", remove_job, tenant, removed,
			   error);
}

static enum tw_status let_go_of_uploads(struct store *store, int64_t tenant, int64_t *removed, struct tw_error *error)
{
	struct sql q = sql_query(store, CHUNK_LET_GO " WHERE number IN (SELECT number FROM blob WHERE tenant = ?"
						     " AND upload IS NOT NULL AND resource IS NULL LIMIT ?)");
	sql_bind_int(&q, tenant);
	sql_bind_int(&q, STEP_ROWS);
	return sql_run(&q, removed, error);
}

/* What has few rows a tenant, and nothing but the tenant's own. */
static enum tw_status remove_rest(struct store *store, int64_t tenant, int64_t *removed, struct tw_error *error)
{
	static const char *const texts[] = {
		"DELETE FROM turn WHERE share IN (SELECT number FROM share WHERE tenant = ?)",
		"DELETE FROM share WHERE tenant = ?",
		"DELETE FROM job_group WHERE tenant = ?",
		"DELETE FROM job_count WHERE tenant = ?",
		"DELETE FROM api_key WHERE tenant = ?",
		"DELETE FROM tenant WHERE number = ?"};
	enum tw_status status = TW_OK;
	for (size_t i = 0; status == TW_OK && i < sizeof texts / sizeof *texts; i++) {
		struct sql q = sql_query(store, texts[i]);
		sql_bind_int(&q, tenant);
		status = sql_run(&q, removed, error);
	}
	return status;
}

static enum tw_status remove_some(struct store *store, int64_t tenant, struct tw_error *error)
{
	static enum tw_status (*const parts[])(struct store * store, int64_t tenant, int64_t * removed,
					       struct tw_error * error) = {remove_resources, remove_jobs,
									   let_go_of_uploads, remove_rest};
	enum tw_status status = TW_OK;
	int64_t removed = 0;
	for (size_t i = 0; status == TW_OK && !removed && i < sizeof parts / sizeof *parts; i++)
		status = parts[i](store, tenant, &removed, error);
	return status;
}

enum tw_status tenant_sweep(struct store *store, bool *more, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number FROM tenant WHERE name IS NULL ORDER BY number LIMIT 1");
	*more = sql_step(&q);
	int64_t tenant = *more ? sql_int(&q) : 0;
	enum tw_status status = sql_end(&q, error);
	if (status == TW_OK && *more)
		status = transaction_begin_alone(store, error);
	if (status != TW_OK || !*more)
		return status;
	status = remove_some(store, tenant, error);
	return transaction_end(store, status, error);
}
