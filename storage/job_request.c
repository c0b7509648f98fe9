#include "storage/job_request.h"

#include "storage/content_hash.h"

#include <assert.h>
#include <string.h>

static const char *const names[JOB_CLASSES_END] = {
	[JOB_INTERACTIVE] = "interactive", [JOB_NORMAL] = "normal", [JOB_BATCH] = "batch"};

const char *job_class_name(enum job_class class)
{
	assert(class > JOB_CLASS_UNSAID && class < JOB_CLASSES_END);
	return names[class];
}

bool job_class_by_name(const char *name, enum job_class *class)
{
	for (enum job_class c = JOB_INTERACTIVE; c < JOB_CLASSES_END; c++)
		if (!strcmp(names[c], name)) {
			*class = c;
			return true;
		}
	return false;
}

static uint32_t hash_of(const char *text)
{
	uint32_t number = 0;
	struct content_hash hash = content_hash_of(text, strlen(text));
	for (unsigned i = 0; i < sizeof number; i++)
		number = number << 8 | hash.bytes[i];
	return number;
}

/* 0 means nothing, and is not given. */
int64_t job_affinity(const char *resource_id, const char *session)
{
	uint64_t number = (uint64_t)(hash_of(resource_id) | 1) << 32 | (session && *session ? hash_of(session) : 0);
	return (int64_t)number;
}
