/* Counters of the daemon, for /metrics in the Prometheus text format. All functions may be called from any thread. */
#ifndef SERVICE_DAEMON_METRICS_H
#define SERVICE_DAEMON_METRICS_H

#include "api/route.h"

struct metrics;

struct metrics *metrics_new(void); /* NULL when out of memory */
void metrics_free(struct metrics *metrics);

/* A request was answered: by which route (NULL: none matched), with which status, after how many seconds. */
void metrics_count_request(struct metrics *metrics, const struct route *route, unsigned status, double seconds);
void metrics_count_received(struct metrics *metrics, uint64_t bytes);
void metrics_count_restart(struct metrics *metrics);                   /* a worker process was replaced */
void metrics_set_connections(struct metrics *metrics, unsigned count); /* open connections */
void metrics_set_held(struct metrics *metrics, unsigned count);        /* connections that wait for a job */
void metrics_set_workers(struct metrics *metrics, unsigned count);     /* living worker processes */

/* All of it as text; malloc, NULL when out of memory. */
char *metrics_text(const struct metrics *metrics);

#endif
