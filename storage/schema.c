/* What the database looks like, and how an older one becomes that.
 *
 * Numbers (INTEGER PRIMARY KEY AUTOINCREMENT, so never used twice) order rows by age and are what pages and readers
 * hold; ids (TEXT) are what clients see. Enumerations are kept as the integers of the headers; a released migration
 * has them as numbers, because it must go on meaning what it meant. Times are milliseconds. */
#include "storage/schema.h"

#include "storage/connection.h"
#include "storage/schema_parts.h"

#include <stdbool.h>

static const char resources_and_queue[] =
	"CREATE TABLE resource("
	"	number INTEGER PRIMARY KEY AUTOINCREMENT,"
	"	id TEXT NOT NULL UNIQUE,"
	"	kind INTEGER NOT NULL," /* enum resource_kind */
	"	name TEXT NOT NULL,"
	"	options TEXT NOT NULL,"
	"	summary TEXT,"
	"	created_ms INTEGER NOT NULL"
	") STRICT;"
	"CREATE INDEX resource_by_kind ON resource(kind, number);"

	/* What a resource is made from. No action on delete: it is refused while something needs it. */
	"CREATE TABLE need("
	"	resource INTEGER NOT NULL REFERENCES resource ON DELETE CASCADE,"
	"	position INTEGER NOT NULL,"
	"	needed INTEGER NOT NULL REFERENCES resource,"
	"	PRIMARY KEY (resource, position)"
	") STRICT, WITHOUT ROWID;"
	"CREATE INDEX need_by_needed ON need(needed, resource);"

	"CREATE TABLE idempotency("
	"	kind INTEGER NOT NULL,"
	"	key TEXT NOT NULL,"
	"	fingerprint BLOB NOT NULL," /* hash of the whole request */
	"	resource INTEGER NOT NULL REFERENCES resource ON DELETE CASCADE,"
	"	PRIMARY KEY (kind, key)"
	") STRICT, WITHOUT ROWID;"
	"CREATE INDEX idempotency_by_resource ON idempotency(resource);"

	"CREATE TABLE job("
	"	number INTEGER PRIMARY KEY AUTOINCREMENT,"
	"	id TEXT NOT NULL UNIQUE,"
	"	resource INTEGER NOT NULL UNIQUE REFERENCES resource ON DELETE CASCADE,"
	"	kind INTEGER NOT NULL,"
	"	state INTEGER NOT NULL DEFAULT 0 CHECK (state BETWEEN 0 AND 4)," /* enum job_state */
	"	priority INTEGER NOT NULL DEFAULT 0,"
	"	waiting_for INTEGER NOT NULL DEFAULT 0 CHECK (waiting_for >= 0)," /* needs that have not succeeded */
	"	attempts INTEGER NOT NULL DEFAULT 0,"
	"	attempts_max INTEGER NOT NULL,"
	"	fence INTEGER NOT NULL DEFAULT 0," /* grows with every claim */
	"	not_before_ms INTEGER NOT NULL DEFAULT 0,"
	"	lease_until_ms INTEGER NOT NULL DEFAULT 0,"
	"	worker TEXT NOT NULL DEFAULT '',"
	"	cancel_requested INTEGER NOT NULL DEFAULT 0,"
	"	progress REAL NOT NULL DEFAULT 0,"
	"	stage TEXT NOT NULL DEFAULT '',"
	"	partial TEXT,"
	"	failure_status INTEGER NOT NULL DEFAULT 0," /* enum tw_status */
	"	failure_type TEXT NOT NULL DEFAULT '',"
	"	failure_where TEXT NOT NULL DEFAULT '',"
	"	failure_text TEXT NOT NULL DEFAULT '',"
	"	created_ms INTEGER NOT NULL,"
	"	started_ms INTEGER NOT NULL DEFAULT 0,"
	"	finished_ms INTEGER NOT NULL DEFAULT 0,"
	"	change INTEGER NOT NULL DEFAULT 0"
	") STRICT;"
	"CREATE INDEX job_claimable ON job(priority DESC, number) WHERE state = 0 AND waiting_for = 0;"
	"CREATE INDEX job_leased ON job(lease_until_ms) WHERE state = 1;"
	"CREATE INDEX job_by_state ON job(state);"
	"CREATE UNIQUE INDEX job_by_change ON job(change);"

	/* Counts changes of jobs; a counter of its own, because the job with the highest change may be deleted. */
	"CREATE TABLE change(only INTEGER PRIMARY KEY CHECK (only = 1), value INTEGER NOT NULL) STRICT;"
	"INSERT INTO change VALUES (1, 0);"
	"CREATE TRIGGER job_added AFTER INSERT ON job BEGIN"
	"	UPDATE change SET value = value + 1;"
	"	UPDATE job SET change = (SELECT value FROM change) WHERE number = NEW.number;"
	" END;"
	"CREATE TRIGGER job_changed AFTER UPDATE OF state, cancel_requested, progress, stage, partial ON job"
	" WHEN OLD.state <> NEW.state OR OLD.cancel_requested <> NEW.cancel_requested OR OLD.progress <> NEW.progress"
	"   OR OLD.stage <> NEW.stage OR OLD.partial IS NOT NEW.partial BEGIN"
	"	UPDATE change SET value = value + 1;"
	"	UPDATE job SET change = (SELECT value FROM change) WHERE number = NEW.number;"
	" END;"

	"CREATE TABLE blob("
	"	number INTEGER PRIMARY KEY AUTOINCREMENT,"
	"	resource INTEGER REFERENCES resource ON DELETE CASCADE," /* NULL: an upload that nothing uses yet, or
									    let go */
	"	upload TEXT UNIQUE,"    /* id of an upload; NULL for arrays and artifacts, and when let go */
	"	role INTEGER NOT NULL," /* enum blob_role */
	"	name TEXT NOT NULL,"
	"	file_name TEXT NOT NULL DEFAULT '',"
	"	media_type TEXT NOT NULL DEFAULT '',"
	"	type INTEGER NOT NULL DEFAULT 0," /* enum tw_type; type, columns and rows of an array */
	"	columns INTEGER NOT NULL DEFAULT 0,"
	"	rows INTEGER NOT NULL DEFAULT 0,"
	"	size INTEGER NOT NULL DEFAULT 0,"
	"	hash BLOB," /* BLAKE2b-256 of all bytes; NULL while it is being written */
	"	touched_ms INTEGER NOT NULL,"
	"	UNIQUE (resource, role, name)"
	") STRICT;"
	"CREATE INDEX blob_unused ON blob(touched_ms) WHERE resource IS NULL;"

	/* Every chunk but the last of a blob has BLOB_CHUNK bytes. */
	"CREATE TABLE chunk("
	"	number INTEGER PRIMARY KEY,"
	"	blob INTEGER NOT NULL REFERENCES blob ON DELETE CASCADE,"
	"	position INTEGER NOT NULL,"
	"	bytes BLOB NOT NULL,"
	"	UNIQUE (blob, position)"
	") STRICT;";

static const char rig[] = "CREATE TABLE rig("
			  "	only INTEGER PRIMARY KEY CHECK (only = 1),"
			  "	device TEXT NOT NULL,"
			  "	status TEXT NOT NULL,"
			  "	text TEXT NOT NULL,"
			  "	updated_ms INTEGER NOT NULL,"
			  "	sample BLOB" /* as in recording_chunk */
			  ") STRICT;"

			  /* Samples in the order in which they were taken, 8 + 2 * 24 bytes each, little-endian. */
			  "CREATE TABLE recording_chunk("
			  "	resource INTEGER NOT NULL REFERENCES resource ON DELETE CASCADE,"
			  "	first INTEGER NOT NULL," /* number of its first sample */
			  "	count INTEGER NOT NULL,"
			  "	samples BLOB NOT NULL,"
			  "	PRIMARY KEY (resource, first)"
			  ") STRICT;";

/* How far the hash of an unfinished upload is; see upload.c. */
static const char upload_hash_state[] = "ALTER TABLE blob ADD COLUMN hash_state BLOB;";

/* Who owns a resource, and which computation made it (1: that of 0.1.0); jobs without a resource, and jobs that end as
 * incomplete. SQLite cannot change a constraint, so tables are made anew and keep their numbers. */
static const char kinds[] =
	"ALTER TABLE resource ADD COLUMN tenant TEXT NOT NULL DEFAULT 'default';"
	"ALTER TABLE resource ADD COLUMN version INTEGER NOT NULL DEFAULT 1;"

	"CREATE TABLE new_idempotency("
	"	tenant TEXT NOT NULL,"
	"	kind INTEGER NOT NULL," /* enum resource_kind */
	"	key TEXT NOT NULL,"
	"	fingerprint BLOB NOT NULL," /* hash of the whole request */
	"	resource INTEGER NOT NULL REFERENCES resource ON DELETE CASCADE,"
	"	PRIMARY KEY (tenant, kind, key)"
	") STRICT, WITHOUT ROWID;"
	"INSERT INTO new_idempotency SELECT 'default', kind, key, fingerprint, resource FROM idempotency;"
	"DROP TABLE idempotency;"
	"ALTER TABLE new_idempotency RENAME TO idempotency;"
	"CREATE INDEX idempotency_by_resource ON idempotency(resource);"

	"CREATE TABLE new_job("
	"	number INTEGER PRIMARY KEY AUTOINCREMENT,"
	"	id TEXT NOT NULL UNIQUE,"
	"	resource INTEGER UNIQUE REFERENCES resource ON DELETE CASCADE,"  /* NULL: it makes none */
	"	kind INTEGER NOT NULL,"                                          /* enum job_kind */
	"	state INTEGER NOT NULL DEFAULT 0 CHECK (state BETWEEN 0 AND 5)," /* enum job_state */
	"	priority INTEGER NOT NULL DEFAULT 0,"
	"	waiting_for INTEGER NOT NULL DEFAULT 0 CHECK (waiting_for >= 0)," /* needs that have not succeeded */
	"	attempts INTEGER NOT NULL DEFAULT 0,"
	"	attempts_max INTEGER NOT NULL,"
	"	fence INTEGER NOT NULL DEFAULT 0,"         /* grows with every claim */
	"	interruptions INTEGER NOT NULL DEFAULT 0," /* claims that ended with their service or machine */
	"	room_bytes INTEGER NOT NULL DEFAULT 0,"    /* what its result is expected to take */
	"	not_before_ms INTEGER NOT NULL DEFAULT 0," /* by the lease clock, as the next; see store_lease_now_ms */
	"	lease_until_ms INTEGER NOT NULL DEFAULT 0,"
	"	worker TEXT NOT NULL DEFAULT '',"
	"	cancel_requested INTEGER NOT NULL DEFAULT 0,"
	"	progress REAL NOT NULL DEFAULT 0,"
	"	stage TEXT NOT NULL DEFAULT '',"
	"	partial TEXT,"
	"	failure_status INTEGER NOT NULL DEFAULT 0," /* enum tw_status */
	"	failure_type TEXT NOT NULL DEFAULT '',"
	"	failure_where TEXT NOT NULL DEFAULT '',"
	"	failure_text TEXT NOT NULL DEFAULT '',"
	"	created_ms INTEGER NOT NULL,"
	"	started_ms INTEGER NOT NULL DEFAULT 0,"
	"	finished_ms INTEGER NOT NULL DEFAULT 0,"
	"	change INTEGER NOT NULL DEFAULT 0"
	") STRICT;"
	/* Leases were measured by the wall clock; they count as run out. */
	"INSERT INTO new_job SELECT number, id, resource, kind, state, priority, waiting_for, attempts, attempts_max,"
	" fence, 0, 0, 0, 0, worker, cancel_requested, progress, stage, partial, failure_status,"
	" failure_type, failure_where, failure_text, created_ms, started_ms, finished_ms, change FROM job;"
	/* The numbers of deleted jobs are not given again. */
	"DELETE FROM sqlite_sequence WHERE name = 'new_job';"
	"INSERT INTO sqlite_sequence(name, seq) SELECT 'new_job', seq FROM sqlite_sequence WHERE name = 'job';"
	"DROP TABLE job;"
	"ALTER TABLE new_job RENAME TO job;"
	"CREATE TRIGGER job_added AFTER INSERT ON job BEGIN"
	"	UPDATE change SET value = value + 1;"
	"	UPDATE job SET change = (SELECT value FROM change) WHERE number = NEW.number;"
	" END;"
	"CREATE TRIGGER job_changed AFTER UPDATE OF state, cancel_requested, progress, stage, partial ON job"
	" WHEN OLD.state <> NEW.state OR OLD.cancel_requested <> NEW.cancel_requested OR OLD.progress <> NEW.progress"
	"   OR OLD.stage <> NEW.stage OR OLD.partial IS NOT NEW.partial BEGIN"
	"	UPDATE change SET value = value + 1;"
	"	UPDATE job SET change = (SELECT value FROM change) WHERE number = NEW.number;"
	" END;"

	"ALTER TABLE rig ADD COLUMN rate_hz INTEGER NOT NULL DEFAULT 0;"
	"ALTER TABLE rig ADD COLUMN scans INTEGER NOT NULL DEFAULT 0;"
	"ALTER TABLE rig ADD COLUMN gaps INTEGER NOT NULL DEFAULT 0;"
	"ALTER TABLE rig ADD COLUMN exceptions INTEGER NOT NULL DEFAULT 0;"
	"ALTER TABLE rig ADD COLUMN dropped INTEGER NOT NULL DEFAULT 0;"
	"ALTER TABLE rig ADD COLUMN connects INTEGER NOT NULL DEFAULT 0;"
	/* Of recordings that have begun and not ended; see struct recording_course. */
	"CREATE TABLE recording_course("
	"	resource INTEGER PRIMARY KEY REFERENCES resource ON DELETE CASCADE,"
	"	boot TEXT NOT NULL,"
	"	rate_hz INTEGER NOT NULL,"
	"	first_slot INTEGER NOT NULL,"
	"	slot_count INTEGER NOT NULL,"
	"	start_us INTEGER NOT NULL,"
	"	last_slot INTEGER NOT NULL,"
	"	longest_gap INTEGER NOT NULL,"
	"	exceptions INTEGER NOT NULL,"
	"	dropped INTEGER NOT NULL"
	") STRICT;"

	/* The options of a field are kept as they count; 0.1.0 kept those that the preset had yet to change. */
	"UPDATE resource SET options = replace(replace(options, '\"energy\":\"stvk\"', '\"energy\":\"printed\"'),"
	" '\"overhang\":\"charge\"', '\"overhang\":\"ignore\"')"
	" WHERE kind = 2 AND instr(options, '\"preset\":\"paper\"') > 0;";

/* Of the same version. */
static const char counts_and_clock[] =
	"CREATE INDEX job_claimable ON job(kind, priority DESC, number)"
	" WHERE state = 0 AND waiting_for = 0 AND not_before_ms = 0;"
	"CREATE INDEX job_put_off ON job(not_before_ms) WHERE state = 0 AND not_before_ms > 0;"
	"CREATE INDEX job_oldest ON job(created_ms) WHERE state = 0 AND waiting_for = 0;"
	"CREATE INDEX job_leased ON job(lease_until_ms) WHERE state = 1;"
	"CREATE INDEX job_by_state ON job(state, number);"
	"CREATE INDEX job_by_kind ON job(kind, state, number);"
	"CREATE INDEX job_by_resource_kind ON job(kind, state, resource);"
	"CREATE INDEX job_by_problem ON job(failure_type, number) WHERE failure_type <> '';"
	"CREATE UNIQUE INDEX job_by_change ON job(change);"

	/* What tells that a chunk is as it was written; apart, because behind the bytes it would be slow to read. */
	"CREATE TABLE chunk_hash("
	"	chunk INTEGER PRIMARY KEY REFERENCES chunk ON DELETE CASCADE,"
	"	hashes BLOB NOT NULL" /* of each block; see block_hash.h */
	") STRICT;"

	/* How many jobs there are, so that nobody has to count a million of them. */
	"CREATE TABLE job_count("
	"	kind INTEGER NOT NULL,"
	"	state INTEGER NOT NULL,"
	"	count INTEGER NOT NULL,"
	"	PRIMARY KEY (kind, state)"
	") STRICT, WITHOUT ROWID;"
	"INSERT INTO job_count SELECT kind, state, count(*) FROM job GROUP BY kind, state;"
	"CREATE TRIGGER job_count_added AFTER INSERT ON job BEGIN"
	"	INSERT INTO job_count VALUES (NEW.kind, NEW.state, 1)"
	"	 ON CONFLICT (kind, state) DO UPDATE SET count = count + 1;"
	" END;"
	"CREATE TRIGGER job_count_removed AFTER DELETE ON job BEGIN"
	"	UPDATE job_count SET count = count - 1 WHERE kind = OLD.kind AND state = OLD.state;"
	" END;"
	"CREATE TRIGGER job_count_moved AFTER UPDATE OF state ON job WHEN OLD.state <> NEW.state BEGIN"
	"	UPDATE job_count SET count = count - 1 WHERE kind = OLD.kind AND state = OLD.state;"
	"	INSERT INTO job_count VALUES (NEW.kind, NEW.state, 1)"
	"	 ON CONFLICT (kind, state) DO UPDATE SET count = count + 1;"
	" END;"

	/* Which start of the machine the lease clock counts from; see store_lease_now_ms. */
	"CREATE TABLE boot(only INTEGER PRIMARY KEY CHECK (only = 1), number INTEGER NOT NULL, id TEXT NOT NULL)"
	" STRICT;"
	"INSERT INTO boot VALUES (1, 0, '');"
	"UPDATE blob SET touched_ms = 1 WHERE resource IS NULL AND touched_ms > 0;"; /* by that clock from now on */

enum { TEXTS_MAX = 4 };
static const char *const migrations[SCHEMA_VERSION][TEXTS_MAX] = {
	{resources_and_queue},
	{rig},
	{upload_hash_state},
	{kinds, counts_and_clock},
	{schema_tenants, schema_queue, schema_queue_jobs, schema_usage},
};

static int read_pragma(sqlite3 *db, const char *pragma, int64_t *value)
{
	sqlite3_stmt *statement = NULL;
	int code = sqlite3_prepare_v2(db, pragma, -1, &statement, NULL);
	if (code == SQLITE_OK)
		code = sqlite3_step(statement);
	if (code == SQLITE_ROW) {
		*value = sqlite3_column_int64(statement, 0);
		code = SQLITE_OK;
	}
	sqlite3_finalize(statement);
	return code;
}

/* What tells whose a database is: all zero in a new one. In one snapshot, because another process may be making it. */
struct owner {
	int64_t version, application, tables;
};

static int read_owner(sqlite3 *db, struct owner *owner)
{
	int code = sqlite3_exec(db, "BEGIN", NULL, NULL, NULL);
	if (code == SQLITE_OK)
		code = read_pragma(db, "PRAGMA user_version", &owner->version);
	if (code == SQLITE_OK)
		code = read_pragma(db, "PRAGMA application_id", &owner->application);
	if (code == SQLITE_OK)
		code = read_pragma(db, "SELECT count(*) FROM sqlite_schema", &owner->tables);
	if (!sqlite3_get_autocommit(db))
		sqlite3_exec(db, "ROLLBACK", NULL, NULL, NULL);
	return code;
}

enum tw_status schema_check_owner(sqlite3 *db, struct tw_error *error)
{
	struct owner owner = {0};
	int code = read_owner(db, &owner);
	if (code == SQLITE_NOTADB)
		return tw_fail(error, TW_ERROR_INPUT, "store-foreign", NULL,
			       "%.200s is not a database; name a file of its own for the store",
			       sqlite3_db_filename(db, "main"));
	if (code != SQLITE_OK)
		return connection_fail(db, code, error);
	bool empty = owner.version == 0 && owner.application == 0 && owner.tables == 0;
	if (!empty && owner.application != SCHEMA_APPLICATION_ID)
		return tw_fail(error, TW_ERROR_INPUT, "store-foreign", NULL,
			       "this database belongs to another program; name a file of its own for the store");
	return TW_OK;
}

static enum tw_status apply(sqlite3 *db, int64_t version, struct tw_error *error)
{
	char text[96];
	int code = SQLITE_OK;
	for (int i = 0; code == SQLITE_OK && i < TEXTS_MAX && migrations[version][i]; i++)
		code = sqlite3_exec(db, migrations[version][i], NULL, NULL, NULL);
	snprintf(text, sizeof text, "PRAGMA application_id = %d; PRAGMA user_version = %d", SCHEMA_APPLICATION_ID,
		 (int)version + 1);
	if (code == SQLITE_OK)
		code = sqlite3_exec(db, text, NULL, NULL, NULL);
	return code == SQLITE_OK ? TW_OK : connection_fail(db, code, error);
}

/* The version is read under the write lock, so that of several processes one migrates and the others find it done. */
static enum tw_status migrate_once(sqlite3 *db, int target, bool *done, struct tw_error *error)
{
	int64_t version = 0;
	int code = sqlite3_exec(db, "BEGIN IMMEDIATE", NULL, NULL, NULL);
	if (code == SQLITE_OK)
		code = read_pragma(db, "PRAGMA user_version", &version);
	enum tw_status status = code == SQLITE_OK ? TW_OK : connection_fail(db, code, error);
	if (status == TW_OK && (version < 0 || version > SCHEMA_VERSION))
		status = tw_fail(error, TW_ERROR_UNSUPPORTED, "store-newer", NULL,
				 "the store has version %lld, this tightwire knows up to %d; run the newer one",
				 (long long)version, SCHEMA_VERSION);
	*done = version >= target;
	if (status == TW_OK && !*done)
		status = apply(db, version, error);
	if (status == TW_OK) {
		code = sqlite3_exec(db, "COMMIT", NULL, NULL, NULL);
		status = code == SQLITE_OK ? TW_OK : connection_fail(db, code, error);
	}
	if (status != TW_OK && !sqlite3_get_autocommit(db))
		sqlite3_exec(db, "ROLLBACK", NULL, NULL, NULL);
	return status;
}

enum tw_status schema_migrate(sqlite3 *db, int target, struct tw_error *error)
{
	int64_t version = 0;
	int code = read_pragma(db, "PRAGMA user_version", &version);
	/* Nearly always; who opens a store must not wait for those that write. */
	bool done = code == SQLITE_OK && version == target;
	enum tw_status status = TW_OK;
	while (status == TW_OK && !done)
		status = migrate_once(db, target, &done, error);
	return status;
}
