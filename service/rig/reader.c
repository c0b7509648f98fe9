#include "service/rig/reader.h"

#include "api/recording.h"
#include "storage/queue.h"
#include "storage/resources.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum {
	TURN_US = 50000,        /* one turn of the loop */
	STATE_PERIOD_MS = 200,  /* the state row */
	APPEND_PERIOD_MS = 500, /* a recording's samples, with the lease */
	LEASE_MS = 10000,
	PENDING_SAMPLES = 4096,
};

struct recording {
	bool active;
	struct job_ticket ticket;
	int64_t start_us, end_us;
	int64_t appended_ms;
	struct rig_sample pending[PENDING_SAMPLES];
	size_t pending_count;
};

struct rig {
	struct store *store;         /* borrowed */
	struct rig_scanner *scanner; /* borrowed */
	const char *device_url;      /* borrowed */
	struct rig_sample latest;
	bool has_sample;
	int64_t state_put_ms;
	struct recording recording;
};

/* --- state -------------------------------------------------------------------------------------------------------- */

static enum tw_status put_state(struct rig *rig, const char *status, struct tw_error *error)
{
	struct rig_scanner_state scanner;
	struct rig_state state = {.has_sample = rig->has_sample, .latest = rig->latest};
	rig_scanner_state(rig->scanner, &scanner);
	snprintf(state.device, sizeof state.device, "%s", rig->device_url);
	snprintf(state.status, sizeof state.status, "%s",
		 status              ? status
		 : scanner.connected ? "connected"
				     : "connecting");
	snprintf(state.text, sizeof state.text, "%s", scanner.problem);
	state.updated_ms = rig->state_put_ms = store_now_ms(rig->store);
	return rig_put(rig->store, &state, error);
}

/* --- one recording -------------------------------------------------------------------------------------------------
 */

static enum tw_status recording_duration(struct rig *rig, const char *resource_id, double *duration_s,
					 struct tw_error *error)
{
	struct resource resource;
	struct recording_options options;
	static const char *const others[] = {"name", NULL};
	enum tw_status status = resource_get(rig->store, RESOURCE_RECORDING, resource_id, &resource, error);
	if (status)
		return status;
	json_t *asked = json_loads(resource.options, 0, NULL);
	option_defaults(&recording_option_table, &options);
	status = option_from_json(&recording_option_table, &options, asked, "", others, error);
	*duration_s = options.duration_s;
	json_decref(asked);
	resource_clear(&resource);
	return status;
}

/* A recording that an earlier process began keeps the end that it had. */
static enum tw_status recording_start(struct rig *rig, struct tw_error *error)
{
	struct recording *r = &rig->recording;
	struct recording_extent extent;
	double duration_s = 0;
	enum tw_status status = recording_duration(rig, r->ticket.resource_id, &duration_s, error);
	if (status)
		return status;
	status = recording_extent(rig->store, r->ticket.resource_id, &extent, error);
	if (status)
		return status;
	r->start_us = extent.sample_count ? extent.first_us : store_now_ms(rig->store) * 1000;
	r->end_us = r->start_us + (int64_t)(duration_s * 1e6);
	r->appended_ms = store_now_ms(rig->store);
	r->pending_count = 0;
	r->active = true;
	return TW_OK;
}

static enum tw_status claim(struct rig *rig, struct tw_error *error)
{
	bool found = false;
	struct recording *r = &rig->recording;
	enum tw_status status =
		job_claim(rig->store, JOB_KIND_BIT(JOB_RECORD), "rig", LEASE_MS, &r->ticket, &found, error);
	if (status || !found)
		return status;
	struct tw_error failure;
	if (recording_start(rig, &failure) == TW_OK)
		return TW_OK;
	return job_fail(rig->store, &r->ticket, &failure, false, error);
}

static enum tw_status recording_finish(struct rig *rig, struct tw_error *error)
{
	struct recording *r = &rig->recording;
	struct recording_extent extent;
	enum tw_status status = recording_extent(rig->store, r->ticket.resource_id, &extent, error);
	if (status)
		return status;
	char summary[256];
	snprintf(summary, sizeof summary,
		 "{\"sample_count\":%llu,\"channels\":%d,\"first_us\":%lld,\"last_us\":%lld,\"duration_s\":%.6f}",
		 (unsigned long long)extent.sample_count, RIG_CHANNELS, (long long)extent.first_us,
		 (long long)extent.last_us, (double)(r->end_us - r->start_us) / 1e6);
	struct tw_error nothing;
	if (extent.sample_count == 0) {
		(void)tw_fail(&nothing, TW_ERROR_IO, "rig-no-samples", NULL,
			      "the rig gave no sample in the whole recording; see /v1/rig for the reason");
		return job_fail(rig->store, &r->ticket, &nothing, false, error);
	}
	return job_finish(rig->store, &r->ticket, &(struct job_result){.summary = summary}, error);
}

static enum tw_status recording_cancel(struct rig *rig, struct tw_error *error)
{
	struct tw_error cancelled;
	(void)tw_fail(&cancelled, TW_ERROR_CANCELLED, "cancelled", NULL, "the recording was cancelled");
	return job_fail(rig->store, &rig->recording.ticket, &cancelled, false, error);
}

/* Appends what is pending, and ends the recording when its time is over. */
static enum tw_status recording_turn(struct rig *rig, struct tw_error *error)
{
	struct recording *r = &rig->recording;
	int64_t now_ms = store_now_ms(rig->store);
	bool over = now_ms * 1000 >= r->end_us;
	if (!over && now_ms - r->appended_ms < APPEND_PERIOD_MS && r->pending_count < PENDING_SAMPLES / 2)
		return TW_OK;
	double share = (double)(now_ms * 1000 - r->start_us) / (double)(r->end_us - r->start_us);
	bool cancel = false;
	enum tw_status status = recording_append(rig->store, &r->ticket, r->pending, r->pending_count,
						 share > 1 ? 1 : share, &cancel, error);
	if (status)
		return status;
	r->pending_count = 0;
	r->appended_ms = now_ms;
	if (cancel)
		status = recording_cancel(rig, error);
	else if (over)
		status = recording_finish(rig, error);
	r->active = !cancel && !over;
	return status;
}

/* --- the loop ------------------------------------------------------------------------------------------------------
 */

static void take_samples(struct rig *rig)
{
	struct rig_sample samples[256];
	struct recording *r = &rig->recording;
	size_t count;
	while ((count = rig_scanner_take(rig->scanner, samples, sizeof samples / sizeof *samples)) > 0) {
		rig->latest = samples[count - 1];
		rig->has_sample = true;
		for (size_t i = 0; i < count && r->active; i++)
			if (samples[i].at_us >= r->start_us && samples[i].at_us < r->end_us &&
			    r->pending_count < PENDING_SAMPLES)
				r->pending[r->pending_count++] = samples[i];
	}
}

static enum tw_status turn(struct rig *rig, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	take_samples(rig);
	if (store_now_ms(rig->store) - rig->state_put_ms >= STATE_PERIOD_MS)
		status = put_state(rig, NULL, error);
	if (status)
		return status;
	return rig->recording.active ? recording_turn(rig, error) : claim(rig, error);
}

/* A busy or full store passes; a lost lease ends only this recording. */
static bool is_passing(struct rig *rig, enum tw_status status)
{
	if (status == TW_ERROR_CONFLICT)
		rig->recording.active = false;
	return status == TW_ERROR_CONFLICT || status == TW_ERROR_FULL || status == TW_ERROR_IO;
}

enum tw_status rig_run(struct store *store, struct rig_scanner *scanner, const char *device_url,
		       const volatile sig_atomic_t *stop, struct tw_error *error)
{
	struct rig *rig = calloc(1, sizeof *rig);
	if (!rig)
		return tw_fail_memory(error);
	*rig = (struct rig){.store = store, .scanner = scanner, .device_url = device_url};
	enum tw_status status = TW_OK;
	while (!*stop) {
		status = turn(rig, error);
		if (status && !is_passing(rig, status))
			break;
		status = TW_OK;
		usleep(TURN_US);
	}
	struct tw_error ignored;
	if (rig->recording.active && job_release(store, &rig->recording.ticket, &ignored)) {
		/* The lease runs out by itself. */
	}
	if (put_state(rig, "stopped", &ignored)) {
		/* Only a display. */
	}
	free(rig);
	return status;
}
