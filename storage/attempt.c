#include "storage/attempt.h"

#include "storage/job_sql.h"
#include "storage/sql.h"

#include <assert.h>
#include <stdlib.h>

static const char *const names[ATTEMPT_ENDINGS] = {
	[ATTEMPT_FAILED] = "failed",     [ATTEMPT_CRASHED] = "crashed", [ATTEMPT_INTERRUPTED] = "interrupted",
	[ATTEMPT_RELEASED] = "released", [ATTEMPT_PUT_OFF] = "put_off", [ATTEMPT_CANCELLED] = "cancelled",
};

const char *attempt_ending_name(enum attempt_ending ending)
{
	assert(ending < ATTEMPT_ENDINGS);
	return names[ending];
}

static bool costs(enum attempt_ending ending)
{
	return ending == ATTEMPT_FAILED || ending == ATTEMPT_CRASHED || ending == ATTEMPT_CANCELLED;
}

/* What is put off every second for a night is one row. */
static enum tw_status count_again(struct store *store, int64_t job, enum attempt_ending ending, const char *type,
				  int64_t *changed, struct tw_error *error)
{
	struct sql q = sql_query(
		store,
		"UPDATE job_attempt SET times = times + 1, worker = j.worker, started_ms = j.started_ms,"
		" ended_ms = ?4 FROM job j WHERE j.number = ?1 AND j.state = " SQL_RUNNING " AND job_attempt.job = ?1"
		" AND job_attempt.number = (SELECT max(a.number) FROM job_attempt a WHERE a.job = ?1)"
		" AND ending = ?2 AND job_attempt.failure_type = ?3");
	sql_bind_int(&q, job);
	sql_bind_int(&q, ending);
	sql_bind_text(&q, type);
	sql_bind_int(&q, store_now_ms(store));
	return sql_run(&q, changed, error);
}

static enum tw_status add(struct store *store, int64_t job, enum attempt_ending ending, const char *type,
			  const char *text, struct tw_error *error)
{
	struct sql q = sql_query(
		store, "INSERT INTO job_attempt(job, number, times, ending, attempt, worker, started_ms, ended_ms,"
		       " failure_type, failure_text) SELECT j.number,"
		       " (SELECT coalesce(max(a.number), 0) + 1 FROM job_attempt a WHERE a.job = ?1), 1, ?2,"
		       " CASE ?3 WHEN 1 THEN j.attempts ELSE 0 END, j.worker, j.started_ms, ?4, ?5, ?6"
		       " FROM job j WHERE j.number = ?1 AND j.state = " SQL_RUNNING);
	sql_bind_int(&q, job);
	sql_bind_int(&q, ending);
	sql_bind_int(&q, costs(ending));
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_text(&q, type);
	sql_bind_text(&q, text);
	return sql_run(&q, NULL, error);
}

static enum tw_status forget_old(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(store, "DELETE FROM job_attempt WHERE job = ?1 AND number <="
					" (SELECT max(a.number) FROM job_attempt a WHERE a.job = ?1) - ?2");
	sql_bind_int(&q, job);
	sql_bind_int(&q, ATTEMPTS_KEPT);
	return sql_run(&q, NULL, error);
}

enum tw_status attempt_note(struct store *store, int64_t job, enum attempt_ending ending,
			    const struct tw_error *failure, struct tw_error *error)
{
	int64_t changed = 0;
	const char *type = failure && failure->type ? failure->type : "";
	enum tw_status status = TW_OK;
	if (!costs(ending))
		status = count_again(store, job, ending, type, &changed, error);
	if (status != TW_OK || changed)
		return status;
	status = add(store, job, ending, type, failure ? failure->text : "", error);
	return status == TW_OK ? forget_old(store, job, error) : status;
}

static void read_attempt(struct sql *q, struct attempt *attempt)
{
	attempt->ending = (enum attempt_ending)sql_int(q);
	attempt->times = (uint32_t)sql_int(q);
	attempt->attempt = (uint32_t)sql_int(q);
	sql_copy_text(q, attempt->worker, sizeof attempt->worker);
	attempt->started_ms = sql_int(q);
	attempt->ended_ms = sql_int(q);
	sql_copy_text(q, attempt->failure_type, sizeof attempt->failure_type);
	sql_copy_text(q, attempt->failure_text, sizeof attempt->failure_text);
}

enum tw_status attempt_list(struct store *store, const char *job_id, struct attempt **attempts, size_t *count,
			    struct tw_error *error)
{
	struct attempt *list = calloc(ATTEMPTS_KEPT, sizeof *list);
	*count = 0;
	if (!list)
		return tw_fail_memory(error);
	struct sql q = sql_query(store, "SELECT a.ending, a.times, a.attempt, a.worker, a.started_ms, a.ended_ms,"
					" a.failure_type, a.failure_text FROM job j JOIN job_attempt a"
					" ON a.job = j.number WHERE j.id = ? ORDER BY a.number");
	sql_bind_text(&q, job_id);
	while (*count < ATTEMPTS_KEPT && sql_step(&q))
		read_attempt(&q, &list[(*count)++]);
	enum tw_status status = sql_end(&q, error);
	if (status != TW_OK)
		free(list);
	else
		*attempts = list;
	return status;
}
