#include "service/daemon/metrics.h"

#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

/* Upper bounds of the latency histogram; one more bucket takes the rest. */
static const double bounds_s[] = {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30, 60};
#define BOUNDS (sizeof bounds_s / sizeof bounds_s[0])
#define STATUS_CLASSES 5

struct route_counters {
	atomic_uint_fast64_t by_class[STATUS_CLASSES]; /* 1xx … 5xx */
};

struct metrics {
	size_t route_count;
	atomic_uint_fast64_t buckets[BOUNDS + 1];
	atomic_uint_fast64_t microseconds;
	atomic_uint_fast64_t received_bytes;
	atomic_uint_fast64_t restarts;
	atomic_uint connections, held, workers;
	struct route_counters routes[]; /* [route_count + 1]: the last is for requests without a route */
};

struct metrics *metrics_new(void)
{
	size_t count = 0;
	while (api_routes[count].method)
		count++;
	struct metrics *metrics = calloc(1, sizeof *metrics + (count + 1) * sizeof metrics->routes[0]);
	if (metrics)
		metrics->route_count = count;
	return metrics;
}

void metrics_free(struct metrics *metrics)
{
	free(metrics);
}

void metrics_count_request(struct metrics *metrics, const struct route *route, unsigned status, double seconds)
{
	size_t row = route ? (size_t)(route - api_routes) : metrics->route_count;
	size_t bucket = 0;
	unsigned class = status / 100 < 1 || status / 100 > STATUS_CLASSES ? STATUS_CLASSES : status / 100;
	while (bucket < BOUNDS && seconds > bounds_s[bucket])
		bucket++;
	atomic_fetch_add_explicit(&metrics->routes[row].by_class[class - 1], 1, memory_order_relaxed);
	atomic_fetch_add_explicit(&metrics->buckets[bucket], 1, memory_order_relaxed);
	atomic_fetch_add_explicit(&metrics->microseconds, (uint64_t)(seconds * 1e6), memory_order_relaxed);
}

void metrics_count_received(struct metrics *metrics, uint64_t bytes)
{
	atomic_fetch_add_explicit(&metrics->received_bytes, bytes, memory_order_relaxed);
}

void metrics_count_restart(struct metrics *metrics)
{
	atomic_fetch_add_explicit(&metrics->restarts, 1, memory_order_relaxed);
}

void metrics_set_connections(struct metrics *metrics, unsigned count)
{
	atomic_store_explicit(&metrics->connections, count, memory_order_relaxed);
}

void metrics_set_held(struct metrics *metrics, unsigned count)
{
	atomic_store_explicit(&metrics->held, count, memory_order_relaxed);
}

void metrics_set_workers(struct metrics *metrics, unsigned count)
{
	atomic_store_explicit(&metrics->workers, count, memory_order_relaxed);
}

static uint64_t value_of(const atomic_uint_fast64_t *number)
{
	return atomic_load_explicit(number, memory_order_relaxed);
}

static void print_head(FILE *out, const char *name, const char *type, const char *help)
{
	fprintf(out, "# HELP tightwire_%s %s\n# TYPE tightwire_%s %s\n", name, help, name, type);
}

static void print_one(FILE *out, const char *name, const char *type, const char *help, uint64_t value)
{
	print_head(out, name, type, help);
	fprintf(out, "tightwire_%s %llu\n", name, (unsigned long long)value);
}

static void print_requests(FILE *out, const struct metrics *metrics)
{
	print_head(out, "http_requests_total", "counter", "Requests answered, by route and class of status.");
	for (size_t i = 0; i <= metrics->route_count; i++)
		for (size_t class = 0; class < STATUS_CLASSES; class ++) {
			uint64_t count = value_of(&metrics->routes[i].by_class[class]);
			bool none = i == metrics->route_count;
			if (count)
				fprintf(out,
					"tightwire_http_requests_total{method=\"%s\",route=\"%s\",status=\"%zuxx\"} "
					"%llu\n",
					none ? "" : api_routes[i].method, none ? "" : api_routes[i].path, class + 1,
					(unsigned long long)count);
		}
}

static void print_latency(FILE *out, const struct metrics *metrics)
{
	uint64_t sum = 0;
	print_head(out, "http_request_seconds", "histogram", "From the request line to the end of the response.");
	for (size_t i = 0; i < BOUNDS; i++) {
		sum += value_of(&metrics->buckets[i]);
		fprintf(out, "tightwire_http_request_seconds_bucket{le=\"%g\"} %llu\n", bounds_s[i],
			(unsigned long long)sum);
	}
	sum += value_of(&metrics->buckets[BOUNDS]);
	fprintf(out,
		"tightwire_http_request_seconds_bucket{le=\"+Inf\"} %llu\ntightwire_http_request_seconds_sum %.6f\n"
		"tightwire_http_request_seconds_count %llu\n",
		(unsigned long long)sum, (double)value_of(&metrics->microseconds) / 1e6, (unsigned long long)sum);
}

/* Resident pages stand second in /proc/self/statm. */
static uint64_t resident_bytes(void)
{
	unsigned long total = 0, resident = 0;
	char text[64] = "";
	FILE *file = fopen("/proc/self/statm", "re");
	if (!file)
		return 0;
	if (fgets(text, sizeof text, file) &&
	    sscanf(text, "%lu %lu", &total, &resident) != 2) /* NOLINT(cert-err34-c) */
		resident = 0;
	fclose(file);
	return (uint64_t)resident * (uint64_t)sysconf(_SC_PAGESIZE);
}

char *metrics_text(const struct metrics *metrics)
{
	char *text = NULL;
	size_t size = 0;
	FILE *out = open_memstream(&text, &size);
	if (!out)
		return NULL;
	print_requests(out, metrics);
	print_latency(out, metrics);
	print_one(out, "http_received_bytes_total", "counter", "Bytes of request bodies.",
		  value_of(&metrics->received_bytes));
	print_one(out, "http_connections", "gauge", "Open connections.", atomic_load(&metrics->connections));
	print_one(out, "http_held", "gauge", "Connections that wait for a job.", atomic_load(&metrics->held));
	print_one(out, "workers", "gauge", "Living worker processes.", atomic_load(&metrics->workers));
	print_one(out, "worker_restarts_total", "counter", "Worker processes that were replaced.",
		  value_of(&metrics->restarts));
	print_one(out, "resident_bytes", "gauge", "Memory of the daemon without its workers.", resident_bytes());
	if (fclose(out) == 0)
		return text;
	free(text);
	return NULL;
}
