#include "api/submit.h"

#include "api/header.h"
#include "api/time_text.h"

#include <string.h>

struct source {
	const char *(*header)(void *context, const char *name);
	void *context;
	int64_t now_ms;
};

static const char *get(const struct source *source, const char *name)
{
	return source->header(source->context, name);
}

static enum tw_status refuse(const char *name, const char *wanted, struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_INPUT, "malformed-header", name, "%s is %s", name, wanted);
}

/* --- words and numbers -------------------------------------------------------------------------------------------- */

static enum tw_status read_word(const struct source *source, const char *name, const char **word,
				struct tw_error *error)
{
	const char *text = get(source, name);
	*word = NULL;
	if (!text)
		return TW_OK;
	size_t length = 0;
	while (text[length] > ' ' && text[length] < 127)
		length++;
	if (!length || text[length] || length > SUBMIT_WORD_MAX)
		return refuse(name, "1 to 64 visible ASCII characters, without blanks", error);
	*word = text;
	return TW_OK;
}

/* Digits with or without a minus, in [minimum, maximum]. */
static bool read_integer(const char *text, int64_t minimum, int64_t maximum, int64_t *value)
{
	bool is_negative = *text == '-';
	uint64_t digits = 0;
	const char *p = text + is_negative;
	if (!header_number(p, strlen(p), &digits) || digits > INT64_MAX)
		return false;
	*value = is_negative ? -(int64_t)digits : (int64_t)digits;
	return *value >= minimum && *value <= maximum;
}

static enum tw_status read_class(const struct source *source, struct submit *submit, struct tw_error *error)
{
	const char *text = get(source, "Job-Class");
	submit->queue.class = submit->wait_s ? JOB_INTERACTIVE : JOB_NORMAL;
	if (text && !job_class_by_name(text, &submit->queue.class))
		return refuse("Job-Class", "interactive, normal or batch", error);
	return TW_OK;
}

static enum tw_status read_priority(const struct source *source, struct submit *submit, struct tw_error *error)
{
	const char *text = get(source, "Job-Priority");
	int64_t value = 0;
	if (text && !read_integer(text, -SUBMIT_PRIORITY_MAX, SUBMIT_PRIORITY_MAX, &value))
		return refuse("Job-Priority", "an integer from -1000 to 1000", error);
	submit->queue.priority = (int32_t)value;
	return TW_OK;
}

static enum tw_status read_group(const struct source *source, struct submit *submit, struct tw_error *error)
{
	const char *text = get(source, "Job-Max-Running");
	int64_t value = 0;
	enum tw_status status = read_word(source, "Job-Group", &submit->queue.group, error);
	if (status != TW_OK || !text)
		return status;
	if (!read_integer(text, 1, SUBMIT_RUNNING_MAX, &value))
		return refuse("Job-Max-Running", "an integer from 1 to 100000", error);
	if (!submit->queue.group)
		return refuse("Job-Max-Running", "how many of a Job-Group run at a time; name the group too", error);
	submit->queue.max_running = (uint32_t)value;
	return TW_OK;
}

/* --- times -------------------------------------------------------------------------------------------------------- */

static enum tw_status read_times(const struct source *source, struct submit *submit, struct tw_error *error)
{
	const char *not_before = get(source, "Not-Before"), *cancel_after = get(source, "Cancel-After");
	struct job_request *queue = &submit->queue;
	int64_t span_ms = 0;
	if (not_before && time_text_read_span(not_before, &span_ms))
		queue->not_before_ms = source->now_ms + span_ms;
	else if (not_before && (!time_text_read(not_before, &queue->not_before_ms) ||
				queue->not_before_ms > source->now_ms + TIME_TEXT_SPAN_MAX_MS))
		return refuse("Not-Before",
			      "a time as 2026-11-28T22:00:00Z, or how long from now, " TIME_TEXT_SPAN_FORM, error);
	if (cancel_after && !time_text_read_span(cancel_after, &queue->cancel_after_ms))
		return refuse("Cancel-After", TIME_TEXT_SPAN_FORM, error);
	return TW_OK;
}

enum tw_status submit_parse(struct submit *submit, const char *(*header)(void *context, const char *name),
			    void *context, int64_t now_ms, struct tw_error *error)
{
	const struct source source = {header, context, now_ms};
	const char *prefer = get(&source, "Prefer");
	*submit = (struct submit){.wait_s = header_prefer_wait_s(prefer)};
	submit->queue.transient = header_prefers(prefer, "on_disconnect", "cancel");
	enum tw_status status = read_class(&source, submit, error);
	if (status == TW_OK)
		status = read_priority(&source, submit, error);
	if (status == TW_OK)
		status = read_group(&source, submit, error);
	if (status == TW_OK)
		status = read_times(&source, submit, error);
	if (status == TW_OK)
		status = read_word(&source, "Supersedes", &submit->queue.supersedes, error);
	if (status == TW_OK)
		status = read_word(&source, "Session", &submit->queue.session, error);
	return status;
}
