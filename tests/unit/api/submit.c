/* What a request may say about its job, header by header. */
#include "api/submit.h"
#include "api/time_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <strings.h>

#include <cmocka.h>

#define NOW_MS 1795816800000 /* 2026-11-27T22:00:00Z, by `date -u -d … +%s` */

struct headers {
	const char *name[4], *value[4];
};

static const char *find(void *context, const char *name)
{
	const struct headers *headers = context;
	for (int i = 0; i < 4 && headers->name[i]; i++)
		if (!strcasecmp(headers->name[i], name))
			return headers->value[i];
	return NULL;
}

static struct submit parse(const struct headers *headers)
{
	struct submit submit;
	struct tw_error error = {0};
	if (submit_parse(&submit, find, (void *)headers, NOW_MS, &error) != TW_OK)
		fail_msg("%s: %s", error.where, error.text);
	return submit;
}

static void assert_refused(const char *name, const char *value)
{
	struct submit submit;
	struct tw_error error = {0};
	struct headers headers = {{name}, {value}};
	if (submit_parse(&submit, find, &headers, NOW_MS, &error) == TW_OK)
		fail_msg("%s: %s was taken", name, value);
	assert_string_equal(error.type, "malformed-header");
	assert_string_equal(error.where, name);
	assert_true(strlen(error.text) > strlen(name) + 4);
	if (!strcmp(name, "Cancel-After") || !strcmp(name, "Not-Before"))
		assert_non_null(strstr(error.text, "90 for seconds; more than 0, at most 366d"));
}

static void who_waits_is_interactive_unless_told_otherwise(void **state)
{
	(void)state;
	assert_int_equal(parse(&(struct headers){0}).queue.class, JOB_NORMAL);
	assert_int_equal(parse(&(struct headers){{"Prefer"}, {"wait=5"}}).queue.class, JOB_INTERACTIVE);
	assert_int_equal(parse(&(struct headers){{"Prefer"}, {"wait=0"}}).queue.class, JOB_NORMAL);
	struct submit submit = parse(&(struct headers){{"Prefer", "Job-Class"}, {"wait=5", "batch"}});
	assert_int_equal(submit.queue.class, JOB_BATCH);
	assert_int_equal(submit.wait_s, 5);
	assert_int_equal(parse(&(struct headers){{"Job-Class"}, {"interactive"}}).queue.class, JOB_INTERACTIVE);
	assert_refused("Job-Class", "");
	assert_refused("Job-Class", "urgent");
	assert_refused("Job-Class", "Batch");
}

static void a_client_says_that_it_wants_no_more_when_it_leaves(void **state)
{
	(void)state;
	static const struct {
		const char *prefer;
		bool transient;
	} cases[] = {
		{"wait=5, on_disconnect=cancel", true}, {"on_disconnect=cancel", true},
		{"On_Disconnect=cancel;wait=9", true},  {"wait=5", false},
		{"on_disconnect=keep", false},          {"on_disconnect", false},
		{"on_disconnect=cancelled", false},     {"non_disconnect=cancel", false},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		assert_int_equal(parse(&(struct headers){{"Prefer"}, {cases[i].prefer}}).queue.transient,
				 cases[i].transient);
}

static void priorities_and_groups_have_limits(void **state)
{
	(void)state;
	assert_int_equal(parse(&(struct headers){{"Job-Priority"}, {"-1000"}}).queue.priority, -1000);
	assert_int_equal(parse(&(struct headers){{"Job-Priority"}, {"7"}}).queue.priority, 7);
	static const char *const priorities[] = {"",     "-",     "+7",  " 7",  "7 ",
						 "1001", "-1001", "1e3", "7.0", "99999999999999999999"};
	for (size_t i = 0; i < sizeof priorities / sizeof *priorities; i++)
		assert_refused("Job-Priority", priorities[i]);
	struct submit submit = parse(&(struct headers){{"Job-Group", "Job-Max-Running"}, {"licence-7", "2"}});
	assert_string_equal(submit.queue.group, "licence-7");
	assert_int_equal(submit.queue.max_running, 2);
	assert_int_equal(parse(&(struct headers){{"Job-Group"}, {"licence-7"}}).queue.max_running, 0);
	assert_refused("Job-Max-Running", "2"); /* of which group? */
	assert_refused("Job-Max-Running", "0");
	assert_refused("Job-Max-Running", "100001");
}

static void words_are_short_and_visible(void **state)
{
	static const char *const names[] = {"Job-Group", "Supersedes", "Session"};
	char word[66];
	(void)state;
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		memset(word, 'x', sizeof word);
		word[64] = 0;
		struct submit submit = parse(&(struct headers){{names[i]}, {word}});
		const char *taken = i == 0   ? submit.queue.group
				    : i == 1 ? submit.queue.supersedes
					     : submit.queue.session;
		assert_string_equal(taken, word);
		word[64] = 'x';
		word[65] = 0;
		assert_refused(names[i], word);
		assert_refused(names[i], "");
		assert_refused(names[i], "two words");
		assert_refused(names[i], "caf\xc3\xa9");
		assert_refused(names[i], "tab\t");
	}
}

static void times_are_spans_or_dates(void **state)
{
	static const struct {
		const char *text;
		int64_t ms; /* from now */
	} spans[] = {{"90s", 90000}, {"90", 90000},    {"250ms", 250},
		     {"5m", 300000}, {"8h", 28800000}, {"2d", 172800000}};
	(void)state;
	for (size_t i = 0; i < sizeof spans / sizeof *spans; i++) {
		struct headers both = {{"Cancel-After", "Not-Before"}, {spans[i].text, spans[i].text}};
		assert_int_equal(parse(&both).queue.cancel_after_ms, spans[i].ms);
		assert_int_equal(parse(&both).queue.not_before_ms, NOW_MS + spans[i].ms);
	}
	static const struct {
		const char *text;
		int64_t ms; /* since 1970, by `date` */
	} dates[] = {
		{"2026-11-28T22:00:00Z", 1795903200000},        {"2026-11-28T23:00:00+01:00", 1795903200000},
		{"2026-11-28T16:30:00-05:30", 1795903200000},   {"2026-11-28 22:00:00.25Z", 1795903200250},
		{"2028-02-29T00:00:00.123456z", 1835395200123}, {"1970-01-01T00:00:00Z", 0},
		{"2026-12-31T23:59:60Z", 1798761600000},
	};
	for (size_t i = 0; i < sizeof dates / sizeof *dates; i++) {
		if (dates[i].ms > NOW_MS + TIME_TEXT_SPAN_MAX_MS) {
			assert_refused("Not-Before", dates[i].text);
			continue;
		}
		assert_int_equal(parse(&(struct headers){{"Not-Before"}, {dates[i].text}}).queue.not_before_ms,
				 dates[i].ms);
	}
	static const char *const bad[] = {
		"", "0s", "0", "00ms", "-5s", "5 s", "5w", "1.5h", "367d", "99999999999999999999s", "soon", "9000h0"};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		assert_refused("Cancel-After", bad[i]);
		assert_refused("Not-Before", bad[i]);
	}
	static const char *const no_dates[] = {
		"2026-11-28",           "2026-11-28T22:00Z",       "2026-11-28T22:00:00",      "2026-02-30T22:00:00Z",
		"2026-13-01T22:00:00Z", "2026-11-28T24:00:00Z",    "2026-11-28T22:00:00+0100", "2026-11-28T22:00:00.Z",
		"26-11-28T22:00:00Z",   "2026-11-28T22:00:00Zulu", "9999-11-28T22:00:00Z"};
	for (size_t i = 0; i < sizeof no_dates / sizeof *no_dates; i++)
		assert_refused("Not-Before", no_dates[i]);
	assert_refused("Cancel-After", "2026-11-28T22:00:00Z");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(who_waits_is_interactive_unless_told_otherwise),
		cmocka_unit_test(a_client_says_that_it_wants_no_more_when_it_leaves),
		cmocka_unit_test(priorities_and_groups_have_limits),
		cmocka_unit_test(words_are_short_and_visible),
		cmocka_unit_test(times_are_spans_or_dates),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
