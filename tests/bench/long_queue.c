/* A queue of a million jobs: what a step costs there, beside what it costs with a hundred. Most wait in the queue, some
 * have ended in each way, and the kind that is rarest is what one asks for. */
#include "storage/jobs.h"
#include "storage/queue.h"
#include "storage/resources.h"

#include "tests/bench/bench.h"
#include "tests/bench/fill_queue.h"

#include <string.h>
#include <unistd.h>

enum { FEW = 100, MANY = 1000000, CLIENTS = 20, ROUNDS = 200 };

struct times {
	double claim, rig, idle, failed, queued, count, submit;
};

static int claim(struct store *store, unsigned kinds, struct job_ticket *ticket)
{
	bool found = false;
	return job_claim(store, &(struct claim_query){.kinds = kinds, .worker = "bench", .lease_ms = 60000}, ticket,
			 &found, NULL) != TW_OK ||
	       !found;
}

static int list(struct store *store, enum job_state state)
{
	struct job_page jobs;
	struct resource_page resources;
	struct job_query job_query = {.tenant = TENANT_DEFAULT, .states = 1u << state, .limit = 50};
	struct resource_query query = {
		.tenant = TENANT_DEFAULT, .kind = RESOURCE_LAYOUT, .states = 1u << state, .limit = 50};
	if (job_list(store, &job_query, &jobs, NULL) != TW_OK)
		return 1;
	job_page_clear(&jobs);
	if (resource_list(store, &query, &resources, NULL) != TW_OK)
		return 1;
	resource_page_clear(&resources);
	return 0;
}

static int submit(struct store *store)
{
	struct resource resource;
	enum resource_outcome outcome;
	struct resource_draft draft = {.owner = OWNER_DEFAULT, .kind = RESOURCE_LAYOUT};
	if (resource_create(store, &draft, &resource, &outcome, NULL) != TW_OK)
		return 1;
	resource_clear(&resource);
	return 0;
}

#define MEASURE(field, call)                                                                                           \
	do {                                                                                                           \
		double start = bench_seconds();                                                                        \
		for (int i = 0; i < ROUNDS && !failed; i++)                                                            \
			failed = (call);                                                                               \
		times->field = (bench_seconds() - start) / ROUNDS * 1e6;                                               \
	} while (0)

/* Claims are given back, so that as many are there as before. */
static int claim_and_release(struct store *store, unsigned kinds)
{
	struct job_ticket ticket;
	return claim(store, kinds, &ticket) || job_release(store, &ticket, NULL) != TW_OK;
}

static int look(struct store *store)
{
	struct job_ticket ticket;
	return claim(store, JOB_KIND_BIT(JOB_IMPORT_MESH), &ticket) == 0;
}

static int count(struct store *store)
{
	struct job_counts counts;
	return job_count(store, &counts, NULL) != TW_OK;
}

static int measure(const char *folder, int jobs, struct times *times)
{
	char path[96], url[112];
	struct store *store = NULL;
	snprintf(path, sizeof path, "%s/%d.db", folder, jobs);
	snprintf(url, sizeof url, "sqlite:%s", path);
	int failed = store_open(&store, url, NULL) != TW_OK || fill_queue(path, jobs, CLIENTS, JOB_NORMAL) != SQLITE_OK;
	MEASURE(claim, claim_and_release(store, JOB_KINDS_ALL & ~JOB_KIND_BIT(JOB_RECORD)));
	MEASURE(rig, claim_and_release(store, JOB_KIND_BIT(JOB_RECORD)));
	MEASURE(idle, look(store));
	MEASURE(failed, list(store, JOB_FAILED));
	MEASURE(queued, list(store, JOB_QUEUED));
	MEASURE(count, count(store));
	MEASURE(submit, submit(store));
	store_close(store);
	return failed;
}

static void print(const char *name, double few, double many, double goal)
{
	char text[64];
	snprintf(text, sizeof text, "%s, a million queued", name);
	bench_line(text, many, "us", 0);
	snprintf(text, sizeof text, "%s: over that with 100", name);
	bench_line(text, many / few, "", goal);
}

int main(void)
{
	char folder[] = "/tmp/tightwire-bench-XXXXXX", command[64];
	struct times few, many;
	if (!mkdtemp(folder))
		return 1;
	int failed = measure(folder, FEW, &few) || measure(folder, MANY, &many);
	if (!failed) {
		print("claim and release", few.claim, many.claim, 2);
		print("claim by the rig", few.rig, many.rig, 2);
		print("look at nothing", few.idle, many.idle, 2);
		print("submit", few.submit, many.submit, 2);
		print("count", few.count, many.count, 2);
		/* A hundred have none that failed; a page of 50 is what it costs. */
		bench_line("50 failed jobs and layouts", many.failed, "us", 5000);
		bench_line("50 queued jobs and layouts", many.queued, "us", 5000);
	}
	snprintf(command, sizeof command, "rm -rf %s", folder);
	return system(command) || failed;
}
