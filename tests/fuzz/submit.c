/* The headers that say how a job is queued, the value of one on each line. What is taken is in its
 * limits. */
#include "api/submit.h"
#include "api/time_text.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const char *const names[] = {"Prefer",     "Job-Class",    "Job-Priority", "Job-Group", "Job-Max-Running",
				    "Not-Before", "Cancel-After", "Supersedes",   "Session"};
enum { NAMES = sizeof names / sizeof *names };

static const char *find(void *context, const char *name)
{
	const char **values = context;
	for (size_t i = 0; i < NAMES; i++)
		if (!strcmp(names[i], name))
			return values[i];
	abort();
}

static void check_word(const char *word)
{
	if (word && (!*word || strlen(word) > SUBMIT_WORD_MAX || strpbrk(word, " \t")))
		abort();
}

static void check(const struct submit *submit, int64_t now_ms)
{
	const struct job_request *queue = &submit->queue;
	check_word(queue->group);
	check_word(queue->supersedes);
	check_word(queue->session);
	if (queue->class < JOB_INTERACTIVE || queue->class > JOB_BATCH || abs(queue->priority) > SUBMIT_PRIORITY_MAX ||
	    queue->max_running > SUBMIT_RUNNING_MAX || (queue->max_running && !queue->group))
		abort();
	if (queue->cancel_after_ms < 0 || queue->cancel_after_ms > TIME_TEXT_SPAN_MAX_MS ||
	    queue->not_before_ms > now_ms + TIME_TEXT_SPAN_MAX_MS || queue->not_before_ms < 0)
		abort();
}

/* Values are lines, the first of them that of the first name; an empty line: the header is not there. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static const int64_t now_ms = 1795816800000;
	const char *values[NAMES] = {NULL};
	struct submit submit;
	struct tw_error error = {0};
	char *text = malloc(size + 1), *rest = text;
	memcpy(text, data, size);
	text[size] = 0;
	for (size_t i = 0; i < NAMES && rest; i++) {
		char *line = strsep(&rest, "\n");
		values[i] = *line ? line : NULL;
	}
	if (submit_parse(&submit, find, values, now_ms, &error) == TW_OK)
		check(&submit, now_ms);
	else if (!error.type || strcmp(error.type, "malformed-header") != 0 || !error.where[0])
		abort();
	free(text);
	return 0;
}
