#include "service/rig/ending.h"

#include "api/recording.h"
#include "service/rig/clock.h"
#include "service/rig/scanner.h"
#include "storage/resources.h"

#include <string.h>

enum {
	LEASE_MS = 10000,
	GRACE_US = 2000000, /* after its last slot a living process has ended it */
	ABANDONED_MAX = 16, /* looked at in one call */
};

enum tw_status recording_asked(struct store *store, const char *resource_id, struct recording_options *options,
			       struct tw_error *error)
{
	struct resource resource;
	static const char *const others[] = {"name", NULL};
	enum tw_status status = resource_get(store, TENANT_ANY, RESOURCE_RECORDING, resource_id, &resource, error);
	if (status != TW_OK)
		return status;
	json_t *asked = json_loads(resource.options, 0, NULL);
	option_defaults(&recording_option_table, options);
	status = option_from_json(&recording_option_table, options, asked, "", others, error);
	json_decref(asked);
	resource_clear(&resource);
	return status;
}

/* --- the end ---------------------------------------------------------------------------------------------------- */

struct losses {
	int64_t missing;     /* slots without a sample */
	int64_t longest_gap; /* of them in a row */
};

/* What was lost behind the last sample is a gap too. */
static struct losses losses_of(const struct recording_course *course, const struct recording_extent *extent)
{
	int64_t tail = course->first_slot + course->slot_count - 1 - course->last_slot;
	int64_t missing = course->slot_count - (int64_t)extent->sample_count;
	return (struct losses){.missing = missing > 0 ? missing : 0,
			       .longest_gap = tail > course->longest_gap ? tail : course->longest_gap};
}

static json_t *summary_of(const struct recording_course *course, const struct recording_extent *extent,
			  const struct losses *losses)
{
	double rate = course->rate_hz;
	return json_pack("{s:I, s:I, s:I, s:f, s:f, s:I, s:I, s:i, s:i, s:I, s:I, s:f}", "sample_count",
			 (json_int_t)extent->sample_count, "expected_count", (json_int_t)course->slot_count,
			 "missing_count", (json_int_t)losses->missing, "missing_share",
			 (double)losses->missing / (double)course->slot_count, "longest_gap_s",
			 (double)losses->longest_gap / rate, "exceptions", (json_int_t)course->exceptions, "dropped",
			 (json_int_t)course->dropped, "rate_hz", (int)course->rate_hz, "channels", RIG_CHANNELS,
			 "first_us", (json_int_t)extent->first_us, "last_us", (json_int_t)extent->last_us, "duration_s",
			 (double)course->slot_count / rate);
}

static enum tw_status finish(struct store *store, const struct job_ticket *ticket,
			     const struct recording_course *course, const struct recording_extent *extent,
			     double tolerance, struct tw_error *error)
{
	struct losses losses = losses_of(course, extent);
	json_t *json = summary_of(course, extent, &losses);
	char *summary = json ? json_dumps(json, JSON_COMPACT) : NULL;
	json_decref(json);
	if (!summary)
		return tw_fail_memory(error);
	struct job_result result = {.summary = summary,
				    .incomplete = (double)losses.missing > tolerance * (double)course->slot_count};
	enum tw_status status = job_finish(store, ticket, &result, error);
	free(summary);
	return status;
}

enum tw_status recording_end(struct store *store, const struct job_ticket *ticket,
			     const struct recording_course *course, struct tw_error *error)
{
	struct recording_extent extent;
	struct recording_options asked;
	struct tw_error nothing;
	enum tw_status status = recording_extent(store, ticket->resource_id, &extent, error);
	if (status == TW_OK)
		status = recording_asked(store, ticket->resource_id, &asked, error);
	if (status != TW_OK)
		return status;
	if (extent.sample_count > 0)
		return finish(store, ticket, course, &extent, asked.tolerance, error);
	(void)tw_fail(&nothing, TW_ERROR_IO, "rig-no-samples", NULL,
		      "the rig gave no sample in the whole recording; see /v1/rig for the reason");
	return job_fail(store, ticket, &nothing, false, error);
}

/* --- what nobody else ends ---------------------------------------------------------------------------------------- */

static bool is_over(const struct recording_course *course)
{
	char boot[RIG_BOOT_SIZE];
	rig_clock_boot(boot);
	int64_t end_us = rig_slot_due_us(course->rate_hz, course->first_slot + course->slot_count);
	return strcmp(boot, course->boot) != 0 || rig_clock_us() > end_us + GRACE_US;
}

static enum tw_status end_abandoned(struct store *store, const char *resource_id, struct tw_error *error)
{
	struct recording_course course;
	struct job_ticket ticket;
	bool found = false;
	enum tw_status status = recording_find_course(store, resource_id, &course, &found, error);
	if (status != TW_OK || !found || !is_over(&course))
		return status;
	status = job_claim_resource(store, resource_id, "daemon", LEASE_MS, &ticket, &found, error);
	return status == TW_OK && found ? recording_end(store, &ticket, &course, error) : status;
}

enum tw_status recording_end_abandoned(struct store *store, struct tw_error *error)
{
	char ids[ABANDONED_MAX][STORE_ID_SIZE];
	size_t count = 0;
	enum tw_status status = recording_list_begun(store, ids, ABANDONED_MAX, &count, error);
	for (size_t i = 0; status == TW_OK && i < count; i++)
		status = end_abandoned(store, ids[i], error);
	return status;
}
