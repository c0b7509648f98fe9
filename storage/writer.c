/* The writer: see writer.h.
 *
 * There is no writing thread: the thread whose turn it is uses the connection, then calls the next. Who finds nobody
 * waiting commits for all of its group, passes the turn on, and waits for the disk together with the others: one of
 * those who wait calls fdatasync for everything that was committed until then.
 *
 * After a failed fdatasync the kernel takes the lost pages for written, and whatever follows them in the log cannot be
 * read without them. So the log is not trusted any more until all of it has been copied into the database and it has
 * been begun anew. */
#include "storage/writer.h"

#include "storage/gate.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum {
	/* A group ends when nobody waits, or here: others want to write too, and wait for at most this. */
	GROUP_MEMBERS_MAX = 64,
	GROUP_MS = 10,
	/* Pages of the log at which it is copied: 16 MiB. At 4 MiB the copying took a tenth of the submits a second. */
	CHECKPOINT_PAGES = 2048,
};

/* A thread that waits for its turn; lies on its stack. */
struct turn {
	struct turn *next;
	pthread_cond_t called;
	bool granted;
	bool alone; /* outside of any group */
};

/* Transactions that are committed together. Freed by the last of its members. */
struct group {
	unsigned members; /* begun */
	unsigned waiting; /* members that have not read the outcome */
	bool alone;       /* it has one member, and no savepoint */
	int64_t begun_ms;
	uint64_t number; /* of the commit; 1 for the first */
	bool decided;
	enum tw_status status;
	struct tw_error error;
};

/* The thread that copies the log. */
struct copier {
	pthread_t thread;
	pthread_cond_t asked;
	bool started, wanted, stop;
};

struct writer {
	struct writer *next; /* in the list of this process */
	unsigned users;
	char *path;
	dev_t device; /* these three tell one writer from another */
	ino_t inode;
	uint64_t limit_bytes;
	struct gate *gate;
	/* Of the thread whose turn it is. */
	struct connection connection;
	struct group *group; /* NULL: no transaction is open */
	int log_pages;       /* after the last commit */
	int copy_at_pages;
	bool distrusts_log; /* guarded by the mutex, as is what follows */
	pthread_mutex_t mutex;
	struct turn *first, *last;
	bool taken; /* somebody has the turn */
	pthread_cond_t decided;
	/* The disk. */
	int log_file;            /* -1 until it is first needed */
	uint64_t committed;      /* number of the last committed group */
	uint64_t synced, failed; /* groups up to these are on the disk; were not confirmed */
	bool syncing;
	pthread_cond_t synced_more;
	struct copier copier;
	struct writer_counts counts;
};

static int64_t now_ms(void)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static void init_condition(pthread_cond_t *condition)
{
	pthread_condattr_t monotonic;
	pthread_condattr_init(&monotonic);
	pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
	pthread_cond_init(condition, &monotonic);
	pthread_condattr_destroy(&monotonic);
}

static enum tw_status fail_busy(struct tw_error *error)
{
	return connection_fail(NULL, SQLITE_BUSY, error);
}

/* --- turns ------------------------------------------------------------------------------------------------------ */

/* With the mutex held. */
static void call_next(struct writer *writer)
{
	struct turn *turn = writer->first;
	writer->taken = turn != NULL;
	if (!turn)
		return;
	writer->first = turn->next;
	if (!writer->first)
		writer->last = NULL;
	turn->granted = true;
	pthread_cond_signal(&turn->called);
}

static void leave_queue(struct writer *writer, const struct turn *turn)
{
	struct turn *previous = NULL;
	for (struct turn *at = writer->first; at && at != turn; at = at->next)
		previous = at;
	if (previous)
		previous->next = turn->next;
	else
		writer->first = turn->next;
	if (writer->last == turn)
		writer->last = previous;
}

static bool wait_in_queue(struct writer *writer, bool alone, int64_t until_ms)
{
	struct turn turn = {.alone = alone};
	struct timespec until = {until_ms / 1000, until_ms % 1000 * 1000000};
	int code = 0;
	init_condition(&turn.called);
	/* It leaves the queue before it ceases to be. */
	if (writer->last)
		writer->last->next = &turn;
	else
		writer->first = &turn; /* cppcheck-suppress autoVariables */
	writer->last = &turn;          /* cppcheck-suppress autoVariables */
	while (!turn.granted && code == 0)
		code = pthread_cond_timedwait(&turn.called, &writer->mutex, &until);
	if (!turn.granted)
		leave_queue(writer, &turn);
	pthread_cond_destroy(&turn.called);
	return turn.granted;
}

static bool take_turn(struct writer *writer, bool alone, int64_t until_ms)
{
	pthread_mutex_lock(&writer->mutex);
	bool taken = !writer->taken && !writer->first;
	if (taken)
		writer->taken = true;
	else
		taken = wait_in_queue(writer, alone, until_ms);
	pthread_mutex_unlock(&writer->mutex);
	return taken;
}

static void pass_turn(struct writer *writer)
{
	pthread_mutex_lock(&writer->mutex);
	call_next(writer);
	pthread_mutex_unlock(&writer->mutex);
}

/* --- copying the log into the database -------------------------------------------------------------------------- */

/* First while others write, which is most of it; then the rest with the gate shut: a log that always grows a little
 * while it is copied would never be at its end, where it can be begun anew. What fails is tried again when the log has
 * grown further. */
static void copy_log(struct writer *writer, sqlite3 *db)
{
	sqlite3_wal_checkpoint_v2(db, "main", SQLITE_CHECKPOINT_PASSIVE, NULL, NULL);
	if (!take_turn(writer, true, now_ms() + CONNECTION_BUSY_MS))
		return;
	if (gate_enter(writer->gate, CONNECTION_BUSY_MS)) {
		sqlite3_wal_checkpoint_v2(db, "main", SQLITE_CHECKPOINT_PASSIVE, NULL, NULL);
		gate_leave(writer->gate);
	}
	pass_turn(writer);
}

static void *run_copier(void *context)
{
	struct writer *writer = context;
	struct connection connection = {0};
	bool open = connection_open(&connection, writer->path, NULL) == TW_OK &&
		    connection_set_up(&connection, writer->limit_bytes, NULL) == TW_OK;
	pthread_mutex_lock(&writer->mutex);
	while (!writer->copier.stop) {
		if (!writer->copier.wanted) {
			pthread_cond_wait(&writer->copier.asked, &writer->mutex);
			continue;
		}
		pthread_mutex_unlock(&writer->mutex);
		if (open)
			copy_log(writer, connection.db);
		pthread_mutex_lock(&writer->mutex);
		writer->copier.wanted = false;
	}
	pthread_mutex_unlock(&writer->mutex);
	connection_close(&connection);
	return NULL;
}

/* With the mutex held. The thread takes no signals: they are for those that know what to do with them. */
static void ask_copier(struct writer *writer)
{
	struct copier *copier = &writer->copier;
	sigset_t all, before;
	copier->wanted = true;
	pthread_cond_signal(&copier->asked);
	if (copier->started)
		return;
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &before);
	copier->started = pthread_create(&copier->thread, NULL, run_copier, writer) == 0;
	pthread_sigmask(SIG_SETMASK, &before, NULL);
}

static void stop_copier(struct writer *writer)
{
	pthread_mutex_lock(&writer->mutex);
	writer->copier.stop = true;
	pthread_cond_signal(&writer->copier.asked);
	pthread_mutex_unlock(&writer->mutex);
	if (writer->copier.started)
		pthread_join(writer->copier.thread, NULL);
}

/* --- groups ----------------------------------------------------------------------------------------------------- */

/* Everything is copied and the log begun anew; see the top. Inside the gate, outside a transaction. */
static enum tw_status renew_log(struct writer *writer, struct tw_error *error)
{
	pthread_mutex_lock(&writer->mutex);
	bool distrusts = writer->distrusts_log;
	pthread_mutex_unlock(&writer->mutex);
	if (!distrusts)
		return TW_OK;
	errno = 0;
	int code = sqlite3_wal_checkpoint_v2(writer->connection.db, "main", SQLITE_CHECKPOINT_TRUNCATE, NULL, NULL);
	if (code != SQLITE_OK)
		return connection_fail(writer->connection.db, code, error);
	pthread_mutex_lock(&writer->mutex);
	writer->distrusts_log = false;
	pthread_mutex_unlock(&writer->mutex);
	return TW_OK;
}

static enum tw_status begin_immediate(struct writer *writer, struct tw_error *error)
{
	enum tw_status status = renew_log(writer, error);
	if (status != TW_OK)
		return status;
	int code = connection_run(&writer->connection, "BEGIN IMMEDIATE");
	return code == SQLITE_OK ? TW_OK : connection_fail(writer->connection.db, code, error);
}

static enum tw_status open_group(struct writer *writer, bool alone, int64_t until_ms, struct tw_error *error)
{
	struct group *group = calloc(1, sizeof *group);
	if (!group)
		return tw_fail_memory(error);
	int64_t left_ms = until_ms - now_ms();
	if (!gate_enter(writer->gate, left_ms > 0 ? left_ms : 0)) {
		free(group);
		return fail_busy(error);
	}
	enum tw_status status = begin_immediate(writer, error);
	if (status != TW_OK) {
		gate_leave(writer->gate);
		free(group);
		return status;
	}
	group->alone = alone;
	group->begun_ms = now_ms();
	writer->group = group;
	return TW_OK;
}

enum tw_status writer_begin(struct writer *writer, bool alone, struct connection **connection, struct tw_error *error)
{
	int64_t until_ms = now_ms() + CONNECTION_BUSY_MS;
	enum tw_status status = connection_check_place(&writer->connection, error);
	if (status != TW_OK)
		return status;
	if (!take_turn(writer, alone, until_ms))
		return fail_busy(error);
	if (!writer->group)
		status = open_group(writer, alone, until_ms, error);
	if (status != TW_OK) {
		pass_turn(writer);
		return status;
	}
	assert(writer->group);
	writer->group->members++;
	int code = alone ? SQLITE_OK : connection_run(&writer->connection, "SAVEPOINT member");
	if (code != SQLITE_OK) {
		status = connection_fail(writer->connection.db, code, error);
		return writer_end(writer, status, false, error);
	}
	*connection = &writer->connection;
	return TW_OK;
}

/* SQLite has rolled back everything by itself after some errors (a full disk, say), and after others not. */
static bool is_rolled_back(const struct writer *writer)
{
	return sqlite3_get_autocommit(writer->connection.db);
}

static enum tw_status end_savepoint(struct writer *writer, enum tw_status status, struct tw_error *error)
{
	struct connection *connection = &writer->connection;
	int code = SQLITE_OK;
	if (writer->group->alone) {
		if (status != TW_OK && !is_rolled_back(writer))
			connection_run(connection, "ROLLBACK");
		return status;
	}
	if (status != TW_OK && !is_rolled_back(writer))
		code = connection_run(connection, "ROLLBACK TO member");
	if (code == SQLITE_OK && !is_rolled_back(writer))
		code = connection_run(connection, "RELEASE member");
	if (code == SQLITE_OK)
		return status;
	enum tw_status failure = connection_fail(connection->db, code, status == TW_OK ? error : NULL);
	if (!is_rolled_back(writer))
		connection_run(connection, "ROLLBACK");
	return status == TW_OK ? failure : status;
}

static void commit(struct writer *writer, struct group *group, enum tw_status status, const struct tw_error *error)
{
	struct connection *connection = &writer->connection;
	group->status = TW_OK;
	if (is_rolled_back(writer)) {
		group->status = status;
		if (error)
			group->error = *error;
	} else {
		int code = connection_run(connection, "COMMIT");
		if (code != SQLITE_OK)
			group->status = connection_fail(connection->db, code, &group->error);
		if (!is_rolled_back(writer))
			connection_run(connection, "ROLLBACK");
	}
	gate_leave(writer->gate);
}

/* With the mutex held. */
static void decide(struct writer *writer, struct group *group)
{
	writer->group = NULL;
	writer->counts.groups++;
	if (group->status == TW_OK)
		group->number = ++writer->committed;
	if (writer->log_pages < writer->copy_at_pages - CHECKPOINT_PAGES)
		writer->copy_at_pages = CHECKPOINT_PAGES; /* it was begun anew */
	if (writer->log_pages >= writer->copy_at_pages) {
		writer->copy_at_pages = writer->log_pages + CHECKPOINT_PAGES;
		ask_copier(writer);
	}
	group->decided = true;
	pthread_cond_broadcast(&writer->decided);
}

/* The outcome of the group becomes that of the member. With the mutex held. */
static enum tw_status read_outcome(struct writer *writer, struct group *group, uint64_t *number, struct tw_error *error)
{
	while (!group->decided)
		pthread_cond_wait(&writer->decided, &writer->mutex);
	enum tw_status status = group->status;
	if (status != TW_OK && error)
		*error = group->error;
	*number = group->number;
	return status;
}

/* --- the disk --------------------------------------------------------------------------------------------------- */

/* The directory too: the log may be new in it. */
static int open_log(struct writer *writer)
{
	const char *path = sqlite3_filename_wal(sqlite3_db_filename(writer->connection.db, "main"));
	char directory[4096];
	snprintf(directory, sizeof directory, "%s", path);
	char *slash = strrchr(directory, '/');
	if (slash)
		slash[slash == directory] = '\0';
	int folder = slash ? open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;
	if (folder >= 0) {
		fsync(folder);
		close(folder);
	}
	return open(path, O_RDONLY | O_CLOEXEC);
}

/* Without the mutex; by one thread at a time. */
static bool sync_log(struct writer *writer)
{
	if (writer->log_file < 0)
		writer->log_file = open_log(writer);
	return writer->log_file >= 0 && fdatasync(writer->log_file) == 0;
}

/* With the mutex held, which is let go of meanwhile. */
static void sync_for_all(struct writer *writer)
{
	uint64_t up_to = writer->committed;
	writer->syncing = true;
	pthread_mutex_unlock(&writer->mutex);
	bool done = sync_log(writer);
	pthread_mutex_lock(&writer->mutex);
	writer->syncing = false;
	writer->counts.syncs++;
	writer->distrusts_log |= !done;
	if (done && !writer->distrusts_log)
		writer->synced = up_to;
	else
		writer->failed = up_to;
	pthread_cond_broadcast(&writer->synced_more);
}

/* With the mutex held. */
static enum tw_status wait_for_disk(struct writer *writer, uint64_t number, struct tw_error *error)
{
	while (writer->synced < number && writer->failed < number) {
		if (writer->syncing)
			pthread_cond_wait(&writer->synced_more, &writer->mutex);
		else
			sync_for_all(writer);
	}
	return writer->synced >= number
		       ? TW_OK
		       : tw_fail(error, TW_ERROR_IO, "store-io", NULL,
				 "the disk did not confirm that this is kept; look whether it is there");
}

/* --- the end of a transaction ----------------------------------------------------------------------------------- */

static bool group_goes_on(const struct writer *writer, const struct group *group)
{
	return writer->first && !writer->first->alone && !group->alone && !is_rolled_back(writer) &&
	       group->members < GROUP_MEMBERS_MAX && now_ms() - group->begun_ms < GROUP_MS;
}

/* What a member whose own end was good is told. */
static enum tw_status await_group(struct writer *writer, struct group *group, bool durable, struct tw_error *error)
{
	uint64_t number = 0;
	enum tw_status status = read_outcome(writer, group, &number, error);
	if (status == TW_OK && durable)
		status = wait_for_disk(writer, number, error);
	return status;
}

enum tw_status writer_end(struct writer *writer, enum tw_status status, bool durable, struct tw_error *error)
{
	struct tw_error own = {0};
	struct group *group = writer->group;
	if (error && status != TW_OK)
		own = *error;
	status = end_savepoint(writer, status, &own);
	pthread_mutex_lock(&writer->mutex);
	writer->counts.transactions++;
	group->waiting++;
	if (!group_goes_on(writer, group)) {
		pthread_mutex_unlock(&writer->mutex);
		commit(writer, group, status, &own);
		pthread_mutex_lock(&writer->mutex);
		decide(writer, group);
	}
	call_next(writer);
	if (status == TW_OK)
		status = await_group(writer, group, durable, &own);
	bool is_last = --group->waiting == 0 && group->decided;
	pthread_mutex_unlock(&writer->mutex);
	if (is_last)
		free(group);
	if (error && status != TW_OK)
		*error = own;
	return status;
}

void writer_place(const struct writer *writer, uint64_t *device, uint64_t *file)
{
	*device = writer->device;
	*file = writer->inode;
}

void writer_count(struct writer *writer, struct writer_counts *counts)
{
	pthread_mutex_lock(&writer->mutex);
	*counts = writer->counts;
	pthread_mutex_unlock(&writer->mutex);
}

/* --- the writers of this process -------------------------------------------------------------------------------- */

static pthread_mutex_t list_mutex = PTHREAD_MUTEX_INITIALIZER;
static pthread_once_t list_once = PTHREAD_ONCE_INIT;
static struct writer *list;

/* A child has its parent's memory, but neither its threads nor its locks: it begins with none. */
static void forget_list(void)
{
	list = NULL;
	pthread_mutex_init(&list_mutex, NULL);
}

static void watch_forks(void)
{
	pthread_atfork(NULL, NULL, forget_list);
}

static int note_log_pages(void *context, sqlite3 *db, const char *schema, int pages)
{
	struct writer *writer = context;
	(void)db;
	(void)schema;
	writer->log_pages = pages;
	return SQLITE_OK;
}

static void destroy(struct writer *writer)
{
	stop_copier(writer);
	connection_close(&writer->connection);
	gate_close(writer->gate);
	if (writer->log_file >= 0)
		close(writer->log_file);
	pthread_cond_destroy(&writer->copier.asked);
	pthread_cond_destroy(&writer->synced_more);
	pthread_cond_destroy(&writer->decided);
	pthread_mutex_destroy(&writer->mutex);
	free(writer->path);
	free(writer);
}

static enum tw_status connect(struct writer *writer, struct tw_error *error)
{
	enum tw_status status = connection_open(&writer->connection, writer->path, error);
	if (status == TW_OK)
		status = connection_set_up(&writer->connection, writer->limit_bytes, error);
	if (status == TW_OK)
		status = gate_open(&writer->gate, writer->path, error);
	if (status == TW_OK)
		sqlite3_wal_hook(writer->connection.db, note_log_pages, writer);
	return status;
}

static enum tw_status create(struct writer **writer, const char *path, const struct stat *file, uint64_t limit_bytes,
			     struct tw_error *error)
{
	struct writer *made = calloc(1, sizeof *made);
	char *copy = strdup(path);
	if (!made || !copy) {
		free(made);
		free(copy);
		return tw_fail_memory(error);
	}
	made->path = copy;
	made->users = 1;
	made->device = file->st_dev;
	made->inode = file->st_ino;
	made->limit_bytes = limit_bytes;
	made->copy_at_pages = CHECKPOINT_PAGES;
	made->log_file = -1;
	pthread_mutex_init(&made->mutex, NULL);
	init_condition(&made->decided);
	init_condition(&made->synced_more);
	init_condition(&made->copier.asked);
	enum tw_status status = connect(made, error);
	if (status == TW_OK)
		*writer = made;
	else
		destroy(made);
	return status;
}

static struct writer *find(const struct stat *file, uint64_t limit_bytes)
{
	struct writer *writer = list;
	while (writer &&
	       (writer->device != file->st_dev || writer->inode != file->st_ino || writer->limit_bytes != limit_bytes))
		writer = writer->next;
	return writer;
}

static enum tw_status find_or_create(struct writer **writer, const char *path, uint64_t limit_bytes,
				     struct tw_error *error)
{
	struct stat file;
	if (stat(path, &file) != 0)
		return tw_fail(error, TW_ERROR_IO, "store-io", NULL, "the store %.200s cannot be opened: %s", path,
			       strerror(errno));
	struct writer *found = find(&file, limit_bytes);
	if (found) {
		found->users++;
		*writer = found;
		return TW_OK;
	}
	enum tw_status status = create(writer, path, &file, limit_bytes, error);
	if (status == TW_OK) {
		(*writer)->next = list;
		list = *writer;
	}
	return status;
}

enum tw_status writer_open(struct writer **writer, const char *path, uint64_t limit_bytes, struct tw_error *error)
{
	pthread_once(&list_once, watch_forks);
	pthread_mutex_lock(&list_mutex);
	enum tw_status status = find_or_create(writer, path, limit_bytes, error);
	pthread_mutex_unlock(&list_mutex);
	return status;
}

void writer_close(struct writer *writer)
{
	if (!writer)
		return;
	pthread_mutex_lock(&list_mutex);
	bool is_last = --writer->users == 0;
	for (struct writer **link = &list; is_last && *link; link = &(*link)->next)
		if (*link == writer) {
			*link = writer->next;
			break;
		}
	pthread_mutex_unlock(&list_mutex);
	if (is_last)
		destroy(writer);
}
