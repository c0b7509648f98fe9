#include "storage/bulk.h"

#include "storage/job_state.h"
#include "storage/sql.h"

enum {
	STEP_JOBS = 50,     /* about 5 ms of the write lock */
	STEP_LOOKED = 1000, /* looked at for these, without the lock */
};

unsigned bulk_states(enum bulk_action action)
{
	return action == BULK_REDRIVE ? 1u << JOB_FAILED | 1u << JOB_CANCELLED : 1u << JOB_QUEUED | 1u << JOB_RUNNING;
}

/* The jobs of a step. */
struct some {
	int64_t jobs[STEP_JOBS];
	size_t count;
	int64_t last; /* looked at last */
	bool more;    /* there may be others behind it */
};

/* Whether a job is what the query means, beside tenant, state and problem, by which it is found. */
#define MATCHES "(?5 = 0 OR ?5 >> kind & 1 = 1) AND " SQL_MATCHES("?6", "?7", "?8")

/* Without the write lock: there may be many to pass by. */
static enum tw_status find_some(struct store *store, const struct job_query *query,
				const struct bulk_progress *progress, struct some *some, struct tw_error *error)
{
	int looked = 0;
	*some = (struct some){.last = progress->last};
	struct sql q = query->failure_type
			       ? sql_query(store, "SELECT number, " MATCHES " FROM job INDEXED BY job_by_problem"
						  " WHERE tenant = ?1 AND failure_type = ?9 AND failure_type <> ''"
						  " AND state = ?2 AND number > ?3 ORDER BY number LIMIT ?4")
			       : sql_query(store, "SELECT number, " MATCHES " FROM job INDEXED BY job_by_state"
						  " WHERE tenant = ?1 AND state = ?2 AND number > ?3"
						  " ORDER BY number LIMIT ?4");
	sql_bind_int(&q, query->tenant);
	sql_bind_int(&q, progress->state);
	sql_bind_int(&q, progress->last);
	sql_bind_int(&q, STEP_LOOKED);
	sql_bind_int(&q, query->kinds);
	sql_bind_int(&q, query->classes);
	sql_bind_int(&q, query->created_before_ms);
	sql_bind_text(&q, query->group ? query->group : "");
	if (query->failure_type)
		sql_bind_text(&q, query->failure_type);
	for (; some->count < STEP_JOBS && sql_step(&q); looked++) {
		some->last = sql_int(&q);
		if (sql_int(&q))
			some->jobs[some->count++] = some->last;
	}
	some->more = looked == STEP_LOOKED || some->count == STEP_JOBS;
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

static enum tw_status apply(struct store *store, enum bulk_action action, int64_t job, struct tw_error *error)
{
	enum job_state after = JOB_QUEUED;
	return action == BULK_REDRIVE ? job_state_redrive(store, job, error)
				      : job_state_cancel(store, job, JOB_CANCEL_ASKED, &after, error);
}

/* What was found may have changed since, or gone back with a job before it; that counts if it was of those found. */
static enum tw_status apply_to_all(struct store *store, enum bulk_action action, enum job_state state,
				   const struct some *some, uint64_t *changed, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	bool still[STEP_JOBS] = {false};
	for (size_t i = 0; status == TW_OK && i < some->count; i++)
		status = has_state(store, some->jobs[i], state, &still[i], error);
	for (size_t i = 0; status == TW_OK && i < some->count; i++) {
		if (!still[i])
			continue;
		status = apply(store, action, some->jobs[i], error);
		(*changed)++;
	}
	return status;
}

static enum tw_status change_some(struct store *store, enum bulk_action action, const struct some *some,
				  struct bulk_progress *progress, struct tw_error *error)
{
	uint64_t changed = 0;
	if (some->count == 0)
		return TW_OK;
	enum tw_status status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = apply_to_all(store, action, progress->state, some, &changed, error);
	status = transaction_end(store, status, error);
	if (status == TW_OK)
		progress->changed += changed;
	return status;
}

static void skip_to(struct bulk_progress *progress, unsigned states)
{
	while (progress->state < JOB_STATES && !(states >> progress->state & 1)) {
		progress->state++;
		progress->last = 0;
	}
	progress->done = progress->state == JOB_STATES;
}

enum tw_status bulk_step(struct store *store, enum bulk_action action, const struct job_query *query,
			 struct bulk_progress *progress, struct tw_error *error)
{
	struct some some;
	unsigned states = query->states ? query->states : bulk_states(action);
	assert(!(states & ~bulk_states(action)));
	skip_to(progress, states);
	if (progress->done)
		return TW_OK;
	enum tw_status status = find_some(store, query, progress, &some, error);
	if (status == TW_OK)
		status = change_some(store, action, &some, progress, error);
	if (status != TW_OK)
		return status;
	progress->last = some.last;
	if (!some.more) {
		progress->state++;
		progress->last = 0;
		skip_to(progress, states);
	}
	return TW_OK;
}
