#include "api/waiting.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { BUCKETS = 1024 };

struct waiting {
	pthread_mutex_t lock;
	struct waiter *first[BUCKETS];
};

struct waiting *waiting_new(void)
{
	struct waiting *made = calloc(1, sizeof *made);
	if (made)
		pthread_mutex_init(&made->lock, NULL);
	return made;
}

void waiting_free(struct waiting *waiting)
{
	if (!waiting)
		return;
	pthread_mutex_destroy(&waiting->lock);
	free(waiting);
}

/* Ids are random. */
static struct waiter **bucket_of(struct waiting *waiting, const char *job_id)
{
	uint32_t hash = 2166136261u;
	for (; *job_id; job_id++)
		hash = (hash ^ (uint8_t)*job_id) * 16777619u;
	return &waiting->first[hash % BUCKETS];
}

void waiting_join(struct waiting *waiting, struct waiter *waiter, const char *job_id, int64_t requests)
{
	*waiter = (struct waiter){.requests = requests, .is_waiting = true};
	snprintf(waiter->job_id, sizeof waiter->job_id, "%s", job_id);
	pthread_mutex_lock(&waiting->lock);
	struct waiter **first = bucket_of(waiting, waiter->job_id);
	waiter->next = *first;
	if (waiter->next)
		waiter->next->previous = waiter;
	*first = waiter;
	pthread_mutex_unlock(&waiting->lock);
}

bool waiting_leave(struct waiting *waiting, struct waiter *waiter, bool gives_up)
{
	bool is_last = true;
	if (!waiter->is_waiting)
		return false;
	pthread_mutex_lock(&waiting->lock);
	struct waiter **first = bucket_of(waiting, waiter->job_id);
	if (waiter->next)
		waiter->next->previous = waiter->previous;
	if (waiter->previous)
		waiter->previous->next = waiter->next;
	else
		*first = waiter->next;
	for (struct waiter *other = *first; other; other = other->next) {
		if (strcmp(other->job_id, waiter->job_id) != 0)
			continue;
		is_last = false;
		if (gives_up && other->requests < waiter->requests)
			other->requests = waiter->requests;
	}
	pthread_mutex_unlock(&waiting->lock);
	waiter->is_waiting = false;
	return is_last;
}
