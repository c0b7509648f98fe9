/* HOST:PORT as a person writes it. */
#include "service/host_port.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static void a_host_and_a_port_are_parted(void **state)
{
	(void)state;
	static const struct {
		const char *text, *host, *port;
		unsigned number;
	} good[] = {
		{"localhost:8080", "localhost", "8080", 8080},
		{"127.0.0.1:0", "127.0.0.1", "0", 0},
		{"[::1]:65535", "::1", "65535", 65535},
		{":00080", "", "80", 80},
	};
	for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
		struct host_port parts;
		assert_true(host_port_parse(&parts, good[i].text));
		assert_string_equal(parts.host, good[i].host);
		assert_string_equal(parts.port, good[i].port);
		assert_int_equal(parts.number, good[i].number);
	}
}

static void a_port_that_no_socket_has_is_refused(void **state)
{
	(void)state;
	static const char *const bad[] = {"h:65536", "h:99999", "h:999999", "h:4294967376", "h:-1",
					  "h:+80",   "h: 80",   "h:80 ",    "h:",           "h",
					  "",        "h:http",  "h:0x50"};
	struct host_port parts;
	char text[400];
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		assert_false(host_port_parse(&parts, bad[i]));
	memset(text, 'h', sizeof text);
	strcpy(text + sizeof text - 4, ":80");
	assert_false(host_port_parse(&parts, text));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_host_and_a_port_are_parted),
		cmocka_unit_test(a_port_that_no_socket_has_is_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
