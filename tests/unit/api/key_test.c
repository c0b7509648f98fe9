/* What the api knows of keys without a store: finding one, counting requests, slowing down guesses, veiling numbers. */
#include "api/key_file.h"
#include "api/key_table.h"
#include "api/meter.h"
#include "api/veil.h"
#include "api/wrong_keys.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>
#include <sodium.h>

/* --- finding one ------------------------------------------------------------------------------------------------ */

static struct access_key key_of(const char *secret, int64_t client, int64_t until_ms)
{
	struct access_key key = {.owner = {1, client}, .scopes = KEY_READ, .until_ms = until_ms};
	crypto_generichash(key.hash, sizeof key.hash, (const uint8_t *)secret, strlen(secret), NULL, 0);
	return key;
}

static void each_key_is_found_by_its_secret_and_by_no_other(void **state)
{
	enum { KEYS = 1000 };
	struct access_key *keys = calloc(KEYS, sizeof *keys);
	char secret[SECRET_SIZE], secrets[KEYS][SECRET_SIZE];
	(void)state;
	for (int i = 0; i < KEYS; i++) {
		secret_make(secrets[i]);
		keys[i] = key_of(secrets[i], i + 1, 0);
	}
	struct key_table *table = key_table_new(keys, KEYS);
	assert_non_null(table);
	free(keys);
	for (int i = 0; i < KEYS; i++)
		assert_int_equal(key_table_find(table, secrets[i], 0)->owner.client, i + 1);
	for (int i = 0; i < KEYS; i++) {
		secret_make(secret);
		assert_null(key_table_find(table, secret, 0));
	}
	assert_null(key_table_find(table, "", 0));
	key_table_free(table);
}

static void a_key_is_good_until_it_expires(void **state)
{
	(void)state;
	const struct access_key keys[] = {key_of("for ever", 1, 0), key_of("a while", 2, 1000)};
	struct key_table *table = key_table_new(keys, 2);
	assert_non_null(key_table_find(table, "a while", 999));
	assert_null(key_table_find(table, "a while", 1000));
	assert_non_null(key_table_find(table, "for ever", INT64_MAX));
	key_table_free(table);
}

static void a_table_without_keys_lets_nobody_in(void **state)
{
	(void)state;
	struct key_table *table = key_table_new(NULL, 0);
	assert_null(key_table_find(table, "anything", 0));
	key_table_free(table);
}

/* --- counting requests ------------------------------------------------------------------------------------------ */

static bool take(struct meter *meter, const struct access_key *key, int64_t now_ms, unsigned *retry_s)
{
	struct tw_error error = {0};
	enum tw_status status = meter_take(meter, key, now_ms, retry_s, &error);
	assert_true(status == TW_OK || status == TW_ERROR_LIMIT);
	return status == TW_OK;
}

/* Against a model that keeps the time of every request that was let through: in no window of a period are there more
 * than twice the limit (what was saved up, and what came since), and over long times as many as the limit says. */
static void a_limit_holds_over_every_window_and_wastes_nothing(void **state)
{
	enum { STEPS = 60000, LIMIT = 7 };
	struct meter *meter = meter_new();
	struct access_key key = key_of("x", 5, 0);
	int64_t *let_through = calloc(STEPS, sizeof *let_through);
	size_t count = 0;
	unsigned retry_s;
	(void)state;
	key.limits.requests_per_s = LIMIT;
	for (int64_t now = 1; now <= STEPS; now++)
		if (take(meter, &key, now, &retry_s))
			let_through[count++] = now;
	for (size_t i = 0, first = 0; i < count; i++) {
		while (let_through[first] <= let_through[i] - 1000)
			first++;
		assert_true(i - first < 2 * LIMIT);
	}
	assert_in_range(count, STEPS / 1000 * LIMIT, STEPS / 1000 * LIMIT + LIMIT);
	free(let_through);
	meter_free(meter);
}

static void who_waits_as_long_as_he_is_told_is_let_through(void **state)
{
	struct meter *meter = meter_new();
	struct access_key key = key_of("x", 5, 0);
	int64_t now = 1000;
	unsigned retry_s = 0, refusals = 0;
	(void)state;
	key.limits.requests_per_s = 3;
	key.limits.requests_per_min = 10;
	for (int i = 0; i < 200; i++) {
		while (take(meter, &key, now, &retry_s))
			;
		assert_in_range(retry_s, 1, 60);
		refusals++;
		now += 1000 * (int64_t)retry_s;
		assert_true(take(meter, &key, now, &retry_s));
	}
	assert_int_equal(refusals, 200);
	meter_free(meter);
}

static void keys_do_not_use_up_each_others_limits(void **state)
{
	struct meter *meter = meter_new();
	unsigned retry_s;
	(void)state;
	for (int64_t client = 1; client <= 1000; client++) {
		struct access_key key = key_of("x", client, 0);
		key.limits.requests_per_min = 2;
		assert_true(take(meter, &key, 5, &retry_s));
		assert_true(take(meter, &key, 5, &retry_s));
		assert_false(take(meter, &key, 5, &retry_s));
	}
	struct access_key unlimited = key_of("y", 5000, 0);
	for (int i = 0; i < 100000; i++)
		assert_true(take(meter, &unlimited, 5, &retry_s));
	meter_free(meter);
}

static void uses_are_told_once_and_refused_requests_among_them(void **state)
{
	struct meter *meter = meter_new();
	struct access_use *uses = NULL;
	size_t count = 0;
	unsigned retry_s;
	(void)state;
	struct access_key of_store = key_of("x", 7, 0), of_file = key_of("y", -7, 0);
	of_store.limits.requests_per_s = 1;
	for (int i = 0; i < 3; i++) {
		(void)take(meter, &of_store, 100, &retry_s);
		assert_true(take(meter, &of_file, 100, &retry_s));
	}
	assert_int_equal(meter_drain(meter, 150, 1000150, &uses, &count, NULL), TW_OK);
	assert_int_equal(count, 1);
	assert_int_equal(uses[0].client, 7);
	assert_int_equal(uses[0].requests, 3);
	assert_int_equal(uses[0].last_ms, 1000100);
	free(uses);
	assert_int_equal(meter_drain(meter, 150, 1000150, &uses, &count, NULL), TW_OK);
	assert_int_equal(count, 0);
	free(uses);
	/* To be told is not to be forgiven. */
	assert_false(take(meter, &of_store, 160, &retry_s));
	meter_free(meter);
}

/* --- guesses ---------------------------------------------------------------------------------------------------- */

static void guesses_are_answered_later_and_later_and_forgiven(void **state)
{
	struct wrong_keys *wrong = wrong_keys_new();
	struct wrong_key_verdict last = {0}, now = {0};
	(void)state;
	for (int i = 0; i < 5; i++)
		assert_int_equal(wrong_keys_add(wrong, 1, 1000).pause_ms, 0);
	for (int i = 5; i < 100; i++) {
		now = wrong_keys_add(wrong, 1, 1000);
		assert_true(now.pause_ms >= last.pause_ms && now.pause_ms > 0 && now.pause_ms <= 2000);
		assert_true(now.retry_s >= 1 && now.retry_s >= last.retry_s);
		last = now;
	}
	assert_true(last.too_many);
	/* Nobody else pays. */
	assert_int_equal(wrong_keys_add(wrong, 2, 1000).pause_ms, 0);
	/* Who waits as long as he is told is not told the same again. */
	assert_false(wrong_keys_add(wrong, 1, 1000 + 1000 * (int64_t)last.retry_s).too_many);
	assert_int_equal(wrong_keys_add(wrong, 1, 1000 + 400000).pause_ms, 0);
	assert_int_equal(wrong_keys_count(wrong), 103);
	wrong_keys_free(wrong);
}

/* A million addresses cannot wash away what the persistent one has done. */
static void a_crowd_does_not_make_a_guesser_forgotten(void **state)
{
	struct wrong_keys *wrong = wrong_keys_new();
	(void)state;
	for (int i = 0; i < 30; i++)
		wrong_keys_add(wrong, 1, 1000);
	for (uint64_t address = 2; address < 1000000; address++)
		wrong_keys_add(wrong, address, 1000);
	assert_true(wrong_keys_add(wrong, 1, 1000).too_many);
	wrong_keys_free(wrong);
}

/* --- numbers ---------------------------------------------------------------------------------------------------- */

static void a_veiled_number_comes_back_and_only_under_its_own_veil(void **state)
{
	uint8_t own[ACCESS_VEIL_SIZE], other[ACCESS_VEIL_SIZE];
	char text[VEIL_TEXT_SIZE], next[VEIL_TEXT_SIZE];
	int64_t number, wrong = 0;
	(void)state;
	randombytes_buf(own, sizeof own);
	randombytes_buf(other, sizeof other);
	for (int64_t i = 1; i < 100000; i += 1 + i / 3) {
		veil_print(own, i, text);
		veil_print(own, i + 1, next);
		assert_true(veil_parse(own, text, &number));
		assert_int_equal(number, i);
		assert_string_not_equal(text, next);
		wrong += veil_parse(other, text, &number) && number == i;
	}
	assert_int_equal(wrong, 0);
	veil_print(own, (INT64_C(1) << 53) - 1, text);
	assert_true(veil_parse(own, text, &number));
	assert_int_equal(number, (INT64_C(1) << 53) - 1);
}

static void what_is_no_veiled_number_is_refused(void **state)
{
	static const char *const wrong[] = {"",
					    "0",
					    "17",
					    "0123456789abcde",
					    "0123456789abcdef0",
					    "0123456789abcdeg",
					    "0123456789ABCDEF",
					    " 123456789abcdef",
					    "-123456789abcdef"};
	uint8_t veil[ACCESS_VEIL_SIZE] = {1};
	char text[VEIL_TEXT_SIZE];
	int64_t number;
	int passed = 0;
	(void)state;
	for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
		assert_false(veil_parse(veil, wrong[i], &number));
	for (uint32_t i = 0; i < 20000; i++) {
		snprintf(text, sizeof text, "%08x%08x", randombytes_random(), randombytes_random());
		passed += veil_parse(veil, text, &number);
	}
	assert_in_range(passed, 0, 60); /* one in 2048: about ten */
}

/* --- the file --------------------------------------------------------------------------------------------------- */

static void write_file(const char *path, const char *text, mode_t mode)
{
	FILE *file = fopen(path, "w");
	assert_non_null(file);
	fputs(text, file);
	fclose(file);
	assert_int_equal(chmod(path, mode), 0);
}

#define HASH "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"

static void the_key_file_is_read_line_by_line(void **state)
{
	char path[] = "/tmp/tightwire-keys-XXXXXX";
	struct access_key *keys = NULL, *again = NULL;
	struct tw_error error = {0};
	size_t count = 0;
	(void)state;
	close(mkstemp(path));
	write_file(path, "# ours\n\nmes " HASH "\n  studio\t" HASH "  \r\n", 0640);
	assert_int_equal(key_file_read(path, &keys, &count, &error), TW_OK);
	assert_int_equal(count, 2);
	assert_string_equal(keys[1].name, "studio");
	assert_int_equal(keys[0].hash[1], 0x23);
	assert_int_equal(keys[0].scopes, KEY_SCOPES_ALL);
	assert_true(keys[0].owner.client < 0 && keys[1].owner.client < 0);
	assert_int_not_equal(keys[0].owner.client, keys[1].owner.client);
	/* The same names are the same clients, wherever they stand. */
	write_file(path, "studio " HASH "\n", 0600);
	assert_int_equal(key_file_read(path, &again, &count, &error), TW_OK);
	assert_int_equal(again[0].owner.client, keys[1].owner.client);
	free(keys);
	free(again);
	static const char *const wrong[] = {"mes\n", "mes abc\n", "mes " HASH "0\n", "ok " HASH "\nmes xyz\n",
					    "# none\n"};
	for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
		write_file(path, wrong[i], 0600);
		assert_int_equal(key_file_read(path, &keys, &count, &error), TW_ERROR_INPUT);
		assert_string_equal(error.type, "key-file");
		assert_null(keys);
	}
	write_file(path, "mes " HASH "\n", 0604);
	assert_int_equal(key_file_read(path, &keys, &count, &error), TW_ERROR_INPUT);
	assert_string_equal(error.type, "key-file-open");
	assert_non_null(strstr(error.text, "chmod o= /tmp/tightwire-keys-"));
	unlink(path);
	assert_int_equal(key_file_read(path, &keys, &count, &error), TW_ERROR_IO);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(each_key_is_found_by_its_secret_and_by_no_other),
		cmocka_unit_test(a_key_is_good_until_it_expires),
		cmocka_unit_test(a_table_without_keys_lets_nobody_in),
		cmocka_unit_test(a_limit_holds_over_every_window_and_wastes_nothing),
		cmocka_unit_test(who_waits_as_long_as_he_is_told_is_let_through),
		cmocka_unit_test(keys_do_not_use_up_each_others_limits),
		cmocka_unit_test(uses_are_told_once_and_refused_requests_among_them),
		cmocka_unit_test(guesses_are_answered_later_and_later_and_forgiven),
		cmocka_unit_test(a_crowd_does_not_make_a_guesser_forgotten),
		cmocka_unit_test(a_veiled_number_comes_back_and_only_under_its_own_veil),
		cmocka_unit_test(what_is_no_veiled_number_is_refused),
		cmocka_unit_test(the_key_file_is_read_line_by_line),
	};
	return sodium_init() < 0 ? 1 : cmocka_run_group_tests(tests, NULL, NULL);
}
