/* The head of an HTTP request as the api sees it: no socket, so a test can make one on the stack. Its target is known
 * earlier: exchange_new. */
#ifndef API_REQUEST_H
#define API_REQUEST_H

#include <stdint.h>

struct api_request {
	const char *method; /* "GET" */
	const char *host;   /* the host that is asked, by the target or by Host; "" or NULL where neither says it */
	uint64_t address;   /* what stands for the client's address; 0 where nobody knows it */
	/* The value of a header, its name in any case; NULL where the request has none. */
	const char *(*header)(void *context, const char *name);
	void *context; /* of header() */
};

#endif
