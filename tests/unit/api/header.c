/* Request headers and query strings: the rules of their RFCs, case by case. */
#include "api/header.h"

#include "api/query.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static void a_media_type_is_lower_case_and_without_parameters(void **state)
{
	char type[32];
	(void)state;
	assert_true(header_media_type("Application/JSON; charset=utf-8", type, sizeof type));
	assert_string_equal(type, "application/json");
	assert_true(header_media_type("  image/svg+xml  ", type, sizeof type));
	assert_string_equal(type, "image/svg+xml");
	const char *bad[] = {NULL,           "",
			     "json",         "/json",
			     "text/",        "a/b/c",
			     "text/plain x", "text /plain",
			     "a/b,c/d",      "application/a-name-that-is-longer-than-the-space"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		assert_false(header_media_type(bad[i], type, sizeof type));
		assert_string_equal(type, "");
	}
}

static void a_parameter_may_be_quoted_and_escaped(void **state)
{
	char text[16];
	(void)state;
	assert_true(header_parameter("multipart/form-data; charset=x; Boundary=abc", "boundary", text, sizeof text));
	assert_string_equal(text, "abc");
	assert_true(header_parameter("form-data; name=\"a;b \\\"c\\\\\"; filename=x", "name", text, sizeof text));
	assert_string_equal(text, "a;b \"c\\");
	assert_true(header_parameter("form-data; name=\"a;b\" ; filename=x", "filename", text, sizeof text));
	assert_string_equal(text, "x");
	assert_false(header_parameter("form-data; filename=x", "name", text, sizeof text));
	assert_false(header_parameter("form-data; name=\"never ends", "name", text, sizeof text));
	assert_false(header_parameter("form-data; name=\"ends\\", "name", text, sizeof text));
	assert_false(header_parameter("form-data; name=longer-than-sixteen", "name", text, sizeof text));
	assert_false(header_parameter("form-data; name", "name", text, sizeof text));
	assert_false(header_parameter(NULL, "name", text, sizeof text));
}

static void the_closest_range_of_accept_decides(void **state)
{
	(void)state;
	const struct {
		const char *accept;
		bool welcome;
	} cases[] = {
		{NULL, true},
		{"", true},
		{"*/*", true},
		{"text/html", false},
		{"application/json", true},
		{"APPLICATION/JSON", true},
		{"application/*", true},
		{"applicatio/*", false},
		{"application/jsonp", false},
		{"text/html, application/json;q=0.5", true},
		{"*/*;q=0, application/json", true},
		{"application/json;q=0, */*", false},
		{"application/json; q=0.000", false},
		{"application/json; q=0.001", true},
		{"application/*;q=0, application/json;q=1", true},
		{",,;;", false},
	};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
		if (header_accepts(cases[i].accept, "application/json") != cases[i].welcome)
			fail_msg("Accept: %s", cases[i].accept);
}

static void prefer_gives_the_seconds_of_its_wait(void **state)
{
	(void)state;
	assert_int_equal(header_prefer_wait_s("wait=5"), 5);
	assert_int_equal(header_prefer_wait_s("respond-async, Wait=10"), 10);
	assert_int_equal(header_prefer_wait_s("handling=lenient; wait=3"), 3);
	assert_int_equal(header_prefer_wait_s("wait=4294967294"), 4294967294);
	const char *long_waits[] = {"wait=4294967295", "wait=4294967296", "wait=99999999999",
				    "wait=99999999999999999999999"};
	for (size_t i = 0; i < sizeof long_waits / sizeof long_waits[0]; i++)
		assert_true(header_prefer_wait_s(long_waits[i]) == UINT32_MAX);
	const char *none[] = {NULL, "", "wait", "wait=", "wait=x", "wait=-1", "await=3"};
	for (size_t i = 0; i < sizeof none / sizeof none[0]; i++)
		assert_int_equal(header_prefer_wait_s(none[i]), 0);
}

static void an_entity_tag_matches_weakly_and_whole(void **state)
{
	(void)state;
	assert_true(header_matches_etag("\"abc\"", "\"abc\""));
	assert_true(header_matches_etag("\"x\", W/\"abc\" ,\"y\"", "\"abc\""));
	assert_true(header_matches_etag("*", "\"abc\""));
	assert_false(header_matches_etag(NULL, "\"abc\""));
	assert_false(header_matches_etag("\"abcd\"", "\"abc\""));
	assert_false(header_matches_etag("abc", "\"abc\""));
}

static void a_length_that_is_no_number_is_too_long(void **state)
{
	uint64_t bytes = 0;
	(void)state;
	assert_false(header_content_length(NULL, &bytes));
	assert_true(header_content_length("5368709120", &bytes));
	assert_int_equal(bytes, 5368709120);
	const char *bad[] = {"", "-1", "1e9", "18446744073709551616", "12 13x"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		assert_true(header_content_length(bad[i], &bytes));
		if (i < 4)
			assert_true(bytes == UINT64_MAX);
	}
}

static void a_target_is_cut_into_path_and_decoded_pairs(void **state)
{
	struct query query;
	struct tw_error error = {0};
	(void)state;
	assert_int_equal(query_parse(&query, "/v1/meshes?name=a%20b%2Bc+d&unit=cm&&flag&e=", &error), TW_OK);
	assert_string_equal(query.path, "/v1/meshes");
	assert_string_equal(query_get(&query, "name"), "a b+c d");
	assert_string_equal(query_get(&query, "unit"), "cm");
	assert_string_equal(query_get(&query, "flag"), "");
	assert_string_equal(query_get(&query, "e"), "");
	assert_null(query_get(&query, "nam"));
	assert_int_equal(query.pair_count, 4);
}

static void a_broken_target_is_refused(void **state)
{
	struct query query;
	struct tw_error error = {0};
	char long_target[QUERY_TEXT_MAX + 10], many[512] = "/x?";
	(void)state;
	const char *bad[] = {"/x?a=%", "/x?a=%4", "/x?a=%zz", "/x?%00=1", "/x?a=1&a=2", "/x?a&%61=2"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		assert_int_equal(query_parse(&query, bad[i], &error), TW_ERROR_INPUT);
	memset(long_target, 'x', sizeof long_target - 1);
	long_target[sizeof long_target - 1] = 0;
	assert_int_equal(query_parse(&query, long_target, &error), TW_ERROR_LIMIT);
	for (int i = 0; i < 40; i++)
		snprintf(many + strlen(many), sizeof many - strlen(many), "a%d&", i);
	assert_int_equal(query_parse(&query, many, &error), TW_ERROR_INPUT);
}

static void what_is_encoded_decodes_to_itself(void **state)
{
	struct query query;
	struct tw_error error = {0};
	char text[256], encoded[1024], target[1100];
	(void)state;
	for (int c = 1; c < 128; c++)
		text[c - 1] = (char)c;
	strcpy(text + 127, "\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80"); /* of two, three and four bytes */
	query_encode(text, encoded, sizeof encoded);
	snprintf(target, sizeof target, "/x?all=%s", encoded);
	assert_int_equal(query_parse(&query, target, &error), TW_OK);
	assert_string_equal(query_get(&query, "all"), text);
	query_encode(text, encoded, 5);
	assert_true(strlen(encoded) < 5);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_media_type_is_lower_case_and_without_parameters),
		cmocka_unit_test(a_parameter_may_be_quoted_and_escaped),
		cmocka_unit_test(the_closest_range_of_accept_decides),
		cmocka_unit_test(prefer_gives_the_seconds_of_its_wait),
		cmocka_unit_test(an_entity_tag_matches_weakly_and_whole),
		cmocka_unit_test(a_length_that_is_no_number_is_too_long),
		cmocka_unit_test(a_target_is_cut_into_path_and_decoded_pairs),
		cmocka_unit_test(a_broken_target_is_refused),
		cmocka_unit_test(what_is_encoded_decodes_to_itself),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
