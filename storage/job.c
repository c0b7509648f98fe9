#include "storage/job.h"

#include <stdlib.h>
#include <string.h>

static const char *const job_state_names[JOB_STATES] = {"queued", "running",   "succeeded",
							"failed", "cancelled", "incomplete"};

static const char *const job_cancel_names[JOB_CANCELS] = {"none", "asked", "deadline", "superseded", "unwanted"};

const char *job_cancel_name(enum job_cancel cause)
{
	return job_cancel_names[cause < JOB_CANCELS ? cause : JOB_CANCEL_ASKED];
}

const char *job_state_name(enum job_state state)
{
	return job_state_names[state];
}

bool job_state_by_name(const char *name, enum job_state *state)
{
	for (int i = 0; i < JOB_STATES; i++)
		if (!strcmp(job_state_names[i], name)) {
			*state = (enum job_state)i;
			return true;
		}
	return false;
}

void job_clear(struct job *job)
{
	free(job->partial);
	job->partial = NULL;
}

void job_page_clear(struct job_page *page)
{
	for (size_t i = 0; i < page->count; i++)
		job_clear(&page->jobs[i]);
	free(page->jobs);
	memset(page, 0, sizeof *page);
}
