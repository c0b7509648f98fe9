/* Options: what a table says is what the command line, JSON, echo and help do. */
#include "solver/option.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct values {
	double width_mm;
	double eta;
	uint32_t rounds;
	int model;
	bool strict;
};

static const char *const models[] = {"stvk", "printed", NULL};
static const struct option rows[] = {
	{"width_mm", OPTION_NUMBER, offsetof(struct values, width_mm), "mm", 15, 0.1, 100, NULL, "strip width"},
	{"eta", OPTION_NUMBER_OR_AUTO, offsetof(struct values, eta), "MPa", NAN, 0, 10, NULL, "regularisation"},
	{"rounds", OPTION_INTEGER, offsetof(struct values, rounds), NULL, 3, 1, 9, NULL, "how often"},
	{"model", OPTION_CHOICE, offsetof(struct values, model), NULL, 1, 0, 0, models, "energy model"},
	{"strict", OPTION_FLAG, offsetof(struct values, strict), NULL, 0, 0, 0, NULL, "no mercy"},
};
static const struct option_table table = {rows, sizeof rows / sizeof *rows};

static void defaults_come_from_the_table(void **state)
{
	(void)state;
	struct values v;
	option_defaults(&table, &v);
	assert_true(v.width_mm == 15 && isnan(v.eta) && v.rounds == 3 && v.model == 1 && !v.strict);
}

static void arguments_are_taken_in_both_forms(void **state)
{
	(void)state;
	struct values v;
	struct tw_error error;
	option_defaults(&table, &v);
	char *argv[] = {"x", "--width-mm", "20.5", "--model=stvk", "--strict", "--eta", "auto", "--other", "file"};
	bool taken = false;
	int taken_count = 0;
	for (int i = 1; i < 9; i++) {
		assert_int_equal(option_from_arguments(&table, &v, 9, argv, &i, &taken, &error), TW_OK);
		taken_count += taken;
	}
	assert_int_equal(taken_count, 4);
	assert_true(v.width_mm == 20.5 && isnan(v.eta) && v.model == 0 && v.strict);
}

static void wrong_text_is_refused_with_the_flag(void **state)
{
	(void)state;
	static const char *const bad[][2] = {{"width_mm", "0"},     {"width_mm", "1e9"}, {"width_mm", "nan"},
					     {"width_mm", "5mm"},   {"rounds", "2.5"},   {"rounds", "-1"},
					     {"rounds", ""},        {"model", "1"},      {"model", "linear"},
					     {"strict", "perhaps"}, {"eta", "inf"},      {"eta", "automatic"}};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		struct values v;
		struct tw_error error = {0};
		option_defaults(&table, &v);
		assert_int_equal(option_from_text(&table, &v, bad[i][0], bad[i][1], &error), TW_ERROR_INPUT);
		assert_string_equal(error.where, bad[i][0]);
	}
}

static void json_sets_what_it_names_and_refuses_the_rest(void **state)
{
	(void)state;
	struct values v;
	struct tw_error error = {0};
	static const char *const others[] = {"terminals", NULL};
	json_t *good = json_pack("{s:f, s:s, s:i, s:s, s:b, s:[]}", "width_mm", 8.0, "eta", "auto", "rounds", 4,
				 "model", "stvk", "strict", 1, "terminals");
	option_defaults(&table, &v);
	assert_int_equal(option_from_json(&table, &v, good, "/options", others, &error), TW_OK);
	assert_true(v.width_mm == 8 && isnan(v.eta) && v.rounds == 4 && v.model == 0 && v.strict);
	json_decref(good);

	json_t *unknown = json_pack("{s:i}", "width-mm", 8);
	assert_int_equal(option_from_json(&table, &v, unknown, "/options", NULL, &error), TW_ERROR_INPUT);
	assert_string_equal(error.where, "/options/width-mm");
	assert_string_equal(error.type, "json-unknown-field");
	json_decref(unknown);

	json_t *wrong = json_pack("{s:n}", "model");
	assert_int_equal(option_from_json(&table, &v, wrong, "", NULL, &error), TW_ERROR_INPUT);
	assert_string_equal(error.where, "/model");
	assert_non_null(strstr(error.text, "stvk or printed"));
	json_decref(wrong);
}

static void an_echo_parses_back_to_the_same_values(void **state)
{
	(void)state;
	struct values v = {.width_mm = 0.1 + 0.2, .eta = NAN, .rounds = 9, .model = 0, .strict = true}, back;
	struct tw_error error;
	json_t *echo = option_to_json(&table, &v);
	char *text = json_dumps(echo, 0);
	json_decref(echo);
	echo = json_loads(text, 0, NULL);
	option_defaults(&table, &back);
	assert_int_equal(option_from_json(&table, &back, echo, "", NULL, &error), TW_OK);
	assert_true(back.width_mm == v.width_mm && isnan(back.eta) && back.rounds == 9 && back.model == 0 &&
		    back.strict);
	json_decref(echo);
	free(text);
}

static void a_pointer_escapes_and_is_cut(void **state)
{
	(void)state;
	char where[16];
	option_pointer(where, sizeof where, "/options", "a/b~c");
	assert_string_equal(where, "/options/a~1b~0");
	option_pointer(where, sizeof where, "", "a/b~c");
	assert_string_equal(where, "/a~1b~0c");
	option_pointer(where, 4, "/options", "x");
	assert_string_equal(where, "/op");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(defaults_come_from_the_table),
		cmocka_unit_test(arguments_are_taken_in_both_forms),
		cmocka_unit_test(wrong_text_is_refused_with_the_flag),
		cmocka_unit_test(json_sets_what_it_names_and_refuses_the_rest),
		cmocka_unit_test(a_pointer_escapes_and_is_cut),
		cmocka_unit_test(an_echo_parses_back_to_the_same_values),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
