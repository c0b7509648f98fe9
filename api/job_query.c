#include "api/job_query.h"

#include "api/job_view.h"
#include "api/time_text.h"
#include "solver/names.h"

#include <string.h>

enum { PARAMETERS_MAX = 16 };

static enum tw_status parse_kind(const char *text, unsigned *kinds, struct tw_error *error)
{
	enum job_kind kind = JOB_IMPORT_MESH;
	const char *names[JOB_KINDS];
	if (!text)
		return TW_OK;
	if (job_kind_by_name(text, &kind)) {
		*kinds = JOB_KIND_BIT(kind);
		return TW_OK;
	}
	for (kind = JOB_IMPORT_MESH; kind < JOB_KINDS; kind++)
		names[kind] = job_kind_name(kind);
	return names_refuse(&(struct names){names, JOB_KINDS}, "kind of job", text, "invalid-parameter", "kind", error);
}

static enum tw_status parse_class(const char *text, unsigned *classes, struct tw_error *error)
{
	enum job_class class = JOB_NORMAL;
	if (!text)
		return TW_OK;
	if (!job_class_by_name(text, &class))
		return tw_fail(error, TW_ERROR_INPUT, "invalid-parameter", "class",
			       "class is interactive, normal or batch");
	*classes = JOB_CLASS_BIT(class);
	return TW_OK;
}

static enum tw_status parse_age(const struct api_call *call, const char *text, int64_t *before_ms,
				struct tw_error *error)
{
	int64_t span_ms = 0;
	if (!text)
		return TW_OK;
	if (!time_text_read_span(text, &span_ms))
		return tw_fail(error, TW_ERROR_INPUT, "invalid-parameter", "older_than",
			       "older_than is " TIME_TEXT_SPAN_FORM);
	*before_ms = store_now_ms(call->store) - span_ms;
	return TW_OK;
}

/* As a problem has it, or its last word alone. */
static const char *problem_slug(const char *text)
{
	static const char urn[] = "urn:tightwire:problem:";
	bool whole = text && !strncmp(text, urn, sizeof urn - 1);
	return whole ? text + sizeof urn - 1 : text;
}

static enum tw_status check_names(const struct api_call *call, const char *const *more, struct tw_error *error)
{
	const char *known[PARAMETERS_MAX + 1] = {"kind", "state", "class", "group", "problem", "older_than"};
	size_t count = 6;
	for (; more && *more && count < PARAMETERS_MAX; more++)
		known[count++] = *more;
	return query_only(&call->query, known, error);
}

enum tw_status job_query_parse(const struct api_call *call, const char *const *more, struct job_query *query,
			       struct tw_error *error)
{
	*query = (struct job_query){
		.tenant = call->caller.owner.tenant,
		.failure_type = problem_slug(query_get(&call->query, "problem")),
		.group = query_get(&call->query, "group"),
	};
	enum tw_status status = check_names(call, more, error);
	if (status == TW_OK)
		status = job_states_parse(query_get(&call->query, "state"), &query->states, error);
	if (status == TW_OK)
		status = parse_kind(query_get(&call->query, "kind"), &query->kinds, error);
	if (status == TW_OK)
		status = parse_class(query_get(&call->query, "class"), &query->classes, error);
	if (status == TW_OK)
		status = parse_age(call, query_get(&call->query, "older_than"), &query->created_before_ms, error);
	return status;
}
