/* Names: what was probably meant is found, what is far is not, and the sentence lists what there is. */
#include "solver/names.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char *const options[] = {"time_limit_s", "strip_width_mm", "eta", "tolerance_mm", "smooth"};
static const struct names known = {options, sizeof options / sizeof *options};

static void a_slip_finds_its_name(void **state)
{
	(void)state;
	static const char *const slips[][2] = {
		{"time_limit", "time_limit_s"},
		{"time-limit-s", "time_limit_s"},
		{"TIME_LIMIT_S", "time_limit_s"},
		{"timelimit", "time_limit_s"},
		{"width", "strip_width_mm"},
		{"stirp_width_mm", "strip_width_mm"},
		{"strip_with_mm", "strip_width_mm"},
		{"tolerance", "tolerance_mm"},
		{"toleranz_mm", "tolerance_mm"},
		{"smoth", "smooth"},
		{"smoothe", "smooth"},
		{"eat", "eta"},
	};
	for (size_t i = 0; i < sizeof slips / sizeof *slips; i++) {
		const char *found = names_nearest(&known, slips[i][0]);
		if (!found || strcmp(found, slips[i][1]) != 0)
			fail_msg("%s: %s", slips[i][0], found ? found : "nothing");
	}
}

static void what_is_far_finds_nothing(void **state)
{
	(void)state;
	char longer[500];
	memset(longer, 'e', sizeof longer - 1);
	longer[sizeof longer - 1] = 0;
	static const char *const far[] = {"", "x", "colour", "threads", "zzzzzzzzzzzzzz"};
	for (size_t i = 0; i < sizeof far / sizeof *far; i++)
		assert_null(names_nearest(&known, far[i]));
	assert_null(names_nearest(&known, longer));
	assert_null(names_nearest(&(struct names){NULL, 0}, "eta"));
}

/* The textbook's recursion, which shares nothing with the rows: optimal string alignment. */
static unsigned slow(const char *a, size_t n, const char *b, size_t m)
{
	if (!n || !m)
		return (unsigned)(n + m);
	unsigned best = slow(a, n - 1, b, m) + 1, other = slow(a, n, b, m - 1) + 1;
	best = other < best ? other : best;
	other = slow(a, n - 1, b, m - 1) + (a[n - 1] != b[m - 1]);
	best = other < best ? other : best;
	if (n > 1 && m > 1 && a[n - 1] == b[m - 2] && a[n - 2] == b[m - 1]) {
		other = slow(a, n - 2, b, m - 2) + 1;
		best = other < best ? other : best;
	}
	return best;
}

static bool includes(const char *name, const char *given)
{
	return strlen(given) >= 3 && strstr(name, given);
}

static void the_nearest_is_the_nearest(void **state)
{
	(void)state;
	unsigned seed = 7;
	for (int round = 0; round < 3000; round++) {
		char given[7], name[2][7];
		const char *list[2] = {name[0], name[1]};
		char *text[3] = {given, name[0], name[1]};
		for (int t = 0; t < 3; t++) {
			seed = seed * 1664525u + 1013904223u;
			size_t length = 3 + (seed >> 16) % 4;
			for (size_t i = 0; i < length; i++) {
				seed = seed * 1664525u + 1013904223u;
				text[t][i] = (char)('a' + (seed >> 16) % 3);
			}
			text[t][length] = 0;
		}
		unsigned off[2];
		for (int t = 0; t < 2; t++) {
			off[t] = slow(given, strlen(given), list[t], strlen(list[t]));
			if (includes(list[t], given) && off[t] > 2)
				off[t] = 2;
		}
		const char *expected = off[0] <= off[1] && off[0] <= 2 ? list[0] : off[1] <= 2 ? list[1] : NULL;
		assert_ptr_equal(names_nearest(&(struct names){list, 2}, given), expected);
	}
}

static void a_refusal_says_what_there_is(void **state)
{
	(void)state;
	struct tw_error error;
	assert_int_equal(names_refuse(&known, "option", "time_limit", "option-unknown", "/options/time_limit", &error),
			 TW_ERROR_INPUT);
	assert_string_equal(error.text, "no option \"time_limit\"; did you mean time_limit_s? There are: "
					"time_limit_s, strip_width_mm, eta, tolerance_mm and smooth");
	assert_string_equal(error.where, "/options/time_limit");
	assert_int_equal(names_refuse(&known, "option", "colour", "option-unknown", NULL, &error), TW_ERROR_INPUT);
	assert_non_null(strstr(error.text, "no option \"colour\"; there are: time_limit_s, "));
	assert_int_equal(names_refuse(&(struct names){NULL, 0}, "query parameter", "x", "t", NULL, &error),
			 TW_ERROR_INPUT);
	assert_string_equal(error.text, "no query parameter \"x\"; there is none here; leave it out");
}

static void a_long_list_says_how_many_more(void **state)
{
	(void)state;
	char text[60][24];
	const char *list[60];
	struct tw_error error;
	for (size_t i = 0; i < 60; i++) {
		snprintf(text[i], sizeof text[i], "sleeve_panel_%02zu", i);
		list[i] = text[i];
	}
	assert_int_equal(names_refuse(&(struct names){list, 60}, "pattern piece", "sleeve_panel_6", "t", NULL, &error),
			 TW_ERROR_INPUT);
	const char *more = strstr(error.text, " and ");
	assert_non_null(more);
	size_t shown = 1;
	for (const char *p = strstr(error.text, "There are: "); (p = strstr(p, ", ")) != NULL; p++)
		shown++;
	assert_int_equal(shown + strtoul(more + 5, NULL, 10), 60);
	assert_string_equal(more + strlen(more) - 5, " more");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_slip_finds_its_name),          cmocka_unit_test(what_is_far_finds_nothing),
		cmocka_unit_test(the_nearest_is_the_nearest),     cmocka_unit_test(a_refusal_says_what_there_is),
		cmocka_unit_test(a_long_list_says_how_many_more),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
