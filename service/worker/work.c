/* What the job handlers share. */
#include "service/worker/work.h"

#include <stdlib.h>
#include <string.h>

/* The search of a suit of 723,000 vertices took 0.62 GiB with ten terminals, and takes what it gets with many; an
 * import has no search, and its arena gets that share too. */
struct work_shares work_shares_of(size_t limit, enum job_kind kind)
{
	bool searches = kind == JOB_COMPUTE_LAYOUT;
	struct work_shares shares = {.cache = limit / 4, .warm = limit / 16, .search = searches ? limit / 2 : 0};
	shares.arena = limit - shares.cache - shares.warm - shares.search;
	return shares;
}

bool work_is_stopped(const struct work *work)
{
	return pulse_says_stop(work->pulse) || (work->stop && work->stop());
}

enum tw_status work_step(struct work *work, double share, const char *stage, struct tw_error *error)
{
	pulse_tell(work->pulse, share, stage, NULL);
	if (work_is_stopped(work))
		return tw_fail(error, TW_ERROR_CANCELLED, "cancelled", NULL, "the job was asked to stop");
	return TW_OK;
}

enum tw_status work_summary(struct work *work, json_t *json, struct tw_error *error)
{
	char *text = json ? json_dumps(json, JSON_COMPACT) : NULL;
	size_t size = text ? strlen(text) + 1 : 0;
	char *copy = text ? ARENA_ARRAY(work->arena, size, char) : NULL;
	if (copy)
		memcpy(copy, text, size);
	free(text);
	json_decref(json);
	work->result.summary = copy;
	return copy ? TW_OK : tw_fail_memory(error);
}

enum tw_status work_find_mesh(struct work *work, const char *resource_id, char mesh_id[STORE_ID_SIZE],
			      struct tw_error *error)
{
	char(*ids)[STORE_ID_SIZE] = NULL;
	size_t count = 0;
	enum tw_status status = resource_needs(work->store, resource_id, RESOURCE_MESH, &ids, &count, error);
	if (status == TW_OK && count != 1)
		status = tw_fail(error, TW_ERROR_INPUT, "one-mesh", NULL, "%s must be made from one mesh, not %zu",
				 resource_id, count);
	if (status == TW_OK)
		memcpy(mesh_id, ids[0], STORE_ID_SIZE);
	free(ids);
	return status;
}
