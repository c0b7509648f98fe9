/* What a client may take. The limits can be changed while the server runs. */
#ifndef SERVICE_DAEMON_HTTP_LIMITS_H
#define SERVICE_DAEMON_HTTP_LIMITS_H

#include <stdatomic.h>

struct http_limits {
	atomic_uint connections;  /* at once */
	atomic_uint per_address;  /* of these, by one client address */
	atomic_uint held;         /* requests and event streams that wait for a job */
	atomic_uint idle_s;       /* a connection without a request, and one that does not take its answer */
	atomic_uint head_s;       /* for a whole head, from its first byte */
	atomic_uint request_s;    /* for head and body together */
	atomic_uint rate_bytes_s; /* that a client must send or take on the average, after GRACE */
};

#define HTTP_GRACE_S 5 /* of waiting for a client before its rate is judged */

#endif
