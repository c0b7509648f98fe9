/* Periods and ends are by the rig's clock; the wall clock only labels samples. Of a recording, what is in its slots is
 * kept, so that how many samples it should have is known to one. */
#include "service/rig/reader.h"

#include "api/recording.h"
#include "service/log.h"
#include "service/rig/clock.h"
#include "service/rig/ending.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
	TURN_US = 50000,           /* one turn of the loop */
	STATE_PERIOD_US = 200000,  /* the state row */
	APPEND_PERIOD_US = 500000, /* a recording's samples, with the lease */
	LEASE_MS = 10000,
	LEASE_BEYOND_MS = 2000, /* the most that a lease outlives its recording */
	LATE_US = 1000000,      /* how long the last slot's answer is waited for */
	PENDING_SAMPLES = 4096,
};

struct recording {
	bool active;
	struct job_ticket ticket;
	struct recording_course course; /* with what is pending */
	struct rig_counts seen;         /* the scanner's counts up to where the course has them */
	int64_t appended_us;
	struct rig_sample pending[PENDING_SAMPLES];
	size_t pending_count;
};

/* What stderr was told last. */
enum told { TOLD_NOTHING, TOLD_CONNECTED, TOLD_APART };

struct rig {
	struct store *store;         /* borrowed */
	struct rig_scanner *scanner; /* borrowed */
	const char *device_url;      /* borrowed */
	struct rig_scanner_state state;
	enum told told;
	uint64_t overflowed; /* samples for which `pending` had no room */
	struct rig_sample latest;
	bool has_sample;
	int64_t state_put_us;
	struct recording recording;
};

/* --- state -------------------------------------------------------------------------------------------------------- */

static enum tw_status put_state(struct rig *rig, const char *status, struct tw_error *error)
{
	struct rig_state state = {.has_sample = rig->has_sample, .latest = rig->latest, .counts = rig->state.counts};
	snprintf(state.device, sizeof state.device, "%s", rig->device_url);
	snprintf(state.status, sizeof state.status, "%s",
		 status                 ? status
		 : rig->state.connected ? "connected"
					: "connecting");
	snprintf(state.text, sizeof state.text, "%s", rig->state.problem);
	state.rate_hz = rig_scanner_rate_hz(rig->scanner);
	state.counts.dropped += rig->overflowed;
	state.updated_ms = store_now_ms(rig->store);
	rig->state_put_us = rig_clock_us();
	return rig_put(rig->store, &state, error);
}

/* --- one recording ------------------------------------------------------------------------------------------------ */

static int64_t end_slot(const struct recording *r)
{
	return r->course.first_slot + r->course.slot_count;
}

static int64_t end_us(const struct recording *r)
{
	return rig_slot_due_us(r->course.rate_hz, end_slot(r));
}

/* A recording from the next slot on. */
static struct recording_course course_from_now(const struct rig *rig, double duration_s)
{
	struct recording_course course = {.rate_hz = rig_scanner_rate_hz(rig->scanner)};
	rig_clock_boot(course.boot);
	course.first_slot = rig_slot_after(course.rate_hz, rig_clock_us());
	course.slot_count = llround(duration_s * course.rate_hz);
	course.slot_count = course.slot_count > 0 ? course.slot_count : 1;
	course.start_us = rig_slot_due_us(course.rate_hz, course.first_slot) + rig_clock_wall_offset_us();
	course.last_slot = course.first_slot - 1;
	return course;
}

/* Whether the slots of an earlier process's course are ours too. */
static bool has_our_slots(const struct rig *rig, const struct recording_course *course)
{
	char boot[RIG_BOOT_SIZE];
	rig_clock_boot(boot);
	return !strcmp(boot, course->boot) && course->rate_hz == rig_scanner_rate_hz(rig->scanner);
}

/* A recording that an earlier process began goes on to the end that it had, where slots are still the same. */
static enum tw_status recording_start(struct rig *rig, struct tw_error *error)
{
	struct recording *r = &rig->recording;
	struct recording_options asked;
	bool resumed = false;
	enum tw_status status = recording_asked(rig->store, r->ticket.resource_id, &asked, error);
	if (status != TW_OK)
		return status;
	r->course = course_from_now(rig, asked.duration_s);
	status = recording_begin(rig->store, &r->ticket, &r->course, &resumed, error);
	if (status != TW_OK)
		return status;
	if (resumed && !has_our_slots(rig, &r->course))
		return recording_end(rig->store, &r->ticket, &r->course, error);
	r->seen = rig->state.counts;
	r->appended_us = rig_clock_us();
	r->pending_count = 0;
	r->active = true;
	return TW_OK;
}

static enum tw_status claim(struct rig *rig, struct tw_error *error)
{
	bool found = false;
	struct recording *r = &rig->recording;
	enum tw_status status = job_claim(
		rig->store,
		&(struct claim_query){.kinds = JOB_KIND_BIT(JOB_RECORD), .worker = RIG_WORKER, .lease_ms = LEASE_MS},
		&r->ticket, &found, error);
	if (status != TW_OK || !found)
		return status;
	struct tw_error failure;
	status = recording_start(rig, &failure);
	if (status == TW_OK)
		return TW_OK;
	if (status == TW_ERROR_INPUT)
		return job_fail(rig->store, &r->ticket, &failure, false, error);
	return job_release(rig->store, &r->ticket, error); /* the store's affair, which passes */
}

static enum tw_status recording_cancel(struct rig *rig, struct tw_error *error)
{
	struct tw_error cancelled;
	(void)tw_fail(&cancelled, TW_ERROR_CANCELLED, "cancelled", NULL, "the recording was cancelled");
	return job_fail(rig->store, &rig->recording.ticket, &cancelled, false, error);
}

/* What the scanner has counted since the last time. */
static void count_losses(struct rig *rig)
{
	struct recording *r = &rig->recording;
	r->course.exceptions += rig->state.counts.exceptions - r->seen.exceptions;
	r->course.dropped += rig->state.counts.dropped - r->seen.dropped;
	r->seen = rig->state.counts;
}

/* A lease does not outlive its recording by much, whatever becomes of this process. */
static int64_t lease_ms(const struct recording *r, int64_t now_us)
{
	int64_t left_ms = (end_us(r) - now_us) / 1000;
	int64_t lease = (left_ms > 0 ? left_ms : 0) + LEASE_BEYOND_MS;
	return lease < LEASE_MS ? lease : LEASE_MS;
}

/* Appends what is pending, and ends the recording when its slots are over. */
static enum tw_status recording_turn(struct rig *rig, struct tw_error *error)
{
	struct recording *r = &rig->recording;
	int64_t now_us = rig_clock_us();
	bool over = rig->state.slot >= end_slot(r) || now_us >= end_us(r) + LATE_US;
	if (!over && now_us - r->appended_us < APPEND_PERIOD_US && r->pending_count < PENDING_SAMPLES / 2)
		return TW_OK;
	int64_t begin_us = rig_slot_due_us(r->course.rate_hz, r->course.first_slot);
	double share = (double)(now_us - begin_us) / (double)(end_us(r) - begin_us);
	bool cancel = false;
	count_losses(rig);
	r->ticket.lease_ms = lease_ms(r, now_us);
	enum tw_status status = recording_append(rig->store, &r->ticket, r->pending, r->pending_count, &r->course,
						 share < 0   ? 0
						 : share > 1 ? 1
							     : share,
						 &cancel, error);
	if (status != TW_OK)
		return status;
	r->pending_count = 0;
	r->appended_us = now_us;
	if (cancel)
		status = recording_cancel(rig, error);
	else if (over)
		status = recording_end(rig->store, &r->ticket, &r->course, error);
	r->active = !cancel && !over;
	return status;
}

static void keep(struct rig *rig, const struct rig_scan *scan)
{
	struct recording *r = &rig->recording;
	struct recording_course *course = &r->course;
	if (scan->slot < course->first_slot || scan->slot >= end_slot(r))
		return;
	if (r->pending_count == PENDING_SAMPLES) {
		course->dropped++;
		rig->overflowed++;
		return;
	}
	int64_t gap = scan->slot - course->last_slot - 1;
	course->longest_gap = gap > course->longest_gap ? gap : course->longest_gap;
	course->last_slot = scan->slot;
	struct rig_sample *sample = &r->pending[r->pending_count++];
	*sample = scan->sample;
	sample->at_us += course->start_us - rig_slot_due_us(course->rate_hz, course->first_slot);
}

/* --- the loop ----------------------------------------------------------------------------------------------------- */

static void take_scans(struct rig *rig)
{
	struct rig_scan scans[256];
	size_t count;
	/* Before the scans: what it counts as scanned is among them. */
	rig_scanner_state(rig->scanner, &rig->state);
	while ((count = rig_scanner_take(rig->scanner, scans, sizeof scans / sizeof *scans)) > 0) {
		rig->latest = scans[count - 1].sample;
		rig->latest.at_us += rig_clock_wall_offset_us();
		rig->has_sample = true;
		for (size_t i = 0; i < count && rig->recording.active; i++)
			keep(rig, &scans[i]);
	}
}

/* For whoever started it by hand: when samples come, and once when they do not. A peer that accepts and says nothing is
 * not connected. */
static void tell_connection(struct rig *rig)
{
	const struct rig_scanner_state *state = &rig->state;
	const bool answers = state->connected && !state->problem[0] && state->counts.scans > 0;
	const enum told now = answers ? TOLD_CONNECTED : state->problem[0] ? TOLD_APART : rig->told;
	if (now == rig->told)
		return;
	rig->told = now;
	if (now == TOLD_CONNECTED)
		log_event(LOG_LEVEL_INFO, "connected", "device=\"%s\"", rig->device_url);
	else
		log_event(LOG_LEVEL_WARNING, "no-samples", "text=\"%s; trying again\"", state->problem);
}

static enum tw_status turn(struct rig *rig, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	take_scans(rig);
	tell_connection(rig);
	if (rig_clock_us() - rig->state_put_us >= STATE_PERIOD_US)
		status = put_state(rig, NULL, error);
	if (status != TW_OK)
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
		if (status != TW_OK && !is_passing(rig, status))
			break;
		status = TW_OK;
		usleep(TURN_US);
	}
	struct tw_error ignored;
	if (rig->recording.active && job_release(store, &rig->recording.ticket, &ignored) != TW_OK) {
		/* The lease runs out by itself. */
	}
	if (put_state(rig, "stopped", &ignored) != TW_OK) {
		/* Only a display. */
	}
	free(rig);
	return status;
}
