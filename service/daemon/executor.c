#include "service/daemon/executor.h"

#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>

/* A thread that has nothing to do. */
struct idler {
	pthread_cond_t called;
	bool is_called;
	struct idler *below;
};

/* Who became idle last is called first: then as many threads as there is work for have connections to the store, caches
 * and heaps that grow, and the others sleep. */
struct executor {
	pthread_mutex_t mutex;
	struct idler *idle; /* borrowed from the stacks of the threads */
	struct task *first, *last;
	bool ending;
	unsigned count;
	pthread_t threads[]; /* [count] */
};

/* With the mutex. */
static void call(struct executor *executor)
{
	struct idler *idler = executor->idle;
	executor->idle = idler->below;
	idler->is_called = true;
	pthread_cond_signal(&idler->called);
}

/* With the mutex. */
static void idle(struct executor *executor, struct idler *idler)
{
	idler->is_called = false;
	idler->below = executor->idle;
	executor->idle = idler;
	while (!idler->is_called)
		pthread_cond_wait(&idler->called, &executor->mutex);
}

static struct task *take(struct executor *executor, struct idler *idler)
{
	pthread_mutex_lock(&executor->mutex);
	while (!executor->first && !executor->ending)
		idle(executor, idler);
	struct task *task = executor->first;
	if (task)
		executor->first = task->next;
	pthread_mutex_unlock(&executor->mutex);
	return task;
}

static void *work(void *context)
{
	struct idler idler = {.is_called = false};
	pthread_cond_init(&idler.called, NULL);
	for (struct task *task; (task = take(context, &idler));)
		task->run(task);
	pthread_cond_destroy(&idler.called);
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
	if (executor->idle)
		call(executor);
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
	while (executor->idle)
		call(executor);
	pthread_mutex_unlock(&executor->mutex);
	for (unsigned i = 0; i < executor->count; i++)
		pthread_join(executor->threads[i], NULL);
	pthread_mutex_destroy(&executor->mutex);
	free(executor);
}
