/* The bench rig's state, and recordings: samples packed little-endian, a batch of them a row. */
#include "storage/recording.h"

#include "storage/job_state.h"
#include "storage/row.h"

#include <stdlib.h>
#include <string.h>

enum {
	SAMPLE_BYTES = 8 + 2 * RIG_CHANNELS,
	BATCH_MAX = 4096 /* samples in a row */
};

static void pack(const struct rig_sample *sample, uint8_t bytes[SAMPLE_BYTES])
{
	for (unsigned i = 0; i < 8; i++)
		bytes[i] = (uint8_t)((uint64_t)sample->at_us >> 8 * i);
	for (unsigned i = 0; i < RIG_CHANNELS; i++) {
		bytes[8 + 2 * i] = (uint8_t)sample->counts[i];
		bytes[9 + 2 * i] = (uint8_t)(sample->counts[i] >> 8);
	}
}

static void unpack(const uint8_t bytes[SAMPLE_BYTES], struct rig_sample *sample)
{
	uint64_t at_us = 0;
	for (unsigned i = 0; i < 8; i++)
		at_us |= (uint64_t)bytes[i] << 8 * i;
	sample->at_us = (int64_t)at_us;
	for (unsigned i = 0; i < RIG_CHANNELS; i++)
		sample->counts[i] = (uint16_t)(bytes[8 + 2 * i] | bytes[9 + 2 * i] << 8);
}

enum tw_status rig_put(struct store *store, const struct rig_state *state, struct tw_error *error)
{
	uint8_t bytes[SAMPLE_BYTES];
	pack(&state->latest, bytes);
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	struct sql q =
		sql_query(store, "INSERT OR REPLACE INTO rig(only, device, status, text, updated_ms, rate_hz, scans,"
				 " gaps, exceptions, dropped, connects, sample)"
				 " VALUES (1, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
	sql_bind_text(&q, state->device);
	sql_bind_text(&q, state->status);
	sql_bind_text(&q, state->text);
	sql_bind_int(&q, state->updated_ms ? state->updated_ms : store_now_ms(store));
	sql_bind_int(&q, state->rate_hz);
	sql_bind_int(&q, (int64_t)state->counts.scans);
	sql_bind_int(&q, (int64_t)state->counts.gaps);
	sql_bind_int(&q, (int64_t)state->counts.exceptions);
	sql_bind_int(&q, (int64_t)state->counts.dropped);
	sql_bind_int(&q, (int64_t)state->counts.connects);
	if (state->has_sample)
		sql_bind_bytes(&q, bytes, sizeof bytes);
	else
		sql_bind_text(&q, NULL);
	status = sql_run(&q, NULL, error);
	return transaction_end(store, status, error);
}

enum tw_status rig_get(struct store *store, struct rig_state *state, struct tw_error *error)
{
	memset(state, 0, sizeof *state);
	struct sql q =
		sql_query(store, "SELECT device, status, text, updated_ms, rate_hz, scans, gaps, exceptions, dropped,"
				 " connects, sample FROM rig");
	if (sql_step(&q)) {
		size_t size;
		sql_copy_text(&q, state->device, sizeof state->device);
		sql_copy_text(&q, state->status, sizeof state->status);
		sql_copy_text(&q, state->text, sizeof state->text);
		state->updated_ms = sql_int(&q);
		state->rate_hz = (uint32_t)sql_int(&q);
		state->counts.scans = (uint64_t)sql_int(&q);
		state->counts.gaps = (uint64_t)sql_int(&q);
		state->counts.exceptions = (uint64_t)sql_int(&q);
		state->counts.dropped = (uint64_t)sql_int(&q);
		state->counts.connects = (uint64_t)sql_int(&q);
		const void *bytes = sql_bytes(&q, &size);
		state->has_sample = bytes && size == SAMPLE_BYTES;
		if (state->has_sample)
			unpack(bytes, &state->latest);
	}
	return sql_end(&q, error);
}

static enum tw_status insert_batch(struct store *store, int64_t resource, const struct rig_sample *samples,
				   size_t count, struct tw_error *error)
{
	uint8_t *bytes = malloc(count * SAMPLE_BYTES);
	if (!bytes)
		return tw_fail_memory(error);
	for (size_t i = 0; i < count; i++)
		pack(&samples[i], bytes + i * SAMPLE_BYTES);
	struct sql q = sql_query(store, "INSERT INTO recording_chunk(resource, first, count, samples) SELECT ?1,"
					" coalesce((SELECT first + count FROM recording_chunk WHERE resource = ?1"
					"  ORDER BY first DESC LIMIT 1), 0), ?2, ?3");
	sql_bind_int(&q, resource);
	sql_bind_int(&q, (int64_t)count);
	sql_bind_bytes(&q, bytes, count * SAMPLE_BYTES);
	enum tw_status status = sql_run(&q, NULL, error);
	free(bytes);
	return status;
}

/* --- the course ------------------------------------------------------------------------------------------------- */

static void bind_course(struct sql *q, const struct recording_course *course)
{
	sql_bind_text(q, course->boot);
	sql_bind_int(q, course->rate_hz);
	sql_bind_int(q, course->first_slot);
	sql_bind_int(q, course->slot_count);
	sql_bind_int(q, course->start_us);
	sql_bind_int(q, course->last_slot);
	sql_bind_int(q, course->longest_gap);
	sql_bind_int(q, (int64_t)course->exceptions);
	sql_bind_int(q, (int64_t)course->dropped);
}

static enum tw_status put_course(struct store *store, int64_t resource, const struct recording_course *course,
				 struct tw_error *error)
{
	struct sql q = sql_query(store, "INSERT OR REPLACE INTO recording_course(resource, boot, rate_hz, first_slot,"
					" slot_count, start_us, last_slot, longest_gap, exceptions, dropped)"
					" VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
	sql_bind_int(&q, resource);
	bind_course(&q, course);
	return sql_run(&q, NULL, error);
}

static enum tw_status get_course(struct store *store, int64_t resource, struct recording_course *course, bool *found,
				 struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT boot, rate_hz, first_slot, slot_count, start_us, last_slot,"
					" longest_gap, exceptions, dropped FROM recording_course WHERE resource = ?");
	sql_bind_int(&q, resource);
	*found = sql_step(&q);
	if (*found) {
		sql_copy_text(&q, course->boot, sizeof course->boot);
		course->rate_hz = (uint32_t)sql_int(&q);
		course->first_slot = sql_int(&q);
		course->slot_count = sql_int(&q);
		course->start_us = sql_int(&q);
		course->last_slot = sql_int(&q);
		course->longest_gap = sql_int(&q);
		course->exceptions = (uint64_t)sql_int(&q);
		course->dropped = (uint64_t)sql_int(&q);
	}
	return sql_end(&q, error);
}

/* Samples without a course are those of a process that knew of none; the recording begins anew. */
static enum tw_status begin(struct store *store, const struct job_ticket *ticket, struct recording_course *course,
			    bool *resumed, struct tw_error *error)
{
	struct job_run run;
	int64_t resource = 0;
	enum tw_status status = job_state_check(store, ticket, &run, error);
	if (status == TW_OK)
		status = row_find_resource(store, TENANT_ANY, ticket->resource_id, &resource, error);
	if (status == TW_OK)
		status = get_course(store, resource, course, resumed, error);
	if (status != TW_OK || *resumed)
		return status;
	struct sql q = sql_query(store, "DELETE FROM recording_chunk WHERE resource = ?");
	sql_bind_int(&q, resource);
	status = sql_run(&q, NULL, error);
	return status == TW_OK ? put_course(store, resource, course, error) : status;
}

enum tw_status recording_begin(struct store *store, const struct job_ticket *ticket, struct recording_course *course,
			       bool *resumed, struct tw_error *error)
{
	*resumed = false;
	enum tw_status status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = begin(store, ticket, course, resumed, error);
	return transaction_end(store, status, error);
}

enum tw_status recording_find_course(struct store *store, const char *resource_id, struct recording_course *course,
				     bool *found, struct tw_error *error)
{
	int64_t resource = 0;
	*found = false;
	enum tw_status status = row_find_resource(store, TENANT_ANY, resource_id, &resource, error);
	return status == TW_OK ? get_course(store, resource, course, found, error) : status;
}

enum tw_status recording_list_begun(struct store *store, char (*resource_ids)[STORE_ID_SIZE], size_t limit,
				    size_t *count, struct tw_error *error)
{
	*count = 0;
	struct sql q = sql_query(store, "SELECT r.id FROM recording_course c JOIN resource r ON r.number = c.resource"
					" ORDER BY c.resource LIMIT ?");
	sql_bind_int(&q, (int64_t)limit);
	while (sql_step(&q))
		sql_copy_text(&q, resource_ids[(*count)++], STORE_ID_SIZE);
	return sql_end(&q, error);
}

/* --- samples ------------------------------------------------------------------------------------------------------ */

static enum tw_status append(struct store *store, const struct job_ticket *ticket, const struct rig_sample *samples,
			     size_t count, const struct recording_course *course, double progress, bool *cancel,
			     struct tw_error *error)
{
	int64_t resource = 0;
	enum tw_status status = job_state_renew(store, ticket, progress, NULL, NULL, cancel, error);
	if (status == TW_OK)
		status = row_find_resource(store, TENANT_ANY, ticket->resource_id, &resource, error);
	if (status == TW_OK)
		status = put_course(store, resource, course, error);
	while (status == TW_OK && count) {
		size_t part = count < BATCH_MAX ? count : BATCH_MAX;
		status = insert_batch(store, resource, samples, part, error);
		samples += part;
		count -= part;
	}
	return status;
}

enum tw_status recording_append(struct store *store, const struct job_ticket *ticket, const struct rig_sample *samples,
				size_t count, const struct recording_course *course, double progress, bool *cancel,
				struct tw_error *error)
{
	enum tw_status status = sql_check_room(store, count * SAMPLE_BYTES, error);
	if (status == TW_OK)
		status = transaction_begin(store, true, error);
	if (status != TW_OK)
		return status;
	status = append(store, ticket, samples, count, course, progress, cancel, error);
	return transaction_end(store, status, error);
}

/* The batch that holds sample number `first`, from that sample on. */
static enum tw_status read_batch(struct store *store, int64_t resource, uint64_t first, struct rig_sample *samples,
				 size_t limit, size_t *got, struct tw_error *error)
{
	*got = 0;
	struct sql q = sql_query(store, "SELECT first, samples FROM recording_chunk WHERE resource = ?1 AND first <= ?2"
					" ORDER BY first DESC LIMIT 1");
	sql_bind_int(&q, resource);
	sql_bind_int(&q, (int64_t)first);
	if (sql_step(&q)) {
		size_t size;
		uint64_t skip = first - (uint64_t)sql_int(&q);
		const uint8_t *bytes = sql_bytes(&q, &size);
		for (uint64_t i = skip; i < size / SAMPLE_BYTES && *got < limit; i++)
			unpack(bytes + i * SAMPLE_BYTES, &samples[(*got)++]);
	}
	return sql_end(&q, error);
}

enum tw_status recording_read(struct store *store, const char *resource_id, uint64_t first, struct rig_sample *samples,
			      size_t limit, size_t *got, struct tw_error *error)
{
	int64_t resource = 0;
	size_t part = 1;
	*got = 0;
	enum tw_status status = row_find_resource(store, TENANT_ANY, resource_id, &resource, error);
	while (status == TW_OK && part && *got < limit) {
		status = read_batch(store, resource, first + *got, samples + *got, limit - *got, &part, error);
		*got += part;
	}
	return status;
}

enum tw_status recording_extent(struct store *store, const char *resource_id, struct recording_extent *extent,
				struct tw_error *error)
{
	int64_t resource = 0;
	struct rig_sample sample;
	size_t got = 0;
	memset(extent, 0, sizeof *extent);
	enum tw_status status = row_find_resource(store, TENANT_ANY, resource_id, &resource, error);
	if (status != TW_OK)
		return status;
	struct sql q =
		sql_query(store, "SELECT coalesce(max(first + count), 0) FROM recording_chunk WHERE resource = ?");
	sql_bind_int(&q, resource);
	extent->sample_count = sql_step(&q) ? (uint64_t)sql_int(&q) : 0;
	status = sql_end(&q, error);
	if (status != TW_OK || !extent->sample_count)
		return status;
	status = read_batch(store, resource, 0, &sample, 1, &got, error);
	extent->first_us = got ? sample.at_us : 0;
	if (status == TW_OK)
		status = read_batch(store, resource, extent->sample_count - 1, &sample, 1, &got, error);
	extent->last_us = got ? sample.at_us : 0;
	return status;
}
