#include "storage/task.h"

#include "storage/chunk.h"
#include "storage/job_state.h"
#include "storage/jobs.h"
#include "storage/key.h"
#include "storage/row.h"

enum {
	READ_NOTED_MS = 3600 * 1000, /* finer than that nobody cares, and every note is a write */
	FRESH_MS = 2000,             /* who asked for a file may be about to read it */
	STEP_FILES = 50,             /* some 30 MiB of drawings, which the sweep removes within a second */
};

/* --- asking ----------------------------------------------------------------------------------------------------- */

/* What a task is found by. */
struct task {
	int64_t resource;
	enum job_kind kind;
	const char *argument;
};

static enum tw_status find_last(struct store *store, const struct task *task, int64_t *job, enum job_state *state,
				struct tw_error *error)
{
	struct sql q =
		sql_query(store, "SELECT number, state FROM job INDEXED BY job_by_subject"
				 " WHERE subject = ? AND argument = ? AND kind = ? ORDER BY number DESC LIMIT 1");
	sql_bind_int(&q, task->resource);
	sql_bind_text(&q, task->argument);
	sql_bind_int(&q, task->kind);
	*job = 0;
	*state = JOB_CANCELLED;
	if (sql_step(&q)) {
		*job = sql_int(&q);
		*state = (enum job_state)sql_int(&q);
	}
	return sql_end(&q, error);
}

static enum tw_status add(struct store *store, struct owner owner, const struct task *task,
			  const struct job_request *request, int64_t *job, struct tw_error *error)
{
	enum tw_status status = key_check_limits(store, owner.client, true, 0, error);
	if (status == TW_OK)
		status = job_state_add(store, owner, 0, task->kind, request, job, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, "UPDATE job SET subject = ?, argument = ? WHERE number = ?");
	sql_bind_int(&q, task->resource);
	sql_bind_text(&q, task->argument);
	sql_bind_int(&q, *job);
	return sql_run(&q, NULL, error);
}

static enum tw_status ask(struct store *store, struct owner owner, const struct task *task,
			  const struct job_request *request, int64_t *job, bool *added, struct tw_error *error)
{
	enum job_state state = JOB_QUEUED;
	enum tw_status status = find_last(store, task, job, &state, error);
	if (status != TW_OK || state == JOB_FAILED)
		return status;
	if (!job_state_is_final(state))
		return job_state_join(store, owner, *job, request, error);
	*added = true;
	return add(store, owner, task, request, job, error);
}

static enum tw_status read_id(struct store *store, int64_t job, char id[STORE_ID_SIZE], struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT id FROM job WHERE number = ?");
	sql_bind_int(&q, job);
	if (sql_step(&q))
		sql_copy_text(&q, id, STORE_ID_SIZE);
	return sql_end(&q, error);
}

enum tw_status task_ask(struct store *store, struct owner owner, enum job_kind kind, const char *resource_id,
			const char *argument, const struct job_request *request, struct job *job, bool *added,
			struct tw_error *error)
{
	struct task task = {.kind = kind, .argument = argument};
	char id[STORE_ID_SIZE] = "";
	int64_t number = 0;
	*added = false;
	enum tw_status status = sql_check_room(store, job_kind_row(kind)->room_bytes, error);
	if (status == TW_OK)
		status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = row_find_resource(store, owner.tenant, resource_id, &task.resource, error);
	if (status == TW_OK)
		status = ask(store, owner, &task, request, &number, added, error);
	if (status == TW_OK)
		status = read_id(store, number, id, error);
	status = transaction_end(store, status, error);
	return status == TW_OK ? job_get(store, owner.tenant, id, job, error) : status;
}

/* --- files that can be made again -------------------------------------------------------------------------------- */

static enum tw_status drop_some(struct store *store, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, CHUNK_LET_GO " WHERE number IN (SELECT number FROM blob INDEXED BY blob_of_task"
						     " WHERE of_task = 1 AND resource IS NOT NULL AND touched_ms < ?"
						     " ORDER BY touched_ms LIMIT ?)");
	sql_bind_int(&q, store_lease_now_ms(store) - FRESH_MS);
	sql_bind_int(&q, STEP_FILES);
	status = sql_run(&q, NULL, error);
	return transaction_end(store, status, error);
}

static enum tw_status has_some(struct store *store, bool *has, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT 1 FROM blob INDEXED BY blob_of_task"
					" WHERE of_task = 1 AND resource IS NOT NULL AND touched_ms < ? LIMIT 1");
	sql_bind_int(&q, store_lease_now_ms(store) - FRESH_MS);
	*has = sql_step(&q);
	return sql_end(&q, error);
}

enum tw_status task_drop_files(struct store *store, uint64_t room_bytes, struct tw_error *error)
{
	uint64_t room = 0;
	bool has = false;
	enum tw_status status = store_room(store, &room, error);
	if (status != TW_OK || room >= room_bytes)
		return status;
	status = has_some(store, &has, error);
	return status == TW_OK && has ? drop_some(store, error) : status;
}

bool task_is_read_seldom(const struct store *store, const struct blob *file)
{
	return file->read_ms && store_lease_now_ms(store) - file->read_ms > READ_NOTED_MS;
}

enum tw_status task_note_read(struct store *store, const struct blob *file, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, "UPDATE blob SET touched_ms = ? WHERE number = ? AND of_task = 1");
	sql_bind_int(&q, store_lease_now_ms(store));
	sql_bind_int(&q, file->number);
	status = sql_run(&q, NULL, error);
	return transaction_end(store, status, error);
}
