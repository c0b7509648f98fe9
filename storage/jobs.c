#include "storage/jobs.h"

#include "storage/job_state.h"
#include "storage/row.h"

#include <string.h>

static enum tw_status no_such_job(const char *id, struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-job", NULL, "there is no job %.64s", id);
}

enum tw_status job_get(struct store *store, int64_t tenant, const char *id, struct job *job, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "SELECT " ROW_JOB_COLUMNS " FROM job j LEFT JOIN resource r ON r.number = j.resource"
				 " WHERE j.id = ?1 AND (?2 = -1 OR j.tenant = ?2)");
	sql_bind_text(&q, id);
	sql_bind_int(&q, tenant);
	bool found = sql_step(&q);
	if (found)
		row_read_job(&q, job);
	enum tw_status status = sql_end(&q, error);
	if (status != TW_OK && found)
		job_clear(job);
	return status == TW_OK && !found ? no_such_job(id, error) : status;
}

static void read_job(struct sql *q, void *job)
{
	row_read_job(q, job);
}

/* page->next is the cursor of the last row. */
static enum tw_status read_page(struct sql *q, uint32_t limit, struct job_page *page, struct tw_error *error)
{
	struct row_page read;
	enum tw_status status = row_read_page(q, limit, sizeof *page->jobs, read_job, &read, error);
	*page = (struct job_page){read.rows, read.count, read.last};
	if (status != TW_OK)
		job_page_clear(page);
	return status;
}

/* Whether a job is what the query means, beside that by which it is found; bound by bind_match. */
#define MATCHES " AND " SQL_MATCHES("?1", "?2", "?3")

static void bind_match(struct sql *q, const struct job_query *query)
{
	sql_bind_int(q, query->classes);
	sql_bind_int(q, query->created_before_ms);
	sql_bind_text(q, query->group ? query->group : "");
}

/* The part of the list that is of one kind and state. */
static enum tw_status list_part(struct store *store, const struct job_query *query, enum job_kind kind,
				enum job_state state, int64_t cursor, struct row_numbers *list, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number FROM job INDEXED BY job_by_kind WHERE tenant = ?4 AND kind = ?5"
					" AND state = ?6 AND number < ?7" MATCHES " ORDER BY number DESC LIMIT ?8");
	bind_match(&q, query);
	sql_bind_int(&q, query->tenant);
	sql_bind_int(&q, kind);
	sql_bind_int(&q, state);
	sql_bind_int(&q, cursor);
	sql_bind_int(&q, (int64_t)list->limit);
	return row_merge(list, &q, error);
}

static enum tw_status list_state(struct store *store, const struct job_query *query, enum job_state state,
				 int64_t cursor, struct row_numbers *list, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "SELECT number FROM job INDEXED BY job_by_state WHERE tenant = ?4 AND state = ?5"
				 " AND number < ?6" MATCHES " ORDER BY number DESC LIMIT ?7");
	bind_match(&q, query);
	sql_bind_int(&q, query->tenant);
	sql_bind_int(&q, state);
	sql_bind_int(&q, cursor);
	sql_bind_int(&q, (int64_t)list->limit);
	return row_merge(list, &q, error);
}

static enum tw_status list_problem(struct store *store, const struct job_query *query, int64_t cursor,
				   struct row_numbers *list, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "SELECT number FROM job INDEXED BY job_by_problem WHERE tenant = ?4"
				 " AND failure_type = ?5 AND failure_type <> '' AND number < ?6"
				 " AND (?7 = 0 OR ?7 >> kind & 1 = 1) AND (?8 = 0 OR ?8 >> state & 1 = 1)" MATCHES
				 " ORDER BY number DESC LIMIT ?9");
	bind_match(&q, query);
	sql_bind_int(&q, query->tenant);
	sql_bind_text(&q, query->failure_type);
	sql_bind_int(&q, cursor);
	sql_bind_int(&q, query->kinds);
	sql_bind_int(&q, query->states);
	sql_bind_int(&q, (int64_t)list->limit);
	return row_merge(list, &q, error);
}

static enum tw_status list_numbers(struct store *store, const struct job_query *query, struct row_numbers *list,
				   struct tw_error *error)
{
	enum tw_status status = TW_OK;
	int64_t cursor = query->cursor > 0 ? query->cursor : INT64_MAX;
	if (query->failure_type)
		return list_problem(store, query, cursor, list, error);
	for (enum job_state state = 0; status == TW_OK && state < JOB_STATES; state++) {
		if (query->states && !(query->states >> state & 1))
			continue;
		if (!query->kinds)
			status = list_state(store, query, state, cursor, list, error);
		for (enum job_kind kind = 0; status == TW_OK && kind < JOB_KINDS; kind++)
			if (query->kinds >> kind & 1)
				status = list_part(store, query, kind, state, cursor, list, error);
	}
	return status;
}

enum tw_status job_list(struct store *store, const struct job_query *query, struct job_page *page,
			struct tw_error *error)
{
	struct row_numbers list;
	struct row_page read = {0};
	enum tw_status status = row_numbers_init(&list, row_page_limit(query->limit) + 1, error);
	if (status == TW_OK)
		status = list_numbers(store, query, &list, error);
	if (status == TW_OK)
		status = row_read_numbers(store, &list,
					  "SELECT " ROW_JOB_COLUMNS " FROM job j LEFT JOIN resource r"
					  " ON r.number = j.resource WHERE j.number = ?",
					  sizeof *page->jobs, read_job, &read, error);
	row_numbers_clear(&list);
	*page = (struct job_page){read.rows, read.count, read.more ? read.last : 0};
	if (status != TW_OK)
		job_page_clear(page);
	return status;
}

enum tw_status job_list_running(struct store *store, struct job_page *page, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT j.number, " ROW_JOB_COLUMNS " FROM job j INDEXED BY job_leased"
					" LEFT JOIN resource r ON r.number = j.resource WHERE j.state = " SQL_RUNNING
					" ORDER BY j.lease_until_ms LIMIT 1000");
	enum tw_status status = read_page(&q, 1000, page, error);
	page->next = 0;
	return status;
}

static enum tw_status newest_change(struct store *store, int64_t *change, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT value FROM change");
	*change = sql_step(&q) ? sql_int(&q) : 0;
	return sql_end(&q, error);
}

enum tw_status job_changes(struct store *store, int64_t since, uint32_t limit, struct job_page *page,
			   struct tw_error *error)
{
	if (since < 0) {
		memset(page, 0, sizeof *page);
		return newest_change(store, &page->next, error);
	}
	limit = row_page_limit(limit);
	struct sql q = sql_query(store, "SELECT j.change, " ROW_JOB_COLUMNS
					" FROM job j LEFT JOIN resource r ON r.number = j.resource"
					" WHERE j.change > ? ORDER BY j.change LIMIT ?");
	sql_bind_int(&q, since);
	sql_bind_int(&q, limit);
	enum tw_status status = read_page(&q, limit, page, error);
	if (status == TW_OK && page->count == 0)
		page->next = since;
	return status;
}

static enum tw_status find_oldest(struct store *store, enum job_class class, struct job_counts *counts,
				  struct tw_error *error)
{
	int64_t now_ms = store_now_ms(store);
	struct sql q = sql_query(store, "SELECT min(created_ms) FROM job INDEXED BY job_oldest WHERE class = ?"
					" AND " SQL_READY);
	sql_bind_int(&q, class);
	int64_t created_ms = sql_step(&q) ? sql_int(&q) : 0;
	int64_t age_ms = created_ms && created_ms < now_ms ? now_ms - created_ms : 0;
	counts->oldest_of_class_ms[class] = age_ms;
	if (age_ms > counts->oldest_ms)
		counts->oldest_ms = age_ms;
	return sql_end(&q, error);
}

enum tw_status job_count(struct store *store, struct job_counts *counts, struct tw_error *error)
{
	memset(counts, 0, sizeof *counts);
	struct sql q = sql_query(store, "SELECT state, count FROM job_count");
	while (sql_step(&q)) {
		int64_t state = sql_int(&q);
		if (state >= 0 && state < JOB_STATES)
			counts->by_state[state] += (uint64_t)sql_int(&q);
	}
	enum tw_status status = sql_end(&q, error);
	if (status != TW_OK)
		return status;
	for (enum job_class class = JOB_INTERACTIVE; status == TW_OK && class < JOB_CLASSES_END; class ++)
		status = find_oldest(store, class, counts, error);
	return status;
}

/* A job by id, as far as cancelling and redriving have to know it. */
static enum tw_status find_job(struct store *store, int64_t tenant, const char *id, int64_t *number,
			       enum job_state *state, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number, state FROM job WHERE id = ? AND tenant = ?");
	sql_bind_text(&q, id);
	sql_bind_int(&q, tenant);
	bool found = sql_step(&q);
	if (found) {
		*number = sql_int(&q);
		*state = (enum job_state)sql_int(&q);
	}
	enum tw_status status = sql_end(&q, error);
	return status == TW_OK && !found ? no_such_job(id, error) : status;
}

static enum tw_status cancel_one(struct store *store, int64_t tenant, const char *id, enum job_state *state,
				 struct tw_error *error)
{
	int64_t number = 0;
	enum tw_status status = find_job(store, tenant, id, &number, state, error);
	if (status != TW_OK)
		return status;
	if (job_state_is_final(*state))
		return tw_fail(error, TW_ERROR_CONFLICT, "job-finished", NULL,
			       "the job %.64s has %s and cannot be cancelled", id,
			       *state == JOB_CANCELLED ? "been cancelled" : job_state_name(*state));
	return job_state_cancel(store, number, JOB_CANCEL_ASKED, state, error);
}

enum tw_status job_cancel(struct store *store, int64_t tenant, const char *id, enum job_state *state,
			  struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = cancel_one(store, tenant, id, state, error);
	return transaction_end(store, status, error);
}

static enum tw_status cancel_if_unwanted(struct store *store, const char *id, int64_t requests, bool *cancelled,
					 struct tw_error *error)
{
	int64_t number = 0;
	enum job_state state = JOB_QUEUED;
	struct sql q = sql_query(
		store,
		"SELECT number FROM job WHERE id = ?1 AND " SQL_UNFINISHED
		" AND transient = ?2 AND transient > 0 AND NOT EXISTS (SELECT 1 FROM need n"
		" JOIN job d ON d.resource = n.resource WHERE n.needed = job.resource AND d." SQL_UNFINISHED ")");
	sql_bind_text(&q, id);
	sql_bind_int(&q, requests);
	*cancelled = sql_step(&q);
	if (*cancelled)
		number = sql_int(&q);
	enum tw_status status = sql_end(&q, error);
	return status == TW_OK && *cancelled ? job_state_cancel(store, number, JOB_CANCEL_UNWANTED, &state, error)
					     : status;
}

enum tw_status job_cancel_unwanted(struct store *store, const char *id, int64_t requests, bool *cancelled,
				   struct tw_error *error)
{
	*cancelled = false;
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	status = cancel_if_unwanted(store, id, requests, cancelled, error);
	return transaction_end(store, status, error);
}

static enum tw_status redrive_one(struct store *store, int64_t tenant, const char *id, struct tw_error *error)
{
	int64_t number = 0;
	enum job_state state = JOB_QUEUED;
	enum tw_status status = find_job(store, tenant, id, &number, &state, error);
	if (status != TW_OK)
		return status;
	if (state != JOB_FAILED && state != JOB_CANCELLED)
		return tw_fail(error, TW_ERROR_CONFLICT, "job-not-failed", NULL,
			       "the job %.64s is %s; only a failed or cancelled job can be redriven", id,
			       job_state_name(state));
	return job_state_redrive(store, number, error);
}

enum tw_status job_redrive(struct store *store, int64_t tenant, const char *id, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = redrive_one(store, tenant, id, error);
	return transaction_end(store, status, error);
}
