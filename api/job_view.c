#include "api/job_view.h"

#include "api/json.h"
#include "api/problem.h"
#include "solver/names.h"

#include <string.h>

json_t *job_show_problem(const struct job *job)
{
	if (job->state != JOB_FAILED)
		return json_null();
	struct tw_error error = {.status = job->failure.status, .type = job->failure.type};
	snprintf(error.where, sizeof error.where, "%s", job->failure.where);
	snprintf(error.text, sizeof error.text, "%s", job->failure.text);
	return problem_json(&error);
}

static json_t *resource_link(const struct job *job)
{
	if (!job->resource_id[0])
		return json_null();
	json_t *resource = json_object();
	enum resource_kind kind = job_kind_row(job->kind)->resource;
	json_object_set_new(resource, "kind", json_string(resource_kind_name(kind)));
	json_object_set_new(resource, "id", json_string(job->resource_id));
	return resource;
}

static json_t *subject_of(const struct job *job)
{
	if (!job->subject_id[0])
		return json_null();
	return json_pack("{s:s, s:s, s:s}", "kind", resource_kind_name(job_kind_row(job->kind)->subject), "id",
			 job->subject_id, "file", job->argument);
}

static json_t *text_or_null(const char *text)
{
	return *text ? json_string(text) : json_null();
}

json_t *job_show(const struct job *job)
{
	json_t *json = json_object();
	json_object_set_new(json, "id", json_string(job->id));
	json_object_set_new(json, "kind", json_string(job_kind_name(job->kind)));
	json_object_set_new(json, "resource", resource_link(job));
	json_object_set_new(json, "state", json_string(job_state_name(job->state)));
	json_object_set_new(json, "subject", subject_of(job));
	json_object_set_new(json, "class", json_string(job_class_name(job->class)));
	json_object_set_new(json, "priority", json_integer(job->priority));
	json_object_set_new(json, "group", text_or_null(job->group));
	json_object_set_new(json, "not_before", json_time(job->not_before_ms));
	json_object_set_new(json, "cancel_at", json_time(job->cancel_at_ms));
	json_object_set_new(json, "cancel_requested", json_boolean(job->cancel_requested));
	json_object_set_new(json, "cancel_cause",
			    job->cancel_requested ? json_string(job_cancel_name(job->cancel_cause)) : json_null());
	json_object_set_new(json, "progress", json_real(job->progress));
	json_object_set_new(json, "stage", json_string(job->stage));
	json_object_set_new(json, "waiting_for", json_integer(job->waiting_for));
	json_object_set_new(json, "attempts", json_integer(job->attempts));
	json_object_set_new(json, "attempts_max", json_integer(job->attempts_max));
	json_object_set_new(json, "partial", json_embed(job->partial));
	json_object_set_new(json, "created_at", json_time(job->created_ms));
	json_object_set_new(json, "started_at", json_time(job->started_ms));
	json_object_set_new(json, "finished_at", json_time(job->finished_ms));
	json_object_set_new(json, "problem", job_show_problem(job));
	return json;
}

static enum tw_status refuse_state(const char *word, struct tw_error *error)
{
	const char *names[JOB_STATES];
	for (enum job_state state = JOB_QUEUED; state < JOB_STATES; state++)
		names[state] = job_state_name(state);
	return names_refuse(&(struct names){names, JOB_STATES}, "state", word, "invalid-parameter", "state", error);
}

enum tw_status job_states_parse(const char *text, unsigned *states, struct tw_error *error)
{
	*states = 0;
	while (text && *text) {
		char word[32];
		size_t length = strcspn(text, ",");
		enum job_state state = JOB_QUEUED;
		snprintf(word, sizeof word, "%.*s", (int)(length < sizeof word ? length : sizeof word), text);
		if (!job_state_by_name(word, &state))
			return refuse_state(word, error);
		*states |= 1u << state;
		text += length + (text[length] == ',');
	}
	return TW_OK;
}

json_t *job_show_attempt(const struct attempt *attempt)
{
	json_t *json = json_object();
	json_object_set_new(json, "ending", json_string(attempt_ending_name(attempt->ending)));
	json_object_set_new(json, "times", json_integer(attempt->times));
	json_object_set_new(json, "attempt", json_integer(attempt->attempt));
	json_object_set_new(json, "worker", json_string(attempt->worker));
	json_object_set_new(json, "started_at", json_time(attempt->started_ms));
	json_object_set_new(json, "ended_at", json_time(attempt->ended_ms));
	json_object_set_new(json, "problem",
			    *attempt->failure_type ? json_sprintf(PROBLEM_URN "%s", attempt->failure_type)
						   : json_null());
	json_object_set_new(json, "detail", json_string(attempt->failure_text));
	return json;
}
