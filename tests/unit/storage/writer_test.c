/* One writer: first come, first served, many transactions at once, and each for itself. */
#include "tests/unit/storage/fixture.h"

#include "storage/gate.h"
#include "storage/sql.h"

#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>

enum { THREADS = 12, EACH = 40 };

/* The disk: this takes the place of the C library's, for SQLite too. */
static atomic_int syncs_that_fail;

int fdatasync(int file)
{
	if (atomic_load(&syncs_that_fail) > 0) {
		atomic_fetch_sub(&syncs_that_fail, 1);
		errno = EIO;
		return -1;
	}
	return (int)syscall(SYS_fdatasync, file);
}

static int64_t monotonic_ms(void)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static void sleep_ms(long ms)
{
	struct timespec pause = {ms / 1000, ms % 1000 * 1000000};
	nanosleep(&pause, NULL);
}

/* --- threads of one process ------------------------------------------------------------------------------------- */

struct client {
	struct fixture *f;
	pthread_t thread;
	int number;
	int kept, refused, other; /* answers */
};

/* Every third request comes with a key that another request had before. */
static void *submit(void *context)
{
	struct client *client = context;
	struct store *store = NULL;
	if (store_open(&store, client->f->url, NULL) != TW_OK)
		return NULL;
	for (int i = 0; i < EACH; i++) {
		char options[64];
		struct tw_error error = {0};
		struct resource resource;
		enum resource_outcome outcome;
		struct resource_draft draft = {.owner = OWNER_DEFAULT, .kind = RESOURCE_LAYOUT, .options = options};
		snprintf(options, sizeof options, "{\"client\":%d,\"request\":%d}", client->number, i);
		if (i % 3 == 2)
			draft.idempotency_key = "taken";
		enum tw_status status = resource_create(store, &draft, &resource, &outcome, &error);
		client->kept += status == TW_OK;
		client->refused += status == TW_ERROR_CONFLICT && !strcmp(error.type, "idempotency-key-reused");
		client->other += status != TW_OK && status != TW_ERROR_CONFLICT;
		if (status == TW_OK)
			resource_clear(&resource);
	}
	store_close(store);
	return NULL;
}

static void many_threads_share_commits_and_a_failing_one_is_rolled_back_alone(void **state)
{
	struct fixture *f = *state;
	struct client clients[THREADS];
	struct resource resource;
	enum resource_outcome outcome;
	struct resource_draft first = {
		.owner = OWNER_DEFAULT, .kind = RESOURCE_LAYOUT, .options = "{}", .idempotency_key = "taken"};
	struct store_writes before, after;
	ok(f, resource_create(f->store, &first, &resource, &outcome, &f->error));
	resource_clear(&resource);
	store_count_writes(f->store, &before);
	for (int i = 0; i < THREADS; i++) {
		clients[i] = (struct client){.f = f, .number = i};
		assert_int_equal(pthread_create(&clients[i].thread, NULL, submit, &clients[i]), 0);
	}
	int kept = 0, refusals = 0;
	for (int i = 0; i < THREADS; i++) {
		pthread_join(clients[i].thread, NULL);
		assert_int_equal(clients[i].other, 0);
		kept += clients[i].kept;
		refusals += clients[i].refused;
	}
	store_count_writes(f->store, &after);
	assert_int_equal(kept + refusals, THREADS * EACH);
	assert_int_equal(refusals, THREADS * (EACH / 3));
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job"), kept + 1);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM resource"), kept + 1);
	assert_int_equal(fixture_ask(f, "SELECT value FROM change"),
			 fixture_ask(f, "SELECT max(change) FROM job")); /* no number was lost */
	assert_int_equal(after.transactions - before.transactions, THREADS * EACH);
	assert_true(after.syncs - before.syncs < (uint64_t)kept / 2);
	fixture_is_sound(f);
}

/* Threads that come one after the other are served in that order. */
struct queuer {
	struct fixture *f;
	pthread_t thread;
	int number;
	atomic_int *served;
	int place;
};

static void *queue_up(void *context)
{
	struct queuer *queuer = context;
	struct store *store = NULL;
	if (store_open(&store, queuer->f->url, NULL) == TW_OK && transaction_begin(store, false, NULL) == TW_OK) {
		queuer->place = atomic_fetch_add(queuer->served, 1);
		enum tw_status ended = transaction_end(store, TW_OK, NULL);
		(void)ended;
	}
	store_close(store);
	return NULL;
}

static void who_comes_first_is_served_first(void **state)
{
	struct fixture *f = *state;
	struct queuer queuers[8];
	atomic_int served = 0;
	ok(f, transaction_begin(f->store, false, &f->error));
	for (int i = 0; i < 8; i++) {
		queuers[i] = (struct queuer){.f = f, .number = i, .served = &served, .place = -1};
		assert_int_equal(pthread_create(&queuers[i].thread, NULL, queue_up, &queuers[i]), 0);
		sleep_ms(60); /* it opens its store and stands in the queue */
	}
	assert_int_equal(atomic_load(&served), 0);
	ok(f, transaction_end(f->store, TW_OK, &f->error));
	for (int i = 0; i < 8; i++) {
		pthread_join(queuers[i].thread, NULL);
		assert_int_equal(queuers[i].place, i);
	}
}

static void *hold(void *context)
{
	struct queuer *queuer = context;
	struct store *store = NULL;
	if (store_open(&store, queuer->f->url, NULL) == TW_OK && transaction_begin(store, true, NULL) == TW_OK) {
		atomic_store(queuer->served, 1);
		while (atomic_load(queuer->served) == 1)
			sleep_ms(5);
		enum tw_status ended = transaction_end(store, TW_OK, NULL);
		(void)ended;
	}
	store_close(store);
	return NULL;
}

static void a_read_never_waits_for_a_write(void **state)
{
	struct fixture *f = *state;
	char layout[STORE_ID_SIZE];
	atomic_int held = 0;
	struct queuer holder = {.f = f, .served = &held};
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, layout);
	assert_int_equal(pthread_create(&holder.thread, NULL, hold, &holder), 0);
	while (!atomic_load(&held))
		sleep_ms(5);
	int64_t start = monotonic_ms();
	for (int i = 0; i < 100; i++) {
		assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, layout), JOB_QUEUED);
		ok(f, store_ping(f->store, &f->error));
	}
	assert_true(monotonic_ms() - start < 5000); /* a write would have waited for ten seconds and failed */
	atomic_store(&held, 2);
	pthread_join(holder.thread, NULL);
}

/* --- a disk that fails ------------------------------------------------------------------------------------------ */

/* How many jobs the file holds without its log. */
static int64_t jobs_in_the_file_alone(struct fixture *f)
{
	char command[400], path[160];
	sqlite3 *db = NULL;
	sqlite3_stmt *statement = NULL;
	snprintf(path, sizeof path, "%s/alone.db", f->directory);
	snprintf(command, sizeof command, "cp %s %s", f->path, path);
	assert_int_equal(system(command), 0);
	assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
	assert_int_equal(sqlite3_prepare_v2(db, "SELECT count(*) FROM job", -1, &statement, NULL), SQLITE_OK);
	assert_int_equal(sqlite3_step(statement), SQLITE_ROW);
	int64_t count = sqlite3_column_int64(statement, 0);
	sqlite3_finalize(statement);
	sqlite3_close(db);
	return count;
}

/* After a write that the disk did not confirm, what follows it in the log may be lost with it: nothing is acknowledged
 * before all of the log has been copied, and begun anew. */
static void what_the_disk_did_not_confirm_is_not_acknowledged(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	struct resource resource;
	enum resource_outcome outcome;
	struct resource_draft draft = {.owner = OWNER_DEFAULT, .kind = RESOURCE_LAYOUT};
	assert_int_equal(sqlite3_exec(f->oracle, "PRAGMA wal_checkpoint(TRUNCATE)", NULL, NULL, NULL), SQLITE_OK);
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	assert_int_equal(jobs_in_the_file_alone(f), 0);
	atomic_store(&syncs_that_fail, 1);
	refused(f, resource_create(f->store, &draft, &resource, &outcome, &f->error), TW_ERROR_IO, "store-io");
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	assert_int_equal(jobs_in_the_file_alone(f), 2); /* all but the last, which is in a log begun anew */
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job"), 3);
	/* A disk that goes on failing: nothing is. */
	atomic_store(&syncs_that_fail, 1000000);
	for (int i = 0; i < 3; i++)
		assert_int_equal(resource_create(f->store, &draft, &resource, &outcome, &f->error), TW_ERROR_IO);
	atomic_store(&syncs_that_fail, 0);
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	fixture_is_sound(f);
}

/* --- large results ---------------------------------------------------------------------------------------------- */

enum { LARGE_BYTES = 48 << 20 };

struct beater {
	struct fixture *f;
	pthread_t thread;
	atomic_bool stop;
	int count;
	int64_t longest_ms;
};

/* Writes all the time, and notes how long it had to wait. */
static void *keep_writing(void *context)
{
	struct beater *beater = context;
	struct store *store = NULL;
	if (store_open(&store, beater->f->url, NULL) != TW_OK)
		return NULL;
	while (!atomic_load(&beater->stop)) {
		int64_t start = monotonic_ms();
		if (transaction_begin(store, false, NULL) != TW_OK)
			break;
		enum tw_status ended = transaction_end(store, TW_OK, NULL);
		int64_t took_ms = monotonic_ms() - start;
		beater->count += ended == TW_OK;
		beater->longest_ms = took_ms > beater->longest_ms ? took_ms : beater->longest_ms;
	}
	store_close(store);
	return NULL;
}

static void others_write_while_a_large_result_is_stored(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	char *bytes = malloc(LARGE_BYTES), *back = malloc(LARGE_BYTES);
	for (size_t i = 0; i < LARGE_BYTES; i++)
		bytes[i] = (char)(i * 2654435761u >> 13);
	struct tw_array array = {"large", TW_U8, 1, LARGE_BYTES / 2, bytes};
	struct job_artifact artifact = {"large.bin", "application/octet-stream", bytes + LARGE_BYTES / 2,
					LARGE_BYTES / 2};
	struct job_result result = {
		.summary = "{}", .arrays = &array, .array_count = 1, .artifacts = &artifact, .artifact_count = 1};
	struct beater beater = {.f = f};
	struct blob blob;
	size_t got = 0;
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	assert_int_equal(pthread_create(&beater.thread, NULL, keep_writing, &beater), 0);
	int64_t start = monotonic_ms();
	ok(f, job_finish(f->store, &ticket, &result, &f->error));
	int64_t took_ms = monotonic_ms() - start;
	atomic_store(&beater.stop, true);
	pthread_join(beater.thread, NULL);
	/* 48 chunks, and others in between most of them. */
	assert_true(beater.count >= 24);
	assert_true(beater.longest_ms < took_ms);
	ok(f, blob_find(f->store, id, BLOB_ARRAY, "large", &blob, &f->error));
	ok(f, blob_read(f->store, blob.number, 0, back, LARGE_BYTES / 2, &got, &f->error));
	assert_memory_equal(back, bytes, LARGE_BYTES / 2);
	ok(f, blob_find(f->store, id, BLOB_ARTIFACT, "large.bin", &blob, &f->error));
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob WHERE resource IS NULL"), 0);
	free(bytes);
	free(back);
}

static void a_large_result_that_nobody_wants_leaves_nothing(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	char *bytes = calloc(1, 3 << 20);
	enum job_state after;
	struct job_artifact artifact = {"large.bin", "application/octet-stream", bytes, 3 << 20};
	struct job_result result = {.summary = "{}", .artifacts = &artifact, .artifact_count = 1};
	fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	struct job_ticket ticket = fixture_claim(f);
	ok(f, job_cancel(f->store, TENANT_DEFAULT, ticket.job_id, &after, &f->error));
	ok(f, job_finish(f->store, &ticket, &result, &f->error));
	assert_int_equal(fixture_state(f, RESOURCE_LAYOUT, id), JOB_CANCELLED);
	fixture_sweep(f, 3600 * 1000);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob"), 0);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM chunk"), 0);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM chunk_hash"), 0);
	refused(f, job_finish(f->store, &ticket, &result, &f->error), TW_ERROR_CONFLICT, "lease-lost");
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob"), 0);
	free(bytes);
}

/* --- processes -------------------------------------------------------------------------------------------------- */

/* Enters as often as it can, and counts in shared memory. */
static pid_t enter_for_ever(const struct fixture *f, atomic_int *entered)
{
	pid_t child = fork();
	if (child != 0)
		return child;
	struct gate *gate = NULL;
	if (gate_open(&gate, f->path, NULL) != TW_OK)
		_exit(1);
	for (;;) {
		if (!gate_enter(gate, 60000))
			_exit(1);
		atomic_fetch_add(entered, 1);
		sleep_ms(1);
		gate_leave(gate);
	}
}

static void end(pid_t child)
{
	kill(child, SIGKILL);
	waitpid(child, NULL, 0);
}

static atomic_int *shared_counters(void)
{
	void *memory = mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	assert_true(memory != MAP_FAILED);
	return memory;
}

static void processes_that_never_rest_share_the_gate(void **state)
{
	struct fixture *f = *state;
	atomic_int *entered = shared_counters();
	pid_t children[3];
	for (int i = 0; i < 3; i++)
		children[i] = enter_for_ever(f, &entered[i]);
	while (atomic_load(&entered[0]) + atomic_load(&entered[1]) + atomic_load(&entered[2]) < 900)
		sleep_ms(10);
	for (int i = 0; i < 3; i++)
		end(children[i]);
	/* A third each; SQLite's own lock gave one of them nearly all. */
	for (int i = 0; i < 3; i++)
		assert_in_range(atomic_load(&entered[i]), 150, 650);
	munmap(entered, 4096);
}

static void a_killed_process_leaves_the_gate_open(void **state)
{
	struct fixture *f = *state;
	atomic_int *entered = shared_counters();
	struct gate *gate = NULL;
	unsigned seed = 7;
	ok(f, gate_open(&gate, f->path, &f->error));
	for (int i = 0; i < 30; i++) {
		pid_t children[2] = {enter_for_ever(f, &entered[0]), enter_for_ever(f, &entered[1])};
		sleep_ms(5 + rand_r(&seed) % 10);
		end(children[0]);
		end(children[1]);
		assert_true(gate_enter(gate, 10000));
		gate_leave(gate);
	}
	gate_close(gate);
	munmap(entered, 4096);
}

static void who_waits_too_long_gives_up_and_may_come_again(void **state)
{
	struct fixture *f = *state;
	atomic_int *entered = shared_counters();
	struct gate *gate = NULL;
	pid_t child = enter_for_ever(f, entered);
	ok(f, gate_open(&gate, f->path, &f->error));
	/* Stopped while it is inside: it is there nearly all the time. */
	for (;;) {
		while (!atomic_load(entered))
			sleep_ms(1);
		kill(child, SIGSTOP);
		waitpid(child, NULL, WUNTRACED);
		if (!gate_enter(gate, 50))
			break;
		gate_leave(gate);
		atomic_store(entered, 0);
		kill(child, SIGCONT);
	}
	assert_false(gate_enter(gate, 50));
	kill(child, SIGCONT);
	assert_true(gate_enter(gate, 10000));
	gate_leave(gate);
	end(child);
	assert_true(gate_enter(gate, 10000));
	gate_leave(gate);
	gate_close(gate);
	munmap(entered, 4096);
}

/* --- a store that is not there any more ------------------------------------------------------------------------- */

static void nothing_is_written_into_a_store_that_was_deleted_or_replaced(void **state)
{
	struct fixture *f = *state;
	char path[160], url[192], other[170];
	struct store *store = NULL;
	struct resource resource;
	enum resource_outcome outcome;
	struct resource_draft draft = {.owner = OWNER_DEFAULT, .kind = RESOURCE_LAYOUT};
	snprintf(path, sizeof path, "%s/moved.db", f->directory);
	snprintf(other, sizeof other, "%s.old", path);
	snprintf(url, sizeof url, "sqlite:%s", path);
	ok(f, store_open(&store, url, &f->error));
	ok(f, store_ping(store, &f->error));
	assert_int_equal(rename(path, other), 0);
	refused(f, store_ping(store, &f->error), TW_ERROR_IO, "store-gone");
	refused(f, resource_create(store, &draft, &resource, &outcome, &f->error), TW_ERROR_IO, "store-gone");
	assert_int_equal(rename(f->path, path), 0); /* another file in its place */
	refused(f, resource_create(store, &draft, &resource, &outcome, &f->error), TW_ERROR_IO, "store-gone");
	assert_int_equal(rename(path, f->path), 0);
	assert_int_equal(rename(other, path), 0);
	ok(f, resource_create(store, &draft, &resource, &outcome, &f->error));
	resource_clear(&resource);
	store_close(store);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		/* First what forks: the thread sanitizer wants no threads before. */
		TEST(processes_that_never_rest_share_the_gate),
		TEST(a_killed_process_leaves_the_gate_open),
		TEST(who_waits_too_long_gives_up_and_may_come_again),
		TEST(many_threads_share_commits_and_a_failing_one_is_rolled_back_alone),
		TEST(who_comes_first_is_served_first),
		TEST(a_read_never_waits_for_a_write),
		TEST(what_the_disk_did_not_confirm_is_not_acknowledged),
		TEST(others_write_while_a_large_result_is_stored),
		TEST(a_large_result_that_nobody_wants_leaves_nothing),
		TEST(nothing_is_written_into_a_store_that_was_deleted_or_replaced),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
