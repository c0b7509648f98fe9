/* Whether the service lives, whether it is ready, how it does, and what it offers. */
#include "api/handlers.h"
#include "api/header.h"
#include "storage/jobs.h"

#include <stdlib.h>
#include <string.h>

/* openapi.yaml as the linker embedded it. */
extern const char _binary_openapi_yaml_start[], _binary_openapi_yaml_end[]; /* NOLINT(bugprone-reserved-identifier) */

static enum tw_status respond_ok(struct api_call *call, struct tw_error *error)
{
	json_t *json = json_object();
	json_object_set_new(json, "status", json_string("ok"));
	json_object_set_new(json, "version", json_string(TW_VERSION));
	response_header(&call->response, "Cache-Control", "no-store");
	return response_json(&call->response, 200, json, error);
}

enum tw_status get_live(struct api_call *call, struct tw_error *error)
{
	return respond_ok(call, error);
}

enum tw_status get_ready(struct api_call *call, struct tw_error *error)
{
	const struct api_hooks *hooks = &call->settings->hooks;
	char why[128] = "";
	struct tw_error reason = {0};
	if (store_ping(call->store, &reason) != TW_OK)
		return tw_fail(error, TW_ERROR_IO, "not-ready", NULL, "the store does not answer: %s", reason.text);
	if (hooks->ready && !hooks->ready(hooks->context, why, sizeof why))
		return tw_fail(error, TW_ERROR_IO, "not-ready", NULL, "%s", why);
	return respond_ok(call, error);
}

/* Of a batch it may be hours, and nothing is wrong; of interactive jobs not even seconds. */
static void print_oldest(FILE *out, const struct job_counts *counts)
{
	fprintf(out,
		"# HELP tightwire_queue_oldest_seconds Age of the oldest job that a worker could take.\n"
		"# TYPE tightwire_queue_oldest_seconds gauge\ntightwire_queue_oldest_seconds %.3f\n"
		"# HELP tightwire_queue_class_oldest_seconds The same of each class.\n"
		"# TYPE tightwire_queue_class_oldest_seconds gauge\n",
		(double)counts->oldest_ms / 1000);
	for (enum job_class class = JOB_INTERACTIVE; class < JOB_CLASSES_END; class ++)
		fprintf(out, "tightwire_queue_class_oldest_seconds{class=\"%s\"} %.3f\n", job_class_name(class),
			(double)counts->oldest_of_class_ms[class] / 1000);
}

/* The service's own figures, then those of the queue. */
enum tw_status get_metrics(struct api_call *call, struct tw_error *error)
{
	const struct api_hooks *hooks = &call->settings->hooks;
	struct job_counts counts;
	struct store_writes writes;
	uint64_t room = 0;
	enum tw_status status = job_count(call->store, &counts, error);
	if (status == TW_OK)
		status = store_room(call->store, &room, error);
	if (status != TW_OK)
		return status;
	char *own = hooks->metrics ? hooks->metrics(hooks->context) : strdup("");
	char *text = NULL;
	size_t size = 0;
	FILE *out = own ? open_memstream(&text, &size) : NULL;
	if (!out) {
		free(own);
		return tw_fail_memory(error);
	}
	fprintf(out, "%s# HELP tightwire_jobs Jobs in the store by state.\n# TYPE tightwire_jobs gauge\n", own);
	for (enum job_state state = JOB_QUEUED; state < JOB_STATES; state++)
		fprintf(out, "tightwire_jobs{state=\"%s\"} %llu\n", job_state_name(state),
			(unsigned long long)counts.by_state[state]);
	store_count_writes(call->store, &writes);
	fprintf(out,
		"# HELP tightwire_store_room_bytes What uploads and results may still take before the store is full.\n"
		"# TYPE tightwire_store_room_bytes gauge\ntightwire_store_room_bytes %llu\n",
		(unsigned long long)room);
	fprintf(out,
		"# HELP tightwire_store_transactions_total Transactions that this process has written.\n"
		"# TYPE tightwire_store_transactions_total counter\ntightwire_store_transactions_total %llu\n"
		"# HELP tightwire_store_syncs_total Waits for the disk; one serves many transactions.\n"
		"# TYPE tightwire_store_syncs_total counter\ntightwire_store_syncs_total %llu\n",
		(unsigned long long)writes.transactions, (unsigned long long)writes.syncs);
	print_oldest(out, &counts);
	fprintf(out,
		"# HELP tightwire_wrong_keys_total Requests with a key that is none.\n"
		"# TYPE tightwire_wrong_keys_total counter\ntightwire_wrong_keys_total %llu\n",
		(unsigned long long)api_wrong_keys(call->api));
	free(own);
	if (fclose(out) != 0) {
		free(text);
		return tw_fail_memory(error);
	}
	response_header(&call->response, "Cache-Control", "no-store");
	return response_bytes(&call->response, 200, "text/plain; version=0.0.4; charset=utf-8", text, size, error);
}

enum tw_status get_openapi(struct api_call *call, struct tw_error *error)
{
	/* Two symbols of the linker, not of one array: subtracted as addresses. */
	size_t size = (size_t)((uintptr_t)_binary_openapi_yaml_end - (uintptr_t)_binary_openapi_yaml_start);
	char *copy = malloc(size);
	if (copy)
		memcpy(copy, _binary_openapi_yaml_start, size);
	return response_bytes(&call->response, 200, "application/yaml", copy, size, error);
}
