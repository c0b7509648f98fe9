/* Who sends a request, as its key tells. */
#ifndef API_CALLER_H
#define API_CALLER_H

#include "storage/access.h"

#include <stdbool.h>

struct caller {
	struct owner owner; /* whose is what the request makes, and whose things it finds */
	uint8_t veil[ACCESS_VEIL_SIZE];
	unsigned scopes; /* KEY_READ… */
	/* Of the tenant "default", or of a service without keys: may see the figures of the service as a whole, and
	 * make keys for every tenant. */
	bool is_operator;
	const struct access_key *key; /* borrowed; NULL where none is needed */
};

#endif
