#include "storage/due.h"

#include "storage/job_state.h"
#include "storage/sql.h"

enum { CANCELS_MAX = 64 }; /* at once: some milliseconds of the write lock */

#define LEASED "job INDEXED BY job_leased WHERE state = " SQL_RUNNING
#define PAUSED "job INDEXED BY job_paused WHERE state = " SQL_QUEUED " AND pause_until_ms > 0"
#define DELAYED "job INDEXED BY job_delayed WHERE state = " SQL_QUEUED " AND delayed = 1"
#define LIMITED "job INDEXED BY job_deadline WHERE " SQL_UNFINISHED " AND cancel_at_ms > 0 AND cancel_requested = 0"

enum tw_status due_any(struct store *store, bool *due, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT EXISTS (SELECT 1 FROM " LEASED " AND lease_until_ms < ?1)"
					" OR EXISTS (SELECT 1 FROM " PAUSED " AND pause_until_ms <= ?1)"
					" OR EXISTS (SELECT 1 FROM " DELAYED " AND not_before_ms <= ?2)"
					" OR EXISTS (SELECT 1 FROM " LIMITED " AND cancel_at_ms <= ?2)");
	sql_bind_int(&q, store_lease_now_ms(store));
	sql_bind_int(&q, store_now_ms(store));
	*due = sql_step(&q) && sql_int(&q);
	return sql_end(&q, error);
}

enum tw_status due_next(struct store *store, int64_t *wait_ms, struct tw_error *error)
{
	int64_t lease_now_ms = store_lease_now_ms(store), now_ms = store_now_ms(store);
	struct sql q = sql_query(store, "SELECT (SELECT min(lease_until_ms) + 1 FROM " LEASED ") - ?1,"
					" (SELECT min(pause_until_ms) FROM " PAUSED ") - ?1,"
					" (SELECT min(not_before_ms) FROM " DELAYED ") - ?2,"
					" (SELECT min(cancel_at_ms) FROM " LIMITED ") - ?2");
	sql_bind_int(&q, lease_now_ms);
	sql_bind_int(&q, now_ms);
	*wait_ms = -1;
	bool found = sql_step(&q);
	for (int column = 0; found && column < 4; column++) {
		bool awaited = !sql_is_null(&q);
		int64_t in_ms = sql_int(&q);
		in_ms = in_ms > 0 ? in_ms : 0;
		if (awaited && (*wait_ms < 0 || in_ms < *wait_ms))
			*wait_ms = in_ms;
	}
	return sql_end(&q, error);
}

/* --- leases ----------------------------------------------------------------------------------------------------- */

static enum tw_status next_expired(struct store *store, int64_t now_ms, struct job_run *run, bool *found,
				   struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT " JOB_RUN_COLUMNS " FROM " LEASED " AND lease_until_ms < ? LIMIT 1");
	sql_bind_int(&q, now_ms);
	*found = sql_step(&q);
	if (*found)
		job_state_read_run(&q, run);
	return sql_end(&q, error);
}

/* Whose fault it is that a lease ran out: nobody's where the machine was started anew, or where the worker could not
 * renew it because the disk was full. */
static enum tw_status expire(struct store *store, const struct job_run *run, struct tw_error *error)
{
	if (store_is_of_older_boot(store, run->lease_until_ms))
		return job_state_interrupt(store, run, error);
	if (sql_had_trouble(store) && !run->cancel_requested)
		return job_state_put_back(store, run->number, &(struct job_return){.ending = ATTEMPT_PUT_OFF}, error);
	return job_state_crash(store, run, error);
}

enum tw_status due_expire_leases(struct store *store, struct tw_error *error)
{
	int64_t now_ms = store_lease_now_ms(store);
	for (;;) {
		struct job_run run;
		bool found = false;
		enum tw_status status = next_expired(store, now_ms, &run, &found, error);
		if (status == TW_OK && found)
			status = expire(store, &run, error);
		if (status != TW_OK || !found)
			return status;
	}
}

/* --- deadlines -------------------------------------------------------------------------------------------------- */

static enum tw_status next_late(struct store *store, int64_t *job, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number FROM " LIMITED " AND cancel_at_ms <= ?"
					" ORDER BY cancel_at_ms LIMIT 1");
	sql_bind_int(&q, store_now_ms(store));
	*job = sql_step(&q) ? sql_int(&q) : 0;
	return sql_end(&q, error);
}

static enum tw_status cancel_late(struct store *store, bool *more, struct tw_error *error)
{
	for (int i = 0; i < CANCELS_MAX; i++) {
		int64_t job = 0;
		enum job_state state = JOB_QUEUED;
		enum tw_status status = next_late(store, &job, error);
		*more = job != 0;
		if (status != TW_OK || !job)
			return status;
		status = job_state_cancel(store, job, JOB_CANCEL_DEADLINE, &state, error);
		if (status != TW_OK)
			return status;
	}
	return TW_OK;
}

/* --- all of it -------------------------------------------------------------------------------------------------- */

enum tw_status due_end(struct store *store, bool *more, struct tw_error *error)
{
	bool late = false, paused = false, delayed = false;
	enum tw_status status = due_expire_leases(store, error);
	if (status == TW_OK)
		status = cancel_late(store, &late, error);
	if (status == TW_OK)
		status = job_state_end_pauses(store, &paused, error);
	if (status == TW_OK)
		status = job_state_end_delays(store, &delayed, error);
	*more = late || paused || delayed;
	return status;
}
