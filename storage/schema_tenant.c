/* Migration 5, first part: tenants, and the API keys that act for them. */
#include "storage/schema_parts.h"

const char schema_tenants[] =
	"CREATE TABLE tenant("
	"	number INTEGER PRIMARY KEY AUTOINCREMENT,"
	"	name TEXT UNIQUE," /* NULL: its data are being deleted; nobody can name it any more */
	/* Part of its content addresses, so that nobody can tell another's from what is addressed. The first
	 * tenant has its name, as releases before had it, so that its addresses stay. */
	"	salt BLOB NOT NULL,"
	"	created_ms INTEGER NOT NULL"
	") STRICT;"
	"CREATE INDEX tenant_deleted ON tenant(number) WHERE name IS NULL;"
	"INSERT INTO tenant VALUES (1, 'default', CAST('default' AS BLOB), 0);"

	"CREATE TABLE api_key("
	"	number INTEGER PRIMARY KEY AUTOINCREMENT,"
	"	id TEXT NOT NULL UNIQUE,"
	"	tenant INTEGER NOT NULL REFERENCES tenant,"
	"	name TEXT NOT NULL,"
	"	scopes INTEGER NOT NULL," /* KEY_READ… */
	"	created_ms INTEGER NOT NULL,"
	"	expires_ms INTEGER NOT NULL DEFAULT 0," /* 0: never */
	"	revoked_ms INTEGER NOT NULL DEFAULT 0," /* 0: it is not */
	"	weight INTEGER NOT NULL DEFAULT 1,"     /* turns in the queue for one of others */
	/* Limits; 0: none. */
	"	requests_per_s INTEGER NOT NULL DEFAULT 0,"
	"	requests_per_min INTEGER NOT NULL DEFAULT 0,"
	"	queued_jobs INTEGER NOT NULL DEFAULT 0,"
	"	stored_bytes INTEGER NOT NULL DEFAULT 0"
	") STRICT;"
	"CREATE UNIQUE INDEX api_key_by_name ON api_key(tenant, name) WHERE revoked_ms = 0;"
	"CREATE INDEX api_key_by_tenant ON api_key(tenant, number);"

	/* What a client sends, hashed. A key that was rotated has two for a while. */
	"CREATE TABLE api_key_secret("
	"	hash BLOB NOT NULL PRIMARY KEY," /* BLAKE2b-256 of its text */
	"	key INTEGER NOT NULL REFERENCES api_key ON DELETE CASCADE,"
	"	created_ms INTEGER NOT NULL,"
	"	until_ms INTEGER NOT NULL DEFAULT 0" /* 0: as long as the key itself */
	") STRICT, WITHOUT ROWID;"
	"CREATE INDEX api_key_secret_by_key ON api_key_secret(key, created_ms);"

	/* What changes all the time, apart from what daemons keep in memory. */
	"CREATE TABLE api_key_usage("
	"	key INTEGER PRIMARY KEY REFERENCES api_key ON DELETE CASCADE,"
	"	stored_bytes INTEGER NOT NULL DEFAULT 0,"
	"	requests INTEGER NOT NULL DEFAULT 0,"
	"	last_used_ms INTEGER NOT NULL DEFAULT 0" /* 0: never */
	") STRICT;"

	/* Grows with every change of a tenant or a key; and whether there has ever been a key: from then on nobody
	 * is let in without one. */
	"CREATE TABLE access(only INTEGER PRIMARY KEY CHECK (only = 1), change INTEGER NOT NULL,"
	" keys_needed INTEGER NOT NULL) STRICT;"
	"INSERT INTO access VALUES (1, 0, 0);"

	/* `client`: the number of the API key that asked; 0 for none, below 0 for one of a key file, which has no row.
	 * Before, there was one tenant. */
	"ALTER TABLE resource DROP COLUMN tenant;"
	"ALTER TABLE resource ADD COLUMN tenant INTEGER NOT NULL DEFAULT 1;"
	"ALTER TABLE resource ADD COLUMN client INTEGER NOT NULL DEFAULT 0;"
	"CREATE INDEX resource_by_tenant ON resource(tenant, number);"
	"ALTER TABLE blob ADD COLUMN tenant INTEGER NOT NULL DEFAULT 1;"
	"ALTER TABLE blob ADD COLUMN client INTEGER NOT NULL DEFAULT 0;"
	"CREATE INDEX blob_upload_by_tenant ON blob(tenant, number) WHERE upload IS NOT NULL AND resource IS NULL;"
	"ALTER TABLE job ADD COLUMN tenant INTEGER NOT NULL DEFAULT 1;"
	"ALTER TABLE job ADD COLUMN client INTEGER NOT NULL DEFAULT 0;"

	"CREATE TABLE new_idempotency("
	"	tenant INTEGER NOT NULL,"
	"	kind INTEGER NOT NULL," /* enum resource_kind */
	"	key TEXT NOT NULL,"
	"	fingerprint BLOB NOT NULL," /* hash of the whole request */
	"	resource INTEGER NOT NULL REFERENCES resource ON DELETE CASCADE,"
	"	PRIMARY KEY (tenant, kind, key)"
	") STRICT, WITHOUT ROWID;"
	"INSERT INTO new_idempotency SELECT 1, kind, key, fingerprint, resource FROM idempotency;"
	"DROP TABLE idempotency;"
	"ALTER TABLE new_idempotency RENAME TO idempotency;"
	"CREATE INDEX idempotency_by_resource ON idempotency(resource);"

	/* Lists are a tenant's own. */
	"DROP INDEX job_by_state;"
	"DROP INDEX job_by_kind;"
	"DROP INDEX job_by_resource_kind;"
	"DROP INDEX job_by_problem;"
	"CREATE INDEX job_by_state ON job(tenant, state, number);"
	"CREATE INDEX job_by_kind ON job(tenant, kind, state, number);"
	"CREATE INDEX job_by_problem ON job(tenant, failure_type, number) WHERE failure_type <> '';";

/* Last, when all tables are as they will be: triggers that count what a key stores. Its jobs are in job_count. */
const char schema_usage[] =
	/* Uploads, arrays, artifacts; requests and summaries; samples. */
	"CREATE TRIGGER blob_counted AFTER INSERT ON blob WHEN NEW.client > 0 BEGIN"
	"	UPDATE api_key_usage SET stored_bytes = stored_bytes + NEW.size WHERE key = NEW.client;"
	" END;"
	"CREATE TRIGGER blob_recounted AFTER UPDATE OF size, client ON blob WHEN OLD.client > 0 OR NEW.client > 0 BEGIN"
	"	UPDATE api_key_usage SET stored_bytes = stored_bytes - OLD.size WHERE key = OLD.client;"
	"	UPDATE api_key_usage SET stored_bytes = stored_bytes + NEW.size WHERE key = NEW.client;"
	" END;"
	"CREATE TRIGGER blob_discounted AFTER DELETE ON blob WHEN OLD.client > 0 BEGIN"
	"	UPDATE api_key_usage SET stored_bytes = stored_bytes - OLD.size WHERE key = OLD.client;"
	" END;"
	"CREATE TRIGGER resource_counted AFTER INSERT ON resource WHEN NEW.client > 0 BEGIN"
	"	UPDATE api_key_usage SET stored_bytes = stored_bytes + length(CAST(NEW.options AS BLOB))"
	"	 WHERE key = NEW.client;"
	" END;"
	"CREATE TRIGGER resource_recounted AFTER UPDATE OF summary ON resource WHEN NEW.client > 0 BEGIN"
	"	UPDATE api_key_usage SET stored_bytes = stored_bytes + coalesce(length(CAST(NEW.summary AS BLOB)), 0)"
	"	 - coalesce(length(CAST(OLD.summary AS BLOB)), 0) WHERE key = NEW.client;"
	" END;"
	/* Before, because the samples go with it, and then nobody could tell whose they were. */
	"CREATE TRIGGER resource_discounted BEFORE DELETE ON resource WHEN OLD.client > 0 BEGIN"
	"	UPDATE api_key_usage SET stored_bytes = stored_bytes - length(CAST(OLD.options AS BLOB))"
	"	 - coalesce(length(CAST(OLD.summary AS BLOB)), 0) - (SELECT coalesce(sum(length(samples)), 0)"
	"	  FROM recording_chunk WHERE resource = OLD.number) WHERE key = OLD.client;"
	" END;"
	"CREATE TRIGGER samples_counted AFTER INSERT ON recording_chunk BEGIN"
	"	UPDATE api_key_usage SET stored_bytes = stored_bytes + length(NEW.samples)"
	"	 WHERE key = (SELECT client FROM resource WHERE number = NEW.resource);"
	" END;"
	"CREATE TRIGGER samples_discounted AFTER DELETE ON recording_chunk BEGIN"
	"	UPDATE api_key_usage SET stored_bytes = stored_bytes - length(OLD.samples)"
	"	 WHERE key = (SELECT client FROM resource WHERE number = OLD.resource);"
	" END;";
