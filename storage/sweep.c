/* Removing what was let go of, a few chunks at a time. */
#include "storage/sweep.h"

#include "storage/chunk.h"
#include "storage/sql.h"

enum { SWEEP_CHUNKS = 32 }; /* removed at once: a write lock of some milliseconds */

/* Without the write lock: mostly there is nothing. */
static enum tw_status find_litter(struct store *store, int64_t before_ms, int64_t *blob, struct tw_error *error)
{
	struct sql q = sql_query(
		store, "SELECT number FROM blob INDEXED BY blob_unused WHERE resource IS NULL AND touched_ms < ?"
		       " ORDER BY touched_ms LIMIT 1");
	sql_bind_int(&q, before_ms);
	*blob = sql_step(&q) ? sql_int(&q) : 0;
	return sql_end(&q, error);
}

static enum tw_status let_go(struct store *store, int64_t blob, int64_t before_ms, bool *gone, struct tw_error *error)
{
	int64_t changed = 0;
	struct sql q = sql_query(store, CHUNK_LET_GO " WHERE number = ? AND resource IS NULL AND touched_ms < ?");
	sql_bind_int(&q, blob);
	sql_bind_int(&q, before_ms);
	enum tw_status status = sql_run(&q, &changed, error);
	*gone = changed > 0;
	return status;
}

static enum tw_status remove_chunks(struct store *store, int64_t blob, int64_t *removed, struct tw_error *error)
{
	struct sql q = sql_query(store, "DELETE FROM chunk WHERE number IN"
					" (SELECT number FROM chunk WHERE blob = ? ORDER BY position LIMIT ?)");
	sql_bind_int(&q, blob);
	sql_bind_int(&q, SWEEP_CHUNKS);
	return sql_run(&q, removed, error);
}

static enum tw_status remove_row(struct store *store, int64_t blob, struct tw_error *error)
{
	struct sql q = sql_query(store, "DELETE FROM blob WHERE number = ?");
	sql_bind_int(&q, blob);
	return sql_run(&q, NULL, error);
}

/* It may have been taken up again since it was found. */
static enum tw_status remove_some(struct store *store, int64_t blob, int64_t before_ms, struct tw_error *error)
{
	bool gone = false;
	int64_t removed = 0;
	enum tw_status status = let_go(store, blob, before_ms, &gone, error);
	if (status == TW_OK && gone)
		status = remove_chunks(store, blob, &removed, error);
	return status == TW_OK && gone && removed < SWEEP_CHUNKS ? remove_row(store, blob, error) : status;
}

enum tw_status store_sweep(struct store *store, int64_t upload_age_ms, bool *more, struct tw_error *error)
{
	int64_t before_ms = store_lease_now_ms(store) - upload_age_ms;
	/* What was left before the machine's last start ages from that start on. */
	if (store_is_of_older_boot(store, before_ms))
		before_ms = 1;
	int64_t blob = 0;
	enum tw_status status = find_litter(store, before_ms, &blob, error);
	*more = blob != 0;
	if (status != TW_OK || !blob)
		return status;
	status = transaction_begin_alone(store, error);
	if (status != TW_OK)
		return status;
	status = remove_some(store, blob, before_ms, error);
	return transaction_end(store, status, error);
}
