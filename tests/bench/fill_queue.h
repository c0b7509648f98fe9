/* A store with many queued jobs, written past the store's own code: a million would take it an hour. */
#ifndef TESTS_BENCH_FILL_QUEUE_H
#define TESTS_BENCH_FILL_QUEUE_H

#include "storage/job.h"

#include <sqlite3.h>
#include <stdio.h>

/* Layouts of one class, of clients 1…`clients` in turn; every thousandth has failed, was cancelled or is done. And one
 * recording behind them all. The store is new, and has been opened before. */
static inline int fill_queue(const char *path, int jobs, int clients, enum job_class class)
{
	static const char fill[] =
		"WITH RECURSIVE i(n) AS (VALUES (1) UNION ALL SELECT n + 1 FROM i, p WHERE n < clients)"
		" INSERT INTO share(number, tenant, client, pool, class, open) SELECT n, 1, n, 0, class, 1 FROM i, p;"
		"INSERT INTO share(number, tenant, client, pool, class, open) SELECT clients + 1, 1, 0, 1, 2, 1 FROM p;"
		"INSERT INTO turn SELECT pool, class, turn, number FROM share;"
		"INSERT INTO lane(number, share, kind, head_priority, head_number)"
		" SELECT number, number, CASE pool WHEN 1 THEN record ELSE compute END, 2147483647, 1 FROM share, p;"
		"WITH RECURSIVE i(n) AS (VALUES (1) UNION ALL SELECT n + 1 FROM i, p WHERE n <= jobs)"
		" INSERT INTO resource(id, kind, name, options, created_ms)"
		" SELECT 'layout_' || n, CASE WHEN n > jobs THEN recording ELSE layout END, '', '{}', n FROM i, p;"
		"INSERT INTO job(id, resource, kind, state, attempts_max, created_ms, client, class, lane)"
		" SELECT 'job_' || number, number, compute,"
		" CASE WHEN number % 1000 IN (2, 3, 4) THEN number % 1000 ELSE 0 END, 3, number,"
		" 1 + number % clients, class, 1 + number % clients FROM resource, p WHERE kind = layout;"
		"INSERT INTO job(id, resource, kind, attempts_max, created_ms, lane)"
		" SELECT 'job_' || number, number, record, 3, number, clients + 1 FROM resource, p"
		" WHERE kind = recording;"
		"COMMIT; PRAGMA wal_checkpoint(TRUNCATE)";
	char begin[256];
	sqlite3 *db = NULL;
	snprintf(
		begin, sizeof begin,
		"PRAGMA synchronous = OFF; BEGIN; CREATE TEMP TABLE p AS SELECT %d AS jobs, %d AS clients, %d AS class,"
		" %d AS layout, %d AS recording, %d AS compute, %d AS record",
		jobs, clients, (int)class, (int)RESOURCE_LAYOUT, (int)RESOURCE_RECORDING, (int)JOB_COMPUTE_LAYOUT,
		(int)JOB_RECORD);
	int code = sqlite3_open(path, &db);
	if (code == SQLITE_OK)
		code = sqlite3_exec(db, begin, NULL, NULL, NULL);
	if (code == SQLITE_OK)
		code = sqlite3_exec(db, fill, NULL, NULL, NULL);
	if (code != SQLITE_OK)
		fprintf(stderr, "bench: %s: %s\n", path, sqlite3_errmsg(db));
	sqlite3_close(db);
	return code;
}

#endif
