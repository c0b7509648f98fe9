/* The queue: what an order costs from being taken to being answered, without any computation: durable on both ends; and
 * how many of many clients are taken a second. */
#include "storage/queue.h"
#include "storage/resources.h"

#include "tests/bench/bench.h"

#include <pthread.h>
#include <string.h>
#include <unistd.h>

enum { ORDERS = 200, CLIENTS = 32, ORDERS_OF_CLIENT = 100 };

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

/* --- many clients ----------------------------------------------------------------------------------------------- */

struct client {
	pthread_t thread;
	const char *url;
	int64_t number;
	int failed;
};

static void *submit(void *context)
{
	struct client *client = context;
	struct store *store = NULL;
	client->failed = store_open(&store, client->url, NULL) != TW_OK;
	const struct resource_draft draft = {
		.owner = {TENANT_DEFAULT, client->number}, .kind = RESOURCE_LAYOUT, .options = request};
	for (int i = 0; i < ORDERS_OF_CLIENT && !client->failed; i++) {
		struct resource resource;
		enum resource_outcome outcome;
		client->failed = resource_create(store, &draft, &resource, &outcome, NULL) != TW_OK;
		if (!client->failed)
			resource_clear(&resource);
	}
	store_close(store);
	return NULL;
}

/* *rate: orders a second, each of them on the disk when its client goes on. */
static int submit_together(struct store *store, const char *url, double *rate, double *syncs)
{
	int failed = 0;
	struct client clients[CLIENTS];
	struct store_writes before, after;
	store_count_writes(store, &before);
	double start = bench_wall_seconds();
	for (int i = 0; i < CLIENTS; i++) {
		clients[i] = (struct client){.url = url, .number = 1 + i};
		if (pthread_create(&clients[i].thread, NULL, submit, &clients[i]) != 0)
			abort();
	}
	for (int i = 0; i < CLIENTS; i++) {
		pthread_join(clients[i].thread, NULL);
		failed |= clients[i].failed;
	}
	*rate = CLIENTS * ORDERS_OF_CLIENT / (bench_wall_seconds() - start);
	store_count_writes(store, &after);
	*syncs = (double)(after.syncs - before.syncs) / (CLIENTS * ORDERS_OF_CLIENT);
	return failed;
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
	double rate = 0, syncs = 0;
	failed = failed || submit_together(store, url, &rate, &syncs);
	store_close(store);
	if (!failed) {
		bench_line("queue: orders of 32 clients, kept", rate, "/s", -1500);
		bench_line("queue: waits for the disk an order", syncs, "", 1);
		bench_line("queue: an order, kept and answered", order_s * 1e3, "ms", 25);
		bench_line("queue: a look at an empty queue", idle_s * 1e6, "us", 100);
	}
	return system(command) || failed;
}
