/* The kernel wakes who waits longest for a lock, but its waiting cannot be given a time. So a thread of the gate's own
 * does it, where there is somebody to wait for; who wants to enter waits for that thread, and may give up. What the
 * thread then gets and nobody wants any more, it lets go of. */
#include "storage/gate.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum lock_byte { LOCK_NEXT, LOCK_TURN };

enum waiting {
	WAITING_NOT,
	WAITING,          /* the thread waits in the kernel, and somebody for it */
	WAITING_DESERTED, /* the thread waits in the kernel, but nobody for it */
	WAITING_DONE,     /* the thread has got the turn for somebody */
};

struct gate {
	int file; /* -1 where it cannot be opened: every lock is as good as got */
	bool has_thread;
	unsigned users; /* the owner, and the thread; the last one frees. This and what follows is under the mutex. */
	bool closed;
	enum waiting waiting;
	pthread_mutex_t mutex;
	pthread_cond_t changed;
};

/* F_OFD_SETLK or F_OFD_SETLKW. True unless another has it: locks that cannot be had here at all are as good as got. */
static bool take(const struct gate *gate, enum lock_byte byte, int command)
{
	struct flock lock = {.l_type = F_WRLCK, .l_whence = SEEK_SET, .l_start = byte, .l_len = 1};
	int code;
	do
		code = fcntl(gate->file, command, &lock);
	while (code < 0 && errno == EINTR);
	return code == 0 || (errno != EAGAIN && errno != EACCES);
}

static void give(const struct gate *gate, enum lock_byte byte)
{
	struct flock lock = {.l_type = F_UNLCK, .l_whence = SEEK_SET, .l_start = byte, .l_len = 1};
	fcntl(gate->file, F_OFD_SETLK, &lock);
}

static void let_go(struct gate *gate)
{
	pthread_mutex_lock(&gate->mutex);
	bool last = --gate->users == 0;
	pthread_mutex_unlock(&gate->mutex);
	if (!last)
		return;
	pthread_cond_destroy(&gate->changed);
	pthread_mutex_destroy(&gate->mutex);
	if (gate->file >= 0)
		close(gate->file);
	free(gate);
}

/* --- the thread that waits -------------------------------------------------------------------------------------- */

static void wait_in_kernel(struct gate *gate)
{
	pthread_mutex_unlock(&gate->mutex);
	take(gate, LOCK_NEXT, F_OFD_SETLKW);
	take(gate, LOCK_TURN, F_OFD_SETLKW);
	give(gate, LOCK_NEXT);
	pthread_mutex_lock(&gate->mutex);
	bool wanted = gate->waiting == WAITING && !gate->closed;
	gate->waiting = wanted ? WAITING_DONE : WAITING_NOT;
	if (!wanted)
		give(gate, LOCK_TURN);
	pthread_cond_broadcast(&gate->changed);
}

static void *run(void *context)
{
	struct gate *gate = context;
	pthread_mutex_lock(&gate->mutex);
	while (!gate->closed) {
		if (gate->waiting == WAITING)
			wait_in_kernel(gate);
		else
			pthread_cond_wait(&gate->changed, &gate->mutex);
	}
	pthread_mutex_unlock(&gate->mutex);
	let_go(gate);
	return NULL;
}

/* It takes no signals: they are for the threads that know what to do with them. Called with the mutex held. */
static bool start_thread(struct gate *gate)
{
	pthread_t thread;
	sigset_t all, before;
	if (gate->has_thread)
		return true;
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &before);
	gate->has_thread = pthread_create(&thread, NULL, run, gate) == 0;
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	if (gate->has_thread) {
		gate->users++;
		pthread_detach(thread);
	}
	return gate->has_thread;
}

/* --- entering --------------------------------------------------------------------------------------------------- */

static struct timespec time_after(int64_t ms)
{
	struct timespec until;
	clock_gettime(CLOCK_MONOTONIC, &until);
	until.tv_sec += ms / 1000;
	until.tv_nsec += ms % 1000 * 1000000;
	if (until.tv_nsec >= 1000000000) {
		until.tv_sec++;
		until.tv_nsec -= 1000000000;
	}
	return until;
}

/* Without a thread to be had, SQLite's own waiting has to do. */
static bool wait_for_thread(struct gate *gate, int64_t timeout_ms)
{
	struct timespec until = time_after(timeout_ms);
	pthread_mutex_lock(&gate->mutex);
	bool started = start_thread(gate);
	if (started)
		gate->waiting = WAITING;
	pthread_cond_broadcast(&gate->changed);
	int code = 0;
	while (started && gate->waiting == WAITING && code == 0)
		code = pthread_cond_timedwait(&gate->changed, &gate->mutex, &until);
	bool entered = gate->waiting == WAITING_DONE;
	gate->waiting = gate->waiting == WAITING ? WAITING_DESERTED : entered ? WAITING_NOT : gate->waiting;
	if (!started)
		give(gate, LOCK_NEXT);
	pthread_mutex_unlock(&gate->mutex);
	return entered || !started;
}

static bool is_deserted(struct gate *gate)
{
	pthread_mutex_lock(&gate->mutex);
	bool deserted = gate->waiting == WAITING_DESERTED;
	pthread_mutex_unlock(&gate->mutex);
	return deserted;
}

bool gate_enter(struct gate *gate, int64_t timeout_ms)
{
	/* The thread waits still, from a time before: its place in the queue is the better one. */
	if (is_deserted(gate) || !take(gate, LOCK_NEXT, F_OFD_SETLK))
		return wait_for_thread(gate, timeout_ms);
	if (!take(gate, LOCK_TURN, F_OFD_SETLK))
		return wait_for_thread(gate,
				       timeout_ms); /* `next` stays ours: the locks are the file's, not a thread's */
	give(gate, LOCK_NEXT);
	return true;
}

void gate_leave(struct gate *gate)
{
	give(gate, LOCK_TURN);
}

/* --- life ------------------------------------------------------------------------------------------------------- */

static void init(struct gate *gate)
{
	pthread_condattr_t monotonic;
	pthread_mutex_init(&gate->mutex, NULL);
	pthread_condattr_init(&monotonic);
	pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
	pthread_cond_init(&gate->changed, &monotonic);
	pthread_condattr_destroy(&monotonic);
	gate->users = 1;
}

/* Its owner is the database's, as with the files that SQLite itself puts beside it: root may have been the first here.
 */
int gate_open_file(const char *database)
{
	char path[4096 + 8];
	struct stat owner;
	if (snprintf(path, sizeof path, "%s-gate", database) >= (int)sizeof path)
		return -1;
	int file = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0644);
	bool is_root = file >= 0 && geteuid() == 0 && stat(database, &owner) == 0;
	int code = is_root ? fchown(file, owner.st_uid, owner.st_gid) : 0;
	(void)code; /* others then write without it */
	return file;
}

enum tw_status gate_open(struct gate **gate, const char *database, struct tw_error *error)
{
	struct gate *opened = calloc(1, sizeof *opened);
	if (!opened)
		return tw_fail_memory(error);
	init(opened);
	opened->file = gate_open_file(database);
	*gate = opened;
	return TW_OK;
}

void gate_close(struct gate *gate)
{
	if (!gate)
		return;
	pthread_mutex_lock(&gate->mutex);
	gate->closed = true;
	pthread_cond_broadcast(&gate->changed);
	pthread_mutex_unlock(&gate->mutex);
	let_go(gate);
}
