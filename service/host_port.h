/* Addresses of sockets as a person writes them: "HOST:PORT", "[IPV6]:PORT". */
#ifndef SERVICE_HOST_PORT_H
#define SERVICE_HOST_PORT_H

#include <stdbool.h>

struct host_port {
	char host[256]; /* without brackets (RFC 3986, 3.2.2); may be empty */
	char port[6];   /* the digits of `number` */
	unsigned number;
};

/* False where the text has no colon, a host that is too long, or a port that is no number from 0 to 65535. */
bool host_port_parse(struct host_port *parts, const char *text);

#endif
