/* What the HTTP server reads, without a client: heads, chunks and addresses; and what a relay leaves behind. */
#include "service/daemon/http/address.h"
#include "service/daemon/http/chunk.h"
#include "service/daemon/http/head.h"
#include "service/daemon/http/relay.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

static enum head_outcome parse(struct head *head, char *bytes, const char *text, struct tw_error *error)
{
	*head = (struct head){0};
	strcpy(bytes, text);
	return head_parse(head, bytes, strlen(bytes), error);
}

static void a_head_is_cut_into_its_parts(void **state)
{
	(void)state;
	struct head head;
	struct tw_error error;
	char bytes[512];
	assert_int_equal(
		parse(&head, bytes,
		      "\r\nPOST /v1/x?a=b HTTP/1.1\r\nhost: localhost:80\r\nContent-Length: 12\r\nPrefer: a\r\n"
		      "X-Empty:\r\nPREFER:  b \t\r\nConnection: x, Close\r\nExpect: 100-Continue\r\n\r\nbody",
		      &error),
		HEAD_COMPLETE);
	assert_string_equal(head.method, "POST");
	assert_string_equal(head.target, "/v1/x?a=b");
	assert_string_equal(head.host, "localhost:80");
	assert_string_equal(head_find(&head, "prefer"), "a, b");
	assert_string_equal(head_find(&head, "X-EMPTY"), "");
	assert_null(head_find(&head, "Content-Type"));
	assert_int_equal(head.body_bytes, 12);
	assert_true(head.ends && head.expects && !head.is_chunked && !head.is_old);
	assert_string_equal(bytes + head.size, "body");
	head_clear(&head);
}

static void the_target_in_absolute_form_names_the_host(void **state)
{
	(void)state;
	static const char *const forms[][3] = {
		{"http://a.example:8/p?q", "/p?q", "a.example:8"},
		{"http://a", "/", "a"},
		{"HTTPS://[::1]?q", "/?q", "[::1]"},
		{"/p", "/p", "there"},
	};
	for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
		struct head head;
		struct tw_error error;
		char text[256], bytes[256];
		snprintf(text, sizeof text, "GET %s HTTP/1.1\r\nHost: there\r\n\r\n", forms[i][0]);
		assert_int_equal(parse(&head, bytes, text, &error), HEAD_COMPLETE);
		assert_string_equal(head.target, forms[i][1]);
		assert_string_equal(head.host, forms[i][2]);
		head_clear(&head);
	}
}

static void a_head_that_comes_in_pieces_is_the_same(void **state)
{
	(void)state;
	static const char text[] = "GET /p HTTP/1.1\r\nHost: h\r\nAccept: a\r\nAccept: b\r\n\r\n";
	for (size_t cut = 1; cut < sizeof text - 1; cut++) {
		struct head head = {0};
		struct tw_error error;
		char bytes[sizeof text];
		memcpy(bytes, text, sizeof text);
		assert_int_equal(head_parse(&head, bytes, cut, &error), HEAD_INCOMPLETE);
		assert_int_equal(head_parse(&head, bytes, sizeof text - 1, &error), HEAD_COMPLETE);
		assert_string_equal(head_find(&head, "Accept"), "a, b");
		head_clear(&head);
	}
}

/* Refused as soon as they cannot become a head any more: nobody waits for the end of what is wrong already. */
static void what_is_wrong_is_refused_at_once(void **state)
{
	(void)state;
	static const char *const starts[] = {"\n",   "\rG",       "GET / HTTP/1.1\n", "GET / HTTP/1.1\r\nA: b\rc",
					     "\x01", "GET /\x7f", "\r\n\r\n\r\n"};
	for (size_t i = 0; i < sizeof starts / sizeof *starts; i++) {
		struct head head;
		struct tw_error error;
		char bytes[64];
		assert_int_equal(parse(&head, bytes, starts[i], &error), HEAD_REFUSED);
		assert_string_equal(error.type, "malformed-request");
		head_clear(&head);
	}
}

static void what_is_no_header_is_named(void **state)
{
	(void)state;
	static const char *const heads[][2] = {
		{"Content-Length : 5\r\n", "Content-Length"},
		{"Content-Length\t: 5\r\n", "Content-Length"},
		{"X: a\r\n b\r\n", "X"},
		{" X: a\r\n", "line 2"},
		{"X: a\r\nBad Header\r\n", "line 3"},
		{"X: a\r\nbad\r\n", "line 3"},
		{"X: a\r\nY: b\r\n: c\r\n", "line 4"},
		{"X: a\r\nY: \x01\r\n", "line 3"},
		{"X: a\nY: b\r\n", "line 2"},
		{"X: a\rY: b\r\n", "line 2"},
	};
	for (size_t i = 0; i < sizeof heads / sizeof *heads; i++) {
		struct head head;
		struct tw_error error = {0};
		char text[128], bytes[128];
		snprintf(text, sizeof text, "\r\nGET / HTTP/1.1\r\n%s\r\n", heads[i][0]);
		assert_int_equal(parse(&head, bytes, text, &error), HEAD_REFUSED);
		assert_string_equal(error.where, heads[i][1]);
		head_clear(&head);
	}
}

/* All data of the chunks, read `step` bytes at a time. */
static enum chunk_state read_chunks(const char *text, size_t step, char *out)
{
	struct chunk chunk = {0};
	size_t size = strlen(text), at = 0;
	*out = 0;
	while (at < size && chunk.state != CHUNK_END && chunk.state != CHUNK_BROKEN) {
		const char *data = NULL;
		size_t data_size = 0, room = size - at < step ? size - at : step;
		at += chunk_take(&chunk, text + at, room, &data, &data_size);
		strncat(out, data ? data : "", data_size);
	}
	assert_true(chunk.state != CHUNK_END || !strcmp(text + at, "next"));
	return chunk.state;
}

static void chunks_are_the_same_in_any_cut(void **state)
{
	(void)state;
	static const char text[] =
		"5\r\nhello\r\n1;a=\"b;c\"\r\n \r\n00000000000006 ; x\r\nworld!\r\n0\r\nT: u\r\n\r\nnext";
	for (size_t step = 1; step < sizeof text; step++) {
		char out[64];
		assert_int_equal(read_chunks(text, step, out), CHUNK_END);
		assert_string_equal(out, "hello world!");
	}
}

static void a_chunk_that_says_more_than_64_bits_is_broken(void **state)
{
	(void)state;
	char out[64];
	assert_int_equal(read_chunks("ffffffffffffffff\r\nx", 100, out), CHUNK_DATA);
	assert_int_equal(read_chunks("0ffffffffffffffff\r\nx", 100, out), CHUNK_BROKEN);
}

/* Against plain counters. */
static void connections_are_counted_by_address(void **state)
{
	(void)state;
	enum { KEYS = 3000, STEPS = 100000 };
	struct address_table *table = address_table_new();
	unsigned *counts = calloc(KEYS, sizeof *counts);
	uint32_t seed = 11;
	assert_non_null(table);
	for (int i = 0; i < STEPS; i++) {
		seed = seed * 1664525u + 1013904223u;
		uint32_t key = (seed >> 8) % KEYS;
		if (counts[key] && seed >> 31) {
			address_remove(table, key + 1);
			counts[key]--;
		} else {
			assert_int_equal(address_add(table, key + 1), ++counts[key]);
		}
	}
	free(counts);
	address_table_free(table);
}

static uint64_t key_of(const char *text, char shown[CONNECTION_PEER_SIZE])
{
	struct sockaddr_storage address = {0};
	if (inet_pton(AF_INET, text, &((struct sockaddr_in *)(void *)&address)->sin_addr) == 1)
		address.ss_family = AF_INET;
	else if (inet_pton(AF_INET6, text, &((struct sockaddr_in6 *)(void *)&address)->sin6_addr) == 1)
		address.ss_family = AF_INET6;
	return address_key(&address, shown);
}

static void an_ipv6_client_counts_by_its_network(void **state)
{
	(void)state;
	char shown[CONNECTION_PEER_SIZE];
	assert_true(key_of("2001:db8::1", shown) == key_of("2001:db8::ffff:2", shown));
	assert_string_equal(shown, "2001:db8::ffff:2");
	assert_true(key_of("2001:db8:0:1::1", shown) != key_of("2001:db8::1", shown));
	assert_true(key_of("192.0.2.1", shown) != key_of("192.0.2.2", shown));
	assert_true(key_of("192.0.2.1", shown) == key_of("::ffff:192.0.2.1", shown));
	assert_true(key_of("::1", shown) != 0 && key_of("0.0.0.0", shown) != 0);
}

/* A worker that is being started holds copies of all descriptors until it has become another program. */
static void nobody_is_told_of_a_relay_that_is_closed(void **state)
{
	(void)state;
	int pair[2], epoll = epoll_create1(0);
	struct epoll_event event = {.events = EPOLLIN}, told;
	assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
	assert_int_equal(epoll_ctl(epoll, EPOLL_CTL_ADD, pair[0], &event), 0);
	struct relay relay = RELAY_NONE;
	relay.socket = pair[0];
	relay.watcher = epoll;
	const int copy = dup(pair[0]);
	relay_close(&relay);
	close(pair[1]);
	assert_int_equal(epoll_wait(epoll, &told, 1, 0), 0);
	close(copy);
	close(epoll);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_head_is_cut_into_its_parts),
		cmocka_unit_test(the_target_in_absolute_form_names_the_host),
		cmocka_unit_test(a_head_that_comes_in_pieces_is_the_same),
		cmocka_unit_test(what_is_wrong_is_refused_at_once),
		cmocka_unit_test(what_is_no_header_is_named),
		cmocka_unit_test(chunks_are_the_same_in_any_cut),
		cmocka_unit_test(a_chunk_that_says_more_than_64_bits_is_broken),
		cmocka_unit_test(connections_are_counted_by_address),
		cmocka_unit_test(an_ipv6_client_counts_by_its_network),
		cmocka_unit_test(nobody_is_told_of_a_relay_that_is_closed),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
