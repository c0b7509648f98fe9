#include "storage/lane.h"

#include "storage/job_sql.h"

#include <assert.h>

/* --- shares ----------------------------------------------------------------------------------------------------- */

struct share {
	int64_t pool, class, turn, weight;
	bool open;
};

static enum tw_status read_share(struct store *store, int64_t number, struct share *share, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT pool, class, turn, weight, open FROM share WHERE number = ?");
	sql_bind_int(&q, number);
	*share = (struct share){.open = true};
	if (sql_step(&q)) {
		share->pool = sql_int(&q);
		share->class = sql_int(&q);
		share->turn = sql_int(&q);
		share->weight = sql_int(&q);
		share->open = sql_int(&q);
	}
	return sql_end(&q, error);
}

/* Where the first of the open shares is; `own` where there is none. */
static enum tw_status first_turn(struct store *store, const struct share *share, int64_t *turn, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT turn FROM turn WHERE pool = ? AND class = ? ORDER BY turn LIMIT 1");
	sql_bind_int(&q, share->pool);
	sql_bind_int(&q, share->class);
	*turn = sql_step(&q) ? sql_int(&q) : share->turn;
	return sql_end(&q, error);
}

/* Not before the first of the others, and not more than a turn of its own behind it. */
static enum tw_status open_share(struct store *store, int64_t number, struct tw_error *error)
{
	struct share share;
	int64_t first = 0;
	enum tw_status status = read_share(store, number, &share, error);
	if (status != TW_OK || share.open)
		return status;
	status = first_turn(store, &share, &first, error);
	if (status != TW_OK)
		return status;
	int64_t last = first + LANE_TURN / share.weight;
	struct sql q = sql_query(store, "INSERT INTO turn(pool, class, turn, share) VALUES (?, ?, ?, ?)");
	sql_bind_int(&q, share.pool);
	sql_bind_int(&q, share.class);
	sql_bind_int(&q, share.turn < first ? first : share.turn > last ? last : share.turn);
	sql_bind_int(&q, number);
	status = sql_run(&q, NULL, error);
	if (status != TW_OK)
		return status;
	q = sql_query(store, "UPDATE share SET open = 1 WHERE number = ?");
	sql_bind_int(&q, number);
	return sql_run(&q, NULL, error);
}

/* --- groups ----------------------------------------------------------------------------------------------------- */

struct group {
	int64_t number; /* 0: none */
	int64_t max_running, running;
};

static void read_group(struct sql *q, struct group *group)
{
	group->number = sql_int(q);
	group->max_running = sql_int(q);
	group->running = sql_int(q);
}

static enum tw_status block_lanes(struct store *store, int64_t group, struct tw_error *error)
{
	struct sql q = sql_query(store, "UPDATE lane SET blocked = 1 WHERE job_group = ? AND job_group > 0"
					" AND blocked = 0");
	sql_bind_int(&q, group);
	return sql_run(&q, NULL, error);
}

static enum tw_status free_lanes(struct store *store, int64_t group, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	struct sql q = sql_query(store, "UPDATE lane SET blocked = 0 WHERE job_group = ? AND job_group > 0"
					" AND blocked = 1 RETURNING share, head_number");
	sql_bind_int(&q, group);
	while (status == TW_OK && sql_step(&q)) {
		int64_t share = sql_int(&q);
		bool has_ready = sql_int(&q) > 0;
		if (has_ready)
			status = open_share(store, share, error);
	}
	enum tw_status ended = sql_end(&q, status == TW_OK ? error : NULL);
	return status == TW_OK ? ended : status;
}

/* Its lanes are as its numbers say. */
static enum tw_status settle(struct store *store, const struct group *group, struct tw_error *error)
{
	return group->running < group->max_running ? free_lanes(store, group->number, error)
						   : block_lanes(store, group->number, error);
}

static enum tw_status count_running(struct store *store, int64_t job, int change, struct tw_error *error)
{
	struct group group = {0};
	struct sql q = sql_query(store, "UPDATE job_group SET running = running + ? WHERE number ="
					" (SELECT l.job_group FROM job j JOIN lane l ON l.number = j.lane"
					"  WHERE j.number = ? AND j.state = " SQL_RUNNING ")"
					" RETURNING number, max_running, running");
	sql_bind_int(&q, change);
	sql_bind_int(&q, job);
	if (sql_step(&q))
		read_group(&q, &group);
	enum tw_status status = sql_run(&q, NULL, error);
	return status == TW_OK && group.number ? settle(store, &group, error) : status;
}

enum tw_status lane_enter(struct store *store, int64_t job, struct tw_error *error)
{
	return count_running(store, job, 1, error);
}

enum tw_status lane_leave(struct store *store, int64_t job, struct tw_error *error)
{
	return count_running(store, job, -1, error);
}

static enum tw_status find_group(struct store *store, struct owner owner, const struct job_request *request,
				 struct group *group, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "SELECT number, max_running, running FROM job_group WHERE tenant = ? AND name = ?");
	sql_bind_int(&q, owner.tenant);
	sql_bind_text(&q, request->group);
	if (sql_step(&q))
		read_group(&q, group);
	return sql_end(&q, error);
}

static enum tw_status add_group(struct store *store, struct owner owner, const struct job_request *request,
				struct group *group, struct tw_error *error)
{
	struct sql q = sql_query(store, "INSERT INTO job_group(tenant, name, max_running) VALUES (?, ?, ?)"
					" RETURNING number, max_running, running");
	sql_bind_int(&q, owner.tenant);
	sql_bind_text(&q, request->group);
	sql_bind_int(&q, request->max_running ? request->max_running : 1);
	if (sql_step(&q))
		read_group(&q, group);
	return sql_run(&q, NULL, error);
}

static enum tw_status limit_group(struct store *store, uint32_t max_running, struct group *group,
				  struct tw_error *error)
{
	group->max_running = max_running;
	struct sql q = sql_query(store, "UPDATE job_group SET max_running = ? WHERE number = ?");
	sql_bind_int(&q, max_running);
	sql_bind_int(&q, group->number);
	enum tw_status status = sql_run(&q, NULL, error);
	return status == TW_OK ? settle(store, group, error) : status;
}

static enum tw_status take_group(struct store *store, struct owner owner, const struct job_request *request,
				 struct group *group, struct tw_error *error)
{
	*group = (struct group){0};
	if (!request->group || !*request->group)
		return TW_OK;
	enum tw_status status = find_group(store, owner, request, group, error);
	if (status == TW_OK && !group->number)
		return add_group(store, owner, request, group, error);
	if (status == TW_OK && request->max_running && request->max_running != group->max_running)
		return limit_group(store, request->max_running, group, error);
	return status;
}

/* --- lanes ------------------------------------------------------------------------------------------------------ */

static void bind_share(struct sql *q, struct owner owner, const struct job_request *request, enum job_kind kind)
{
	sql_bind_int(q, owner.tenant);
	sql_bind_int(q, owner.client);
	sql_bind_int(q, job_kind_row(kind)->pool);
	sql_bind_int(q, job_request_class(request));
}

static enum tw_status find_lane(struct store *store, struct owner owner, const struct job_request *request,
				enum job_kind kind, const struct group *group, int64_t *lane, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT l.number FROM share s JOIN lane l ON l.share = s.number"
					" WHERE s.tenant = ? AND s.client = ? AND s.pool = ? AND s.class = ?"
					" AND l.kind = ? AND l.job_group = ?");
	bind_share(&q, owner, request, kind);
	sql_bind_int(&q, kind);
	sql_bind_int(&q, group->number);
	*lane = sql_step(&q) ? sql_int(&q) : 0;
	return sql_end(&q, error);
}

static enum tw_status add_share(struct store *store, struct owner owner, const struct job_request *request,
				enum job_kind kind, struct tw_error *error)
{
	struct sql q = sql_query(store, "INSERT INTO share(tenant, client, pool, class) VALUES (?, ?, ?, ?)"
					" ON CONFLICT (tenant, client, pool, class) DO NOTHING");
	bind_share(&q, owner, request, kind);
	return sql_run(&q, NULL, error);
}

static enum tw_status add_lane(struct store *store, struct owner owner, const struct job_request *request,
			       enum job_kind kind, const struct group *group, int64_t *lane, struct tw_error *error)
{
	struct sql q = sql_query(store, "INSERT INTO lane(share, kind, job_group, blocked) SELECT number, ?5, ?6, ?7"
					" FROM share WHERE tenant = ?1 AND client = ?2 AND pool = ?3 AND class = ?4"
					" RETURNING number");
	bind_share(&q, owner, request, kind);
	sql_bind_int(&q, kind);
	sql_bind_int(&q, group->number);
	sql_bind_int(&q, group->number && group->running >= group->max_running);
	*lane = sql_step(&q) ? sql_int(&q) : 0;
	return sql_run(&q, NULL, error);
}

static enum tw_status weigh(struct store *store, struct owner owner, const struct job_request *request,
			    enum job_kind kind, struct tw_error *error)
{
	if (!request->weight)
		return TW_OK;
	assert(request->weight <= JOB_WEIGHT_MAX);
	struct sql q = sql_query(store, "UPDATE share SET weight = ?5 WHERE tenant = ?1 AND client = ?2 AND pool = ?3"
					" AND class = ?4 AND weight <> ?5");
	bind_share(&q, owner, request, kind);
	sql_bind_int(&q, request->weight);
	return sql_run(&q, NULL, error);
}

enum tw_status lane_find(struct store *store, struct owner owner, const struct job_request *request, enum job_kind kind,
			 int64_t *lane, struct tw_error *error)
{
	struct group group;
	enum tw_status status = take_group(store, owner, request, &group, error);
	if (status == TW_OK)
		status = find_lane(store, owner, request, kind, &group, lane, error);
	if (status == TW_OK && !*lane)
		status = add_share(store, owner, request, kind, error);
	if (status == TW_OK && !*lane)
		status = add_lane(store, owner, request, kind, &group, lane, error);
	return status == TW_OK ? weigh(store, owner, request, kind, error) : status;
}

enum tw_status lane_offer(struct store *store, int64_t lane, int64_t priority, int64_t job, struct tw_error *error)
{
	int64_t share = 0;
	struct sql q = sql_query(store, "UPDATE lane SET head_priority = ?2, head_number = ?3 WHERE number = ?1"
					" AND (head_number = 0 OR head_priority < ?2"
					"  OR (head_priority = ?2 AND head_number > ?3))"
					" RETURNING CASE blocked WHEN 0 THEN share ELSE 0 END");
	sql_bind_int(&q, lane);
	sql_bind_int(&q, priority);
	sql_bind_int(&q, job);
	if (sql_step(&q))
		share = sql_int(&q);
	enum tw_status status = sql_run(&q, NULL, error);
	return status == TW_OK && share ? open_share(store, share, error) : status;
}
