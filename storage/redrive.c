#include "storage/redrive.h"

#include "storage/job_state.h"
#include "storage/sql.h"

/* About 5 ms of the write lock. */
enum { STEP_JOBS = 50 };

/* Without the write lock: there may be many to pass by. */
static enum tw_status find_some(struct store *store, const struct redrive_query *query, int64_t after,
				int64_t jobs[STEP_JOBS], size_t *count, struct tw_error *error)
{
	*count = 0;
	struct sql q = query->failure_type
			       ? sql_query(store, "SELECT number FROM job INDEXED BY job_by_problem"
						  " WHERE tenant = ?5 AND failure_type = ?6 AND failure_type <> ''"
						  " AND state = ?1 AND number > ?2 AND (?3 = 0 OR ?3 >> kind & 1 = 1)"
						  " ORDER BY number LIMIT ?4")
			       : sql_query(store, "SELECT number FROM job INDEXED BY job_by_state WHERE tenant = ?5"
						  " AND state = ?1 AND number > ?2 AND (?3 = 0 OR ?3 >> kind & 1 = 1)"
						  " ORDER BY number LIMIT ?4");
	sql_bind_int(&q, query->state);
	sql_bind_int(&q, after);
	sql_bind_int(&q, query->kinds);
	sql_bind_int(&q, STEP_JOBS);
	sql_bind_int(&q, query->tenant);
	if (query->failure_type)
		sql_bind_text(&q, query->failure_type);
	while (sql_step(&q))
		jobs[(*count)++] = sql_int(&q);
	return sql_end(&q, error);
}

static enum tw_status has_state(struct store *store, int64_t job, enum job_state state, bool *has,
				struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT 1 FROM job WHERE number = ? AND state = ?");
	sql_bind_int(&q, job);
	sql_bind_int(&q, state);
	*has = sql_step(&q);
	return sql_end(&q, error);
}

/* What was found may have changed since, or gone back with a job before it; that counts if it was of those found. */
static enum tw_status redrive_some(struct store *store, enum job_state state, const int64_t *jobs, size_t count,
				   uint64_t *redriven, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	bool still[STEP_JOBS] = {false};
	for (size_t i = 0; status == TW_OK && i < count; i++)
		status = has_state(store, jobs[i], state, &still[i], error);
	for (size_t i = 0; status == TW_OK && i < count; i++) {
		if (!still[i])
			continue;
		status = job_state_redrive(store, jobs[i], error);
		(*redriven)++;
	}
	return status;
}

enum tw_status redrive_step(struct store *store, const struct redrive_query *query, struct redrive_progress *progress,
			    struct tw_error *error)
{
	int64_t jobs[STEP_JOBS];
	size_t count = 0;
	uint64_t redriven = 0;
	assert(query->state == JOB_FAILED || query->state == JOB_CANCELLED);
	enum tw_status status = find_some(store, query, progress->last, jobs, &count, error);
	if (status != TW_OK)
		return status;
	progress->done = count < STEP_JOBS;
	if (count == 0)
		return TW_OK;
	status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = redrive_some(store, query->state, jobs, count, &redriven, error);
	status = transaction_end(store, status, error);
	if (status == TW_OK) {
		progress->last = jobs[count - 1];
		progress->redriven += redriven;
	}
	return status;
}
