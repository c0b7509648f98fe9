/* Problem details: which status an error has on the outside, and what its body says. */
#include "api/problem.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static void a_type_decides_the_status_before_the_kind_of_error_does(void **state)
{
	const struct {
		enum tw_status status;
		const char *type;
		unsigned http;
	} cases[] = {
		{TW_ERROR_INPUT, "mesh-non-manifold-edge", 422},
		{TW_ERROR_INPUT, "json-malformed", 400},
		{TW_ERROR_INPUT, "unauthorized", 401},
		{TW_ERROR_NOT_FOUND, "no-such-resource", 404},
		{TW_ERROR_UNSUPPORTED, "method-not-allowed", 405},
		{TW_ERROR_UNSUPPORTED, "not-acceptable", 406},
		{TW_ERROR_CONFLICT, "resource-in-use", 409},
		{TW_ERROR_CONFLICT, "idempotency-key-reused", 422},
		{TW_ERROR_LIMIT, "upload-too-large", 413},
		{TW_ERROR_UNSUPPORTED, "unsupported-media-type", 415},
		{TW_ERROR_IO, "store-io", 500},
		{TW_ERROR_IO, "store-busy", 503},
		{TW_ERROR_FULL, "store-full", 507},
		{TW_ERROR_INTERNAL, NULL, 500},
	};
	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		struct tw_error error = {.status = cases[i].status, .type = cases[i].type};
		assert_int_equal(problem_status(&error), cases[i].http);
	}
}

static const char *first_error(const json_t *problem, const char *member)
{
	return json_string_value(json_object_get(json_array_get(json_object_get(problem, "errors"), 0), member));
}

static void a_json_pointer_is_a_pointer_and_anything_else_a_place(void **state)
{
	struct tw_error error = {0};
	(void)state;
	(void)tw_fail(&error, TW_ERROR_INPUT, "json-type", "/terminals/3/vertex", "must be a whole number");
	json_t *problem = problem_json(&error);
	assert_string_equal(json_string_value(json_object_get(problem, "type")), "urn:tightwire:problem:json-type");
	assert_string_equal(json_string_value(json_object_get(problem, "title")), "Json type");
	assert_string_equal(first_error(problem, "pointer"), "/terminals/3/vertex");
	assert_null(first_error(problem, "place"));
	json_decref(problem);
	(void)tw_fail(&error, TW_ERROR_INPUT, "obj-index", "line 12", "there is no vertex 99");
	problem = problem_json(&error);
	assert_string_equal(first_error(problem, "place"), "line 12");
	assert_null(first_error(problem, "pointer"));
	json_decref(problem);
	(void)tw_fail(&error, TW_ERROR_NOT_FOUND, "no-such-path", NULL, "there is nothing here");
	problem = problem_json(&error);
	assert_null(json_object_get(problem, "errors"));
	json_decref(problem);
}

static void a_text_that_is_no_utf_8_is_still_told(void **state)
{
	struct tw_error error = {0};
	(void)state;
	(void)tw_fail(&error, TW_ERROR_INPUT, "obj-line", "line 1", "\"f\xff\xfe\" is no line");
	json_t *problem = problem_json(&error);
	assert_string_equal(json_string_value(json_object_get(problem, "detail")), "\"f??\" is no line");
	json_decref(problem);
}

static void a_problem_takes_the_place_of_a_response_and_keeps_its_headers(void **state)
{
	struct api_response response = {0};
	struct tw_error error = {0};
	(void)state;
	assert_int_equal(response_json(&response, 200, json_object(), &error), TW_OK);
	response_header(&response, "Allow", "GET");
	(void)tw_fail(&error, TW_ERROR_IO, "store-busy", NULL, "somebody else writes");
	problem_respond(&response, &error, "id-1");
	assert_int_equal(response.status, 503);
	assert_string_equal(response_get_header(&response, "Content-Type"), "application/problem+json");
	assert_string_equal(response_get_header(&response, "Allow"), "GET");
	assert_string_equal(response_get_header(&response, "Retry-After"), "1");
	assert_non_null(strstr(response.bytes, "\"request_id\":\"id-1\""));
	response_clear(&response);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_type_decides_the_status_before_the_kind_of_error_does),
		cmocka_unit_test(a_json_pointer_is_a_pointer_and_anything_else_a_place),
		cmocka_unit_test(a_text_that_is_no_utf_8_is_still_told),
		cmocka_unit_test(a_problem_takes_the_place_of_a_response_and_keeps_its_headers),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
