/* The socket that the service listens on. */
#ifndef SERVICE_DAEMON_LISTEN_H
#define SERVICE_DAEMON_LISTEN_H

#include "tightwire.h"

#include <stdbool.h>

struct listener {
	int socket; /* owned by whoever takes it over; non-blocking, close-on-exec */
	bool is_loopback;
	char url[128]; /* "http://127.0.0.1:8080", with the port that was taken */
};

/* Binds and listens on "HOST:PORT", "[IPV6]:PORT" or ":PORT" (every address). With `loopback_only` an address that
 * other machines can reach is refused (TW_ERROR_INPUT "listen-unprotected"). TW_ERROR_INPUT "listen-address",
 * TW_ERROR_IO. */
enum tw_status listen_open(struct listener *listener, const char *address, bool loopback_only,
			   struct tw_error *error) TW_NODISCARD;

#endif
