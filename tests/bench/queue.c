/* The queue: what an order costs from being taken to being answered, without any computation: durable on both ends. */
#include "storage/queue.h"
#include "storage/resources.h"

#include "tests/bench/bench.h"

#include <string.h>
#include <unistd.h>

enum { ORDERS = 200 };

static char request[2000];

static int take_and_answer(struct store *store)
{
	static char svg[60000];
	struct resource resource;
	enum resource_outcome outcome;
	struct job_ticket ticket;
	bool found = false;
	struct resource_draft draft = {.owner = OWNER_DEFAULT, .kind = RESOURCE_LAYOUT, .options = request};
	struct job_artifact artifact = {"pattern.svg", "image/svg+xml", svg, sizeof svg};
	struct job_result result = {.summary = "{}", .artifacts = &artifact, .artifact_count = 1};
	if (resource_create(store, &draft, &resource, &outcome, NULL))
		return 1;
	resource_clear(&resource);
	return job_claim(store, &(struct claim_query){.kinds = JOB_KINDS_ALL, .worker = "bench", .lease_ms = 10000},
			 &ticket, &found, NULL) ||
	       !found || job_finish(store, &ticket, &result, NULL);
}

int main(void)
{
	char directory[] = "/tmp/tightwire-bench-XXXXXX", url[64], command[64];
	struct store *store = NULL;
	struct job_ticket ticket;
	bool found;
	memset(request, ' ', sizeof request - 1);
	if (!mkdtemp(directory))
		return 1;
	snprintf(url, sizeof url, "sqlite:%s/store.db", directory);
	snprintf(command, sizeof command, "rm -rf %s", directory);
	int failed = store_open(&store, url, NULL) != TW_OK;
	double start = bench_wall_seconds();
	for (int i = 0; i < ORDERS && !failed; i++)
		failed = take_and_answer(store);
	double order_s = (bench_wall_seconds() - start) / ORDERS;
	start = bench_seconds();
	for (int i = 0; i < 1000 && !failed; i++)
		failed = job_claim(store,
				   &(struct claim_query){.kinds = JOB_KINDS_ALL, .worker = "bench", .lease_ms = 10000},
				   &ticket, &found, NULL) ||
			 found;
	double idle_s = (bench_seconds() - start) / 1000;
	store_close(store);
	if (!failed) {
		bench_line("queue: an order, kept and answered", order_s * 1e3, "ms", 25);
		bench_line("queue: a look at an empty queue", idle_s * 1e6, "us", 100);
	}
	return system(command) || failed;
}
