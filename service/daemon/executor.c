#include "service/daemon/executor.h"

#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>

struct executor {
	pthread_mutex_t mutex;
	pthread_cond_t changed;
	struct task *first, *last;
	bool ending;
	unsigned count;
	pthread_t threads[]; /* [count] */
};

static struct task *take(struct executor *executor)
{
	pthread_mutex_lock(&executor->mutex);
	while (!executor->first && !executor->ending)
		pthread_cond_wait(&executor->changed, &executor->mutex);
	struct task *task = executor->first;
	if (task)
		executor->first = task->next;
	pthread_mutex_unlock(&executor->mutex);
	return task;
}

static void *work(void *context)
{
	for (struct task *task; (task = take(context));)
		task->run(task);
	return NULL;
}

void executor_run(struct executor *executor, struct task *task)
{
	task->next = NULL;
	pthread_mutex_lock(&executor->mutex);
	if (executor->first)
		executor->last->next = task;
	else
		executor->first = task;
	executor->last = task;
	pthread_cond_signal(&executor->changed);
	pthread_mutex_unlock(&executor->mutex);
}

/* Its threads take no signals: those are for the main thread. */
static void start(struct executor *executor, unsigned threads)
{
	sigset_t all, before;
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &before);
	while (executor->count < threads &&
	       pthread_create(&executor->threads[executor->count], NULL, work, executor) == 0)
		executor->count++;
	pthread_sigmask(SIG_SETMASK, &before, NULL);
}

enum tw_status executor_new(struct executor **executor, unsigned threads, struct tw_error *error)
{
	struct executor *made = calloc(1, sizeof *made + threads * sizeof made->threads[0]);
	if (!made)
		return tw_fail_memory(error);
	pthread_mutex_init(&made->mutex, NULL);
	pthread_cond_init(&made->changed, NULL);
	start(made, threads);
	if (made->count == 0) {
		executor_free(made);
		return tw_fail(error, TW_ERROR_MEMORY, "no-thread", NULL, "no thread for writing can be started");
	}
	*executor = made;
	return TW_OK;
}

void executor_free(struct executor *executor)
{
	if (!executor)
		return;
	pthread_mutex_lock(&executor->mutex);
	executor->ending = true;
	pthread_cond_broadcast(&executor->changed);
	pthread_mutex_unlock(&executor->mutex);
	for (unsigned i = 0; i < executor->count; i++)
		pthread_join(executor->threads[i], NULL);
	pthread_cond_destroy(&executor->changed);
	pthread_mutex_destroy(&executor->mutex);
	free(executor);
}
