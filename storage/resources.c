/* Resources: creating them with their job, reading, removing. */
#include "storage/resources.h"

#include "storage/address.h"
#include "storage/chunk.h"
#include "storage/id.h"
#include "storage/job_state.h"
#include "storage/key.h"
#include "storage/remove.h"
#include "storage/row.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

/* --- reading ---------------------------------------------------------------------------------------------------- */

static enum tw_status read_by_id(struct store *store, int64_t tenant, int kind, const char *id,
				 struct resource *resource, struct tw_error *error)
{
	struct sql q =
		sql_query(store, "SELECT " ROW_RESOURCE_COLUMNS " FROM resource r JOIN job j ON j.resource = r.number"
				 " WHERE r.id = ?1 AND (?2 < 0 OR r.kind = ?2) AND (?3 = -1 OR r.tenant = ?3)");
	sql_bind_text(&q, id);
	sql_bind_int(&q, kind);
	sql_bind_int(&q, tenant);
	bool found = sql_step(&q);
	if (found)
		row_read_resource(&q, resource);
	enum tw_status status = sql_end(&q, error);
	if (status != TW_OK && found)
		resource_clear(resource);
	if (status == TW_OK && !found)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-resource", NULL, "there is no %s %.64s",
				 kind < 0 ? "resource" : resource_kind_name((enum resource_kind)kind), id);
	return status;
}

enum tw_status resource_get(struct store *store, int64_t tenant, enum resource_kind kind, const char *id,
			    struct resource *resource, struct tw_error *error)
{
	return read_by_id(store, tenant, (int)kind, id, resource, error);
}

static void read_resource(struct sql *q, void *resource)
{
	row_read_resource(q, resource);
}

/* By the numbers of their jobs, which are in the order of their own: each comes with its job. */
static enum tw_status list_state(struct store *store, const struct resource_query *query, enum job_state state,
				 struct row_numbers *list, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number FROM job INDEXED BY job_by_kind WHERE tenant = ?"
					" AND kind = ? AND state = ? AND number < ? ORDER BY number DESC LIMIT ?");
	sql_bind_int(&q, query->tenant);
	sql_bind_int(&q, resource_kind_row(query->kind)->job);
	sql_bind_int(&q, state);
	sql_bind_int(&q, query->cursor > 0 ? query->cursor : INT64_MAX);
	sql_bind_int(&q, (int64_t)list->limit);
	return row_merge(list, &q, error);
}

/* What is made from a resource is found by that, and looked through for the state; by its own number. */
static enum tw_status list_needing(struct store *store, const struct resource_query *query, struct row_numbers *list,
				   struct tw_error *error)
{
	struct sql q = sql_query(
		store, "SELECT DISTINCT n.resource FROM need n JOIN job j ON j.resource = n.resource"
		       " WHERE n.needed = (SELECT number FROM resource WHERE id = ?1"
		       " AND tenant = ?6) AND n.resource < ?2 AND j.kind = ?3 AND (?4 = 0 OR ?4 >> j.state & 1)"
		       " ORDER BY n.resource DESC LIMIT ?5");
	sql_bind_text(&q, query->needs);
	sql_bind_int(&q, query->cursor > 0 ? query->cursor : INT64_MAX);
	sql_bind_int(&q, resource_kind_row(query->kind)->job);
	sql_bind_int(&q, query->states);
	sql_bind_int(&q, (int64_t)list->limit);
	sql_bind_int(&q, query->tenant);
	return row_merge(list, &q, error);
}

static enum tw_status list_numbers(struct store *store, const struct resource_query *query, struct row_numbers *list,
				   struct tw_error *error)
{
	enum tw_status status = TW_OK;
	if (query->needs)
		return list_needing(store, query, list, error);
	for (enum job_state state = 0; status == TW_OK && state < JOB_STATES; state++)
		if (!query->states || query->states >> state & 1)
			status = list_state(store, query, state, list, error);
	return status;
}

enum tw_status resource_list(struct store *store, const struct resource_query *query, struct resource_page *page,
			     struct tw_error *error)
{
	struct row_numbers list;
	struct row_page read = {0};
	enum tw_status status = row_numbers_init(&list, row_page_limit(query->limit) + 1, error);
	if (status == TW_OK)
		status = list_numbers(store, query, &list, error);
	if (status == TW_OK)
		status = row_read_numbers(store, &list,
					  query->needs ? "SELECT " ROW_RESOURCE_LIST_COLUMNS " FROM resource r"
							 " JOIN job j ON j.resource = r.number WHERE r.number = ?"
						       : "SELECT " ROW_RESOURCE_LIST_COLUMNS " FROM job j"
							 " JOIN resource r ON r.number = j.resource WHERE j.number = ?",
					  sizeof *page->resources, read_resource, &read, error);
	row_numbers_clear(&list);
	*page = (struct resource_page){read.rows, read.count, read.more ? read.last : 0};
	if (status != TW_OK)
		resource_page_clear(page);
	return status;
}

enum tw_status resource_needs(struct store *store, const char *id, enum resource_kind kind, char (**ids)[STORE_ID_SIZE],
			      size_t *count, struct tw_error *error)
{
	char(*list)[STORE_ID_SIZE] = NULL;
	size_t used = 0;
	size_t room = 0;
	struct sql q = sql_query(store, "SELECT m.id FROM resource r JOIN need n ON n.resource = r.number"
					" JOIN resource m ON m.number = n.needed WHERE r.id = ? AND m.kind = ?"
					" ORDER BY n.position");
	sql_bind_text(&q, id);
	sql_bind_int(&q, kind);
	while (sql_step(&q)) {
		if (used == room) {
			room = room ? 2 * room : 8;
			void *more = realloc(list, room * sizeof *list);
			if (!more) {
				q.code = SQLITE_NOMEM;
				break;
			}
			list = more;
		}
		sql_copy_text(&q, list[used++], STORE_ID_SIZE);
	}
	enum tw_status status = sql_end(&q, error);
	if (status != TW_OK) {
		free(list);
		return status;
	}
	*ids = list;
	*count = used;
	return TW_OK;
}

static enum tw_status has_outdated_need(struct store *store, const char *id, enum resource_kind kind, bool *outdated,
					struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT 1 FROM resource r JOIN need n ON n.resource = r.number"
					" JOIN resource m ON m.number = n.needed JOIN job j ON j.resource = m.number"
					" WHERE r.id = ? AND m.kind = ? AND m.version <> ?"
					" AND j.state IN " SQL_WITH_RESULT " LIMIT 1");
	sql_bind_text(&q, id);
	sql_bind_int(&q, kind);
	sql_bind_int(&q, resource_kind_row(kind)->version);
	*outdated = sql_step(&q);
	return sql_end(&q, error);
}

/* What is not computed yet will be by this release, whoever asked for it. */
enum tw_status resource_is_outdated(struct store *store, const struct resource *resource, bool *outdated,
				    struct tw_error *error)
{
	const struct resource_kind_row *kind = resource_kind_row(resource->kind);
	enum tw_status status = TW_OK;
	*outdated = job_state_has_result(resource->job.state) && resource->version != kind->version;
	for (unsigned i = 0; status == TW_OK && !*outdated && i < kind->need_count; i++)
		if (kind->needs[i].outdates)
			status = has_outdated_need(store, resource->id, kind->needs[i].kind, outdated, error);
	return status;
}

/* --- creating, inside one transaction --------------------------------------------------------------------------- */

static enum tw_status discard_uploads(struct store *store, const struct resource_draft *draft, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	for (size_t i = 0; status == TW_OK && i < draft->upload_count; i++) {
		struct sql q = sql_query(store, CHUNK_LET_GO " WHERE upload = ? AND tenant = ? AND resource IS NULL");
		sql_bind_text(&q, draft->uploads[i]);
		sql_bind_int(&q, draft->owner.tenant);
		status = sql_run(&q, NULL, error);
	}
	return status;
}

static enum tw_status take_uploads(struct store *store, int64_t resource, const struct resource_draft *draft,
				   struct tw_error *error)
{
	enum tw_status status = TW_OK;
	for (size_t i = 0; status == TW_OK && i < draft->upload_count; i++) {
		struct sql q = sql_query(store, "UPDATE blob SET resource = ? WHERE upload = ? AND tenant = ?");
		sql_bind_int(&q, resource);
		sql_bind_text(&q, draft->uploads[i]);
		sql_bind_int(&q, draft->owner.tenant);
		status = sql_run(&q, NULL, error);
	}
	return status;
}

static const char *unsuccessful_end(enum job_state state)
{
	return state == JOB_CANCELLED ? "was cancelled" : state == JOB_INCOMPLETE ? "is incomplete" : "has failed";
}

static enum tw_status refuse_failed_need(struct store *store, int64_t resource, struct tw_error *error)
{
	struct sql q = sql_query(
		store, "SELECT r.id, j.state, j.failure_text FROM need n JOIN resource r ON r.number = n.needed"
		       " JOIN job j ON j.resource = r.number WHERE n.resource = ? AND j.state IN " SQL_UNSUCCESSFUL
		       " LIMIT 1");
	sql_bind_int(&q, resource);
	enum tw_status refused = TW_OK;
	if (sql_step(&q)) {
		const char *id = sql_text(&q);
		const char *end = unsuccessful_end((enum job_state)sql_int(&q));
		const char *text = sql_text(&q);
		refused = tw_fail(error, TW_ERROR_CONFLICT, "dependency-failed", NULL,
				  "%s, which this would be made from, %s%s%.250s", id, end, *text ? ": " : "", text);
	}
	enum tw_status status = sql_end(&q, refused == TW_OK ? error : NULL);
	return refused != TW_OK ? refused : status;
}

static enum tw_status insert_needs(struct store *store, int64_t resource, const struct resource_draft *draft,
				   struct tw_error *error)
{
	for (size_t i = 0; i < draft->need_count; i++) {
		int64_t needed;
		enum tw_status status = row_find_resource(store, draft->owner.tenant, draft->needs[i], &needed, error);
		if (status != TW_OK)
			return status;
		struct sql q = sql_query(store, "INSERT INTO need(resource, position, needed) VALUES (?, ?, ?)");
		sql_bind_int(&q, resource);
		sql_bind_int(&q, (int64_t)i);
		sql_bind_int(&q, needed);
		status = sql_run(&q, NULL, error);
		if (status != TW_OK)
			return status;
	}
	return refuse_failed_need(store, resource, error);
}

static enum tw_status insert_resource(struct store *store, const char *id, const struct resource_draft *draft,
				      int64_t *number, struct tw_error *error)
{
	struct sql q = sql_query(store, "INSERT INTO resource(id, tenant, client, kind, version, name, options,"
					" created_ms) VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
	sql_bind_text(&q, id);
	sql_bind_int(&q, draft->owner.tenant);
	sql_bind_int(&q, draft->owner.client);
	sql_bind_int(&q, draft->kind);
	sql_bind_int(&q, resource_kind_row(draft->kind)->version);
	sql_bind_text(&q, draft->name ? draft->name : "");
	sql_bind_text(&q, draft->options ? draft->options : "{}");
	sql_bind_int(&q, store_now_ms(store));
	enum tw_status status = sql_run(&q, NULL, error);
	*number = sql_inserted(store);
	return status;
}

static enum tw_status insert_all(struct store *store, const char *id, const struct resource_draft *draft,
				 struct tw_error *error)
{
	int64_t number = 0, job = 0;
	enum tw_status status =
		key_check_limits(store, draft->owner.client, true, draft->options ? strlen(draft->options) : 0, error);
	if (status == TW_OK)
		status = insert_resource(store, id, draft, &number, error);
	if (status == TW_OK)
		status = insert_needs(store, number, draft, error);
	if (status == TW_OK)
		status = job_state_add(store, draft->owner, number, resource_kind_row(draft->kind)->job, &draft->queue,
				       &job, error);
	if (status == TW_OK && draft->need_count)
		status = job_state_hasten_needs(store, draft->owner, number, &draft->queue, error);
	if (status == TW_OK)
		status = take_uploads(store, number, draft, error);
	return status == TW_OK ? job_state_expect_room(store, number, error) : status;
}

static enum tw_status remember_key(struct store *store, const char *id, const struct resource_draft *draft,
				   const struct content_hash *fingerprint, struct tw_error *error)
{
	if (!draft->idempotency_key)
		return TW_OK;
	struct sql q = sql_query(store, "INSERT INTO idempotency(tenant, kind, key, fingerprint, resource)"
					" SELECT ?, ?, ?, ?, number FROM resource WHERE id = ? ON CONFLICT DO NOTHING");
	sql_bind_int(&q, draft->owner.tenant);
	sql_bind_int(&q, draft->kind);
	sql_bind_text(&q, draft->idempotency_key);
	sql_bind_bytes(&q, fingerprint->bytes, sizeof fingerprint->bytes);
	sql_bind_text(&q, id);
	return sql_run(&q, NULL, error);
}

/* `id` is "" when the key is new. */
static enum tw_status find_by_key(struct store *store, const struct resource_draft *draft,
				  const struct content_hash *fingerprint, char id[STORE_ID_SIZE],
				  struct tw_error *error)
{
	bool same = true;
	id[0] = '\0';
	if (!draft->idempotency_key)
		return TW_OK;
	struct sql q = sql_query(store, "SELECT r.id, i.fingerprint = ? FROM idempotency i"
					" JOIN resource r ON r.number = i.resource"
					" WHERE i.tenant = ? AND i.kind = ? AND i.key = ?");
	sql_bind_bytes(&q, fingerprint->bytes, sizeof fingerprint->bytes);
	sql_bind_int(&q, draft->owner.tenant);
	sql_bind_int(&q, draft->kind);
	sql_bind_text(&q, draft->idempotency_key);
	if (sql_step(&q)) {
		sql_copy_text(&q, id, STORE_ID_SIZE);
		same = sql_int(&q);
	}
	enum tw_status status = sql_end(&q, error);
	if (status == TW_OK && !same)
		status = tw_fail(error, TW_ERROR_CONFLICT, "idempotency-key-reused", NULL,
				 "this Idempotency-Key came with another request before; use a new one");
	return status;
}

static enum tw_status exists(struct store *store, const char *id, bool *found, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT 1 FROM resource WHERE id = ?");
	sql_bind_text(&q, id);
	*found = sql_step(&q);
	return sql_end(&q, error);
}

/* What there is of equal content. */
struct existing {
	int64_t resource, job;
	enum job_state state;
};

static enum tw_status find_existing(struct store *store, const char *id, struct existing *existing,
				    struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT r.number, j.number, j.state FROM resource r"
					" JOIN job j ON j.resource = r.number WHERE r.id = ?");
	sql_bind_text(&q, id);
	*existing = (struct existing){.state = JOB_SUCCEEDED};
	if (sql_step(&q)) {
		existing->resource = sql_int(&q);
		existing->job = sql_int(&q);
		existing->state = (enum job_state)sql_int(&q);
	}
	return sql_end(&q, error);
}

static enum tw_status retry(struct store *store, const struct resource_draft *draft, int64_t job,
			    enum resource_outcome *outcome, struct tw_error *error)
{
	*outcome = RESOURCE_RETRIED;
	enum tw_status status = key_check_limits(store, draft->owner.client, true, 0, error);
	return status == TW_OK ? job_state_retry(store, draft->owner, job, &draft->queue, error) : status;
}

/* Nothing to do, unless it failed the last time, or is yet to be made and more urgent now. */
static enum tw_status use_again(struct store *store, const char *id, const struct resource_draft *draft,
				enum resource_outcome *outcome, struct tw_error *error)
{
	struct existing existing;
	*outcome = RESOURCE_EXISTED;
	enum tw_status status = discard_uploads(store, draft, error);
	if (status == TW_OK)
		status = find_existing(store, id, &existing, error);
	if (status != TW_OK)
		return status;
	bool failed = existing.state == JOB_FAILED || existing.state == JOB_CANCELLED;
	bool may_retry = failed && resource_kind_row(draft->kind)->addressed;
	if (job_state_is_final(existing.state) && !may_retry)
		return resource_kind_row(draft->kind)->addressed
			       ? job_state_supersede(store, draft->owner, draft->queue.supersedes, error)
			       : TW_OK;
	status = may_retry ? retry(store, draft, existing.job, outcome, error)
			   : job_state_join(store, draft->owner, existing.job, &draft->queue, error);
	if (status != TW_OK || !draft->need_count)
		return status;
	return job_state_hasten_needs(store, draft->owner, existing.resource, &draft->queue, error);
}

/* The id that a draft has by its content, or a new one. */
static enum tw_status choose_id(struct store *store, const struct resource_draft *draft,
				const struct content_hash *fingerprint, char id[STORE_ID_SIZE], struct tw_error *error)
{
	struct content_hash address;
	const struct resource_kind_row *kind = resource_kind_row(draft->kind);
	enum tw_status status = address_of(store, draft, fingerprint, &address, error);
	if (kind->addressed)
		id_from_bytes(id, kind->name, address.bytes);
	else
		id_random(id, kind->name);
	return status;
}

static enum tw_status create(struct store *store, const struct resource_draft *draft, char id[STORE_ID_SIZE],
			     enum resource_outcome *outcome, struct tw_error *error)
{
	struct content_hash fingerprint;
	enum tw_status status = address_fingerprint(store, draft, &fingerprint, error);
	if (status == TW_OK)
		status = find_by_key(store, draft, &fingerprint, id, error);
	if (status != TW_OK)
		return status;
	bool found = id[0];
	if (!found) {
		status = choose_id(store, draft, &fingerprint, id, error);
		if (status == TW_OK)
			status = exists(store, id, &found, error);
	}
	if (status != TW_OK)
		return status;
	*outcome = RESOURCE_CREATED;
	status = found ? use_again(store, id, draft, outcome, error) : insert_all(store, id, draft, error);
	return status == TW_OK ? remember_key(store, id, draft, &fingerprint, error) : status;
}

enum tw_status resource_create(struct store *store, const struct resource_draft *draft, struct resource *resource,
			       enum resource_outcome *outcome, struct tw_error *error)
{
	char id[STORE_ID_SIZE];
	enum tw_status status = sql_check_room(store, draft->options ? strlen(draft->options) : 0, error);
	if (status == TW_OK)
		status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = create(store, draft, id, outcome, error);
	if (status == TW_OK)
		status = read_by_id(store, draft->owner.tenant, (int)draft->kind, id, resource, error);
	enum tw_status ended = transaction_end(store, status, error);
	if (status == TW_OK && ended != TW_OK)
		resource_clear(resource);
	return ended;
}

/* --- removing --------------------------------------------------------------------------------------------------- */

static enum tw_status refuse_in_use(struct store *store, int64_t resource, const char *id, struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT count(DISTINCT resource) FROM need WHERE needed = ?");
	sql_bind_int(&q, resource);
	int64_t users = sql_step(&q) ? sql_int(&q) : 0;
	enum tw_status status = sql_end(&q, error);
	if (status == TW_OK && users)
		status = tw_fail(
			error, TW_ERROR_CONFLICT, "resource-in-use", NULL,
			"%" PRId64
			" other resource%s made from %.64s; delete what is made from it first, or use ?dependents=true",
			users, users == 1 ? " is" : "s are", id);
	return status;
}

static enum tw_status delete_one(struct store *store, int64_t tenant, enum resource_kind kind, const char *id,
				 bool with_dependents, struct tw_error *error)
{
	int64_t number = 0;
	struct sql q = sql_query(store, "SELECT number FROM resource WHERE id = ? AND kind = ? AND tenant = ?");
	sql_bind_text(&q, id);
	sql_bind_int(&q, kind);
	sql_bind_int(&q, tenant);
	bool found = sql_step(&q);
	if (found)
		number = sql_int(&q);
	enum tw_status status = sql_end(&q, error);
	if (status == TW_OK && !found)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-resource", NULL, "there is no %s %.64s",
				 resource_kind_name(kind), id);
	if (status == TW_OK && !with_dependents)
		status = refuse_in_use(store, number, id, error);
	return status == TW_OK ? resource_remove(store, number, error) : status;
}

enum tw_status resource_delete(struct store *store, int64_t tenant, enum resource_kind kind, const char *id,
			       bool with_dependents, struct tw_error *error)
{
	enum tw_status status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = delete_one(store, tenant, kind, id, with_dependents, error);
	return transaction_end(store, status, error);
}
