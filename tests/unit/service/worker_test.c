/* Worker processes, real ones, on a store: what they do with jobs, and what is left of a job when they are stopped. The
 * binary is that of the environment's TIGHTWIRE. */
#include "service/worker/worker.h"

#include "service/worker/work.h"
#include "storage/sweep.h"
#include "storage/task.h"

#include "tests/unit/storage/fixture.h"

#include <math.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>

enum { GRID = 40, STEP_MM = 20, LONG_MOTION = 1500 };

static int64_t real_clock(void *context)
{
	(void)context;
	struct timespec now;
	clock_gettime(CLOCK_REALTIME, &now);
	return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static void sleep_ms(long ms)
{
	struct timespec pause = {ms / 1000, ms % 1000 * 1000000};
	nanosleep(&pause, NULL);
}

static int set_up(void **state)
{
	fixture_new(state);
	struct fixture *f = *state;
	store_set_clock(f->store, real_clock, NULL);
	return 0;
}

/* --- processes ------------------------------------------------------------------------------------------------------
 */

static pid_t start_worker(struct fixture *f, const char *name, const char *more)
{
	pid_t child = fork();
	if (child == 0) {
		prctl(PR_SET_PDEATHSIG, SIGKILL);
		execl(getenv("TIGHTWIRE"), "tightwire", "worker", "--store", f->url, "--name", name, "--lease-s", "1",
		      more, (char *)NULL);
		_exit(127);
	}
	return child;
}

static int end_worker(pid_t worker, int number)
{
	int code = 0;
	kill(worker, number);
	waitpid(worker, &code, 0);
	return WIFEXITED(code) ? WEXITSTATUS(code) : -WTERMSIG(code);
}

/* Waits until `sql` gives `value`. */
static void wait_for(struct fixture *f, const char *sql, int64_t value)
{
	for (int i = 0; i < 5000; i++) {
		if (fixture_ask(f, sql) == value)
			return;
		sleep_ms(2);
	}
	print_error("waited in vain for %s\n", sql);
	fail();
}

/* --- a square of fabric, and how it is stretched
 * ---------------------------------------------------------------------- */

/* GRID x GRID squares, flat as worn and as cut. */
static char *square_obj(void)
{
	size_t room = 400000, used = 0;
	char *text = malloc(room);
	for (int y = 0; y <= GRID; y++)
		for (int x = 0; x <= GRID; x++)
			used += (size_t)snprintf(text + used, room - used, "v %d %d 0\nvt %d %d\n", x * STEP_MM,
						 y * STEP_MM, x * STEP_MM, y * STEP_MM);
	for (int y = 0; y < GRID; y++)
		for (int x = 0; x < GRID; x++) {
			int a = y * (GRID + 1) + x + 1, b = a + 1, c = a + GRID + 1, d = c + 1;
			used += (size_t)snprintf(text + used, room - used, "f %d/%d %d/%d %d/%d\nf %d/%d %d/%d %d/%d\n",
						 a, a, b, b, d, d, a, a, d, d, c, c);
		}
	return text;
}

static void put32(unsigned char *at, const void *value)
{
	memcpy(at, value, 4);
}

/* Frames in which the right half is pulled by up to a tenth. */
static void upload_motion(struct fixture *f, uint32_t frames, char id[STORE_ID_SIZE])
{
	uint32_t points = (GRID + 1) * (GRID + 1), version = 1;
	float zero = 0, one = 1;
	unsigned char header[32] = "POINTCACHE2";
	float *frame = malloc(points * 12);
	struct upload *upload = NULL;
	put32(header + 12, &version);
	put32(header + 16, &points);
	put32(header + 20, &zero);
	put32(header + 24, &one);
	put32(header + 28, &frames);
	ok(f, upload_begin(&upload, f->store, OWNER_DEFAULT, "motion", "pull.pc2", "", 1u << 30, &f->error));
	ok(f, upload_write(upload, header, sizeof header, &f->error));
	for (uint32_t j = 0; j < frames; j++) {
		float pull = 1 + 0.1f * (float)(j % 16) / 16;
		for (uint32_t v = 0; v < points; v++) {
			float x = (float)(v % (GRID + 1) * STEP_MM), middle = GRID * STEP_MM / 2;
			frame[3 * v] = x < middle ? x : middle + (x - middle) * pull;
			frame[3 * v + 1] = (float)(v / (GRID + 1) * STEP_MM);
			frame[3 * v + 2] = 0;
		}
		ok(f, upload_write(upload, frame, points * 12, &f->error));
	}
	ok(f, upload_seal(upload, &f->error));
	snprintf(id, STORE_ID_SIZE, "%s", upload_id(upload));
	upload_free(upload);
	free(frame);
}

static void create(struct fixture *f, struct resource_draft draft, char id[STORE_ID_SIZE])
{
	struct resource resource;
	enum resource_outcome outcome;
	draft.owner = OWNER_DEFAULT;
	ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
	snprintf(id, STORE_ID_SIZE, "%s", resource.id);
	resource_clear(&resource);
}

static void create_mesh(struct fixture *f, const char *obj, char id[STORE_ID_SIZE])
{
	char upload[STORE_ID_SIZE];
	const char *uploads[] = {upload};
	fixture_upload(f, "worn", "square.obj", obj, upload);
	create(f, (struct resource_draft){.kind = RESOURCE_MESH, .uploads = uploads, .upload_count = 1}, id);
}

static void create_square(struct fixture *f, char id[STORE_ID_SIZE])
{
	char *obj = square_obj();
	create_mesh(f, obj, id);
	free(obj);
}

static void create_motion_kept(struct fixture *f, const char *mesh, uint32_t frames, const char *options,
			       char id[STORE_ID_SIZE])
{
	char upload[STORE_ID_SIZE];
	const char *uploads[] = {upload}, *needs[] = {mesh};
	upload_motion(f, frames, upload);
	create(f,
	       (struct resource_draft){.kind = RESOURCE_MOTION,
				       .name = "pull",
				       .options = options,
				       .needs = needs,
				       .need_count = 1,
				       .uploads = uploads,
				       .upload_count = 1},
	       id);
}

static void create_motion(struct fixture *f, const char *mesh, uint32_t frames, char id[STORE_ID_SIZE])
{
	create_motion_kept(f, mesh, frames, "{}", id);
}

/* --- claims ---------------------------------------------------------------------------------------------------------
 */

static void an_order_goes_all_the_way(void **state)
{
	struct fixture *f = *state;
	char mesh[STORE_ID_SIZE], motion[STORE_ID_SIZE], field[STORE_ID_SIZE], layout[STORE_ID_SIZE];
	struct blob blob;
	size_t got;
	const char *field_needs[] = {mesh, motion}, *layout_needs[] = {field};
	create_square(f, mesh);
	create_motion(f, mesh, 32, motion);
	create(f, (struct resource_draft){.kind = RESOURCE_FIELD, .needs = field_needs, .need_count = 2}, field);
	create(f,
	       (struct resource_draft){.kind = RESOURCE_LAYOUT,
				       .options = "{\"terminals\":[{\"vertex\":0},{\"vertex\":40},{\"vertex\":1680}]}",
				       .needs = layout_needs,
				       .need_count = 1},
	       layout);
	pid_t first = start_worker(f, "first", "--threads=1");
	pid_t second = start_worker(f, "second", "--threads=2");
	wait_for(f, "SELECT count(*) FROM job WHERE state > 1", 4);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 2 AND attempts = 1"), 4);
	assert_int_equal(end_worker(first, SIGTERM), 0);
	assert_int_equal(end_worker(second, SIGTERM), 0);

	/* The left half does not move; of the right one the strain is known: G = (pull^2 - 1) / 2 in one direction. */
	uint32_t faces = 2 * GRID * GRID;
	double *density = malloc(faces * sizeof *density), expected = 0;
	double mu = 5.4 / (2 * 1.33), lambda = 5.4 * 0.33 / (1.33 * 0.34);
	for (int j = 0; j < 16; j++) {
		double pull = 1 + 0.1 * j / 16, g = (pull * pull - 1) / 2;
		expected += (mu + lambda / 2) * g * g / 16;
	}
	ok(f, blob_find(f->store, motion, BLOB_ARRAY, "mean_stvk", &blob, &f->error));
	assert_int_equal(blob.rows, faces);
	ok(f, blob_read(f->store, blob.number, 0, density, faces * sizeof *density, &got, &f->error));
	assert_true(fabs(density[0]) < 1e-9);
	assert_true(fabs(density[2 * GRID - 1] - expected) < 1e-4 * expected);
	free(density);
	ok(f, blob_find(f->store, layout, BLOB_ARTIFACT, "layout.json", &blob, &f->error));
	assert_int_equal(
		fixture_ask(f, "SELECT json_extract(summary, '$.outcome') = 'optimal' FROM resource WHERE kind = 3"),
		1);
}

static struct job ask_to_draw(struct fixture *f, const char *layout, bool expect_new)
{
	const struct job_request request = {.class = JOB_INTERACTIVE};
	struct job job;
	bool added = false;
	ok(f, task_ask(f->store, OWNER_DEFAULT, JOB_DRAW, layout, "pattern.svg", &request, &job, &added, &f->error));
	assert_int_equal(added, expect_new);
	assert_string_equal(job.subject_id, layout);
	assert_string_equal(job.argument, "pattern.svg");
	job_clear(&job);
	return job;
}

static struct content_hash hash_of_drawing(struct fixture *f, const char *layout)
{
	struct blob blob;
	ok(f, blob_find(f->store, layout, BLOB_ARTIFACT, "pattern.svg", &blob, &f->error));
	assert_true(blob.size > 1000 && blob.read_ms > 0);
	return blob.hash;
}

/* Whoever asks while it is made waits for the same job; what was dropped for want of room is made again. */
static void a_drawing_is_made_when_it_is_asked_for(void **state)
{
	struct fixture *f = *state;
	char mesh[STORE_ID_SIZE], field[STORE_ID_SIZE], layout[STORE_ID_SIZE];
	struct blob blob;
	bool more = true;
	const char *field_needs[] = {mesh}, *layout_needs[] = {field};
	create_square(f, mesh);
	create(f, (struct resource_draft){.kind = RESOURCE_FIELD, .needs = field_needs, .need_count = 1}, field);
	create(f,
	       (struct resource_draft){.kind = RESOURCE_LAYOUT,
				       .options = "{\"terminals\":[{\"vertex\":0},{\"vertex\":40},{\"vertex\":1680}]}",
				       .needs = layout_needs,
				       .need_count = 1},
	       layout);
	pid_t worker = start_worker(f, "first", "--threads=1");
	wait_for(f, "SELECT count(*) FROM job WHERE state = 2", 3);
	assert_int_equal(end_worker(worker, SIGTERM), 0);
	assert_int_equal(blob_find(f->store, layout, BLOB_ARTIFACT, "pattern.svg", &blob, &f->error),
			 TW_ERROR_NOT_FOUND);
	struct job first = ask_to_draw(f, layout, true), second = ask_to_draw(f, layout, false);
	assert_string_equal(first.id, second.id);
	worker = start_worker(f, "second", "--threads=1");
	wait_for(f, "SELECT count(*) FROM job WHERE state = 2", 4);
	struct content_hash hash = hash_of_drawing(f, layout);

	ok(f, task_drop_files(f->store, 1 << 20, &f->error)); /* there is room: it stays */
	(void)hash_of_drawing(f, layout);
	sleep_ms(2500); /* what is fresh is not dropped */
	ok(f, task_drop_files(f->store, UINT64_MAX, &f->error));
	assert_int_equal(blob_find(f->store, layout, BLOB_ARTIFACT, "pattern.svg", &blob, &f->error),
			 TW_ERROR_NOT_FOUND);
	ok(f, blob_find(f->store, layout, BLOB_ARTIFACT, "layout.json", &blob, &f->error));
	while (more)
		ok(f, store_sweep(f->store, 1000, &more, &f->error));
	(void)ask_to_draw(f, layout, true);
	wait_for(f, "SELECT count(*) FROM job WHERE state = 2", 5);
	struct content_hash again = hash_of_drawing(f, layout);
	assert_memory_equal(&again, &hash, sizeof hash);
	assert_int_equal(end_worker(worker, SIGTERM), 0);
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_LAYOUT, layout, false, &f->error));
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job"), 2); /* its drawings' jobs go with it */
}

static int64_t bytes_kept(struct fixture *f, const char *motion, const char *part)
{
	char sql[256];
	snprintf(sql, sizeof sql,
		 "SELECT coalesce(sum(b.size), 0) FROM blob b JOIN resource r ON r.number = b.resource"
		 " WHERE b.role = 0 AND r.id = '%s' AND b.name = '%s'",
		 motion, part);
	return fixture_ask(f, sql);
}

/* Of three equal motions one is kept as it came, one packed, one not at all: the same means; a layout has elongation
 * where there are frames; a field against the worn suit needs them. */
static void frames_are_kept_as_asked(void **state)
{
	struct fixture *f = *state;
	static const char *const options[] = {"{\"frames\":\"upload\"}", "{\"frames\":\"packed\"}",
					      "{\"frames\":\"none\"}"};
	char mesh[STORE_ID_SIZE], motion[3][STORE_ID_SIZE], field[6][STORE_ID_SIZE], layout[3][STORE_ID_SIZE];
	create_square(f, mesh);
	for (int k = 0; k < 3; k++) {
		const char *field_needs[] = {mesh, motion[k]}, *layout_needs[] = {field[k]};
		create_motion_kept(f, mesh, 32, options[k], motion[k]);
		create(f, (struct resource_draft){.kind = RESOURCE_FIELD, .needs = field_needs, .need_count = 2},
		       field[k]);
		create(f,
		       (struct resource_draft){.kind = RESOURCE_FIELD,
					       .options = "{\"reference\":\"worn\"}",
					       .needs = field_needs,
					       .need_count = 2},
		       field[3 + k]);
		create(f,
		       (struct resource_draft){.kind = RESOURCE_LAYOUT,
					       .options = "{\"terminals\":[{\"vertex\":0},{\"vertex\":40}]}",
					       .needs = layout_needs,
					       .need_count = 1},
		       layout[k]);
	}
	pid_t worker = start_worker(f, "w", "--threads=1");
	wait_for(f, "SELECT count(*) FROM job WHERE state > 1", 13);
	assert_int_equal(end_worker(worker, SIGTERM), 0);
	assert_true(bytes_kept(f, motion[0], "motion") > 32 * 12 * (GRID + 1) * (GRID + 1));
	assert_int_equal(bytes_kept(f, motion[0], "frames"), 0);
	assert_int_equal(bytes_kept(f, motion[1], "motion"), 0);
	assert_true(bytes_kept(f, motion[1], "frames") > 0);
	assert_true(bytes_kept(f, motion[1], "frames") < bytes_kept(f, motion[0], "motion") / 4);
	assert_int_equal(bytes_kept(f, motion[2], "motion") + bytes_kept(f, motion[2], "frames"), 0);
	fixture_sweep(f, 3600000);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob WHERE resource IS NULL"), 0);
	assert_int_equal(fixture_ask(f, "SELECT count(DISTINCT hash) FROM blob WHERE name = 'mean_stvk'"), 1);
	assert_int_equal(fixture_state(f, RESOURCE_FIELD, field[3]), JOB_SUCCEEDED);
	assert_int_equal(fixture_state(f, RESOURCE_FIELD, field[4]), JOB_SUCCEEDED);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE failure_type = 'motion-without-frames'"), 1);
	assert_int_equal(fixture_state(f, RESOURCE_FIELD, field[5]), JOB_FAILED);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM resource WHERE kind = 3"
					" AND json_extract(summary, '$.elongation_max') > 0.03"),
			 2);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM resource WHERE kind = 3 AND summary IS NOT NULL"
					" AND json_extract(summary, '$.elongation_max') IS NULL"),
			 1);
	fixture_is_sound(f);
}

static void a_bad_file_fails_at_once_with_its_place(void **state)
{
	struct fixture *f = *state;
	char mesh[STORE_ID_SIZE];
	struct resource resource;
	create_mesh(f, "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 9/3\n", mesh);
	pid_t worker = start_worker(f, "w", "--threads=1");
	wait_for(f, "SELECT state FROM job", JOB_FAILED);
	assert_int_equal(end_worker(worker, SIGTERM), 0);
	ok(f, resource_get(f->store, TENANT_DEFAULT, RESOURCE_MESH, mesh, &resource, &f->error));
	assert_int_equal(resource.job.attempts, 1);
	assert_string_equal(resource.job.failure.where, "line 7");
	assert_int_equal(resource.job.failure.status, TW_ERROR_INPUT);
	resource_clear(&resource);
}

static void a_job_too_large_for_the_memory_limit_fails_and_the_worker_lives(void **state)
{
	struct fixture *f = *state;
	char mesh[STORE_ID_SIZE];
	size_t size = 2u << 20;
	char *large = malloc(size + 1);
	memset(large, '\n', size);
	large[size] = '\0';
	create_mesh(f, large, mesh);
	free(large);
	pid_t worker = start_worker(f, "w", "--memory-mib=1");
	wait_for(f, "SELECT failure_type = 'mesh-too-large' FROM job", 1);
	assert_int_equal(end_worker(worker, SIGTERM), 0);
}

static void a_job_that_runs_out_of_memory_tells_what_to_raise(void **state)
{
	struct fixture *f = *state;
	char mesh[STORE_ID_SIZE];
	char *square = square_obj(), *text = NULL;
	/* The file fits into the arena's 704 KiB, and leaves too little for the garment. */
	assert_true(asprintf(&text, "%*s%s", 500 << 10, "\n", square) > 0);
	create_mesh(f, text, mesh);
	free(square);
	free(text);
	pid_t worker = start_worker(f, "w", "--memory-mib=1");
	wait_for(f,
		 "SELECT count(*) > 0 FROM job_attempt WHERE failure_type = 'out-of-memory' AND failure_text LIKE '% 1 "
		 "MiB "
		 "%--worker-memory-mib%'",
		 1);
	assert_int_equal(end_worker(worker, SIGTERM), 0);
}

static void the_shares_of_the_memory_make_its_whole(void **state)
{
	(void)state;
	static const size_t limits[] = {1, 7, 1 << 20, (size_t)4096 << 20, SIZE_MAX};
	for (size_t i = 0; i < sizeof limits / sizeof *limits; i++)
		for (enum job_kind kind = 0; kind < JOB_KINDS; kind++) {
			struct work_shares shares = work_shares_of(limits[i], kind);
			assert_true(shares.cache + shares.warm + shares.arena + shares.search == limits[i]);
		}
	struct work_shares none = work_shares_of(0, JOB_COMPUTE_LAYOUT);
	assert_true(!none.cache && !none.warm && !none.arena && !none.search);
}

/* Loads a mesh and a field; how that ends is all that a job can notice of a cache. */
static void load(struct fixture *f, struct cache *cache, const char *mesh_id, const char *field_id,
		 enum tw_status outcome[2])
{
	const struct cached_mesh *mesh = NULL;
	const struct cached_field *field = NULL;
	outcome[0] = cache_mesh(cache, f->store, mesh_id, &mesh, &f->error);
	outcome[1] = outcome[0] == TW_OK ? cache_field(cache, f->store, field_id, mesh, &field, &f->error) : TW_OK;
}

/* Whatever a worker has done before: with the same budget the same garment and field fit, or do not. */
static void what_fits_does_not_depend_on_what_a_cache_holds(void **state)
{
	struct fixture *f = *state;
	char mesh[2][STORE_ID_SIZE], field[2][STORE_ID_SIZE];
	char *obj = square_obj();
	create_mesh(f, obj, mesh[0]);
	create_mesh(f,
		    "v 0 0 0\nv 600 0 0\nv 600 600 0\nv 0 600 0\n"
		    "vt 0 0\nvt 600 0\nvt 600 600\nvt 0 600\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n",
		    mesh[1]);
	free(obj);
	for (int i = 0; i < 2; i++) {
		const char *needs[] = {mesh[i]};
		create(f, (struct resource_draft){.kind = RESOURCE_FIELD, .needs = needs, .need_count = 1}, field[i]);
	}
	pid_t worker = start_worker(f, "w", "--threads=1");
	wait_for(f, "SELECT count(*) FROM job WHERE state > 1", 4);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 2"), 4);
	assert_int_equal(end_worker(worker, SIGTERM), 0);
	int fitted[3] = {0};
	for (size_t budget = 16 << 10; budget < (size_t)16 << 20; budget += budget / 4) {
		enum tw_status cold[2], warm[2], again[2], ignored[2];
		struct cache *first = cache_new(budget), *second = cache_new(budget);
		load(f, first, mesh[0], field[0], cold);
		load(f, second, mesh[1], field[1], ignored);
		load(f, second, mesh[0], field[0], warm);
		load(f, second, mesh[0], field[0], again);
		assert_memory_equal(cold, warm, sizeof cold);
		assert_memory_equal(cold, again, sizeof cold);
		fitted[(cold[0] == TW_OK) + (cold[0] == TW_OK && cold[1] == TW_OK)]++;
		cache_free(first);
		cache_free(second);
	}
	assert_true(fitted[0] && fitted[1] && fitted[2]);
}

/* A motion that takes long enough to be stopped in the middle, with its mesh done. */
static void prepare_long_job(struct fixture *f, char motion[STORE_ID_SIZE])
{
	char mesh[STORE_ID_SIZE];
	create_square(f, mesh);
	pid_t worker = start_worker(f, "importer", "--threads=1");
	wait_for(f, "SELECT state FROM job", JOB_SUCCEEDED);
	end_worker(worker, SIGTERM);
	create_motion(f, mesh, LONG_MOTION, motion);
}

static void a_killed_workers_job_is_done_by_another(void **state)
{
	struct fixture *f = *state;
	char motion[STORE_ID_SIZE];
	prepare_long_job(f, motion);
	pid_t victim = start_worker(f, "victim", "--threads=1");
	wait_for(f, "SELECT count(*) FROM job WHERE state = 1", 1);
	assert_int_equal(end_worker(victim, SIGKILL), -SIGKILL);
	assert_int_equal(fixture_ask(f, "SELECT state FROM job WHERE kind = 1"), JOB_RUNNING);
	pid_t heir = start_worker(f, "heir", "--threads=1");
	/* What the supervisor does when it sees that a worker is dead: nobody has to wait for the lease. */
	ok(f, job_abandon(f->store, "victim", true, &f->error));
	wait_for(f, "SELECT state FROM job WHERE kind = 1", JOB_SUCCEEDED);
	assert_int_equal(fixture_ask(f, "SELECT worker = 'heir' AND attempts = 2 FROM job WHERE kind = 1"), 1);
	assert_int_equal(end_worker(heir, SIGTERM), 0);
	fixture_is_sound(f);
}

/* Frozen for longer than its lease, a worker comes back when another has done its job. */
static void a_worker_that_comes_back_late_is_refused(void **state)
{
	struct fixture *f = *state;
	char motion[STORE_ID_SIZE];
	prepare_long_job(f, motion);
	pid_t sleeper = start_worker(f, "sleeper", "--threads=1");
	wait_for(f, "SELECT count(*) FROM job WHERE state = 1", 1);
	kill(sleeper, SIGSTOP);
	pid_t heir = start_worker(f, "heir", "--threads=1");
	wait_for(f, "SELECT state FROM job WHERE kind = 1", JOB_SUCCEEDED);
	kill(sleeper, SIGCONT);
	sleep_ms(300);
	assert_int_equal(fixture_ask(f, "SELECT worker = 'heir' AND attempts = 2 FROM job WHERE kind = 1"), 1);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob WHERE role = 1 AND name = 'mean_stvk'"), 1);
	assert_int_equal(end_worker(sleeper, SIGTERM), 0);
	assert_int_equal(end_worker(heir, SIGTERM), 0);
	fixture_is_sound(f);
}

/* Of four workers one is gone, one killed but not waited for, one this very process, and one lives where its process id
 * says nothing to us. */
static void only_the_leases_of_dead_workers_are_ended(void **state)
{
	struct fixture *f = *state;
	char names[4][WORKER_NAME_SIZE], id[STORE_ID_SIZE];
	siginfo_t ended;
	pid_t child = fork(), zombie = child ? fork() : 0;
	if (child == 0 || zombie == 0)
		_exit(0);
	waitpid(child, NULL, 0);
	waitid(P_PID, (id_t)zombie, &ended, WEXITED | WNOWAIT);
	worker_name(names[0], child);
	worker_name(names[1], getpid());
	snprintf(names[2], sizeof names[2], "worker-%ld-1", (long)child);
	worker_name(names[3], zombie);
	for (int i = 0; i < 4; i++) {
		struct job_ticket ticket;
		bool found = false;
		create(f, (struct resource_draft){.kind = RESOURCE_LAYOUT}, id);
		ok(f, job_claim(f->store,
				&(struct claim_query){.kinds = JOB_KINDS_ALL, .worker = names[i], .lease_ms = 60000},
				&ticket, &found, &f->error));
		assert_true(found);
	}
	ok(f, worker_abandon_dead(f->store, &f->error));
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM job WHERE state = 1 AND lease_until_ms > 0"), 2);
	fixture_claim(f);
	fixture_claim(f);
	assert_true(fixture_nothing_to_claim(f));
	waitpid(zombie, NULL, 0);
}

static void sigterm_lets_the_running_job_end(void **state)
{
	struct fixture *f = *state;
	char motion[STORE_ID_SIZE];
	prepare_long_job(f, motion);
	pid_t worker = start_worker(f, "w", "--threads=1");
	wait_for(f, "SELECT count(*) FROM job WHERE state = 1", 1);
	assert_int_equal(end_worker(worker, SIGTERM), 0);
	assert_int_equal(fixture_ask(f, "SELECT state FROM job WHERE kind = 1"), JOB_SUCCEEDED);
}

static void a_second_sigterm_gives_the_job_back(void **state)
{
	struct fixture *f = *state;
	char motion[STORE_ID_SIZE];
	prepare_long_job(f, motion);
	pid_t worker = start_worker(f, "w", "--threads=1");
	wait_for(f, "SELECT count(*) FROM job WHERE state = 1", 1);
	/* Two signals that come before the process runs again are one to it, so there are as many as it takes. */
	int code = 0;
	do {
		kill(worker, SIGTERM);
		sleep_ms(5);
	} while (waitpid(worker, &code, WNOHANG) != worker);
	assert_true(WIFEXITED(code) && WEXITSTATUS(code) == 0);
	assert_int_equal(fixture_ask(f, "SELECT state = 0 AND attempts = 0 FROM job WHERE kind = 1"), 1);
}

static void a_running_job_that_is_cancelled_stops(void **state)
{
	struct fixture *f = *state;
	char motion[STORE_ID_SIZE];
	struct resource resource;
	enum job_state after;
	prepare_long_job(f, motion);
	ok(f, resource_get(f->store, TENANT_DEFAULT, RESOURCE_MOTION, motion, &resource, &f->error));
	pid_t worker = start_worker(f, "w", "--threads=1");
	wait_for(f, "SELECT count(*) FROM job WHERE state = 1", 1);
	/* Frozen, so that it cannot end before its next heartbeat. */
	kill(worker, SIGSTOP);
	ok(f, job_cancel(f->store, TENANT_DEFAULT, resource.job.id, &after, &f->error));
	assert_int_equal(after, JOB_RUNNING);
	sleep_ms(350);
	kill(worker, SIGCONT);
	wait_for(f, "SELECT state > 1 FROM job WHERE kind = 1", 1);
	end_worker(worker, SIGTERM);
	resource_clear(&resource);
	/* It may have been faster than the word; then its result stands. */
	int64_t state_after = fixture_ask(f, "SELECT state FROM job WHERE kind = 1");
	assert_true(state_after == JOB_CANCELLED || state_after == JOB_SUCCEEDED);
	assert_int_equal(fixture_ask(f, "SELECT count(*) > 0 FROM blob WHERE name = 'mean_stvk'"),
			 state_after == JOB_SUCCEEDED);
}

static void a_worker_ends_with_its_supervisor(void **state)
{
	struct fixture *f = *state;
	int wake[2];
	assert_int_equal(pipe(wake), 0);
	pid_t worker = fork();
	if (worker == 0) {
		char fd[16];
		close(wake[1]);
		snprintf(fd, sizeof fd, "%d", wake[0]);
		execl(getenv("TIGHTWIRE"), "tightwire", "worker", "--store", f->url, "--wake-fd", fd, (char *)NULL);
		_exit(127);
	}
	close(wake[0]);
	sleep_ms(100);
	assert_int_equal(waitpid(worker, NULL, WNOHANG), 0);
	close(wake[1]);
	int code = -1;
	for (int i = 0; i < 500 && waitpid(worker, &code, WNOHANG) == 0; i++)
		sleep_ms(10);
	assert_int_equal(code, 0);
}

#define WORKER_TEST(name) cmocka_unit_test_setup_teardown(name, set_up, fixture_free)

int main(void)
{
	const struct CMUnitTest tests[] = {
		WORKER_TEST(an_order_goes_all_the_way),
		WORKER_TEST(a_drawing_is_made_when_it_is_asked_for),
		WORKER_TEST(frames_are_kept_as_asked),
		WORKER_TEST(a_bad_file_fails_at_once_with_its_place),
		WORKER_TEST(a_job_that_runs_out_of_memory_tells_what_to_raise),
		WORKER_TEST(a_job_too_large_for_the_memory_limit_fails_and_the_worker_lives),
		cmocka_unit_test(the_shares_of_the_memory_make_its_whole),
		WORKER_TEST(what_fits_does_not_depend_on_what_a_cache_holds),
		WORKER_TEST(a_killed_workers_job_is_done_by_another),
		WORKER_TEST(a_worker_that_comes_back_late_is_refused),
		WORKER_TEST(only_the_leases_of_dead_workers_are_ended),
		WORKER_TEST(sigterm_lets_the_running_job_end),
		WORKER_TEST(a_second_sigterm_gives_the_job_back),
		WORKER_TEST(a_running_job_that_is_cancelled_stops),
		WORKER_TEST(a_worker_ends_with_its_supervisor),
	};
	if (!getenv("TIGHTWIRE")) {
		print_message("worker_test needs TIGHTWIRE, the path of the binary\n");
		return 0;
	}
	return cmocka_run_group_tests(tests, NULL, NULL);
}
