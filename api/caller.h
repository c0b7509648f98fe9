/* Who sends a request, as its key tells. */
#ifndef API_CALLER_H
#define API_CALLER_H

#include "storage/tenant.h"

struct caller {
	struct owner owner; /* whose is what the request makes, and whose things it finds */
};

#endif
