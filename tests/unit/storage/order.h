/* Orders for the queue's tests: many small requests that differ in who asks and how urgently. */
#ifndef TESTS_UNIT_STORAGE_ORDER_H
#define TESTS_UNIT_STORAGE_ORDER_H

#include "tests/unit/storage/fixture.h"

/* A job that needs nothing; its number, by the oracle. */
static inline int64_t order_of_kind(struct fixture *f, enum resource_kind kind, int64_t client,
				    struct job_request request)
{
	struct resource resource;
	enum resource_outcome outcome;
	const struct resource_draft draft = {.owner = {TENANT_DEFAULT, client}, .kind = kind, .queue = request};
	ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
	resource_clear(&resource);
	return fixture_ask(f, "SELECT max(number) FROM job");
}

static inline int64_t order(struct fixture *f, int64_t client, struct job_request request)
{
	return order_of_kind(f, RESOURCE_LAYOUT, client, request);
}
#define ORDER(f, client, ...) order((f), (client), (struct job_request){__VA_ARGS__})

static inline struct claim_query order_query(void)
{
	return (struct claim_query){.kinds = JOB_KINDS_ALL, .worker = "tester", .lease_ms = 5000};
}

/* The number of the job that is claimed; 0: none. */
static inline int64_t order_claim(struct fixture *f, struct claim_query query, struct job_ticket *ticket)
{
	bool found = false;
	ok(f, job_claim(f->store, &query, ticket, &found, &f->error));
	return found ? ticket->number : 0;
}

static inline int64_t order_next(struct fixture *f)
{
	struct job_ticket ticket;
	return order_claim(f, order_query(), &ticket);
}

static inline int64_t order_field(struct fixture *f, int64_t job, const char *column)
{
	char text[128];
	snprintf(text, sizeof text, "SELECT %s FROM job WHERE number = %lld", column, (long long)job);
	return fixture_ask(f, text);
}

#endif
