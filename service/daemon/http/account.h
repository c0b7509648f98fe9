/* What is kept of a request that has ended: a line of the log, and its place in the metrics. */
#ifndef SERVICE_DAEMON_HTTP_ACCOUNT_H
#define SERVICE_DAEMON_HTTP_ACCOUNT_H

#include "api/exchange.h"
#include "service/daemon/metrics.h"

#include <stdbool.h>
#include <stdint.h>

struct account {
	const struct exchange *exchange; /* borrowed, as all */
	const char *peer;                /* the client's address */
	const char *method;              /* NULL where the head did not get so far */
	unsigned status;                 /* of the answer; 0: the client had left before there was one */
	int64_t started_us;              /* of the monotonic clock */
	uint64_t received;               /* bytes of the body */
	bool is_complete;                /* the client was sent all of it */
};

void account_request(struct metrics *metrics, const struct account *account);

#endif
