/* The bench rig: what it measures now, and recordings. The rig process writes, this reads. */
#include "api/handlers.h"
#include "api/json.h"
#include "api/page.h"
#include "api/recording.h"
#include "api/resource.h"
#include "solver/option_json.h"
#include "storage/recording.h"

#include <stdlib.h>
#include <string.h>

#define SAMPLES_LIMIT_DEFAULT 500
#define SAMPLES_LIMIT_MAX 5000

/* --- state ------------------------------------------------------------------------------------------------------ */

static json_t *show_sample(const struct rig_sample *sample)
{
	json_t *json = json_object(), *counts = json_array();
	for (size_t i = 0; i < RIG_CHANNELS; i++)
		json_array_append_new(counts, json_integer(sample->counts[i]));
	json_object_set_new(json, "at_us", json_integer(sample->at_us));
	json_object_set_new(json, "counts", counts);
	return json;
}

enum tw_status get_rig(struct api_call *call, struct tw_error *error)
{
	struct rig_state state = {0};
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = rig_get(call->store, &state, error);
	if (status != TW_OK)
		return status;
	json_t *json = json_object();
	json_object_set_new(json, "device", json_string(state.device));
	json_object_set_new(json, "status", json_string(state.status[0] ? state.status : "stopped"));
	json_object_set_new(json, "text", json_string(state.text));
	json_object_set_new(json, "rate_hz", json_integer(state.rate_hz));
	json_object_set_new(json, "scans", json_integer((json_int_t)state.counts.scans));
	json_object_set_new(json, "gaps", json_integer((json_int_t)state.counts.gaps));
	json_object_set_new(json, "exceptions", json_integer((json_int_t)state.counts.exceptions));
	json_object_set_new(json, "dropped", json_integer((json_int_t)state.counts.dropped));
	json_object_set_new(json, "connects", json_integer((json_int_t)state.counts.connects));
	json_object_set_new(json, "updated_at", json_time(state.updated_ms));
	json_object_set_new(json, "latest", state.has_sample ? show_sample(&state.latest) : json_null());
	return response_json(&call->response, 200, json, error);
}

/* --- recordings ------------------------------------------------------------------------------------------------- */

static enum tw_status parse_recording(const json_t *body, const char **name, char **options, struct tw_error *error)
{
	static const char *const others[] = {"name", NULL};
	struct recording_options values;
	option_defaults(&recording_option_table, &values);
	enum tw_status status = option_from_json(&recording_option_table, &values, body, "", others, error);
	if (status == TW_OK)
		status = json_get_name(body, name, error);
	if (status != TW_OK)
		return status;
	json_t *json = option_to_json(&recording_option_table, &values);
	*options = json ? json_dumps(json, JSON_COMPACT) : NULL;
	json_decref(json);
	return *options ? TW_OK : tw_fail_memory(error);
}

enum tw_status post_recording(struct api_call *call, struct tw_error *error)
{
	json_t *body = NULL;
	char *options = NULL;
	struct resource_draft draft = {.owner = call->caller.owner, .kind = RESOURCE_RECORDING};
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = option_json_parse(&body, call->body, call->body_size, error);
	if (status == TW_OK)
		status = parse_recording(body, &draft.name, &options, error);
	draft.options = options;
	if (status == TW_OK)
		status = resource_respond_create(call, &draft, error);
	free(options);
	json_decref(body);
	return status;
}

enum tw_status list_recordings(struct api_call *call, struct tw_error *error)
{
	return resource_respond_list(call, RESOURCE_RECORDING, NULL, NULL, error);
}

enum tw_status get_recording(struct api_call *call, struct tw_error *error)
{
	return resource_respond(call, RESOURCE_RECORDING, error);
}

enum tw_status delete_recording(struct api_call *call, struct tw_error *error)
{
	return resource_respond_delete(call, RESOURCE_RECORDING, error);
}

static enum tw_status check_recording_exists(struct api_call *call, struct tw_error *error)
{
	struct resource recording = {0};
	enum tw_status status = resource_get(call->store, call->caller.owner.tenant, RESOURCE_RECORDING,
					     call->match.parameters[0], &recording, error);
	resource_clear(&recording);
	return status;
}

/* A page of samples: the cursor is the number of its first sample. */
enum tw_status get_recording_samples(struct api_call *call, struct tw_error *error)
{
	static const char *const known[] = {"limit", "cursor", NULL};
	int64_t limit = 0, first = 0;
	size_t got = 0;
	enum tw_status status = query_only(&call->query, known, error);
	if (status == TW_OK)
		status = query_integer(&call->query, "limit", SAMPLES_LIMIT_DEFAULT, 1, SAMPLES_LIMIT_MAX, &limit,
				       error);
	if (status == TW_OK)
		status = query_integer(&call->query, "cursor", 0, 0, INT64_MAX / 2, &first, error);
	if (status == TW_OK)
		status = check_recording_exists(call, error);
	struct rig_sample *samples = status != TW_OK ? NULL : calloc((size_t)limit, sizeof *samples);
	if (status == TW_OK && !samples)
		status = tw_fail_memory(error);
	if (status == TW_OK)
		status = recording_read(call->store, call->match.parameters[0], (uint64_t)first, samples, (size_t)limit,
					&got, error);
	json_t *items = status != TW_OK ? NULL : json_array();
	for (size_t i = 0; i < got; i++)
		json_array_append_new(items, show_sample(&samples[i]));
	free(samples);
	char next[24];
	snprintf(next, sizeof next, "%lld", (long long)first + limit);
	return status != TW_OK ? status : page_respond_text(call, items, (int64_t)got == limit ? next : NULL, error);
}

/* --- CSV -------------------------------------------------------------------------------------------------------- */

#define CSV_SAMPLES 256                      /* read at once */
#define CSV_LINE_MAX (24 + RIG_CHANNELS * 6) /* a time stamp, and five digits and a comma a channel */

/* The recording as text, made line by line while it is sent. */
struct csv_stream {
	struct api_stream stream;
	struct store *store; /* borrowed: of the thread that sends */
	char id[ROUTE_PARAMETER_SIZE];
	uint64_t next; /* sample to read next */
	size_t used, filled;
	char text[CSV_SAMPLES * CSV_LINE_MAX];
};

static size_t print_line(char *text, size_t size, const struct rig_sample *sample)
{
	size_t used = (size_t)snprintf(text, size, "%lld", (long long)sample->at_us);
	for (size_t i = 0; i < RIG_CHANNELS; i++)
		used += (size_t)snprintf(text + used, size - used, ",%u", sample->counts[i]);
	text[used++] = '\n';
	return used;
}

static size_t print_head(char *text, size_t size)
{
	size_t used = (size_t)snprintf(text, size, "time_us");
	for (unsigned i = 1; i <= RIG_CHANNELS; i++)
		used += (size_t)snprintf(text + used, size - used, ",channel_%u", i);
	text[used++] = '\n';
	return used;
}

static enum tw_status refill(struct csv_stream *csv)
{
	struct rig_sample samples[CSV_SAMPLES];
	size_t got = 0;
	enum tw_status status = recording_read(csv->store, csv->id, csv->next, samples, CSV_SAMPLES, &got, NULL);
	csv->used = csv->filled = 0;
	csv->next += got;
	for (size_t i = 0; status == TW_OK && i < got; i++)
		csv->filled += print_line(csv->text + csv->filled, sizeof csv->text - csv->filled, &samples[i]);
	return status;
}

static enum tw_status read_csv(struct api_stream *stream, uint64_t offset, void *bytes, size_t size, size_t *got)
{
	struct csv_stream *csv = (struct csv_stream *)stream;
	(void)offset; /* a stream of unknown size is read in order */
	enum tw_status status = csv->used == csv->filled ? refill(csv) : TW_OK;
	size_t left = csv->filled - csv->used;
	*got = left < size ? left : size;
	memcpy(bytes, csv->text + csv->used, *got);
	csv->used += *got;
	return status;
}

static void close_csv(struct api_stream *stream)
{
	free(stream);
}

enum tw_status get_recording_csv(struct api_call *call, struct tw_error *error)
{
	enum tw_status status = query_only(&call->query, NULL, error);
	if (status == TW_OK)
		status = check_recording_exists(call, error);
	if (status != TW_OK)
		return status;
	struct csv_stream *csv = calloc(1, sizeof *csv);
	if (!csv)
		return tw_fail_memory(error);
	csv->stream = (struct api_stream){.size = API_STREAM_UNKNOWN, .read = read_csv, .close = close_csv};
	csv->store = call->store;
	memcpy(csv->id, call->match.parameters[0], sizeof csv->id);
	csv->filled = print_head(csv->text, sizeof csv->text);
	response_stream(&call->response, "text/csv; charset=utf-8", &csv->stream);
	return TW_OK;
}
