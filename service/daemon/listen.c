#include "service/daemon/listen.h"

#include "service/host_port.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static bool is_loopback(const struct sockaddr *address)
{
	if (address->sa_family == AF_INET)
		return ntohl(((const struct sockaddr_in *)(const void *)address)->sin_addr.s_addr) >> 24 == 127;
	return address->sa_family == AF_INET6 &&
	       IN6_IS_ADDR_LOOPBACK(&((const struct sockaddr_in6 *)(const void *)address)->sin6_addr);
}

static void print_url(struct listener *listener)
{
	struct sockaddr_storage taken;
	socklen_t size = sizeof taken;
	char host[64] = "", port[8] = "";
	if (getsockname(listener->socket, (struct sockaddr *)&taken, &size) == 0)
		getnameinfo((struct sockaddr *)&taken, size, host, sizeof host, port, sizeof port,
			    NI_NUMERICHOST | NI_NUMERICSERV);
	bool is_v6 = strchr(host, ':') != NULL;
	snprintf(listener->url, sizeof listener->url, "http://%s%s%s:%s", is_v6 ? "[" : "", host, is_v6 ? "]" : "",
		 port);
}

static enum tw_status open_socket(struct listener *listener, const struct addrinfo *info, const char *address,
				  struct tw_error *error)
{
	int on = 1;
	int fd = socket(info->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
	if (fd >= 0 && setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
	    bind(fd, info->ai_addr, info->ai_addrlen) == 0 && listen(fd, SOMAXCONN) == 0) {
		listener->socket = fd;
		print_url(listener);
		return TW_OK;
	}
	int reason = errno;
	if (fd >= 0)
		close(fd);
	return tw_fail(error, TW_ERROR_IO, "listen", "listen", "cannot listen on %.80s: %s", address, strerror(reason));
}

enum tw_status listen_open(struct listener *listener, const char *address, bool loopback_only, struct tw_error *error)
{
	struct host_port parts;
	struct addrinfo hints = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE},
			*info = NULL;
	enum tw_status status = TW_OK;
	if (!host_port_parse(&parts, address))
		return tw_fail(error, TW_ERROR_INPUT, "listen-address", "listen",
			       "\"%.80s\" is no address; write HOST:PORT or [IPV6]:PORT, with a port from 0 to 65535",
			       address);
	int code = getaddrinfo(parts.host[0] ? parts.host : NULL, parts.port, &hints, &info);
	if (code)
		return tw_fail(error, TW_ERROR_INPUT, "listen-address", "listen", "%.80s: %s", address,
			       gai_strerror(code));
	listener->is_loopback = is_loopback(info->ai_addr);
	if (loopback_only && !listener->is_loopback)
		status = tw_fail(error, TW_ERROR_INPUT, "listen-unprotected", "listen",
				 "%.80s can be reached from other machines; make a key with tightwire key create, give "
				 "--key-file, or "
				 "listen on 127.0.0.1",
				 address);
	else
		status = open_socket(listener, info, address, error);
	freeaddrinfo(info);
	return status;
}
