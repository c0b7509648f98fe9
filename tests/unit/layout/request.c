/* The layout request: what it takes, and that everything else is refused with the place and a stable type. */
#include "solver/layout/request.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define TERMINAL "{\"terminals\":[{\"vertex\":1},"
#define ONE(terminal) "{\"terminals\":[" terminal "]}"

static void takes_the_four_forms_of_a_terminal(void **state)
{
	(void)state;
	const char *json = "{\"field\":\"fld_x\",\"terminals\":[{\"name\":\"left elbow\",\"vertex\":17},"
			   "{\"face\":5,\"barycentric\":[0.2,0.3,0.50001]},{\"point_mm\":[1,-2.5,3e2]},"
			   "{\"name\":\"ü\",\"piece\":\"front\",\"uv_mm\":[310,45.5]}],"
			   "\"options\":{\"baseline\":\"length\",\"tolerance_mm\":\"auto\",\"time_limit_s\":2}}";
	struct layout_request request;
	struct tw_error error = {0};
	assert_int_equal(layout_request_parse(&request, json, strlen(json), &error), TW_OK);
	assert_string_equal(request.field, "fld_x");
	assert_int_equal(request.terminal_count, 4);
	const struct layout_terminal *t = request.terminals;
	assert_int_equal(t[0].kind, TERMINAL_VERTEX);
	assert_int_equal(t[0].vertex, 17);
	assert_string_equal(t[0].name, "left elbow");
	assert_int_equal(t[1].kind, TERMINAL_FACE);
	assert_true(fabs(t[1].barycentric[0] + t[1].barycentric[1] + t[1].barycentric[2] - 1) < 1e-12);
	assert_null(t[1].name);
	assert_int_equal(t[2].kind, TERMINAL_POINT);
	assert_true(t[2].point_mm[2] == 300);
	assert_int_equal(t[3].kind, TERMINAL_PATTERN);
	assert_string_equal(t[3].piece, "front");
	assert_int_equal(request.options.baseline, BASELINE_LENGTH);
	assert_true(isnan(request.options.tolerance_mm));
	assert_true(request.options.time_limit_s == 2);
	assert_true(request.options.elongation);
	layout_request_clear(&request);
}

static const struct {
	const char *json, *type, *where;
} refused[] = {
	{"", "json-malformed", NULL},
	{"{", "json-malformed", NULL},
	{"[]", "json-type", ""},
	{"{}", "json-missing-field", "/terminals"},
	{"{\"terminals\":{}}", "json-type", "/terminals"},
	{"{\"terminals\":[]}", "json-value", "/terminals"},
	{"{\"terminals\":[{\"vertex\":1}],\"terminals\":[]}", "json-malformed", NULL},
	{"{\"terminals\":[{\"vertex\":1}],\"colour\":1}", "json-unknown-field", "/colour"},
	{"{\"terminals\":[{\"vertex\":1}],\"field\":7}", "json-type", "/field"},
	{"{\"terminals\":[{\"vertex\":1}],\"options\":{\"speed\":1}}", "json-unknown-field", "/options/speed"},
	{"{\"terminals\":[{\"vertex\":1}],\"options\":{\"time_limit_s\":-1}}", "option-value", "/options/time_limit_s"},
	{ONE("3"), "json-type", "/terminals/0"},
	{ONE("{}"), "json-missing-field", "/terminals/0"},
	{ONE("{\"vertex\":-1}"), "json-type", "/terminals/0/vertex"},
	{ONE("{\"vertex\":1.5}"), "json-type", "/terminals/0/vertex"},
	{ONE("{\"vertex\":4294967295}"), "json-type", "/terminals/0/vertex"},
	{ONE("{\"vertex\":\"1\"}"), "json-type", "/terminals/0/vertex"},
	{ONE("{\"vertex\":1,\"face\":2,\"barycentric\":[1,0,0]}"), "json-value", "/terminals/0"},
	{ONE("{\"vertex\":3,\"face\":5}"), "json-value", "/terminals/0"},
	{ONE("{\"face\":2}"), "json-missing-field", "/terminals/0"},
	{ONE("{\"barycentric\":[1,0,0]}"), "json-missing-field", "/terminals/0"},
	{ONE("{\"face\":2,\"barycentric\":[1,0]}"), "json-type", "/terminals/0/barycentric"},
	{ONE("{\"face\":2,\"barycentric\":[2,-1,0]}"), "json-value", "/terminals/0/barycentric"},
	{ONE("{\"face\":2,\"barycentric\":[0.5,0.1,0.1]}"), "json-value", "/terminals/0/barycentric"},
	{ONE("{\"point_mm\":[1,2,\"3\"]}"), "json-value", "/terminals/0/point_mm/2"},
	{ONE("{\"point_mm\":[1,2,1e30]}"), "json-value", "/terminals/0/point_mm/2"},
	{ONE("{\"point_mm\":[1,2,1e999]}"), "json-value", NULL},
	{ONE("{\"piece\":\"\",\"uv_mm\":[1,2]}"), "json-value", "/terminals/0/piece"},
	{ONE("{\"vertex\":1,\"name\":\"a\\u0007\"}"), "json-value", "/terminals/0/name"},
	{ONE("{\"vertex\":1,\"name\":\"a\\u0000b\"}"), "json-value", NULL},
	{ONE("{\"vertex\":1,\"name\":\"a\"},{\"vertex\":2,\"name\":\"a\"}"), "terminal-name-taken",
	 "/terminals/1/name"},
	{TERMINAL "{\"vertices\":1}]}", "json-unknown-field", "/terminals/1/vertices"},
	{ONE("{\"vertex\":1,\"name\":\"\xff\"}"), "json-malformed", NULL},
};

static void refuses_what_is_no_request(void **state)
{
	(void)state;
	for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
		struct layout_request request;
		struct tw_error error = {0};
		enum tw_status status =
			layout_request_parse(&request, refused[i].json, strlen(refused[i].json), &error);
		if (status != TW_ERROR_INPUT || strcmp(error.type, refused[i].type) != 0 ||
		    (refused[i].where && strcmp(error.where, refused[i].where) != 0))
			fail_msg("%s: status %d, type %s, where %s", refused[i].json, status, error.type, error.where);
		assert_null(request.terminals);
	}
}

static void refuses_depth_before_it_recurses(void **state)
{
	(void)state;
	enum { DEPTH = 100000 };
	char *json = malloc(DEPTH);
	assert_non_null(json);
	memset(json, '[', DEPTH);
	struct layout_request request;
	struct tw_error error = {0};
	assert_int_equal(layout_request_parse(&request, json, DEPTH, &error), TW_ERROR_INPUT);
	assert_string_equal(error.type, "json-too-deep");
	free(json);
}

static void refuses_size_before_it_reads(void **state)
{
	(void)state;
	struct layout_request request;
	struct tw_error error = {0};
	assert_int_equal(layout_request_parse(&request, "", (size_t)TW_LIMIT_JSON_BYTES + 1, &error), TW_ERROR_LIMIT);
	assert_string_equal(error.type, "json-too-large");
}

static void refuses_more_terminals_than_the_limit(void **state)
{
	(void)state;
	size_t size = 32 + 16 * (size_t)(TW_LIMIT_TERMINALS + 1), used;
	char *json = malloc(size);
	assert_non_null(json);
	used = (size_t)snprintf(json, size, "{\"terminals\":[");
	for (uint32_t i = 0; i <= TW_LIMIT_TERMINALS; i++)
		used += (size_t)snprintf(json + used, size - used, "%s{\"vertex\":%u}", i ? "," : "", i % 10);
	used += (size_t)snprintf(json + used, size - used, "]}");
	struct layout_request request;
	struct tw_error error = {0};
	assert_int_equal(layout_request_parse(&request, json, used, &error), TW_ERROR_LIMIT);
	assert_string_equal(error.type, "too-many-terminals");
	free(json);
}

static void knows_whether_it_counts_vertices_faces_or_edges(void **state)
{
	(void)state;
#define PLACE "{\"terminals\":[{\"point_mm\":[1,2,3]}],\"constraints\":"
	static const struct {
		const char *json;
		bool has_numbers;
	} cases[] = {
		{ONE("{\"vertex\":1}"), true},
		{ONE("{\"point_mm\":[1,2,3]},{\"face\":1,\"barycentric\":[0,0,1]}"), true},
		{ONE("{\"point_mm\":[1,2,3]},{\"piece\":\"front\",\"uv_mm\":[1,2]}"), false},
		{PLACE "{\"keep_out\":[{\"faces\":[7]}]}}", true},
		{PLACE "{\"keep_out\":[{\"piece\":\"front\",\"polygon_mm\":[[0,0],[8,0],[0,6]]}]}}", false},
		{PLACE "{\"face_multipliers\":[{\"faces\":[2],\"factor\":2}]}}", true},
		{PLACE "{\"free_edges\":[[1,2]]}}", true},
		{PLACE "{\"seam_price_mpa_mm2\":4}}", false},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct layout_request request;
		struct tw_error error = {0};
		assert_int_equal(layout_request_parse(&request, cases[i].json, strlen(cases[i].json), &error), TW_OK);
		assert_int_equal(layout_request_has_numbers(&request), cases[i].has_numbers);
		layout_request_clear(&request);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(takes_the_four_forms_of_a_terminal),
		cmocka_unit_test(refuses_what_is_no_request),
		cmocka_unit_test(refuses_depth_before_it_recurses),
		cmocka_unit_test(refuses_size_before_it_reads),
		cmocka_unit_test(refuses_more_terminals_than_the_limit),
		cmocka_unit_test(knows_whether_it_counts_vertices_faces_or_edges),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
