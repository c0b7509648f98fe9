/* Opening, closing and caring for the database file.
 *
 * WAL, because readers (the daemon) must not wait for writers (the workers). Pages of 8 KiB, because most of the file
 * is chunks of a megabyte. Incremental vacuum, so that a deleted suit gives its space back without a stop. Deleted
 * pages are not overwritten with zeros, as Debian's SQLite does unless told otherwise: it would write a large upload
 * once more when it goes. */
#include "storage/chunk.h"
#include "storage/schema.h"
#include "storage/sql.h"

#include <errno.h>
#include <inttypes.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum {
	PAGE_BYTES = 8192,
	RESERVE_BYTES = 32 << 20,
	BUSY_TIMEOUT_MS = 10000,
	SHRINK_PAGES = 4096, /* freed to the file system at once: 32 MiB, a short write lock */
};

/* What a URL says. */
struct target {
	char path[4096];
	uint64_t limit_bytes; /* 0: none */
	uint64_t reserve_bytes;
};

/* "KEY=N" at *query, which then stands behind it and a "&" that follows. */
static bool parse_number(const char **query, const char *key, uint64_t *number)
{
	size_t length = strlen(key);
	const char *text = *query + length + 1;
	char *end = NULL;
	if (strncmp(*query, key, length) != 0 || (*query)[length] != '=' || *text < '0' || *text > '9')
		return false;
	errno = 0;
	*number = strtoull(text, &end, 10);
	if (errno || (*end && (*end != '&' || !end[1])))
		return false;
	*query = *end ? end + 1 : end;
	return true;
}

static bool parse_query(const char *query, struct target *target)
{
	bool understood = *query;
	while (understood && *query)
		understood = (parse_number(&query, "limit_bytes", &target->limit_bytes) &&
			      target->limit_bytes >= PAGE_BYTES) ||
			     parse_number(&query, "reserve_bytes", &target->reserve_bytes);
	return understood;
}

static enum tw_status parse_url(const char *url, struct target *target, struct tw_error *error)
{
	static const char scheme[] = "sqlite:";
	const char *path = url + sizeof scheme - 1;
	const char *query = strchr(url, '?');
	bool known = !strncmp(url, scheme, sizeof scheme - 1);
	size_t size = known ? (query ? (size_t)(query - path) : strlen(path)) : 0;
	target->limit_bytes = 0;
	target->reserve_bytes = RESERVE_BYTES;
	if (!known || size == 0 || size >= sizeof target->path || (query && !parse_query(query + 1, target)))
		return tw_fail(error, TW_ERROR_INPUT, "store-url", NULL,
			       "the store \"%.200s\" is not understood; write sqlite:PATH, or "
			       "sqlite:PATH?limit_bytes=N&reserve_bytes=N",
			       url);
	memcpy(target->path, path, size);
	target->path[size] = '\0';
	return TW_OK;
}

static int64_t wall_clock_ms(void *context)
{
	(void)context;
	struct timespec now;
	clock_gettime(CLOCK_REALTIME, &now);
	return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

int64_t store_now_ms(const struct store *store)
{
	return store->now_ms(store->clock_context);
}

void store_set_clock(struct store *store, int64_t (*now_ms)(void *context), void *context)
{
	store->now_ms = now_ms ? now_ms : wall_clock_ms;
	store->clock_context = context;
}

/* Turning a new database to WAL needs it exclusively, and SQLite does not wait for that by itself. */
static int set_up(sqlite3 *db, uint64_t limit_bytes)
{
	char text[512];
	snprintf(text, sizeof text,
		 "PRAGMA page_size = %d; PRAGMA auto_vacuum = INCREMENTAL; PRAGMA journal_mode = WAL;"
		 "PRAGMA secure_delete = FAST; PRAGMA foreign_keys = ON; PRAGMA trusted_schema = OFF; PRAGMA "
		 "synchronous = FULL;"
		 "PRAGMA temp_store = MEMORY; PRAGMA cache_size = -4096; PRAGMA journal_size_limit = 67108864;"
		 "PRAGMA max_page_count = %" PRIu64,
		 PAGE_BYTES, limit_bytes ? limit_bytes / PAGE_BYTES : UINT64_C(4294967294));
	int code = SQLITE_BUSY;
	for (int waited_ms = 0; code == SQLITE_BUSY && waited_ms < BUSY_TIMEOUT_MS; waited_ms += 5) {
		code = sqlite3_exec(db, text, NULL, NULL, NULL);
		if (code == SQLITE_BUSY)
			sqlite3_sleep(5);
	}
	return code;
}

static enum tw_status open_database(struct store *store, const struct target *target, struct tw_error *error)
{
	int code = sqlite3_open_v2(
		target->path, &store->db,
		SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE, NULL);
	if (code != SQLITE_OK)
		return tw_fail(error, TW_ERROR_IO, "store-io", NULL, "the store %.200s cannot be opened: %s",
			       target->path, store->db ? sqlite3_errmsg(store->db) : sqlite3_errstr(code));
	sqlite3_busy_timeout(store->db, BUSY_TIMEOUT_MS);
	sqlite3_db_config(store->db, SQLITE_DBCONFIG_DEFENSIVE, 1, NULL);
	enum tw_status status = schema_check_owner(store->db, error);
	if (status != TW_OK)
		return status;
	code = set_up(store->db, target->limit_bytes);
	if (code != SQLITE_OK)
		return sql_fail(store->db, code, error);
	store->durable = true;
	store->reserve_bytes = target->reserve_bytes;
	return schema_migrate(store->db, SCHEMA_VERSION, error);
}

static enum tw_status open_target(struct store **store, const struct target *target, struct tw_error *error)
{
	if (sodium_init() < 0)
		return tw_fail(error, TW_ERROR_INTERNAL, "no-randomness", NULL, "libsodium cannot be initialised");
	struct store *opened = calloc(1, sizeof *opened);
	if (!opened)
		return tw_fail_memory(error);
	store_set_clock(opened, NULL, NULL);
	enum tw_status status = open_database(opened, target, error);
	if (status == TW_OK)
		*store = opened;
	else
		store_close(opened);
	return status;
}

enum tw_status store_open(struct store **store, const char *url, struct tw_error *error)
{
	struct target target;
	enum tw_status status = parse_url(url, &target, error);
	return status == TW_OK ? open_target(store, &target, error) : status;
}

enum tw_status store_open_existing(struct store **store, const char *url, struct tw_error *error)
{
	struct target target;
	enum tw_status status = parse_url(url, &target, error);
	if (status == TW_OK && access(target.path, F_OK) != 0)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-store", NULL, "there is no store %.200s",
				 target.path);
	return status == TW_OK ? open_target(store, &target, error) : status;
}

void store_close(struct store *store)
{
	if (!store)
		return;
	for (int i = 0; i < store->statement_count; i++)
		sqlite3_finalize(store->statements[i].statement);
	sqlite3_close(store->db);
	free(store);
}

enum tw_status store_ping(struct store *store, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT value FROM change");
	return sql_run(&q, NULL, error);
}

enum tw_status store_sweep(struct store *store, int64_t upload_age_ms, bool *more, struct tw_error *error)
{
	return chunk_sweep(store, store_now_ms(store) - upload_age_ms, more, error);
}

enum tw_status store_shrink(struct store *store, struct tw_error *error)
{
	char text[64];
	snprintf(text, sizeof text, "PRAGMA incremental_vacuum(%d)", SHRINK_PAGES);
	int code = sqlite3_exec(store->db, text, NULL, NULL, NULL);
	return code == SQLITE_OK ? TW_OK : sql_fail(store->db, code, error);
}

static enum tw_status copy_to(struct store *store, sqlite3 *copy, struct tw_error *error)
{
	sqlite3_backup *backup = sqlite3_backup_init(copy, "main", store->db, "main");
	if (!backup)
		return sql_fail(copy, sqlite3_errcode(copy), error);
	/* All in one step: a backup in parts starts over with every write of another process. WAL keeps writers going.
	 */
	int code = sqlite3_backup_step(backup, -1);
	int finished = sqlite3_backup_finish(backup);
	if (code == SQLITE_DONE)
		code = finished;
	return code == SQLITE_OK ? TW_OK : sql_fail(copy, code, error);
}

enum tw_status store_backup(struct store *store, const char *path, struct tw_error *error)
{
	if (access(path, F_OK) == 0)
		return tw_fail(error, TW_ERROR_CONFLICT, "backup-exists", NULL,
			       "%.200s is there already; name a new file for the backup", path);
	sqlite3 *copy = NULL;
	int code = sqlite3_open_v2(path, &copy, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, NULL);
	enum tw_status status = code == SQLITE_OK ? copy_to(store, copy, error)
						  : tw_fail(error, TW_ERROR_IO, "backup-io", NULL,
							    "%.200s cannot be written: %s", path, sqlite3_errstr(code));
	sqlite3_close(copy);
	if (status != TW_OK)
		unlink(path);
	return status;
}
