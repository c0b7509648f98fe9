/* What fairness costs: claims from a queue of many clients, beside claims of a plain first-in-first-out queue in the
 * same run; and how soon a designer's job begins behind a batch. */
#include "storage/jobs.h"
#include "storage/queue.h"
#include "storage/resources.h"
#include "storage/schema.h"
#include "storage/sql.h"

#include "tests/bench/bench.h"
#include "tests/bench/fill_queue.h"

#include <string.h>
#include <unistd.h>

enum { JOBS = 100000, CLIENTS = 100, CLAIMS = 200, ROUNDS = 30 };

/* --- first in, first out ---------------------------------------------------------------------------------------- */

/* Before there were classes and clients: the tables of schema 4, and one index that has the whole order. What a claim
 * does besides (whether a lease has run out, whether there is room) is as it is today. */
static int make_plain(const char *path)
{
	struct connection connection = {0};
	char text[1024];
	if (connection_open(&connection, path, NULL) != TW_OK || connection_set_up(&connection, 0, NULL) != TW_OK ||
	    schema_migrate(connection.db, 4, NULL) != TW_OK)
		return 1;
	snprintf(text, sizeof text,
		 "DROP INDEX job_claimable;"
		 "CREATE INDEX job_claimable ON job(priority DESC, number)"
		 " WHERE state = 0 AND waiting_for = 0 AND not_before_ms = 0;"
		 "PRAGMA synchronous = OFF; BEGIN;"
		 "WITH RECURSIVE i(n) AS (VALUES (1) UNION ALL SELECT n + 1 FROM i WHERE n < %d)"
		 " INSERT INTO resource(id, kind, name, options, created_ms)"
		 " SELECT 'layout_' || n, %d, '', '{}', n FROM i;"
		 "INSERT INTO job(id, resource, kind, attempts_max, created_ms)"
		 " SELECT 'job_' || number, number, %d, 3, number FROM resource;"
		 "COMMIT; PRAGMA user_version = %d; PRAGMA wal_checkpoint(TRUNCATE)",
		 JOBS, (int)RESOURCE_LAYOUT, (int)JOB_COMPUTE_LAYOUT, SCHEMA_VERSION);
	int code = sqlite3_exec(connection.db, text, NULL, NULL, NULL);
	if (code != SQLITE_OK)
		fprintf(stderr, "bench: %s: %s\n", path, sqlite3_errmsg(connection.db));
	connection_close(&connection);
	return code;
}

static int64_t plain_first(struct store *store)
{
	struct sql q =
		sql_query(store, "SELECT number FROM job INDEXED BY job_claimable WHERE state = 0"
				 " AND waiting_for = 0 AND not_before_ms = 0 ORDER BY priority DESC, number LIMIT 1");
	int64_t job = sql_step(&q) ? sql_int(&q) : 0;
	return sql_end(&q, NULL) == TW_OK ? job : 0;
}

static bool plain_is_due(struct store *store)
{
	struct sql q = sql_query(store, "SELECT EXISTS (SELECT 1 FROM job INDEXED BY job_leased WHERE state = 1"
					" AND lease_until_ms < ?1) OR EXISTS (SELECT 1 FROM job INDEXED BY job_put_off"
					" WHERE state = 0 AND not_before_ms > 0 AND not_before_ms <= ?1)");
	sql_bind_int(&q, store_lease_now_ms(store));
	bool due = sql_step(&q) && sql_int(&q);
	return sql_end(&q, NULL) == TW_OK && due;
}

static enum tw_status plain_take(struct store *store, int64_t job)
{
	struct sql q = sql_query(store, "UPDATE job SET state = 1, attempts = attempts + 1, fence = fence + 1,"
					" worker = ?, lease_until_ms = ?, started_ms = ?, progress = 0, stage = ''"
					" WHERE number = ? RETURNING number, fence, kind, attempts, id,"
					" (SELECT id FROM resource WHERE number = job.resource)");
	sql_bind_text(&q, "bench");
	sql_bind_int(&q, store_lease_now_ms(store) + 60000);
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, NULL);
}

static int plain_claim(struct store *store)
{
	uint64_t room = 0;
	if (transaction_begin(store, false, NULL) != TW_OK)
		return 1;
	int64_t job = plain_is_due(store) || sql_room(store, &room, NULL) != TW_OK ? 0 : plain_first(store);
	enum tw_status status = job ? plain_take(store, job) : TW_ERROR_INTERNAL;
	return transaction_end(store, status, NULL) != TW_OK;
}

/* --- today ------------------------------------------------------------------------------------------------------ */

static int claim(struct store *store, struct job_ticket *ticket)
{
	bool found = false;
	const struct claim_query query = {.kinds = JOB_KINDS_ALL, .worker = "bench", .lease_ms = 60000};
	return job_claim(store, &query, ticket, &found, NULL) != TW_OK || !found;
}

static int fair_claim(struct store *store)
{
	struct job_ticket ticket;
	return claim(store, &ticket);
}

static int submit(struct store *store, enum job_class class)
{
	struct resource resource;
	enum resource_outcome outcome;
	const struct resource_draft draft = {
		.owner = {TENANT_DEFAULT, 500}, .kind = RESOURCE_LAYOUT, .queue.class = class};
	if (resource_create(store, &draft, &resource, &outcome, NULL) != TW_OK)
		return 1;
	resource_clear(&resource);
	return 0;
}

/* A worker ends a job of the batch and claims the next: the longest of fifty times, for a job that was submitted
 * meanwhile. */
static int designer(struct store *store, double *longest_s)
{
	struct job_ticket ticket;
	const struct job_result result = {.summary = "{}"};
	int failed = claim(store, &ticket);
	*longest_s = 0;
	for (int i = 0; i < 50 && !failed; i++) {
		failed = submit(store, JOB_INTERACTIVE) || job_finish(store, &ticket, &result, NULL) != TW_OK;
		double start = bench_wall_seconds();
		failed = failed || claim(store, &ticket);
		double seconds = bench_wall_seconds() - start;
		*longest_s = seconds > *longest_s ? seconds : *longest_s;
		failed = failed || job_finish(store, &ticket, &result, NULL) != TW_OK || claim(store, &ticket);
	}
	return failed;
}

static double measure(struct store *store, int (*step)(struct store *store), int *failed)
{
	double start = bench_seconds();
	for (int i = 0; i < CLAIMS && !*failed; i++)
		*failed = step(store);
	return (bench_seconds() - start) / CLAIMS;
}

/* The two in turn, and the best of each: what else the machine does falls on both. */
static int compare(struct store *plain, struct store *fair, double *plain_s, double *fair_s)
{
	int failed = 0;
	*plain_s = *fair_s = 1;
	for (int i = 0; i < ROUNDS && !failed; i++) {
		double a = measure(plain, plain_claim, &failed), b = measure(fair, fair_claim, &failed);
		*plain_s = a < *plain_s ? a : *plain_s;
		*fair_s = b < *fair_s ? b : *fair_s;
	}
	return failed;
}

static int run(const char *folder)
{
	char plain_url[96], fair_url[96];
	const char *plain_path = plain_url + strlen("sqlite:"), *fair_path = fair_url + strlen("sqlite:");
	struct store *plain = NULL, *fair = NULL;
	double plain_s = 0, fair_s = 0, longest_s = 0;
	snprintf(plain_url, sizeof plain_url, "sqlite:%s/plain.db", folder);
	snprintf(fair_url, sizeof fair_url, "sqlite:%s/fair.db", folder);
	int failed = make_plain(plain_path) != 0 || store_open(&plain, plain_url, NULL) != TW_OK ||
		     store_open(&fair, fair_url, NULL) != TW_OK ||
		     fill_queue(fair_path, JOBS, CLIENTS, JOB_BATCH) != SQLITE_OK;
	failed = failed || compare(plain, fair, &plain_s, &fair_s) || designer(fair, &longest_s);
	store_close(plain);
	store_close(fair);
	if (failed)
		return 1;
	bench_line("claims, first in first out", 1 / plain_s, "/s", 0);
	bench_line("claims, 100 clients in turn", 1 / fair_s, "/s", 0);
	bench_line("what fairness costs of them", 100 * (1 - plain_s / fair_s), "%", 10);
	bench_line("interactive, 100,000 of a batch", longest_s * 1e3, "ms", 50);
	return 0;
}

int main(void)
{
	char folder[] = "/tmp/tightwire-bench-XXXXXX", command[64];
	if (!mkdtemp(folder))
		return 1;
	int failed = run(folder);
	snprintf(command, sizeof command, "rm -rf %s", folder);
	return system(command) || failed;
}
