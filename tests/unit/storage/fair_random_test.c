/* The queue against a model: some thousand random submits, claims, ends, kills and cancels, and after each claim the
 * question whether it was the right one. The model knows every job and looks through all of them each time; it shares
 * nothing with lanes and turns but what storage/job_request.h promises. */
#include "tests/unit/storage/order.h"

enum { JOBS_MAX = 4000, CLIENTS = 5, GROUPS = 3, RUNNING_MAX = 6 };

enum { ABSENT, WAITING, READY, RUNS, ENDED }; /* of a job in the model; WAITING: for a pause or a time */

struct model_job {
	int state;
	int64_t client, class, priority, group; /* group 0: none */
	enum resource_kind kind;
	int64_t ready_at_ms, cancel_at_ms, lease_until_ms;
	int word;
	bool stops; /* it was asked to */
	int failures;
	struct job_ticket ticket;
	char id[STORE_ID_SIZE], resource_id[STORE_ID_SIZE];
};

struct model {
	struct fixture *f;
	uint64_t random;
	struct model_job jobs[JOBS_MAX]; /* by number */
	int64_t count;
	int64_t max_running[GROUPS + 1];
	int64_t weight[CLIENTS];
	/* Claims that passed over a class in a row, for certain, and at most. */
	int64_t passes[JOB_CLASSES_END], passes_most[JOB_CLASSES_END];
	/* For two clients of a class: what each was given while both could have been served; in twelfths over weight.
	 */
	int64_t given[JOB_CLASSES_END][CLIENTS][CLIENTS];
	int claims, overtakings, blocked;
};

static unsigned roll(struct model *m, unsigned sides)
{
	m->random ^= m->random << 13;
	m->random ^= m->random >> 7;
	m->random ^= m->random << 17;
	return (unsigned)((m->random >> 20) % sides);
}

static int64_t running_of(const struct model *m, int64_t group)
{
	int64_t running = 0;
	for (int64_t i = 1; i <= m->count; i++)
		running += m->jobs[i].state == RUNS && m->jobs[i].group == group;
	return running;
}

static int running(const struct model *m)
{
	int running = 0;
	for (int64_t i = 1; i <= m->count; i++)
		running += m->jobs[i].state == RUNS;
	return running;
}

static bool is_claimable(const struct model *m, const struct model_job *job)
{
	return job->state == READY && (!job->group || running_of(m, job->group) < m->max_running[job->group]);
}

/* --- time ------------------------------------------------------------------------------------------------------- */

static void end(struct model_job *job)
{
	job->state = ENDED;
}

static void back(struct model *m, struct model_job *job, int64_t ready_at_ms)
{
	if (job->stops) {
		end(job);
		return;
	}
	job->ready_at_ms = ready_at_ms;
	job->state = ready_at_ms > m->f->now_ms ? WAITING : READY;
}

static void blame(struct model *m, struct model_job *job, int64_t ready_at_ms)
{
	back(m, job, ready_at_ms);
	if (job->state != ENDED && ++job->failures == 3)
		end(job);
}

static void let_time_pass(struct model *m)
{
	for (int64_t i = 1; i <= m->count; i++) {
		struct model_job *job = &m->jobs[i];
		if (job->state == RUNS && job->lease_until_ms < m->f->now_ms)
			blame(m, job, 0);
		if (job->cancel_at_ms && job->cancel_at_ms <= m->f->now_ms &&
		    (job->state == WAITING || job->state == READY))
			end(job);
		job->stops |= job->state == RUNS && job->cancel_at_ms && job->cancel_at_ms <= m->f->now_ms;
		if (job->state == WAITING && job->ready_at_ms <= m->f->now_ms)
			job->state = READY;
	}
}

/* --- what may be claimed ---------------------------------------------------------------------------------------- */

struct view {
	bool any[JOB_CLASSES_END];               /* of the class something is claimable */
	bool client[JOB_CLASSES_END][CLIENTS];   /* and of this client */
	int64_t first[JOB_CLASSES_END][CLIENTS]; /* its first job */
};

static bool comes_before(const struct model *m, int64_t a, int64_t b)
{
	int64_t left = m->jobs[a].priority, right = m->jobs[b].priority;
	return left > right || (left == right && a < b);
}

static struct view look(const struct model *m, unsigned kinds)
{
	struct view view = {0};
	for (int64_t i = 1; i <= m->count; i++) {
		const struct model_job *job = &m->jobs[i];
		if (!(kinds & JOB_KIND_BIT(resource_kind_row(job->kind)->job)) || !is_claimable(m, job))
			continue;
		int64_t *first = &view.first[job->class][job->client];
		view.any[job->class] = true;
		view.client[job->class][job->client] = true;
		if (!*first || comes_before(m, i, *first))
			*first = i;
	}
	return view;
}

/* Who could not be served for a moment counts anew from then on. */
static void note_absences(struct model *m)
{
	const struct view view = look(m, ~JOB_KIND_BIT(JOB_RECORD));
	for (int c = JOB_INTERACTIVE; c < JOB_CLASSES_END; c++)
		for (int a = 0; a < CLIENTS; a++)
			for (int b = 0; b < CLIENTS; b++)
				if (!view.client[c][a] || !view.client[c][b])
					m->given[c][a][b] = 0;
}

/* Neither of two clients that could both be served is ahead of the other by more than a turn of each. */
static void check_turns(struct model *m, const struct view *view, int64_t class, int64_t client)
{
	for (int a = 0; a < CLIENTS; a++)
		for (int b = 0; b < CLIENTS; b++) {
			int64_t *given = &m->given[class][a][b];
			if (!view->client[class][a] || !view->client[class][b] || a == b)
				continue;
			*given += (a == client ? 12 / m->weight[a] : 0) - (b == client ? 12 / m->weight[b] : 0);
			assert_in_range(*given + 100, 100 - 12 / m->weight[a] - 12 / m->weight[b],
					100 + 12 / m->weight[a] + 12 / m->weight[b]);
		}
}

/* An earlier class is overtaken only by one that was passed over fifteen times; and none is passed over more often. */
static void check_class(struct model *m, const struct view *view, unsigned classes, int64_t class)
{
	for (int64_t c = JOB_INTERACTIVE; c < JOB_CLASSES_END; c++) {
		bool waited = view->any[c] && classes & JOB_CLASS_BIT(c);
		if (c < class && waited) {
			assert_true(m->passes_most[class] >= PICK_PASSES_MAX);
			m->overtakings++;
		}
		if (c > class && classes & JOB_CLASS_BIT(c)) {
			m->passes[c] += waited;
			m->passes_most[c]++;
			/* Where two classes are overdue one of them waits for the other. */
			assert_true(m->passes[c] <= PICK_PASSES_MAX + 1);
		}
	}
	m->passes[class] = m->passes_most[class] = 0;
}

/* --- what happens ----------------------------------------------------------------------------------------------- */

static void submit(struct model *m)
{
	struct fixture *f = m->f;
	char group[8], word[8];
	int64_t client = roll(m, CLIENTS), group_number = roll(m, 3) ? 0 : 1 + roll(m, GROUPS);
	int64_t limit = group_number && roll(m, 4) == 0 ? 1 + roll(m, 3) : 0;
	int word_number = roll(m, 6) ? 0 : 1 + (int)roll(m, 3);
	struct resource resource;
	enum resource_outcome outcome;
	snprintf(group, sizeof group, "g%d", (int)group_number);
	snprintf(word, sizeof word, "w%d", word_number);
	struct job_request request = {
		.class = JOB_INTERACTIVE + roll(m, 3),
		.priority = (int32_t)roll(m, 3) - 1,
		.weight = (uint32_t)m->weight[client],
		.group = group_number ? group : NULL,
		.max_running = (uint32_t)limit,
		.supersedes = word_number ? word : NULL,
		.not_before_ms = roll(m, 8) ? 0 : f->now_ms + roll(m, 3000),
		.cancel_after_ms = roll(m, 8) ? 0 : 1 + roll(m, 9000),
	};
	const struct resource_draft draft = {.owner = {TENANT_DEFAULT, client},
					     .kind = roll(m, 8) ? RESOURCE_LAYOUT : RESOURCE_RECORDING,
					     .queue = request};
	ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
	for (int64_t i = 1; word_number && i <= m->count; i++) {
		struct model_job *other = &m->jobs[i];
		if (other->word != word_number || other->client != client)
			continue;
		if (other->state == READY || other->state == WAITING)
			end(other);
		other->stops |= other->state == RUNS;
	}
	struct model_job *job = &m->jobs[++m->count];
	*job = (struct model_job){.state = request.not_before_ms > f->now_ms ? WAITING : READY,
				  .client = client,
				  .class = request.class,
				  .priority = request.priority,
				  .group = group_number,
				  .kind = draft.kind,
				  .ready_at_ms = request.not_before_ms,
				  .cancel_at_ms = request.cancel_after_ms ? f->now_ms + request.cancel_after_ms : 0,
				  .word = word_number};
	snprintf(job->id, sizeof job->id, "%s", resource.job.id);
	snprintf(job->resource_id, sizeof job->resource_id, "%s", resource.id);
	resource_clear(&resource);
	if (group_number && limit)
		m->max_running[group_number] = limit;
}

static void claim(struct model *m)
{
	struct fixture *f = m->f;
	struct job_ticket ticket;
	struct claim_query query = order_query();
	query.kinds = roll(m, 8) ? JOB_KIND_BIT(JOB_COMPUTE_LAYOUT) | JOB_KIND_BIT(JOB_COMPUTE_FIELD)
				 : JOB_KIND_BIT(JOB_RECORD);
	query.classes = roll(m, 5) ? 0 : JOB_CLASS_BIT(JOB_INTERACTIVE);
	unsigned classes = query.classes ? query.classes : JOB_CLASSES_ALL;
	bool rig = query.kinds == JOB_KIND_BIT(JOB_RECORD);
	if (running(m) >= RUNNING_MAX)
		return;
	let_time_pass(m);
	const struct view view = look(m, query.kinds);
	bool any = false;
	for (int c = JOB_INTERACTIVE; c < JOB_CLASSES_END; c++)
		any |= view.any[c] && classes & JOB_CLASS_BIT(c);
	int64_t number = order_claim(f, query, &ticket);
	assert_int_equal(number != 0, any);
	if (!number)
		return;
	struct model_job *job = &m->jobs[number];
	assert_true(is_claimable(m, job));
	assert_true(classes & JOB_CLASS_BIT(job->class));
	assert_int_equal(view.first[job->class][job->client], number);
	if (!rig) {
		check_class(m, &view, classes, job->class);
		check_turns(m, &view, job->class, job->client);
	}
	job->state = RUNS;
	job->ticket = ticket;
	job->lease_until_ms = f->now_ms + query.lease_ms;
	m->claims++;
	m->blocked += job->group && running_of(m, job->group) == m->max_running[job->group];
}

/* A job in this state, by chance; 0: none. */
static int64_t some_job(struct model *m, int state)
{
	int64_t from = m->count ? 1 + roll(m, (unsigned)m->count) : 0;
	for (int64_t i = 0; i < m->count; i++) {
		int64_t number = 1 + (from + i) % m->count;
		if (m->jobs[number].state == state)
			return number;
	}
	return 0;
}

static void end_one(struct model *m)
{
	struct fixture *f = m->f;
	struct tw_error failure = {TW_ERROR_MEMORY, "out-of-memory", "", "no"};
	let_time_pass(m);
	ok(f, job_expire(f->store, &f->error));
	int64_t number = some_job(m, RUNS);
	struct model_job *job = &m->jobs[number];
	if (!number)
		return;
	switch (roll(m, 6)) {
	case 0:
		ok(f, job_fail(f->store, &job->ticket, &failure, true, &f->error));
		blame(m, job, INT64_MAX);
		if (job->state == WAITING)
			job->ready_at_ms = order_field(f, number, "pause_until_ms");
		break;
	case 1:
		ok(f, job_release(f->store, &job->ticket, &f->error));
		back(m, job, 0);
		break;
	case 2:
		ok(f, job_fail(f->store, &job->ticket, &failure, false, &f->error));
		end(job);
		break;
	default:
		fixture_finish(f, &job->ticket);
		end(job);
	}
}

static void cancel_one(struct model *m)
{
	struct fixture *f = m->f;
	enum job_state after;
	let_time_pass(m);
	ok(f, job_expire(f->store, &f->error));
	int64_t number = some_job(m, roll(m, 3) ? READY : RUNS);
	struct model_job *job = &m->jobs[number];
	if (!number)
		return;
	ok(f, job_cancel(f->store, TENANT_DEFAULT, job->id, &after, &f->error));
	job->stops = job->state == RUNS;
	if (job->state == READY)
		end(job);
}

static void delete_one(struct model *m)
{
	struct fixture *f = m->f;
	int64_t number = some_job(m, roll(m, 2) ? READY : RUNS);
	struct model_job *job = &m->jobs[number];
	if (!number || number == m->count) /* the model numbers jobs as the store does */
		return;
	ok(f, resource_delete(f->store, TENANT_DEFAULT, job->kind, job->resource_id, false, &f->error));
	end(job);
}

/* --- what is written down --------------------------------------------------------------------------------------- */

/* It may err in one direction only. */
static const char *const impossible[] = {
	"SELECT count(*) FROM job_group g WHERE running <> (SELECT count(*) FROM job j JOIN lane l ON l.number = j.lane"
	" WHERE j.state = 1 AND l.job_group = g.number)",
	"SELECT count(*) FROM lane l JOIN job_group g ON g.number = l.job_group"
	" WHERE l.blocked <> (g.running >= g.max_running)",
	"SELECT count(*) FROM lane WHERE job_group = 0 AND blocked = 1",
	"SELECT count(*) FROM job j JOIN lane l ON l.number = j.lane WHERE j.state = 0 AND waiting_for = 0"
	" AND pause_until_ms = 0 AND delayed = 0 AND (l.head_number = 0 OR j.priority > l.head_priority"
	" OR (j.priority = l.head_priority AND j.number < l.head_number))",
	"SELECT count(*) FROM lane l JOIN share s ON s.number = l.share"
	" WHERE l.head_number > 0 AND l.blocked = 0 AND s.open = 0",
	"SELECT count(*) FROM share s WHERE open <> (SELECT count(*) FROM turn t WHERE t.share = s.number"
	" AND t.pool = s.pool AND t.class = s.class)",
	"SELECT count(*) FROM turn WHERE share NOT IN (SELECT number FROM share)",
	"SELECT count(*) FROM (SELECT tenant, client, class, kind, state, count(*) FROM job GROUP BY 1, 2, 3, 4, 5"
	" EXCEPT SELECT * FROM job_count)",
	"SELECT count(*) FROM (SELECT * FROM job_count WHERE count > 0"
	" EXCEPT SELECT tenant, client, class, kind, state, count(*) FROM job GROUP BY 1, 2, 3, 4, 5)",
	"SELECT count(*) FROM job j JOIN lane l ON l.number = j.lane JOIN share s ON s.number = l.share"
	" WHERE j.kind <> l.kind OR j.class <> s.class OR j.client <> s.client OR j.tenant <> s.tenant",
};

static void check_books(struct model *m)
{
	for (size_t i = 0; i < sizeof impossible / sizeof *impossible; i++)
		if (fixture_ask(m->f, impossible[i]) != 0)
			fail_msg("after %d claims: %s", m->claims, impossible[i]);
	for (int64_t i = 1; i <= m->count; i++)
		if (m->jobs[i].state == READY || m->jobs[i].state == WAITING)
			assert_int_equal(order_field(m->f, i, "state"), JOB_QUEUED);
}

static void go_on(struct model *m)
{
	unsigned what = roll(m, 100);
	m->f->now_ms += roll(m, 60);
	if (what < 38 && m->count < JOBS_MAX - 1)
		submit(m);
	else if (what < 70)
		claim(m);
	else if (what < 94)
		end_one(m);
	else if (what < 97)
		cancel_one(m);
	else if (what < 99)
		delete_one(m);
	else
		m->f->now_ms += roll(m, 6000);
	note_absences(m);
}

static void every_claim_is_the_right_one(void **state)
{
	struct fixture *f = *state;
	struct model *m = calloc(1, sizeof *m);
	const char *seed = getenv("SEED"), *steps = getenv("STEPS");
	*m = (struct model){.f = f,
			    .random = seed ? strtoull(seed, NULL, 10) * 0x9e3779b97f4a7c15 + 1 : 88172645463325252u,
			    .max_running = {INT64_MAX, 1, 1, 1},
			    .weight = {1, 1, 2, 3, 4}};
	for (int i = 0, last = steps ? (int)strtol(steps, NULL, 10) : 5000; i < last; i++) {
		go_on(m);
		if (i % 100 == 0) {
			let_time_pass(m);
			ok(f, job_expire(f->store, &f->error));
			check_books(m);
		}
	}
	assert_true(m->claims > m->count / 4);
	assert_true(m->overtakings > 0 && m->blocked > 0);
	fixture_is_sound(f);
	free(m);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		FAST_TEST(every_claim_is_the_right_one),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
