#include "storage/remove.h"

#include "storage/chunk.h"
#include "storage/job_sql.h"
#include "storage/lane.h"
#include "storage/sql.h"

/* What is made from a resource, directly or not, and itself. */
#define WITH_DOWN                                                                                                      \
	"WITH RECURSIVE down(resource) AS (VALUES (?)"                                                                 \
	" UNION SELECT n.resource FROM need n JOIN down d ON n.needed = d.resource) "

static enum tw_status let_go_of_blobs(struct store *store, int64_t resource, struct tw_error *error)
{
	struct sql q = sql_query(store, WITH_DOWN CHUNK_LET_GO " WHERE resource IN (SELECT resource FROM down)");
	sql_bind_int(&q, resource);
	return sql_run(&q, NULL, error);
}

/* Jobs that run go with what they make. */
static enum tw_status leave_groups(struct store *store, int64_t resource, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	struct sql q = sql_query(store, WITH_DOWN "SELECT number FROM job WHERE +state = " SQL_RUNNING
						  " AND (resource IN (SELECT resource FROM down)"
						  "  OR subject IN (SELECT resource FROM down))");
	sql_bind_int(&q, resource);
	while (status == TW_OK && sql_step(&q))
		status = lane_leave(store, sql_int(&q), error);
	enum tw_status ended = sql_end(&q, status == TW_OK ? error : NULL);
	return status == TW_OK ? ended : status;
}

enum tw_status resource_remove(struct store *store, int64_t resource, struct tw_error *error)
{
	enum tw_status status = let_go_of_blobs(store, resource, error);
	if (status == TW_OK)
		status = leave_groups(store, resource, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, WITH_DOWN "DELETE FROM resource WHERE number IN (SELECT resource FROM down)");
	sql_bind_int(&q, resource);
	return sql_run(&q, NULL, error);
}
