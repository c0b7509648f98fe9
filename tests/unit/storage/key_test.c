/* API keys: told once, kept as hashes, rotated with an overlap, revoked; their limits, and what they store. */
#include "storage/access.h"
#include "storage/key.h"
#include "storage/recording.h"
#include "tests/unit/storage/fixture.h"

#include <sodium.h>

static struct key_draft usual(const char *name)
{
	return (struct key_draft){.tenant = TENANT_DEFAULT, .name = name, .scopes = KEY_READ | KEY_SUBMIT};
}

static struct key make(struct fixture *f, const struct key_draft *draft, char secret[SECRET_SIZE])
{
	struct key key = {0};
	ok(f, key_create(f->store, draft, &key, secret, &f->error));
	return key;
}

/* Whether a daemon that reads now would let the secret in, now. */
static bool lets_in(struct fixture *f, const char *secret)
{
	struct access access;
	uint8_t hash[SECRET_HASH_SIZE];
	bool found = false;
	crypto_generichash(hash, sizeof hash, (const uint8_t *)secret, strlen(secret), NULL, 0);
	ok(f, access_read(f->store, &access, &f->error));
	for (size_t i = 0; i < access.count; i++)
		found |= !memcmp(access.keys[i].hash, hash, sizeof hash) &&
			 (!access.keys[i].until_ms || access.keys[i].until_ms > f->now_ms);
	access_clear(&access);
	return found;
}

static void a_secret_has_a_prefix_and_a_checksum_over_all_of_it(void **state)
{
	char secret[SECRET_SIZE], other[SECRET_SIZE], damaged[SECRET_SIZE];
	(void)state;
	secret_make(secret);
	secret_make(other);
	assert_string_not_equal(secret, other);
	assert_int_equal(strlen(secret), 63);
	assert_memory_equal(secret, "twk_", 4);
	assert_int_equal(strspn(secret + 4, "0123456789abcdefghjkmnpqrstvwxyz"), 59);
	assert_false(secret_is_damaged(secret));
	assert_false(secret_is_damaged("of another form"));
	for (size_t i = 4; i < 63; i++) {
		memcpy(damaged, secret, sizeof damaged);
		damaged[i] = damaged[i] == '0' ? '1' : '0';
		assert_true(secret_is_damaged(damaged));
	}
	damaged[40] = '\0';
	assert_true(secret_is_damaged(damaged));
}

static void a_key_is_told_once_and_kept_as_a_hash(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE], command[256];
	const struct key_draft draft = usual("mes");
	struct key key = make(f, &draft, secret);
	assert_string_equal(key.name, "mes");
	assert_string_equal(key.tenant, "default");
	assert_true(lets_in(f, secret));
	assert_int_equal(sqlite3_exec(f->oracle, "PRAGMA wal_checkpoint(TRUNCATE)", NULL, NULL, NULL), SQLITE_OK);
	snprintf(command, sizeof command, "grep -qaF %s %s*", secret, f->path);
	assert_int_not_equal(system(command), 0);
}

static void drafts_that_make_no_key_are_refused(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE];
	struct key key;
	struct key_draft draft = usual("");
	refused(f, key_create(f->store, &draft, &key, secret, &f->error), TW_ERROR_INPUT, "key-name");
	draft.name = "two words";
	refused(f, key_create(f->store, &draft, &key, secret, &f->error), TW_ERROR_INPUT, "key-name");
	draft = usual("a");
	draft.scopes = 0;
	refused(f, key_create(f->store, &draft, &key, secret, &f->error), TW_ERROR_INPUT, "key-scope");
	draft.scopes = 16;
	refused(f, key_create(f->store, &draft, &key, secret, &f->error), TW_ERROR_INPUT, "key-scope");
	draft = usual("a");
	draft.expires_ms = f->now_ms;
	refused(f, key_create(f->store, &draft, &key, secret, &f->error), TW_ERROR_INPUT, "key-expiry");
	draft = usual("a");
	draft.limits.queued_jobs = -1;
	refused(f, key_create(f->store, &draft, &key, secret, &f->error), TW_ERROR_INPUT, "key-limit");
	draft = usual("a");
	draft.weight = JOB_WEIGHT_MAX + 1;
	refused(f, key_create(f->store, &draft, &key, secret, &f->error), TW_ERROR_INPUT, "key-weight");
	draft = usual("a");
	draft.tenant = 77;
	refused(f, key_create(f->store, &draft, &key, secret, &f->error), TW_ERROR_NOT_FOUND, "no-such-tenant");
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM api_key"), 0);
	assert_int_equal(fixture_ask(f, "SELECT keys_needed FROM access"), 0);
}

static void scopes_are_words_in_one_order(void **state)
{
	struct fixture *f = *state;
	unsigned scopes = 0;
	char text[KEY_SCOPES_SIZE];
	ok(f, key_parse_scopes("admin,read", &scopes, &f->error));
	key_print_scopes(scopes, text);
	assert_string_equal(text, "read,admin");
	key_print_scopes(KEY_SCOPES_ALL, text);
	assert_string_equal(text, "read,submit,rig,admin");
	refused(f, key_parse_scopes("read,write", &scopes, &f->error), TW_ERROR_INPUT, "key-scope");
	assert_non_null(strstr(f->error.text, "\"write\""));
	refused(f, key_parse_scopes("", &scopes, &f->error), TW_ERROR_INPUT, "key-scope");
}

static void a_name_is_taken_until_its_key_is_revoked(void **state)
{
	struct fixture *f = *state;
	char first_secret[SECRET_SIZE], secret[SECRET_SIZE];
	int64_t mill = 0;
	struct key_draft draft = usual("mes");
	struct key first = make(f, &draft, first_secret), key;
	refused(f, key_create(f->store, &draft, &key, secret, &f->error), TW_ERROR_CONFLICT, "key-exists");
	ok(f, tenant_create(f->store, "mill", &mill, &f->error));
	draft.tenant = mill;
	make(f, &draft, secret); /* another tenant's names are its own */
	draft.tenant = TENANT_DEFAULT;
	ok(f, key_revoke(f->store, TENANT_DEFAULT, first.id, &key, &f->error));
	assert_int_equal(key.revoked_ms, f->now_ms);
	ok(f, key_revoke(f->store, TENANT_DEFAULT, first.id, &key, &f->error));
	make(f, &draft, secret);
	assert_true(lets_in(f, secret));
	assert_false(lets_in(f, first_secret));
	refused(f, key_rotate(f->store, TENANT_DEFAULT, first.id, 0, &key, secret, &f->error), TW_ERROR_CONFLICT,
		"key-revoked");
}

static void a_rotated_key_has_two_secrets_for_the_overlap_and_never_three(void **state)
{
	struct fixture *f = *state;
	char secrets[3][SECRET_SIZE];
	const struct key_draft draft = usual("mes");
	struct key key = make(f, &draft, secrets[0]), rotated;
	const int64_t beyond[] = {-1, 1000 * (int64_t)KEY_OVERLAP_MAX_S + 1, INT64_MAX};
	for (unsigned i = 0; i < 3; i++)
		refused(f, key_rotate(f->store, TENANT_DEFAULT, key.id, beyond[i], &rotated, secrets[1], &f->error),
			TW_ERROR_INPUT, "key-overlap");
	ok(f, key_rotate(f->store, TENANT_DEFAULT, key.id, 1000, &rotated, secrets[1], &f->error));
	assert_int_equal(rotated.number, key.number);
	assert_int_equal(rotated.overlap_until_ms, f->now_ms + 1000);
	assert_true(lets_in(f, secrets[0]) && lets_in(f, secrets[1]));
	ok(f, key_rotate(f->store, TENANT_DEFAULT, key.id, 1000, &rotated, secrets[2], &f->error));
	assert_false(lets_in(f, secrets[0]));
	assert_true(lets_in(f, secrets[1]) && lets_in(f, secrets[2]));
	f->now_ms += 1000;
	assert_false(lets_in(f, secrets[1]));
	assert_true(lets_in(f, secrets[2]));
	ok(f, key_rotate(f->store, TENANT_DEFAULT, key.id, 0, &rotated, secrets[0], &f->error));
	assert_false(lets_in(f, secrets[2]));
	assert_int_equal(rotated.overlap_until_ms, 0);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM api_key_secret"), 1);
}

static void an_expired_key_lets_nobody_in(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE];
	struct key_draft draft = usual("guest");
	draft.expires_ms = f->now_ms + 10;
	make(f, &draft, secret);
	assert_true(lets_in(f, secret));
	f->now_ms += 10;
	assert_false(lets_in(f, secret));
}

static void daemons_are_told_of_every_change(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE];
	int64_t changes[4];
	const struct key_draft draft = usual("mes");
	ok(f, access_change(f->store, &changes[0], &f->error));
	struct key key = make(f, &draft, secret);
	ok(f, access_change(f->store, &changes[1], &f->error));
	ok(f, key_rotate(f->store, TENANT_DEFAULT, key.id, 0, &key, secret, &f->error));
	ok(f, access_change(f->store, &changes[2], &f->error));
	ok(f, key_revoke(f->store, TENANT_DEFAULT, key.id, &key, &f->error));
	ok(f, access_change(f->store, &changes[3], &f->error));
	for (int i = 1; i < 4; i++)
		assert_true(changes[i] > changes[i - 1]);
	struct access access;
	ok(f, access_read(f->store, &access, &f->error));
	assert_int_equal(access.change, changes[3]);
	assert_true(access.keys_needed); /* though there is none any more */
	assert_int_equal(access.default_tenant, TENANT_DEFAULT);
	assert_int_equal(access.count, 0);
	access_clear(&access);
}

static void keys_list_by_tenant_in_pages(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE], name[16];
	int64_t mill = 0, cursor = 0;
	size_t seen = 0;
	ok(f, tenant_create(f->store, "mill", &mill, &f->error));
	for (int i = 0; i < 14; i++) {
		snprintf(name, sizeof name, "key-%d", i);
		struct key_draft draft = usual(name);
		draft.tenant = i % 2 ? mill : TENANT_DEFAULT;
		make(f, &draft, secret);
	}
	do {
		struct key_page page;
		ok(f, key_list(f->store, mill, cursor, 3, &page, &f->error));
		for (size_t i = 0; i < page.count; i++) {
			snprintf(name, sizeof name, "key-%zu", 2 * seen++ + 1);
			assert_string_equal(page.keys[i].name, name);
			assert_string_equal(page.keys[i].tenant, "mill");
		}
		cursor = page.next;
		key_page_clear(&page);
	} while (cursor);
	assert_int_equal(seen, 7);
}

static void another_tenants_key_is_not_there(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE];
	int64_t mill = 0;
	ok(f, tenant_create(f->store, "mill", &mill, &f->error));
	const struct key_draft draft = usual("mes");
	struct key key = make(f, &draft, secret), other;
	refused(f, key_get(f->store, mill, key.id, &other, &f->error), TW_ERROR_NOT_FOUND, "no-such-key");
	refused(f, key_find(f->store, mill, "mes", &other, &f->error), TW_ERROR_NOT_FOUND, "no-such-key");
	refused(f, key_revoke(f->store, mill, key.id, &other, &f->error), TW_ERROR_NOT_FOUND, "no-such-key");
	refused(f, key_rotate(f->store, mill, key.id, 0, &other, secret, &f->error), TW_ERROR_NOT_FOUND, "no-such-key");
	refused(f, key_get(f->store, 0, key.id, &other, &f->error), TW_ERROR_NOT_FOUND, "no-such-key");
	ok(f, key_get(f->store, TENANT_ANY, key.id, &other, &f->error));
}

static void use_is_added_up(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE];
	const struct key_draft draft = usual("mes");
	struct key key = make(f, &draft, secret);
	const struct access_use first[] = {{key.number, 3, 500}, {-77, 1, 500}}, second[] = {{key.number, 4, 400}};
	ok(f, access_add_uses(f->store, first, 2, &f->error));
	ok(f, access_add_uses(f->store, second, 1, &f->error));
	ok(f, key_get(f->store, TENANT_DEFAULT, key.id, &key, &f->error));
	assert_int_equal(key.requests, 7);
	assert_int_equal(key.last_used_ms, 500);
}

/* --- limits and what is stored ---------------------------------------------------------------------------------- */

/* What the key's row says, and what a recount of all that it has says. */
static void counts_are_right(struct fixture *f)
{
	assert_int_equal(
		fixture_ask(f, "SELECT stored_bytes FROM api_key_usage"),
		fixture_ask(f, "SELECT (SELECT coalesce(sum(size), 0) FROM blob WHERE client > 0)"
			       " + (SELECT coalesce(sum(length(CAST(options AS BLOB))"
			       " + coalesce(length(CAST(summary AS BLOB)), 0)), 0) FROM resource WHERE client > 0)"
			       " + (SELECT coalesce(sum(length(samples)), 0) FROM recording_chunk c"
			       " JOIN resource r ON r.number = c.resource WHERE r.client > 0)"));
}

static void upload_of(struct fixture *f, struct owner owner, size_t size, char id[STORE_ID_SIZE])
{
	struct upload *upload = NULL;
	char *bytes = calloc(1, size);
	ok(f, upload_begin(&upload, f->store, owner, "worn", "a.obj", "", 1u << 30, &f->error));
	ok(f, upload_write(upload, bytes, size, &f->error));
	ok(f, upload_seal(upload, &f->error));
	snprintf(id, STORE_ID_SIZE, "%s", upload_id(upload));
	upload_free(upload);
	free(bytes);
}

static void what_a_key_stores_is_counted_until_it_is_gone(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE], id[STORE_ID_SIZE];
	const char *uploads[] = {id};
	const struct key_draft keyed = usual("mes");
	struct key key = make(f, &keyed, secret);
	const struct owner owner = {TENANT_DEFAULT, key.number};
	struct resource_draft draft = {.owner = owner,
				       .kind = RESOURCE_MESH,
				       .options = "{\"unit\":\"cm\"}",
				       .uploads = uploads,
				       .upload_count = 1};
	struct resource mesh;
	enum resource_outcome outcome;
	upload_of(f, owner, (2u << 20) + 5, id);
	counts_are_right(f);
	ok(f, key_get(f->store, TENANT_DEFAULT, key.id, &key, &f->error));
	assert_int_equal(key.stored_bytes, (2 << 20) + 5);
	ok(f, resource_create(f->store, &draft, &mesh, &outcome, &f->error));
	counts_are_right(f);
	struct job_ticket ticket = fixture_claim(f);
	const struct tw_array array = {"position", TW_F64, 3, 2, (double[6]){0}};
	const struct job_artifact artifact = {"a.svg", "image/svg+xml", "<svg/>", 6};
	const struct job_result result = {.summary = "{\"vertices\":2}",
					  .arrays = &array,
					  .array_count = 1,
					  .artifacts = &artifact,
					  .artifact_count = 1};
	ok(f, job_finish(f->store, &ticket, &result, &f->error));
	counts_are_right(f);
	ok(f, key_get(f->store, TENANT_DEFAULT, key.id, &key, &f->error));
	assert_int_equal(key.stored_bytes, (2 << 20) + 5 + 13 + 14 + 48 + 6);
	/* Equal content again costs nothing: its upload is dropped. */
	upload_of(f, owner, (2u << 20) + 5, id);
	struct resource again;
	ok(f, resource_create(f->store, &draft, &again, &outcome, &f->error));
	assert_int_equal(outcome, RESOURCE_EXISTED);
	resource_clear(&again);
	ok(f, key_get(f->store, TENANT_DEFAULT, key.id, &key, &f->error));
	assert_int_equal(key.stored_bytes, (2 << 20) + 5 + 13 + 14 + 48 + 6);
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_MESH, mesh.id, false, &f->error));
	resource_clear(&mesh);
	ok(f, key_get(f->store, TENANT_DEFAULT, key.id, &key, &f->error));
	assert_int_equal(key.stored_bytes, 0);
	fixture_sweep(f, 0);
	counts_are_right(f);
}

static void samples_of_a_recording_are_counted(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE];
	const struct key_draft keyed = usual("rig");
	struct key key = make(f, &keyed, secret);
	const struct resource_draft draft = {.owner = {TENANT_DEFAULT, key.number}, .kind = RESOURCE_RECORDING};
	struct recording_course course = {
		.boot = "b", .rate_hz = 50, .first_slot = 1, .slot_count = 500, .last_slot = 0};
	struct rig_sample samples[10] = {{.at_us = 1}};
	struct resource recording;
	enum resource_outcome outcome;
	bool resumed = false, cancel = false;
	for (int64_t i = 0; i < 10; i++)
		samples[i].at_us = i + 1;
	for (int round = 0; round < 2; round++) {
		ok(f, resource_create(f->store, &draft, &recording, &outcome, &f->error));
		struct job_ticket ticket = fixture_claim(f);
		ok(f, recording_begin(f->store, &ticket, &course, &resumed, &f->error));
		ok(f, recording_append(f->store, &ticket, samples, 10, &course, 0.1, &cancel, &f->error));
		counts_are_right(f);
		ok(f, key_get(f->store, TENANT_DEFAULT, key.id, &key, &f->error));
		assert_true(key.stored_bytes >= 10 * (8 + 2 * RIG_CHANNELS));
		if (round) { /* its samples go when it is made again */
			const struct tw_error failure = {TW_ERROR_IO, "rig", "", "gone"};
			ok(f, job_fail(f->store, &ticket, &failure, false, &f->error));
			ok(f, job_redrive(f->store, TENANT_DEFAULT, recording.job.id, &f->error));
			counts_are_right(f);
		}
		ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_RECORDING, recording.id, false, &f->error));
		ok(f, key_get(f->store, TENANT_DEFAULT, key.id, &key, &f->error));
		assert_int_equal(key.stored_bytes, 0);
		resource_clear(&recording);
	}
}

static void an_upload_beyond_the_limit_of_stored_bytes_is_refused(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE], id[STORE_ID_SIZE];
	struct upload *upload = NULL;
	struct key_draft draft = usual("mes");
	draft.limits.stored_bytes = 100;
	struct key key = make(f, &draft, secret);
	const struct owner owner = {TENANT_DEFAULT, key.number};
	upload_of(f, owner, 100, id);
	refused(f, upload_begin(&upload, f->store, owner, "worn", "", "", 1u << 20, &f->error), TW_ERROR_LIMIT,
		"limit-stored-bytes");
	ok(f, upload_discard(f->store, TENANT_DEFAULT, id, &f->error));
	ok(f, upload_begin(&upload, f->store, owner, "worn", "", "", 1u << 20, &f->error));
	char bytes[101] = {0};
	ok(f, upload_write(upload, bytes, sizeof bytes, &f->error));
	refused(f, upload_seal(upload, &f->error), TW_ERROR_LIMIT, "limit-stored-bytes");
	upload_free(upload);
	upload_of(f, OWNER_DEFAULT, 200, id); /* nobody else is held to it */
}

static void queued_jobs_are_limited_and_those_that_run_are_not(void **state)
{
	struct fixture *f = *state;
	char secret[SECRET_SIZE];
	struct key_draft keyed = usual("batch");
	keyed.limits.queued_jobs = 2;
	struct key key = make(f, &keyed, secret);
	struct resource_draft draft = {.owner = {TENANT_DEFAULT, key.number}, .kind = RESOURCE_LAYOUT};
	struct resource layout;
	enum resource_outcome outcome;
	for (int i = 0; i < 2; i++) {
		ok(f, resource_create(f->store, &draft, &layout, &outcome, &f->error));
		resource_clear(&layout);
	}
	refused(f, resource_create(f->store, &draft, &layout, &outcome, &f->error), TW_ERROR_LIMIT,
		"limit-queued-jobs");
	struct job_ticket ticket = fixture_claim(f);
	ok(f, resource_create(f->store, &draft, &layout, &outcome, &f->error));
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_LAYOUT, layout.id, false, &f->error));
	resource_clear(&layout);
	ok(f, resource_create(f->store, &draft, &layout, &outcome, &f->error));
	enum job_state after;
	ok(f, job_cancel(f->store, TENANT_DEFAULT, layout.job.id, &after, &f->error));
	resource_clear(&layout);
	ok(f, job_release(f->store, &ticket, &f->error)); /* back in the queue: nobody is asked */
	refused(f, resource_create(f->store, &draft, &layout, &outcome, &f->error), TW_ERROR_LIMIT,
		"limit-queued-jobs");
	ok(f, key_get(f->store, TENANT_DEFAULT, key.id, &key, &f->error));
	assert_int_equal(key.queued_jobs, fixture_ask(f, "SELECT count(*) FROM job WHERE client > 0 AND state = 0"));
	draft.owner.client = 0;
	ok(f, resource_create(f->store, &draft, &layout, &outcome, &f->error));
	resource_clear(&layout);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(a_secret_has_a_prefix_and_a_checksum_over_all_of_it),
		TEST(a_key_is_told_once_and_kept_as_a_hash),
		TEST(drafts_that_make_no_key_are_refused),
		TEST(scopes_are_words_in_one_order),
		TEST(a_name_is_taken_until_its_key_is_revoked),
		TEST(a_rotated_key_has_two_secrets_for_the_overlap_and_never_three),
		TEST(an_expired_key_lets_nobody_in),
		TEST(daemons_are_told_of_every_change),
		TEST(keys_list_by_tenant_in_pages),
		TEST(another_tenants_key_is_not_there),
		TEST(use_is_added_up),
		TEST(what_a_key_stores_is_counted_until_it_is_gone),
		TEST(samples_of_a_recording_are_counted),
		TEST(an_upload_beyond_the_limit_of_stored_bytes_is_refused),
		TEST(queued_jobs_are_limited_and_those_that_run_are_not),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
