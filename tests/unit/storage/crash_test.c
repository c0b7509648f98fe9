/* Several processes on one store, some of them killed at any moment: nothing that was acknowledged is lost, and no
 * result is written twice. What was acknowledged stands in log files, written by the processes after each call
 * returned. */
#include "tests/unit/storage/fixture.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>

/* A small result is written with the end of its job, a large one ahead of it. */
enum { WORKERS = 3, LEASE_MS = 150, SMALL_BYTES = 300000, LARGE_BYTES = 1300000 };

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

/* One line in one write: killed before it or after it. */
static void log_line(const struct fixture *f, const char *name, const char *id)
{
	char path[160], line[64];
	snprintf(path, sizeof path, "%s/%s", f->directory, name);
	int size = snprintf(line, sizeof line, "%s\n", id);
	int fd = open(path, O_WRONLY | O_CREAT | O_APPEND, 0600);
	if (fd < 0 || write(fd, line, (size_t)size) != size)
		_exit(9);
	close(fd);
}

/* Claims and finishes until killed. */
static void work(const struct fixture *f)
{
	struct store *store = NULL;
	char *bytes = malloc(LARGE_BYTES);
	char name[32];
	snprintf(name, sizeof name, "worker-%ld", (long)getpid());
	if (store_open(&store, f->url, NULL) != TW_OK)
		_exit(8);
	for (;;) {
		struct job_ticket ticket;
		bool found = false;
		bool cancel;
		if (job_claim(store,
			      &(struct claim_query){.kinds = JOB_KINDS_ALL, .worker = name, .lease_ms = LEASE_MS},
			      &ticket, &found, NULL) != TW_OK ||
		    !found) {
			sleep_ms(2);
			continue;
		}
		size_t size = ticket.number % 4 ? SMALL_BYTES : LARGE_BYTES;
		memset(bytes, (int)ticket.fence, size);
		struct job_artifact artifact = {"result.bin", "application/octet-stream", bytes, size};
		char summary[64];
		snprintf(summary, sizeof summary, "{\"fence\":%d}", (int)ticket.fence);
		struct job_result result = {.summary = summary, .artifacts = &artifact, .artifact_count = 1};
		/* Some are slow beyond their lease and come back late. */
		if (ticket.number % 13 == 0 && ticket.attempt == 1)
			sleep_ms(2 * LEASE_MS);
		else if (job_heartbeat(store, &ticket, 0.5, "half", NULL, &cancel, NULL) != TW_OK)
			continue;
		if (job_finish(store, &ticket, &result, NULL) == TW_OK)
			log_line(f, "finished", ticket.job_id);
	}
}

/* Asks for layouts until killed. */
static void produce(const struct fixture *f)
{
	struct store *store = NULL;
	struct resource_draft draft = {.owner = OWNER_DEFAULT,
				       .kind = RESOURCE_LAYOUT,
				       .options = "{\"terminals\":[]}",
				       .queue.attempts_max = 1000};
	if (store_open(&store, f->url, NULL) != TW_OK)
		_exit(8);
	for (;;) {
		struct resource resource;
		enum resource_outcome outcome;
		if (resource_create(store, &draft, &resource, &outcome, NULL) == TW_OK) {
			log_line(f, "created", resource.job.id);
			resource_clear(&resource);
		}
		sleep_ms(1);
	}
}

static pid_t start(const struct fixture *f, void (*run)(const struct fixture *f))
{
	pid_t child = fork();
	if (child == 0) {
		run(f);
		_exit(0);
	}
	assert_true(child > 0);
	return child;
}

static void end(pid_t child)
{
	int code = 0;
	kill(child, SIGKILL);
	waitpid(child, &code, 0);
	assert_true(WIFSIGNALED(code));
}

static int64_t count_lines(const struct fixture *f, const char *command_format)
{
	char command[400];
	long long lines = -1;
	snprintf(command, sizeof command, command_format, f->directory);
	FILE *out = popen(command, "r");
	assert_int_equal(fscanf(out, "%lld", &lines), 1);
	pclose(out);
	return lines;
}

/* Every id that was logged as created is a job in the store. */
static void nothing_acknowledged_is_lost(struct fixture *f)
{
	char path[160], line[64];
	sqlite3_stmt *statement = NULL;
	snprintf(path, sizeof path, "%s/created", f->directory);
	FILE *created = fopen(path, "r");
	assert_non_null(created);
	assert_int_equal(sqlite3_prepare_v2(f->oracle, "SELECT state FROM job WHERE id = ?", -1, &statement, NULL),
			 SQLITE_OK);
	while (fgets(line, sizeof line, created)) {
		line[strcspn(line, "\n")] = '\0';
		sqlite3_bind_text(statement, 1, line, -1, SQLITE_TRANSIENT);
		assert_int_equal(sqlite3_step(statement), SQLITE_ROW);
		assert_int_equal(sqlite3_column_int(statement, 0), JOB_SUCCEEDED);
		sqlite3_reset(statement);
	}
	sqlite3_finalize(statement);
	fclose(created);
}

/* The artifact was written by the claim whose fence stands in the summary, whole and once. */
static void every_result_is_of_one_hand(struct fixture *f)
{
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob WHERE resource IS NOT NULL") -
				 fixture_ask(f, "SELECT count(*) FROM job"),
			 0);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob WHERE resource IS NOT NULL"
					" AND (size NOT IN (300000, 1300000) OR hash IS NULL)"),
			 0);
	assert_int_equal(fixture_ask(f,
				     "SELECT count(*) FROM resource r JOIN job j ON j.resource = r.number"
				     " JOIN blob b ON b.resource = r.number JOIN chunk c ON c.blob = b.number"
				     " WHERE json_extract(r.summary, '$.fence') <> j.fence"
				     " OR substr(hex(substr(c.bytes, 1, 1)), 1, 2) <> printf('%02X', j.fence % 256)"
				     " OR substr(hex(substr(c.bytes, -1, 1)), 1, 2) <> printf('%02X', j.fence % 256)"),
			 0);
	fixture_is_sound(f);
}

static void wait_until_all_are_done(struct fixture *f)
{
	int64_t until = monotonic_ms() + 30000;
	while (fixture_ask(f, "SELECT count(*) FROM job WHERE state IN (0, 1)") > 0) {
		assert_true(monotonic_ms() < until);
		sleep_ms(20);
	}
}

static void killing_processes_at_any_moment_loses_and_doubles_nothing(void **state)
{
	struct fixture *f = *state;
	pid_t children[WORKERS + 1];
	int64_t until = monotonic_ms() + 4000;
	unsigned seed = 12345;
	for (int i = 0; i <= WORKERS; i++)
		children[i] = start(f, i < WORKERS ? work : produce);
	/* On a loaded machine longer: a producer that is killed before it has opened the store produces nothing. */
	while (monotonic_ms() < until ||
	       (monotonic_ms() < until + 60000 && count_lines(f, "cat %s/created* | wc -l") <= 20)) {
		sleep_ms(5 + rand_r(&seed) % 60);
		int victim = rand_r(&seed) % (WORKERS + 1);
		end(children[victim]);
		children[victim] = start(f, victim < WORKERS ? work : produce);
	}
	end(children[WORKERS]);
	wait_until_all_are_done(f);
	for (int i = 0; i < WORKERS; i++)
		end(children[i]);
	assert_true(count_lines(f, "wc -l <%s/created") > 20);
	assert_int_equal(count_lines(f, "sort %s/finished | uniq -d | wc -l"), 0);
	nothing_acknowledged_is_lost(f);
	every_result_is_of_one_hand(f);
}

/* Without kills: every job is claimed by exactly one of the processes. */
static void a_job_is_claimed_by_one_of_many(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE];
	pid_t children[WORKERS];
	for (int i = 0; i < 120; i++)
		fixture_create(f, RESOURCE_LAYOUT, NULL, NULL, NULL, id);
	/* A lease of the fixture's clock would look expired to the processes, which use the real one. */
	for (int i = 0; i < WORKERS; i++)
		children[i] = start(f, work);
	wait_until_all_are_done(f);
	sleep_ms(2 * LEASE_MS + 100);
	/* What others can see already, its worker knows to be on the disk only later. */
	for (int i = 0; i < 300 && count_lines(f, "wc -l <%s/finished") < 120; i++)
		sleep_ms(100);
	for (int i = 0; i < WORKERS; i++)
		end(children[i]);
	assert_int_equal(count_lines(f, "wc -l <%s/finished"), 120);
	assert_int_equal(count_lines(f, "sort -u %s/finished | wc -l"), 120);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 2 AND fence <> attempts"), 0);
	every_result_is_of_one_hand(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(killing_processes_at_any_moment_loses_and_doubles_nothing),
		TEST(a_job_is_claimed_by_one_of_many),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
