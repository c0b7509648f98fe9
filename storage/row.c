#include "storage/row.h"

#include <stdlib.h>
#include <string.h>

void row_read_job(struct sql *q, struct job *job)
{
	memset(job, 0, sizeof *job);
	sql_copy_text(q, job->id, sizeof job->id);
	sql_copy_text(q, job->resource_id, sizeof job->resource_id);
	job->kind = (enum job_kind)sql_int(q);
	job->state = (enum job_state)sql_int(q);
	job->cancel_cause = (enum job_cancel)sql_int(q);
	job->cancel_requested = job->cancel_cause != JOB_CANCEL_NONE;
	job->waiting_for = (uint32_t)sql_int(q);
	job->attempts = (uint32_t)sql_int(q);
	job->attempts_max = (uint32_t)sql_int(q);
	job->priority = (int32_t)sql_int(q);
	job->progress = sql_real(q);
	sql_copy_text(q, job->stage, sizeof job->stage);
	job->partial = sql_own_text(q);
	sql_copy_text(q, job->worker, sizeof job->worker);
	job->created_ms = sql_int(q);
	job->started_ms = sql_int(q);
	job->finished_ms = sql_int(q);
	job->lease_until_ms = sql_int(q);
	job->change = sql_int(q);
	job->failure.status = (enum tw_status)sql_int(q);
	sql_copy_text(q, job->failure.type, sizeof job->failure.type);
	sql_copy_text(q, job->failure.where, sizeof job->failure.where);
	sql_copy_text(q, job->failure.text, sizeof job->failure.text);
	job->class = (enum job_class)sql_int(q);
	job->transient = (uint32_t)sql_int(q);
	job->not_before_ms = sql_int(q);
	job->cancel_at_ms = sql_int(q);
	sql_copy_text(q, job->group, sizeof job->group);
	sql_copy_text(q, job->argument, sizeof job->argument);
	sql_copy_text(q, job->subject_id, sizeof job->subject_id);
}

void row_read_resource(struct sql *q, struct resource *resource)
{
	memset(resource, 0, sizeof *resource);
	sql_copy_text(q, resource->id, sizeof resource->id);
	resource->owner.tenant = sql_int(q);
	resource->owner.client = sql_int(q);
	resource->kind = (enum resource_kind)sql_int(q);
	resource->version = (uint32_t)sql_int(q);
	resource->name = sql_own_text(q);
	resource->options = sql_own_text(q);
	resource->summary = sql_own_text(q);
	resource->created_ms = sql_int(q);
	row_read_job(q, &resource->job);
}

uint32_t row_page_limit(uint32_t limit)
{
	return limit < 1 ? 1 : limit > 1000 ? 1000 : limit;
}

enum tw_status row_read_page(struct sql *q, uint32_t limit, size_t size, void (*read)(struct sql *q, void *row),
			     struct row_page *page, struct tw_error *error)
{
	*page = (struct row_page){.rows = calloc(limit, size)};
	if (!page->rows)
		q->code = SQLITE_NOMEM;
	while (sql_step(q)) {
		page->more = page->count == limit;
		if (page->more)
			break;
		page->last = sql_int(q);
		read(q, (char *)page->rows + size * page->count++);
	}
	return sql_end(q, error);
}

enum tw_status row_numbers_init(struct row_numbers *list, uint32_t limit, struct tw_error *error)
{
	*list = (struct row_numbers){.numbers = malloc(2 * limit * sizeof *list->numbers), .limit = limit};
	return list->numbers ? TW_OK : tw_fail_memory(error);
}

void row_numbers_clear(struct row_numbers *list)
{
	free(list->numbers);
	list->numbers = NULL;
}

static int newest_first(const void *a, const void *b)
{
	int64_t left = *(const int64_t *)a, right = *(const int64_t *)b;
	return (left < right) - (left > right);
}

enum tw_status row_merge(struct row_numbers *list, struct sql *q, struct tw_error *error)
{
	for (size_t added = 0; added < list->limit && sql_step(q); added++)
		list->numbers[list->count++] = sql_int(q);
	qsort(list->numbers, list->count, sizeof *list->numbers, newest_first);
	if (list->count > list->limit)
		list->count = list->limit;
	return sql_end(q, error);
}

/* A row that was deleted since its number was read is left out. */
enum tw_status row_read_numbers(struct store *store, const struct row_numbers *list, const char *text, size_t size,
				void (*read)(struct sql *q, void *row), struct row_page *page, struct tw_error *error)
{
	*page = (struct row_page){.rows = calloc(list->limit, size), .more = list->count == list->limit};
	if (!page->rows)
		return tw_fail_memory(error);
	enum tw_status status = TW_OK;
	size_t shown = page->more ? list->count - 1 : list->count;
	for (size_t i = 0; status == TW_OK && i < shown; i++) {
		struct sql q = sql_query(store, text);
		sql_bind_int(&q, list->numbers[i]);
		if (sql_step(&q))
			read(&q, (char *)page->rows + size * page->count++);
		page->last = list->numbers[i];
		status = sql_end(&q, error);
	}
	return status;
}

enum tw_status row_find_resource(struct store *store, int64_t tenant, const char *id, int64_t *number,
				 struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number FROM resource WHERE id = ?1 AND (?2 = -1 OR tenant = ?2)");
	sql_bind_text(&q, id);
	sql_bind_int(&q, tenant);
	bool found = sql_step(&q);
	*number = found ? sql_int(&q) : 0;
	enum tw_status status = sql_end(&q, error);
	if (status == TW_OK && !found)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-resource", NULL, "there is no %.64s", id);
	return status;
}
