/* Opening, closing and caring for the store. */
#include "storage/store.h"

#include "storage/schema.h"
#include "storage/sql.h"
#include "storage/writer.h"

#include <errno.h>
#include <inttypes.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum {
	RESERVE_BYTES = 32 << 20,
	BOOT_ID_SIZE = 64,
	BOOT_SHIFT = 40,
	SHRINK_STEPS = 16, /* of 256 pages each: 32 MiB, in steps for which nobody waits long */
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
			      target->limit_bytes >= CONNECTION_PAGE_BYTES) ||
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
	if (!strcmp(target->path, ":memory:"))
		return tw_fail(error, TW_ERROR_INPUT, "store-url", NULL,
			       "a store in memory cannot be shared by the processes that work on it; name a file");
	return TW_OK;
}

static int64_t clock_ms(clockid_t clock)
{
	struct timespec now;
	clock_gettime(clock, &now);
	return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

int64_t store_now_ms(const struct store *store)
{
	return store->now_ms ? store->now_ms(store->clock_context) : clock_ms(CLOCK_REALTIME);
}

/* The number of the boot in the upper bits: 34 years of uptime fit into the lower ones. */
int64_t store_lease_now_ms(const struct store *store)
{
	return store->now_ms ? store->now_ms(store->clock_context)
			     : (store->boot << BOOT_SHIFT) + clock_ms(CLOCK_BOOTTIME);
}

bool store_is_of_older_boot(const struct store *store, int64_t lease_ms)
{
	return lease_ms >> BOOT_SHIFT < store_lease_now_ms(store) >> BOOT_SHIFT;
}

void store_set_clock(struct store *store, int64_t (*now_ms)(void *context), void *context)
{
	store->now_ms = now_ms;
	store->clock_context = context;
}

static void read_boot_id(char id[BOOT_ID_SIZE])
{
	id[0] = '\0';
	FILE *file = fopen("/proc/sys/kernel/random/boot_id", "re");
	if (file && fgets(id, BOOT_ID_SIZE, file))
		id[strcspn(id, "\n")] = '\0';
	if (file)
		fclose(file);
}

static enum tw_status read_boot(struct store *store, const char *id, bool *same, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number, id = ? FROM boot");
	sql_bind_text(&q, id);
	*same = false;
	if (sql_step(&q)) {
		store->boot = sql_int(&q);
		*same = sql_int(&q);
	}
	return sql_end(&q, error);
}

static enum tw_status note_boot(struct store *store, const char *id, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, "UPDATE boot SET number = number + 1, id = ?1 WHERE id <> ?1");
	sql_bind_text(&q, id);
	status = sql_run(&q, NULL, error);
	return transaction_end(store, status, error);
}

/* Where it cannot be written down (the disk is full), the next to open the store does it, and finds the same number. */
static enum tw_status take_up_boot(struct store *store, struct tw_error *error)
{
	char id[BOOT_ID_SIZE];
	bool same = false;
	read_boot_id(id);
	enum tw_status status = read_boot(store, id, &same, error);
	if (status != TW_OK || same || !id[0])
		return status;
	if (note_boot(store, id, NULL) == TW_OK)
		return read_boot(store, id, &same, error);
	store->boot++;
	return TW_OK;
}

/* The file is migrated through the connection for reading, before anybody else uses it. */
static enum tw_status open_database(struct store *store, const struct target *target, struct tw_error *error)
{
	enum tw_status status = connection_open(&store->reads, target->path, error);
	if (status == TW_OK)
		status = schema_check_owner(store->reads.db, error);
	if (status == TW_OK)
		status = connection_set_up(&store->reads, target->limit_bytes, error);
	if (status == TW_OK)
		status = schema_migrate(store->reads.db, SCHEMA_VERSION, error);
	if (status != TW_OK)
		return status;
	store->connection = &store->reads;
	store->reserve_bytes = target->reserve_bytes;
	int code = sqlite3_exec(store->reads.db, "PRAGMA query_only = ON", NULL, NULL, NULL);
	if (code != SQLITE_OK)
		return connection_fail(store->reads.db, code, error);
	status = writer_open(&store->writer, target->path, target->limit_bytes, error);
	return status == TW_OK ? take_up_boot(store, error) : status;
}

static enum tw_status open_target(struct store **store, const struct target *target, struct tw_error *error)
{
	if (sodium_init() < 0)
		return tw_fail(error, TW_ERROR_INTERNAL, "no-randomness", NULL, "libsodium cannot be initialised");
	struct store *opened = calloc(1, sizeof *opened);
	if (!opened)
		return tw_fail_memory(error);
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
	writer_close(store->writer);
	connection_close(&store->reads);
	free(store);
}

struct store_place store_place(const struct store *store)
{
	struct store_place place;
	writer_place(store->writer, &place.device, &place.file);
	return place;
}

enum tw_status store_check_place(struct store *store, struct tw_error *error)
{
	return connection_check_place(&store->reads, error);
}

enum tw_status store_ping(struct store *store, struct tw_error *error)
{
	enum tw_status status = connection_check_place(&store->reads, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, "SELECT value FROM change");
	return sql_run(&q, NULL, error);
}

enum tw_status store_room(struct store *store, uint64_t *bytes, struct tw_error *error)
{
	return sql_room(store, bytes, error);
}

void store_count_writes(struct store *store, struct store_writes *writes)
{
	struct writer_counts counts;
	writer_count(store->writer, &counts);
	*writes = (struct store_writes){counts.transactions, counts.groups, counts.syncs};
}

static enum tw_status shrink_a_little(struct store *store, struct tw_error *error)
{
	enum tw_status status = transaction_begin_alone(store, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, "PRAGMA incremental_vacuum(256)");
	status = sql_run(&q, NULL, error);
	return transaction_end(store, status, error);
}

enum tw_status store_shrink(struct store *store, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	int64_t free_pages = 1;
	for (int i = 0; status == TW_OK && free_pages && i < SHRINK_STEPS; i++) {
		struct sql q = sql_query(store, "PRAGMA freelist_count");
		free_pages = sql_step(&q) ? sql_int(&q) : 0;
		status = sql_end(&q, error);
		if (status == TW_OK && free_pages)
			status = shrink_a_little(store, error);
	}
	return status;
}

static enum tw_status copy_to(struct store *store, sqlite3 *copy, struct tw_error *error)
{
	sqlite3_backup *backup = sqlite3_backup_init(copy, "main", store->reads.db, "main");
	if (!backup)
		return connection_fail(copy, sqlite3_errcode(copy), error);
	/* All in one step: a backup in parts starts over with every write of another process. WAL keeps writers going.
	 */
	int code = sqlite3_backup_step(backup, -1);
	int finished = sqlite3_backup_finish(backup);
	if (code == SQLITE_DONE)
		code = finished;
	return code == SQLITE_OK ? TW_OK : connection_fail(copy, code, error);
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
