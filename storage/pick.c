/* A search goes from class to share to lane to job, and takes the first that it may: mostly the first of each. What it
 * cannot use it steps over; what turns out to be out of date (lane.h) it corrects, and looks again. */
#include "storage/pick.h"

#include "storage/job_sql.h"
#include "storage/lane.h"

#include <string.h>

enum {
	REPAIRS_MAX = 64, /* in one transaction: a write lock of less than a millisecond */
	LANES_MAX = 32,   /* of a share that are looked at: more hold nothing that the worker may do, or has room for */
	TOO_LARGE_MAX = 1000, /* jobs of a lane that are looked over for one that there is room for */
};

struct search {
	struct store *store;
	const struct claim_query *query;
	uint64_t room;
	struct pick *pick;
	bool may_write;
	int repairs;
	bool again; /* something was corrected: the share has to be looked at once more */
};

struct lane_head {
	int64_t number;
	int64_t kind;
	int64_t priority, job; /* no ready job of it comes before */
};

/* --- correcting ------------------------------------------------------------------------------------------------- */

static enum tw_status set_head(struct store *store, int64_t lane, int64_t priority, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE lane SET head_priority = ?, head_number = ? WHERE number = ?");
	sql_bind_int(&q, priority);
	sql_bind_int(&q, job);
	sql_bind_int(&q, lane);
	return sql_run(&q, NULL, error);
}

static enum tw_status close_if_empty(struct store *store, const struct pick *pick, struct tw_error *error)
{
	int64_t closed = 0;
	struct sql q = sql_query(store, "DELETE FROM turn WHERE pool = ?1 AND class = ?2 AND turn = ?3 AND share = ?4"
					" AND NOT EXISTS (SELECT 1 FROM lane INDEXED BY lane_open WHERE lane.share = ?4"
					" AND head_number > 0 AND blocked = 0)");
	sql_bind_int(&q, pick->pool);
	sql_bind_int(&q, pick->class);
	sql_bind_int(&q, pick->turn);
	sql_bind_int(&q, pick->share);
	enum tw_status status = sql_run(&q, &closed, error);
	if (status != TW_OK || !closed)
		return status;
	q = sql_query(store, "UPDATE share SET open = 0, turn = ? WHERE number = ?");
	sql_bind_int(&q, pick->turn);
	sql_bind_int(&q, pick->share);
	return sql_run(&q, NULL, error);
}

static bool may_repair(struct search *s)
{
	s->pick->stale = true;
	return s->may_write && s->repairs++ < REPAIRS_MAX;
}

/* --- a lane ----------------------------------------------------------------------------------------------------- */

/* A ready job, as the index shows it. */
struct ready {
	int64_t number, priority, affinity, room_bytes;
};

static bool fits(const struct search *s, const struct ready *job)
{
	return job->room_bytes <= 0 || (uint64_t)job->room_bytes <= s->room;
}

/* 2: the worker has just that in memory; 1: what it works on. */
static int warmth(const struct search *s, const struct ready *job)
{
	int best = 0;
	for (size_t i = 0; job->affinity && best < 2 && i < s->query->affinity_count; i++) {
		uint64_t differs = (uint64_t)job->affinity ^ (uint64_t)s->query->affinities[i];
		best = differs == 0 ? 2 : differs >> 32 == 0 ? 1 : best;
	}
	return best;
}

/* The first jobs of a lane, at most `limit`; *count of them. */
static enum tw_status read_ready(struct store *store, int64_t lane, int64_t limit, struct ready *jobs, size_t *count,
				 struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number, priority, affinity, room_bytes FROM job INDEXED BY job_ready"
					" WHERE lane = ? AND " SQL_READY " ORDER BY priority DESC, number LIMIT ?");
	sql_bind_int(&q, lane);
	sql_bind_int(&q, limit);
	*count = 0;
	while (sql_step(&q)) {
		struct ready *job = &jobs[(*count)++];
		job->number = sql_int(&q);
		job->priority = sql_int(&q);
		job->affinity = sql_int(&q);
		job->room_bytes = sql_int(&q);
	}
	return sql_end(&q, error);
}

static enum tw_status find_small(struct search *s, int64_t lane, int64_t *job, struct tw_error *error)
{
	struct sql q = sql_query(
		s->store, "SELECT number FROM (SELECT number, room_bytes FROM job INDEXED BY job_ready WHERE lane = ?"
			  " AND " SQL_READY " ORDER BY priority DESC, number LIMIT ?) f WHERE room_bytes <= ? LIMIT 1");
	sql_bind_int(&q, lane);
	sql_bind_int(&q, TOO_LARGE_MAX);
	sql_bind_int(&q, s->room < INT64_MAX ? (int64_t)s->room : INT64_MAX);
	*job = sql_step(&q) ? sql_int(&q) : 0;
	return sql_end(&q, error);
}

static enum tw_status may_pass(struct store *store, int64_t job, bool *may, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT passed FROM job WHERE number = ?");
	sql_bind_int(&q, job);
	*may = sql_step(&q) && sql_int(&q) < PICK_PREFERRED_MAX;
	return sql_end(&q, error);
}

/* The first, or one of those behind it that the worker has in memory what it needs for. */
static enum tw_status prefer(struct search *s, const struct ready *jobs, size_t count, struct tw_error *error)
{
	size_t best = 0;
	int best_warmth = warmth(s, &jobs[0]);
	bool may = false;
	for (size_t i = 1; i < count && jobs[i].priority == jobs[0].priority; i++)
		if (warmth(s, &jobs[i]) > best_warmth && fits(s, &jobs[i])) {
			best = i;
			best_warmth = warmth(s, &jobs[i]);
		}
	s->pick->job = jobs[0].number;
	if (best == 0)
		return TW_OK;
	enum tw_status status = may_pass(s->store, jobs[0].number, &may, error);
	if (status == TW_OK && may) {
		s->pick->job = jobs[best].number;
		s->pick->passed = jobs[0].number;
	}
	return status;
}

/* `next`: the lane behind it, or NULL; a lane whose head is not what it was taken for may have to come after that. */
static enum tw_status search_lane(struct search *s, const struct lane_head *lane, const struct lane_head *next,
				  struct tw_error *error)
{
	struct ready jobs[PICK_WINDOW];
	size_t count = 0;
	enum tw_status status =
		read_ready(s->store, lane->number, s->query->affinity_count ? PICK_WINDOW : 2, jobs, &count, error);
	if (status != TW_OK)
		return status;
	bool comes_later = count && next &&
			   (jobs[0].priority < next->priority ||
			    (jobs[0].priority == next->priority && jobs[0].number > next->job));
	if ((count == 0 || comes_later) && may_repair(s)) {
		s->again = true;
		return set_head(s->store, lane->number, count ? jobs[0].priority : 0, count ? jobs[0].number : 0,
				error);
	}
	if (count == 0)
		return TW_OK;
	s->pick->lane = lane->number;
	s->pick->is_last = count == 1;
	return fits(s, &jobs[0]) ? prefer(s, jobs, count, error) : find_small(s, lane->number, &s->pick->job, error);
}

/* --- a share ---------------------------------------------------------------------------------------------------- */

static enum tw_status read_lanes(struct store *store, int64_t share, struct lane_head lanes[LANES_MAX], size_t *count,
				 struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number, kind, head_priority, head_number FROM lane INDEXED BY lane_open"
					" WHERE share = ? AND head_number > 0 AND blocked = 0"
					" ORDER BY head_priority DESC, head_number LIMIT ?");
	sql_bind_int(&q, share);
	sql_bind_int(&q, LANES_MAX);
	*count = 0;
	while (sql_step(&q)) {
		struct lane_head *lane = &lanes[(*count)++];
		lane->number = sql_int(&q);
		lane->kind = sql_int(&q);
		lane->priority = sql_int(&q);
		lane->job = sql_int(&q);
	}
	return sql_end(&q, error);
}

static bool is_wanted(const struct search *s, const struct lane_head *lane)
{
	return lane->kind >= 0 && lane->kind < JOB_KINDS && s->query->kinds >> lane->kind & 1;
}

static enum tw_status search_lanes(struct search *s, struct tw_error *error)
{
	struct lane_head lanes[LANES_MAX];
	size_t count = 0;
	s->again = false;
	enum tw_status status = read_lanes(s->store, s->pick->share, lanes, &count, error);
	if (status == TW_OK && count == 0 && may_repair(s))
		return close_if_empty(s->store, s->pick, error);
	for (size_t i = 0; status == TW_OK && i < count && !s->pick->job && !s->again; i++)
		if (is_wanted(s, &lanes[i]))
			status = search_lane(s, &lanes[i], i + 1 < count ? &lanes[i + 1] : NULL, error);
	return status;
}

static enum tw_status search_share(struct search *s, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	do
		status = search_lanes(s, error);
	while (status == TW_OK && s->again && !s->pick->job);
	return status;
}

/* --- classes ---------------------------------------------------------------------------------------------------- */

/* The open share behind class, turn and share of the pick takes their place there; its class is JOB_CLASSES_END where
 * there is none. */
static enum tw_status next_share(struct search *s, struct tw_error *error)
{
	struct pick *pick = s->pick;
	struct sql q = sql_query(s->store, "SELECT class, turn, share FROM turn WHERE pool = ?"
					   " AND (class, turn, share) > (?, ?, ?) ORDER BY class, turn, share LIMIT 2");
	sql_bind_int(&q, pick->pool);
	sql_bind_int(&q, pick->class);
	sql_bind_int(&q, pick->turn);
	sql_bind_int(&q, pick->share);
	enum job_class class = sql_step(&q) ? (enum job_class)sql_int(&q) : JOB_CLASSES_END;
	if (class != JOB_CLASSES_END) {
		pick->turn = sql_int(&q);
		pick->share = sql_int(&q);
		pick->has_rivals = sql_step(&q) && sql_int(&q) == (int64_t) class;
	}
	pick->has_skipped = pick->has_skipped && pick->class == class;
	pick->class = class;
	return sql_end(&q, error);
}

/* Before the first of the class. */
static void go_to(struct pick *pick, enum job_class class)
{
	pick->class = class;
	pick->turn = -1;
	pick->share = 0;
	pick->has_skipped = false;
}

/* `classes`: JOB_CLASS_BIT… */
static enum tw_status search_classes(struct search *s, unsigned classes, struct tw_error *error)
{
	struct pick *pick = s->pick;
	go_to(pick, JOB_INTERACTIVE);
	for (;;) {
		enum tw_status status = next_share(s, error);
		if (status != TW_OK || pick->class >= JOB_CLASSES_END)
			return status;
		if (!(classes & JOB_CLASS_BIT(pick->class))) {
			go_to(pick, pick->class + 1);
			continue;
		}
		status = search_share(s, error);
		if (status != TW_OK || pick->job)
			return status;
		pick->has_skipped = true;
	}
}

static unsigned classes_of(const struct claim_query *query)
{
	return query->classes ? query->classes & JOB_CLASSES_ALL : JOB_CLASSES_ALL;
}

/* --- classes that were passed over ------------------------------------------------------------------------------ */

/* Of the pool: how often each was passed over since its last turn. */
static enum tw_status read_passes(struct search *s, struct tw_error *error)
{
	struct sql q = sql_query(s->store, "SELECT class, passed FROM class_turn WHERE pool = ? AND passed > 0");
	sql_bind_int(&q, s->pick->pool);
	memset(s->pick->passes, 0, sizeof s->pick->passes);
	while (sql_step(&q)) {
		int64_t class = sql_int(&q);
		if (class >= 0 && class < JOB_CLASSES_END)
			s->pick->passes[class] = sql_int(&q);
	}
	return sql_end(&q, error);
}

/* Its turn has come, whoever is there besides; the last class before others. */
static enum tw_status search_overdue(struct search *s, struct tw_error *error)
{
	enum tw_status status = read_passes(s, error);
	for (enum job_class class = JOB_BATCH; status == TW_OK && class > JOB_INTERACTIVE && !s->pick->job; class --)
		if (s->pick->passes[class] >= PICK_PASSES_MAX)
			status = search_classes(s, classes_of(s->query) & JOB_CLASS_BIT(class), error);
	return status;
}

static enum tw_status is_waiting(struct store *store, const struct pick *pick, enum job_class class, bool *waiting,
				 struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT 1 FROM turn WHERE pool = ? AND class = ? LIMIT 1");
	sql_bind_int(&q, pick->pool);
	sql_bind_int(&q, class);
	*waiting = sql_step(&q);
	return sql_end(&q, error);
}

static enum tw_status count_passes(struct store *store, const struct claim_query *query, const struct pick *pick,
				   struct tw_error *error)
{
	enum tw_status status = TW_OK;
	for (enum job_class class = pick->class + 1; status == TW_OK && class < JOB_CLASSES_END; class ++) {
		bool waiting = false;
		if (!(classes_of(query) & JOB_CLASS_BIT(class)))
			continue;
		status = is_waiting(store, pick, class, &waiting, error);
		if (status != TW_OK || !waiting)
			continue;
		struct sql q = sql_query(store, "INSERT INTO class_turn VALUES (?, ?, 1) ON CONFLICT (pool, class)"
						" DO UPDATE SET passed = class_turn.passed + 1");
		sql_bind_int(&q, pick->pool);
		sql_bind_int(&q, class);
		status = sql_run(&q, NULL, error);
	}
	return status;
}

static enum tw_status forget_passes(struct store *store, const struct pick *pick, struct tw_error *error)
{
	if (!pick->passes[pick->class])
		return TW_OK;
	struct sql q = sql_query(store, "UPDATE class_turn SET passed = 0 WHERE pool = ? AND class = ?");
	sql_bind_int(&q, pick->pool);
	sql_bind_int(&q, pick->class);
	return sql_run(&q, NULL, error);
}

/* --- the whole -------------------------------------------------------------------------------------------------- */

static bool works_in(const struct claim_query *query, enum job_pool pool)
{
	for (enum job_kind kind = 0; kind < JOB_KINDS; kind++)
		if (query->kinds & JOB_KIND_BIT(kind) && job_kind_row(kind)->pool == pool)
			return true;
	return false;
}

static enum tw_status search(struct search *s, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	for (enum job_pool pool = 0; status == TW_OK && pool < JOB_POOLS && !s->pick->job; pool++) {
		if (!works_in(s->query, pool))
			continue;
		s->pick->pool = pool;
		if (s->may_write)
			status = search_overdue(s, error);
		if (status == TW_OK && !s->pick->job)
			status = search_classes(s, classes_of(s->query), error);
	}
	return status;
}

enum tw_status pick_look(struct store *store, const struct claim_query *query, uint64_t room, struct pick *pick,
			 struct tw_error *error)
{
	*pick = (struct pick){0};
	return search(&(struct search){.store = store, .query = query, .room = room, .pick = pick}, error);
}

enum tw_status pick_find(struct store *store, const struct claim_query *query, uint64_t room, struct pick *pick,
			 struct tw_error *error)
{
	struct search s = {.store = store, .query = query, .room = room, .pick = pick, .may_write = true};
	*pick = (struct pick){0};
	enum tw_status status = search(&s, error);
	pick->stale = s.repairs > REPAIRS_MAX;
	return status;
}

/* Those that had nothing to be claimed come in again where this one was. */
static enum tw_status catch_up(struct store *store, const struct pick *pick, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE turn SET turn = ?3 WHERE pool = ?1 AND class = ?2 AND turn < ?3");
	sql_bind_int(&q, pick->pool);
	sql_bind_int(&q, pick->class);
	sql_bind_int(&q, pick->turn);
	return sql_run(&q, NULL, error);
}

static enum tw_status take_turn(struct store *store, struct pick *pick, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "UPDATE turn SET turn = turn + ?5 / (SELECT weight FROM share WHERE number = ?4)"
				 " WHERE pool = ?1 AND class = ?2 AND turn = ?3 AND share = ?4 RETURNING turn");
	sql_bind_int(&q, pick->pool);
	sql_bind_int(&q, pick->class);
	sql_bind_int(&q, pick->turn);
	sql_bind_int(&q, pick->share);
	sql_bind_int(&q, LANE_TURN);
	if (sql_step(&q))
		pick->turn = sql_int(&q);
	return sql_run(&q, NULL, error);
}

static enum tw_status note_passed(struct store *store, int64_t job, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE job SET passed = passed + 1 WHERE number = ?");
	sql_bind_int(&q, job);
	return sql_run(&q, NULL, error);
}

enum tw_status pick_taken(struct store *store, const struct claim_query *query, struct pick *pick,
			  struct tw_error *error)
{
	enum tw_status status = count_passes(store, query, pick, error);
	if (status == TW_OK)
		status = forget_passes(store, pick, error);
	if (status == TW_OK && pick->has_skipped)
		status = catch_up(store, pick, error);
	if (status == TW_OK && (pick->has_rivals || pick->has_skipped))
		status = take_turn(store, pick, error);
	if (status == TW_OK && pick->passed)
		status = note_passed(store, pick->passed, error);
	if (status != TW_OK || !pick->is_last)
		return status;
	status = set_head(store, pick->lane, 0, 0, error);
	return status == TW_OK ? close_if_empty(store, pick, error) : status;
}
