/* Web pages of other origins, and a service without keys on this machine. A browser lets any page send requests to
 * 127.0.0.1, directly or under a name of the page's own that resolves to it (DNS rebinding). Therefore such a service
 * answers only to a Host that is this machine, and to no Origin but its own and the one that CORS allows.
 *
 * That is one of two fences. The other: whatever changes something and has a body names a media type that a page cannot
 * send without asking first (api/exchange.c). */
#ifndef API_ORIGIN_H
#define API_ORIGIN_H

#include <stdbool.h>

/* Whether Host ("localhost:8080") names this machine: localhost, 127.0.0.0/8, [::1], or one of `names` (with commas, no
 * ports; may be ""). */
bool origin_is_local_host(const char *host, const char *names);

/* Whether Origin ("http://localhost:8080") may drive the service that was asked as `host`: it is the same place, or the
 * `cors_origin` ("*": all). NULL, no Origin, is no browser's page. */
bool origin_is_welcome(const char *origin, const char *host, const char *cors_origin);

#endif
