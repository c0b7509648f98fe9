/* Rows of jobs and resources as structs. Internal to this folder. The columns belong to statements that call the tables
 * `j` (job) and `r` (resource). */
#ifndef STORAGE_ROW_H
#define STORAGE_ROW_H

#include "storage/resource.h"
#include "storage/sql.h"

#define ROW_JOB_COLUMNS                                                                                                \
	"j.id, r.id, j.kind, j.state, j.cancel_requested, j.waiting_for, j.attempts, j.attempts_max, j.priority,"      \
	" j.progress, j.stage, j.partial, j.worker, j.created_ms, j.started_ms, j.finished_ms, j.lease_until_ms,"      \
	" j.change, j.failure_status, j.failure_type, j.failure_where, j.failure_text, j.class, j.transient,"          \
	" j.not_before_ms, j.cancel_at_ms,"                                                                            \
	" (SELECT g.name FROM lane l JOIN job_group g ON g.number = l.job_group WHERE l.number = j.lane),"             \
	" j.argument, (SELECT id FROM resource WHERE number = j.subject)"
#define ROW_RESOURCE_COLUMNS_BUT(options)                                                                              \
	"r.id, r.tenant, r.client, r.kind, r.version, r.name, " options ", r.summary, r.created_ms, " ROW_JOB_COLUMNS
#define ROW_RESOURCE_COLUMNS ROW_RESOURCE_COLUMNS_BUT("r.options")
/* A page of a thousand requests of some MiB each would not fit anywhere. */
#define ROW_RESOURCE_LIST_COLUMNS ROW_RESOURCE_COLUMNS_BUT("NULL")

void row_read_job(struct sql *q, struct job *job);
void row_read_resource(struct sql *q, struct resource *resource);

/* A page of rows that begin with their cursor. */
struct row_page {
	void *rows; /* owned, also after an error */
	size_t count;
	int64_t last; /* cursor of the last row */
	bool more;    /* there was one row more than the limit */
};

/* Runs the query and reads at most `limit` rows of `size` bytes. */
enum tw_status row_read_page(struct sql *q, uint32_t limit, size_t size, void (*read)(struct sql *q, void *row),
			     struct row_page *page, struct tw_error *error) TW_NODISCARD;

/* A list that is put together from several parts, each in the order of an index: reading it costs what it shows,
 * however many rows are passed over. First the numbers: */
struct row_numbers {
	int64_t *numbers; /* owned, newest first */
	size_t count;
	size_t limit; /* more are not kept */
};

/* Adds what `q` gives (numbers below the cursor, newest first, at most `limit`), and keeps the newest `limit` of all.
 */
enum tw_status row_merge(struct row_numbers *list, struct sql *q, struct tw_error *error) TW_NODISCARD;
enum tw_status row_numbers_init(struct row_numbers *list, uint32_t limit, struct tw_error *error) TW_NODISCARD;
void row_numbers_clear(struct row_numbers *list);

/* Then the rows: `text` finds one by its number. Where the list is full its last is only a sign that there are more. */
enum tw_status row_read_numbers(struct store *store, const struct row_numbers *list, const char *text, size_t size,
				void (*read)(struct sql *q, void *row), struct row_page *page,
				struct tw_error *error) TW_NODISCARD;

/* How many rows are given where a client asks for so many. */
uint32_t row_page_limit(uint32_t limit);

/* The number of a resource by id. TW_ERROR_NOT_FOUND "no-such-resource"; also when it is another tenant's. */
enum tw_status row_find_resource(struct store *store, int64_t tenant, const char *id, int64_t *number,
				 struct tw_error *error) TW_NODISCARD;

#endif
