/* The plus in `+state` keeps SQLite from walking all queued jobs by their state where the few rows are known by
 * resource: with ten thousand jobs queued that is what every step would cost. */
#include "storage/job_state.h"

#include "storage/id.h"
#include "storage/lane.h"
#include "storage/sql.h"

#include <inttypes.h>
#include <string.h>

/* A job that takes all the memory of a machine kills service and worker at once, and must end some day too. */
enum {
	INTERRUPTIONS_FREE = 10,
	ATTEMPTS_DEFAULT = 3,
	STEP_JOBS = 64, /* whose pause or delay is ended at once: about a millisecond of the write lock */
};

static enum tw_status fail_lost(const struct job_ticket *ticket, struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_CONFLICT, "lease-lost", NULL,
		       "the lease on %s ran out or the job was removed; its result is not wanted any more",
		       ticket->job_id);
}

/* --- what becomes ready ------------------------------------------------------------------------------------------ */

/* Of the rows that a statement has changed: what offer_changed reads. */
#define RETURNING_OFFERS " RETURNING lane, priority, number, " SQL_READY

/* Ends the statement; its lanes are told of the jobs that are ready now. */
static enum tw_status offer_changed(struct sql *q, int64_t *changed, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	int64_t count = 0;
	for (; status == TW_OK && sql_step(q); count++) {
		int64_t lane = sql_int(q);
		int64_t priority = sql_int(q);
		int64_t job = sql_int(q);
		if (sql_int(q))
			status = lane_offer(q->store, lane, priority, job, error);
	}
	if (changed)
		*changed = count;
	enum tw_status ended = sql_end(q, status == TW_OK ? error : NULL);
	return status == TW_OK ? ended : status;
}

/* --- what waits for what ---------------------------------------------------------------------------------------- */

/* Counts again what queued jobs wait for; which jobs, follows. */
#define COUNT_NEEDS                                                                                                    \
	"UPDATE job SET waiting_for = (SELECT count(*) FROM need n JOIN job m ON m.resource = n.needed"                \
	" WHERE n.resource = job.resource AND m.state <> " SQL_SUCCEEDED ") WHERE +state = " SQL_QUEUED                \
	" AND resource IN "

/* Of `resource`, and of everything it is made from. */
static enum tw_status count_needs(struct store *store, int64_t resource, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "WITH RECURSIVE up(resource) AS (VALUES (?)"
				 " UNION SELECT n.needed FROM need n JOIN up ON n.resource = up.resource) " COUNT_NEEDS
				 "(SELECT resource FROM up)" RETURNING_OFFERS);
	sql_bind_int(&q, resource);
	return offer_changed(&q, NULL, error);
}

static enum tw_status release_dependents(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(store, COUNT_NEEDS "(SELECT n.resource FROM need n JOIN job d ON d.resource = n.needed"
						    " WHERE d.number = ?)" RETURNING_OFFERS);
	sql_bind_int(&q, job);
	return offer_changed(&q, NULL, error);
}

/* All that is made from it, directly or not, is still queued: nobody could claim it. */
static enum tw_status fail_dependents(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(
		store,
		"WITH RECURSIVE cause(resource, id, state, text) AS"
		" (SELECT r.number, r.id, j.state, j.failure_text FROM job j JOIN resource r ON r.number = j.resource"
		"  WHERE j.number = ?1),"
		" down(resource) AS (SELECT n.resource FROM need n, cause c WHERE n.needed = c.resource"
		"  UNION SELECT n.resource FROM need n JOIN down d ON n.needed = d.resource)"
		" UPDATE job SET state = " SQL_FAILED ", finished_ms = ?2, failure_status = ?3,"
		" failure_type = 'dependency-failed', failure_where = '', failure_text = (SELECT id ||"
		"  CASE state WHEN " SQL_CANCELLED " THEN ', which this is made from, was cancelled'"
		"  WHEN " SQL_INCOMPLETE " THEN ', which this is made from, is incomplete'"
		"  ELSE ', which this is made from, failed: ' || text END FROM cause)"
		" WHERE +state = " SQL_QUEUED " AND resource IN (SELECT resource FROM down)");
	sql_bind_int(&q, job);
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, TW_ERROR_CONFLICT);
	return sql_run(&q, NULL, error);
}

/* --- into the queue --------------------------------------------------------------------------------------------- */

/* What a request comes to: columns of a job. */
struct terms {
	int64_t tenant, client, class, priority, lane;
	int64_t not_before_ms, cancel_at_ms;
	int64_t transient;
	bool cancelled;   /* of a job: it was asked to stop */
	const char *word; /* borrowed */
};

static int64_t time_after(struct store *store, int64_t span_ms)
{
	int64_t now_ms = store_now_ms(store);
	return span_ms <= 0 ? 0 : span_ms < INT64_MAX - now_ms ? now_ms + span_ms : INT64_MAX;
}

static enum tw_status read_request(struct store *store, struct owner owner, const struct job_request *request,
				   enum job_kind kind, struct terms *terms, struct tw_error *error)
{
	*terms = (struct terms){
		.tenant = owner.tenant,
		.client = owner.client,
		.class = job_request_class(request),
		.priority = request->priority,
		.not_before_ms = request->not_before_ms,
		.cancel_at_ms = time_after(store, request->cancel_after_ms),
		.word = request->supersedes ? request->supersedes : "",
		.transient = request->transient,
	};
	return lane_find(store, owner, request, kind, &terms->lane, error);
}

/* A job that needs nothing is ready at once; what another waits for is counted first. */
static enum tw_status end_insert(struct sql *q, bool needs_nothing, int64_t *job, struct tw_error *error)
{
	int64_t lane = 0, priority = 0;
	bool ready = false;
	if (sql_step(q)) {
		lane = sql_int(q);
		priority = sql_int(q);
		*job = sql_int(q);
		ready = sql_int(q);
	}
	enum tw_status status = sql_run(q, NULL, error);
	return status == TW_OK && ready && needs_nothing ? lane_offer(q->store, lane, priority, *job, error) : status;
}

static enum tw_status insert(struct store *store, int64_t resource, enum job_kind kind, const struct terms *terms,
			     const struct job_request *request, int64_t *job, struct tw_error *error)
{
	char id[STORE_ID_SIZE];
	id_random(id, "job");
	struct sql q = sql_query(store, "INSERT INTO job(id, resource, kind, state, priority, attempts_max, room_bytes,"
					" created_ms, tenant, client, class, lane, not_before_ms, delayed,"
					" cancel_at_ms, supersedes, affinity, session, transient)"
					" VALUES (?, ?, ?, " SQL_QUEUED
					", ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)" RETURNING_OFFERS);
	sql_bind_text(&q, id);
	if (resource)
		sql_bind_int(&q, resource);
	else
		sql_bind_text(&q, NULL);
	sql_bind_int(&q, kind);
	sql_bind_int(&q, terms->priority);
	sql_bind_int(&q, request->attempts_max ? request->attempts_max : ATTEMPTS_DEFAULT);
	sql_bind_int(&q, (int64_t)job_kind_row(kind)->room_bytes);
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, terms->tenant);
	sql_bind_int(&q, terms->client);
	sql_bind_int(&q, terms->class);
	sql_bind_int(&q, terms->lane);
	sql_bind_int(&q, terms->not_before_ms);
	sql_bind_int(&q, terms->not_before_ms > store_now_ms(store));
	sql_bind_int(&q, terms->cancel_at_ms);
	sql_bind_text(&q, terms->word);
	sql_bind_int(&q, request->affinity);
	sql_bind_text(&q, request->session ? request->session : "");
	sql_bind_int(&q, terms->transient);
	return end_insert(&q, resource == 0, job, error);
}

static enum tw_status find_superseded(struct store *store, const struct terms *terms, int64_t but, int64_t *job,
				      struct tw_error *error)
{
	struct sql q =
		sql_query(store, "SELECT number FROM job INDEXED BY job_superseded WHERE tenant = ? AND client = ?"
				 " AND supersedes = ? AND supersedes <> '' AND " SQL_UNFINISHED
				 " AND cancel_requested = 0 AND number <> ? LIMIT 1");
	sql_bind_int(&q, terms->tenant);
	sql_bind_int(&q, terms->client);
	sql_bind_text(&q, terms->word);
	sql_bind_int(&q, but);
	*job = sql_step(&q) ? sql_int(&q) : 0;
	return sql_end(&q, error);
}

static enum tw_status supersede(struct store *store, const struct terms *terms, int64_t but, struct tw_error *error)
{
	while (*terms->word) {
		int64_t job = 0;
		enum job_state state = JOB_QUEUED;
		enum tw_status status = find_superseded(store, terms, but, &job, error);
		if (status != TW_OK || !job)
			return status;
		status = job_state_cancel(store, job, JOB_CANCEL_SUPERSEDED, &state, error);
		if (status != TW_OK)
			return status;
	}
	return TW_OK;
}

enum tw_status job_state_supersede(struct store *store, struct owner owner, const char *word, struct tw_error *error)
{
	const struct terms terms = {.tenant = owner.tenant, .client = owner.client, .word = word ? word : ""};
	return supersede(store, &terms, 0, error);
}

enum tw_status job_state_add(struct store *store, struct owner owner, int64_t resource, enum job_kind kind,
			     const struct job_request *request, int64_t *job, struct tw_error *error)
{
	struct terms terms;
	enum tw_status status = read_request(store, owner, request, kind, &terms, error);
	if (status == TW_OK)
		status = insert(store, resource, kind, &terms, request, job, error);
	if (status == TW_OK)
		status = supersede(store, &terms, *job, error);
	return status == TW_OK && resource ? count_needs(store, resource, error) : status;
}

enum tw_status job_state_expect_room(struct store *store, int64_t resource, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "UPDATE job SET room_bytes = room_bytes"
				 " + (SELECT coalesce(sum(size), 0) FROM blob WHERE resource = ?1)"
				 " + (SELECT coalesce(sum(b.size), 0) FROM need n JOIN blob b ON b.resource = n.needed"
				 "    WHERE n.resource = ?1 AND n.position = 0 AND b.role = ?2)"
				 " WHERE resource = ?1");
	sql_bind_int(&q, resource);
	sql_bind_int(&q, BLOB_ARRAY);
	return sql_run(&q, NULL, error);
}

static bool is_blamed(enum attempt_ending ending)
{
	return ending == ATTEMPT_FAILED || ending == ATTEMPT_CRASHED;
}

static enum tw_status queue_after(struct store *store, int64_t job, const struct job_return *how,
				  struct tw_error *error)
{
	uint64_t room_bytes = how->room_bytes;
	struct sql q = sql_query(store, "UPDATE job SET state = " SQL_QUEUED ", attempts = attempts - ?1,"
					" interruptions = interruptions + ?2, pause_until_ms = ?3,"
					" room_bytes = CASE WHEN ?4 > room_bytes THEN ?4 ELSE room_bytes END,"
					" lease_until_ms = 0, progress = 0, stage = ''"
					" WHERE number = ?5" RETURNING_OFFERS);
	sql_bind_int(&q, !is_blamed(how->ending));
	sql_bind_int(&q, how->ending == ATTEMPT_INTERRUPTED);
	sql_bind_int(&q, how->pause_ms ? store_lease_now_ms(store) + how->pause_ms : 0);
	sql_bind_int(&q, room_bytes < INT64_MAX ? (int64_t)room_bytes : INT64_MAX);
	sql_bind_int(&q, job);
	return offer_changed(&q, NULL, error);
}

enum tw_status job_state_put_back(struct store *store, int64_t job, const struct job_return *how,
				  struct tw_error *error)
{
	enum tw_status status = attempt_note(store, job, how->ending, how->failure, error);
	if (status == TW_OK)
		status = lane_leave(store, job, error);
	return status == TW_OK ? queue_after(store, job, how, error) : status;
}

/* What is due at `now_ms`, a step of it. */
static enum tw_status end_some(struct sql *q, int64_t now_ms, bool *more, struct tw_error *error)
{
	int64_t changed = 0;
	sql_bind_int(q, now_ms);
	sql_bind_int(q, STEP_JOBS);
	enum tw_status status = offer_changed(q, &changed, error);
	*more = changed == STEP_JOBS;
	return status;
}

enum tw_status job_state_end_pauses(struct store *store, bool *more, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE job SET pause_until_ms = 0 WHERE number IN"
					" (SELECT number FROM job INDEXED BY job_paused WHERE state = " SQL_QUEUED
					"  AND pause_until_ms > 0 AND pause_until_ms <= ?"
					"  ORDER BY pause_until_ms LIMIT ?)" RETURNING_OFFERS);
	return end_some(&q, store_lease_now_ms(store), more, error);
}

enum tw_status job_state_end_delays(struct store *store, bool *more, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE job SET delayed = 0 WHERE number IN"
					" (SELECT number FROM job INDEXED BY job_delayed WHERE state = " SQL_QUEUED
					"  AND delayed = 1 AND not_before_ms <= ?"
					"  ORDER BY not_before_ms LIMIT ?)" RETURNING_OFFERS);
	return end_some(&q, store_now_ms(store), more, error);
}

static enum tw_status forget_samples(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(store, "DELETE FROM recording_chunk WHERE resource ="
					" (SELECT resource FROM job WHERE number = ?)");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

/* A job without a resource is its own row only. */
static enum tw_status queue_again(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(
		store,
		"WITH RECURSIVE up(resource) AS (SELECT resource FROM job WHERE number = ?1"
		" UNION SELECT n.needed FROM need n JOIN up ON n.resource = up.resource"
		"  JOIN job m ON m.resource = n.needed WHERE m.state IN " SQL_REDRIVABLE ")"
		" UPDATE job SET state = " SQL_QUEUED ", attempts = 0, interruptions = 0, pause_until_ms = 0,"
		" cancel_requested = 0, cancel_at_ms = 0, supersedes = '', transient = 0, passed = 0, delayed = 0,"
		" not_before_ms = 0,"
		" progress = 0, stage = '', partial = NULL, failure_status = 0, failure_type = '',"
		" failure_where = '', failure_text = '', started_ms = 0, finished_ms = 0, worker = ''"
		" WHERE +state IN " SQL_REDRIVABLE
		" AND (number = ?1 OR resource IN (SELECT resource FROM up))" RETURNING_OFFERS);
	sql_bind_int(&q, job);
	return offer_changed(&q, NULL, error);
}

enum tw_status job_state_redrive(struct store *store, int64_t job, struct tw_error *error)
{
	int64_t resource = 0;
	enum tw_status status = forget_samples(store, job, error);
	if (status == TW_OK)
		status = queue_again(store, job, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, "SELECT resource FROM job WHERE number = ?");
	sql_bind_int(&q, job);
	if (sql_step(&q))
		resource = sql_int(&q);
	status = sql_end(&q, error);
	return status == TW_OK && resource ? count_needs(store, resource, error) : status;
}

/* --- running ---------------------------------------------------------------------------------------------------- */

enum tw_status job_state_take(struct store *store, int64_t job, const char *worker, struct job_ticket *ticket,
			      struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE job SET state = " SQL_RUNNING
					", attempts = attempts + 1, fence = fence + 1, worker = ?,"
					" lease_until_ms = ?, started_ms = ?, progress = 0, stage = '' WHERE number = ?"
					" RETURNING number, fence, kind, attempts, id, session, affinity,"
					" argument, (SELECT id FROM resource WHERE number = job.subject),"
					" (SELECT id FROM resource WHERE number = job.resource),"
					" (SELECT job_group FROM lane WHERE number = job.lane)");
	sql_bind_text(&q, worker);
	sql_bind_int(&q, store_lease_now_ms(store) + ticket->lease_ms);
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, job);
	bool has_group = false;
	if (sql_step(&q)) {
		ticket->number = sql_int(&q);
		ticket->fence = sql_int(&q);
		ticket->kind = (enum job_kind)sql_int(&q);
		ticket->attempt = (uint32_t)sql_int(&q);
		sql_copy_text(&q, ticket->job_id, sizeof ticket->job_id);
		sql_copy_text(&q, ticket->session, sizeof ticket->session);
		ticket->affinity = sql_int(&q);
		sql_copy_text(&q, ticket->argument, sizeof ticket->argument);
		sql_copy_text(&q, ticket->subject_id, sizeof ticket->subject_id);
		sql_copy_text(&q, ticket->resource_id, sizeof ticket->resource_id);
		has_group = sql_int(&q);
	}
	enum tw_status status = sql_run(&q, NULL, error);
	return status == TW_OK && has_group ? lane_enter(store, job, error) : status;
}

void job_state_read_run(struct sql *q, struct job_run *run)
{
	run->number = sql_int(q);
	run->attempts = sql_int(q);
	run->attempts_max = sql_int(q);
	run->interruptions = sql_int(q);
	run->lease_until_ms = sql_int(q);
	run->cancel_requested = sql_int(q);
}

enum tw_status job_state_check(struct store *store, const struct job_ticket *ticket, struct job_run *run,
			       struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT " JOB_RUN_COLUMNS
					" FROM job WHERE number = ? AND fence = ? AND state = " SQL_RUNNING);
	sql_bind_int(&q, ticket->number);
	sql_bind_int(&q, ticket->fence);
	bool own = sql_step(&q);
	if (own)
		job_state_read_run(&q, run);
	enum tw_status status = sql_end(&q, error);
	return status == TW_OK && !own ? fail_lost(ticket, error) : status;
}

enum tw_status job_state_renew(struct store *store, const struct job_ticket *ticket, double progress, const char *stage,
			       const char *partial, bool *cancel, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE job SET lease_until_ms = ?, progress = ?, stage = coalesce(?, stage),"
					" partial = coalesce(?, partial) WHERE number = ? AND fence = ?"
					" AND state = " SQL_RUNNING " RETURNING cancel_requested");
	sql_bind_int(&q, store_lease_now_ms(store) + ticket->lease_ms);
	sql_bind_real(&q, progress);
	sql_bind_text(&q, stage);
	sql_bind_text(&q, partial);
	sql_bind_int(&q, ticket->number);
	sql_bind_int(&q, ticket->fence);
	bool own = sql_step(&q);
	*cancel = own && sql_int(&q);
	enum tw_status status = sql_run(&q, NULL, error);
	return status == TW_OK && !own ? fail_lost(ticket, error) : status;
}

/* --- the end ---------------------------------------------------------------------------------------------------- */

static enum tw_status set_ended(struct store *store, int64_t job, enum job_state state, const struct tw_error *failure,
				struct tw_error *error)
{
	bool failed = state == JOB_FAILED && failure;
	struct sql q = sql_query(store, "UPDATE job SET state = ?1, finished_ms = ?2, lease_until_ms = 0,"
					" progress = CASE WHEN ?3 = 1 THEN 1.0 ELSE progress END,"
					" partial = CASE WHEN ?3 = 1 THEN NULL ELSE partial END, failure_status = ?4,"
					" failure_type = ?5, failure_where = ?6, failure_text = ?7 WHERE number = ?8");
	sql_bind_int(&q, state);
	sql_bind_int(&q, store_now_ms(store));
	sql_bind_int(&q, job_state_has_result(state));
	sql_bind_int(&q, failed ? failure->status : TW_OK);
	sql_bind_text(&q, failed && failure->type ? failure->type : "");
	sql_bind_text(&q, failed ? failure->where : "");
	sql_bind_text(&q, failed ? failure->text : "");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

/* A recording has a course only while nobody has ended it. */
static enum tw_status forget_course(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(store, "DELETE FROM recording_course WHERE resource ="
					" (SELECT resource FROM job WHERE number = ?)");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

/* `ending`: that of its last attempt, where it was running. */
static enum tw_status end_job(struct store *store, int64_t job, enum job_state state, enum attempt_ending ending,
			      const struct tw_error *failure, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	if (!job_state_has_result(state))
		status = attempt_note(store, job, ending, failure, error);
	if (status == TW_OK)
		status = lane_leave(store, job, error);
	if (status == TW_OK)
		status = set_ended(store, job, state, failure, error);
	if (status == TW_OK)
		status = forget_course(store, job, error);
	if (status != TW_OK)
		return status;
	return state == JOB_SUCCEEDED ? release_dependents(store, job, error) : fail_dependents(store, job, error);
}

enum tw_status job_state_end(struct store *store, int64_t job, enum job_state state, const struct tw_error *failure,
			     struct tw_error *error)
{
	assert(job_state_is_final(state));
	return end_job(store, job, state, state == JOB_CANCELLED ? ATTEMPT_CANCELLED : ATTEMPT_FAILED, failure, error);
}

enum tw_status job_state_crash(struct store *store, const struct job_run *run, struct tw_error *error)
{
	struct tw_error failure = {0};
	if (run->cancel_requested)
		return job_state_end(store, run->number, JOB_CANCELLED, NULL, error);
	if (run->attempts < run->attempts_max)
		return job_state_put_back(store, run->number, &(struct job_return){.ending = ATTEMPT_CRASHED}, error);
	(void)tw_fail(&failure, TW_ERROR_INTERNAL, "attempts-exhausted", NULL,
		      "every one of the %" PRId64 " workers that tried it died or hung; redrive it to try again",
		      run->attempts);
	return end_job(store, run->number, JOB_FAILED, ATTEMPT_CRASHED, &failure, error);
}

enum tw_status job_state_interrupt(struct store *store, const struct job_run *run, struct tw_error *error)
{
	if (run->cancel_requested || run->interruptions >= INTERRUPTIONS_FREE)
		return job_state_crash(store, run, error);
	return job_state_put_back(store, run->number, &(struct job_return){.ending = ATTEMPT_INTERRUPTED}, error);
}

enum tw_status job_state_cancel(struct store *store, int64_t job, enum job_cancel cause, enum job_state *state,
				struct tw_error *error)
{
	struct sql q =
		sql_query(store, "UPDATE job SET cancel_requested = CASE cancel_requested WHEN 0 THEN ?"
				 " ELSE cancel_requested END WHERE number = ? AND " SQL_UNFINISHED " RETURNING state");
	sql_bind_int(&q, cause);
	sql_bind_int(&q, job);
	*state = sql_step(&q) ? (enum job_state)sql_int(&q) : JOB_CANCELLED;
	enum tw_status status = sql_run(&q, NULL, error);
	if (status != TW_OK || *state != JOB_QUEUED)
		return status;
	*state = JOB_CANCELLED;
	return job_state_end(store, job, JOB_CANCELLED, NULL, error);
}

/* --- another request for the same ------------------------------------------------------------------------------- */

/* Of an unfinished job; *found is false where it is none. */
static enum tw_status read_terms(struct store *store, int64_t job, struct terms *terms, char word[JOB_WORD_SIZE],
				 enum job_kind *kind, bool *queued, bool *found, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT tenant, client, class, priority, lane, not_before_ms, cancel_at_ms,"
					" transient, cancel_requested, supersedes, kind, state = " SQL_QUEUED
					" FROM job WHERE number = ? AND " SQL_UNFINISHED);
	sql_bind_int(&q, job);
	*found = sql_step(&q);
	if (*found) {
		terms->tenant = sql_int(&q);
		terms->client = sql_int(&q);
		terms->class = sql_int(&q);
		terms->priority = sql_int(&q);
		terms->lane = sql_int(&q);
		terms->not_before_ms = sql_int(&q);
		terms->cancel_at_ms = sql_int(&q);
		terms->transient = sql_int(&q);
		terms->cancelled = sql_int(&q);
		sql_copy_text(&q, word, JOB_WORD_SIZE);
		*kind = (enum job_kind)sql_int(&q);
		*queued = sql_int(&q);
		terms->word = word;
	}
	return sql_end(&q, error);
}

static int64_t greater(int64_t a, int64_t b)
{
	return a > b ? a : b;
}

static int64_t smaller(int64_t a, int64_t b)
{
	return a < b ? a : b;
}

static void merge(struct terms *terms, const struct terms *other, bool queued)
{
	bool same_word = other->client == terms->client && !strcmp(terms->word, other->word);
	if (queued && other->class < terms->class) {
		terms->class = other->class;
		terms->client = other->client;
		terms->lane = other->lane;
	}
	terms->priority = greater(terms->priority, other->priority);
	terms->not_before_ms = smaller(terms->not_before_ms, other->not_before_ms);
	terms->cancel_at_ms =
		terms->cancel_at_ms && other->cancel_at_ms ? greater(terms->cancel_at_ms, other->cancel_at_ms) : 0;
	if (terms->cancelled) { /* then only the other wants it */
		terms->cancel_at_ms = other->cancel_at_ms;
		terms->word = other->client == terms->client ? other->word : "";
	}
	terms->transient = terms->transient && other->transient ? terms->transient + 1 : 0;
	if (!same_word && !terms->cancelled)
		terms->word = "";
}

static enum tw_status write_terms(struct store *store, int64_t job, const struct terms *terms, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "UPDATE job SET client = ?, class = ?, lane = ?, priority = ?, not_before_ms = ?,"
				 " delayed = ?, cancel_at_ms = ?, supersedes = ?, transient = ?,"
				 " cancel_requested = 0"
				 " WHERE number = ?" RETURNING_OFFERS);
	sql_bind_int(&q, terms->client);
	sql_bind_int(&q, terms->class);
	sql_bind_int(&q, terms->lane);
	sql_bind_int(&q, terms->priority);
	sql_bind_int(&q, terms->not_before_ms);
	sql_bind_int(&q, terms->not_before_ms > store_now_ms(store));
	sql_bind_int(&q, terms->cancel_at_ms);
	sql_bind_text(&q, terms->word);
	sql_bind_int(&q, terms->transient);
	sql_bind_int(&q, job);
	return offer_changed(&q, NULL, error);
}

/* Whether equal requests have one job between them: of others, a second one is a first one that is repeated. */
static bool is_shared(enum job_kind kind)
{
	const struct job_kind_row *row = job_kind_row(kind);
	return row->subject != RESOURCE_NONE || resource_kind_row(row->resource)->addressed;
}

static enum tw_status read_group(struct store *store, int64_t job, char name[JOB_WORD_SIZE], struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT g.name FROM job j JOIN lane l ON l.number = j.lane"
					" JOIN job_group g ON g.number = l.job_group WHERE j.number = ?");
	sql_bind_int(&q, job);
	name[0] = '\0';
	if (sql_step(&q))
		sql_copy_text(&q, name, JOB_WORD_SIZE);
	return sql_end(&q, error);
}

enum tw_status job_state_join(struct store *store, struct owner owner, int64_t job, const struct job_request *request,
			      struct tw_error *error)
{
	struct terms terms, other;
	enum job_kind kind = 0;
	char word[JOB_WORD_SIZE], group[JOB_WORD_SIZE];
	bool queued = false, found = false;
	struct job_request grouped = *request;
	enum tw_status status = read_terms(store, job, &terms, word, &kind, &queued, &found, error);
	if (status != TW_OK || !found || (terms.cancelled && !is_shared(kind)))
		return status;
	/* Who wants it sooner, and names no group, does not take it out of the one that it is in. */
	status = read_group(store, job, group, error);
	if (status != TW_OK)
		return status;
	if (!grouped.group || !*grouped.group)
		grouped.group = group;
	status = read_request(store, owner, &grouped, kind, &other, error);
	if (status != TW_OK)
		return status;
	merge(&terms, &other, queued);
	status = write_terms(store, job, &terms, error);
	return status == TW_OK ? supersede(store, &other, job, error) : status;
}

enum tw_status job_state_retry(struct store *store, struct owner owner, int64_t job, const struct job_request *request,
			       struct tw_error *error)
{
	struct terms terms, other;
	enum job_kind kind = 0;
	char word[JOB_WORD_SIZE];
	bool queued = false, found = false;
	enum tw_status status = job_state_redrive(store, job, error);
	if (status == TW_OK)
		status = read_terms(store, job, &terms, word, &kind, &queued, &found, error);
	if (status != TW_OK || !found)
		return status;
	status = read_request(store, owner, request, kind, &other, error);
	if (status == TW_OK)
		status = write_terms(store, job, &other, error);
	return status == TW_OK ? supersede(store, &other, job, error) : status;
}

/* What a resource is made from, directly or not. */
#define WITH_UP                                                                                                        \
	"WITH RECURSIVE up(resource) AS (SELECT needed FROM need WHERE resource = ?1"                                  \
	" UNION SELECT n.needed FROM need n JOIN up ON n.resource = up.resource) "

static enum tw_status keep_needs(struct store *store, int64_t resource, struct tw_error *error)
{
	struct sql q = sql_query(store, WITH_UP "UPDATE job SET cancel_at_ms = 0, supersedes = '', transient = 0"
						" WHERE resource IN (SELECT resource FROM up) AND +" SQL_UNFINISHED);
	sql_bind_int(&q, resource);
	return sql_run(&q, NULL, error);
}

static enum tw_status next_less_urgent(struct store *store, int64_t resource, const struct terms *terms, int64_t *job,
				       struct tw_error *error)
{
	struct sql q = sql_query(store, WITH_UP "SELECT number FROM job WHERE resource IN (SELECT resource FROM up)"
						" AND +state = " SQL_QUEUED " AND cancel_requested = 0"
						" AND (class > ?2 OR (class = ?2 AND priority < ?3)) LIMIT 1");
	sql_bind_int(&q, resource);
	sql_bind_int(&q, terms->class);
	sql_bind_int(&q, terms->priority);
	*job = sql_step(&q) ? sql_int(&q) : 0;
	return sql_end(&q, error);
}

enum tw_status job_state_hasten_needs(struct store *store, struct owner owner, int64_t resource,
				      const struct job_request *request, struct tw_error *error)
{
	const struct job_request urgency = {.class = job_request_class(request), .priority = request->priority};
	const struct terms terms = {.class = urgency.class, .priority = urgency.priority};
	enum tw_status status = keep_needs(store, resource, error);
	for (int64_t job = 1; status == TW_OK && job;) {
		status = next_less_urgent(store, resource, &terms, &job, error);
		if (status == TW_OK && job)
			status = job_state_join(store, owner, job, &urgency, error);
	}
	return status;
}
