/* Uploads and blobs: what goes in comes out, in any pieces. */
#include "tests/unit/storage/fixture.h"

#include <sys/stat.h>

/* Bytes that do not repeat with any chunk. */
static unsigned char *noise(size_t size)
{
	unsigned char *bytes = malloc(size + 1);
	uint64_t x = 88172645463325252u;
	for (size_t i = 0; i < size; i++) {
		x ^= x << 13;
		x ^= x >> 7;
		x ^= x << 17;
		bytes[i] = (unsigned char)x;
	}
	return bytes;
}

static struct upload *begin(struct fixture *f, uint64_t limit)
{
	struct upload *upload = NULL;
	ok(f, upload_begin(&upload, f->store, OWNER_DEFAULT, "motion", "walk.pc2", "", limit, &f->error));
	return upload;
}

/* A motion that owns the upload, so that its bytes can be read. */
static void own(struct fixture *f, const char *upload, char id[STORE_ID_SIZE])
{
	const char *uploads[] = {upload};
	struct resource_draft draft = {
		.owner = OWNER_DEFAULT, .kind = RESOURCE_MOTION, .uploads = uploads, .upload_count = 1};
	struct resource resource;
	enum resource_outcome outcome;
	ok(f, resource_create(f->store, &draft, &resource, &outcome, &f->error));
	snprintf(id, STORE_ID_SIZE, "%s", resource.id);
	resource_clear(&resource);
}

static void an_upload_comes_back_byte_for_byte(void **state)
{
	struct fixture *f = *state;
	static const size_t sizes[] = {
		1, BLOB_CHUNK - 1, BLOB_CHUNK, BLOB_CHUNK + 1, 3 * BLOB_CHUNK, 3 * BLOB_CHUNK + 12345};
	static const size_t steps[] = {1000003, 77777, BLOB_CHUNK, 4096, 5 * BLOB_CHUNK, 333};
	for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
		unsigned char *bytes = noise(sizes[k]);
		unsigned char *back = malloc(sizes[k] + 10);
		char id[STORE_ID_SIZE];
		struct blob blob;
		size_t got;
		struct upload *upload = begin(f, UINT64_MAX);
		for (size_t at = 0; at < sizes[k]; at += steps[k])
			ok(f, upload_write(upload, bytes + at, sizes[k] - at < steps[k] ? sizes[k] - at : steps[k],
					   &f->error));
		ok(f, upload_seal(upload, &f->error));
		assert_int_equal(upload_size(upload), sizes[k]);
		own(f, upload_id(upload), id);
		upload_free(upload);
		ok(f, blob_find(f->store, id, BLOB_UPLOAD, "motion", &blob, &f->error));
		assert_int_equal(blob.size, sizes[k]);
		assert_string_equal(blob.file_name, "walk.pc2");
		ok(f, blob_read(f->store, blob.number, 0, back, sizes[k] + 10, &got, &f->error));
		assert_int_equal(got, sizes[k]);
		assert_memory_equal(back, bytes, got);
		size_t middle = sizes[k] / 2;
		size_t part = sizes[k] / 3;
		ok(f, blob_read(f->store, blob.number, middle, back, part, &got, &f->error));
		assert_int_equal(got, part);
		assert_memory_equal(back, bytes + middle, got);
		ok(f, blob_read(f->store, blob.number, sizes[k], back, 1, &got, &f->error));
		assert_int_equal(got, 0);
		ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_MOTION, id, false, &f->error));
		assert_int_equal(blob_read(f->store, blob.number, 0, back, 1, &got, &f->error), TW_ERROR_NOT_FOUND);
		free(bytes);
		free(back);
	}
	fixture_sweep(f, 0);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM chunk"), 0);
	fixture_is_sound(f);
}

/* coreutils computes the same hash and shares no code with libsodium. */
static void the_hash_is_that_of_b2sum(void **state)
{
	struct fixture *f = *state;
	size_t size = 2 * BLOB_CHUNK + 99;
	unsigned char *bytes = noise(size);
	char path[160], command[256], expected[65] = "", found[65], id[STORE_ID_SIZE];
	struct blob blob;
	snprintf(path, sizeof path, "%s/bytes", f->directory);
	FILE *file = fopen(path, "wb");
	assert_int_equal(fwrite(bytes, 1, size, file), size);
	fclose(file);
	snprintf(command, sizeof command, "b2sum -l 256 %s 2>/dev/null", path);
	FILE *sum = popen(command, "r");
	bool have_tool = fscanf(sum, "%64s", expected) == 1 && strlen(expected) == 64;
	pclose(sum);
	struct upload *upload = begin(f, size);
	ok(f, upload_write(upload, bytes, size, &f->error));
	ok(f, upload_seal(upload, &f->error));
	own(f, upload_id(upload), id);
	upload_free(upload);
	free(bytes);
	ok(f, blob_find(f->store, id, BLOB_UPLOAD, "motion", &blob, &f->error));
	for (int i = 0; i < CONTENT_HASH_SIZE; i++)
		snprintf(found + 2 * i, 3, "%02x", blob.hash.bytes[i]);
	if (!have_tool)
		skip();
	assert_string_equal(found, expected);
}

/* The writer died in the middle; another takes it up where the store says. */
static void a_resumed_upload_is_the_same_upload(void **state)
{
	struct fixture *f = *state;
	size_t size = 2 * BLOB_CHUNK + 500;
	unsigned char *bytes = noise(size);
	char whole[STORE_ID_SIZE], parts[STORE_ID_SIZE], id[STORE_ID_SIZE];
	uint64_t offset = 0;
	struct upload *upload = begin(f, size);
	ok(f, upload_write(upload, bytes, size, &f->error));
	ok(f, upload_seal(upload, &f->error));
	own(f, upload_id(upload), whole);
	upload_free(upload);

	upload = begin(f, size);
	snprintf(id, sizeof id, "%s", upload_id(upload));
	ok(f, upload_write(upload, bytes, BLOB_CHUNK + 7000, &f->error));
	upload_free(upload);
	ok(f, upload_resume(&upload, f->store, TENANT_DEFAULT, id, size, &offset, &f->error));
	assert_int_equal(offset, BLOB_CHUNK);
	ok(f, upload_write(upload, bytes + offset, size - offset, &f->error));
	ok(f, upload_seal(upload, &f->error));
	upload_free(upload);
	own(f, id, parts);
	assert_string_equal(parts, whole);
	/* Once more as if another version of libsodium had kept the hash: then it is made again from what is stored. */
	ok(f, resource_delete(f->store, TENANT_DEFAULT, RESOURCE_MOTION, whole, false, &f->error));
	upload = begin(f, size);
	snprintf(id, sizeof id, "%s", upload_id(upload));
	ok(f, upload_write(upload, bytes, BLOB_CHUNK, &f->error));
	upload_free(upload);
	assert_int_equal(
		sqlite3_exec(f->oracle, "UPDATE blob SET hash_state = zeroblob(length(hash_state))", NULL, NULL, NULL),
		SQLITE_OK);
	ok(f, upload_resume(&upload, f->store, TENANT_DEFAULT, id, size, &offset, &f->error));
	ok(f, upload_write(upload, bytes + offset, size - offset, &f->error));
	ok(f, upload_seal(upload, &f->error));
	upload_free(upload);
	own(f, id, parts);
	assert_string_equal(parts, whole);
	refused(f, upload_resume(&upload, f->store, TENANT_DEFAULT, "upload_none", size, &offset, &f->error),
		TW_ERROR_NOT_FOUND, "no-such-upload");
	free(bytes);
}

static void two_writers_of_one_upload_do_not_mix(void **state)
{
	struct fixture *f = *state;
	unsigned char *bytes = noise(BLOB_CHUNK);
	struct upload *first = begin(f, UINT64_MAX);
	struct upload *second = NULL;
	uint64_t offset;
	ok(f, upload_resume(&second, f->store, TENANT_DEFAULT, upload_id(first), UINT64_MAX, &offset, &f->error));
	ok(f, upload_write(first, bytes, BLOB_CHUNK, &f->error));
	refused(f, upload_write(second, bytes, BLOB_CHUNK, &f->error), TW_ERROR_CONFLICT, "upload-conflict");
	refused(f, upload_seal(second, &f->error), TW_ERROR_CONFLICT, "upload-broken");
	ok(f, upload_seal(first, &f->error));
	upload_free(first);
	upload_free(second);
	free(bytes);
	assert_int_equal(fixture_ask(f, "SELECT size FROM blob"), BLOB_CHUNK);
}

static void an_upload_beyond_its_limit_is_refused(void **state)
{
	struct fixture *f = *state;
	struct upload *upload = begin(f, 10);
	ok(f, upload_write(upload, "0123456789", 10, &f->error));
	refused(f, upload_write(upload, "x", 1, &f->error), TW_ERROR_LIMIT, "upload-too-large");
	upload_free(upload);
	upload = begin(f, 10);
	refused(f, upload_write(upload, "x", SIZE_MAX, &f->error), TW_ERROR_LIMIT, "upload-too-large");
	upload_free(upload);
	upload = begin(f, 10);
	refused(f, upload_seal(upload, &f->error), TW_ERROR_INPUT, "upload-empty");
	upload_free(upload);
}

static void a_long_name_is_cut_between_characters(void **state)
{
	struct fixture *f = *state;
	char name[300];
	for (size_t i = 0; i + 2 < sizeof name; i += 2)
		memcpy(name + i, "\xc3\xa4", 3);
	struct upload *upload = NULL;
	ok(f, upload_begin(&upload, f->store, OWNER_DEFAULT, "worn", name, NULL, 10, &f->error));
	upload_free(upload);
	assert_int_equal(fixture_ask(f, "SELECT length(CAST(file_name AS BLOB)) FROM blob"), 126);
}

static void the_sweep_takes_what_nobody_used(void **state)
{
	struct fixture *f = *state;
	char id[STORE_ID_SIZE], used[STORE_ID_SIZE];
	fixture_upload(f, "worn", "a.obj", "forgotten", id);
	fixture_create(f, RESOURCE_MESH, "used", NULL, NULL, used);
	f->now_ms += 5000;
	fixture_upload(f, "worn", "b.obj", "fresh", id);
	fixture_sweep(f, 5000);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob"), 3);
	f->now_ms += 1;
	fixture_sweep(f, 5000);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob"), 2);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM chunk"), 2);
	ok(f, upload_discard(f->store, TENANT_DEFAULT, id, &f->error));
	refused(f, upload_discard(f->store, TENANT_DEFAULT, id, &f->error), TW_ERROR_NOT_FOUND, "no-such-upload");
}

/* Nor does deleting write what it deletes: the log stays small. */
static void deleting_a_large_upload_writes_little(void **state)
{
	struct fixture *f = *state;
	unsigned char *bytes = noise(16 * BLOB_CHUNK);
	struct upload *upload = begin(f, UINT64_MAX);
	char log[160];
	struct stat after;
	ok(f, upload_write(upload, bytes, 16 * BLOB_CHUNK, &f->error));
	free(bytes);
	/* The store's own thread may be at it, and then this says "busy". */
	while (fixture_ask(f, "PRAGMA wal_checkpoint(TRUNCATE)"))
		usleep(1000);
	ok(f, upload_discard(f->store, TENANT_DEFAULT, upload_id(upload), &f->error));
	upload_free(upload);
	fixture_sweep(f, 0);
	snprintf(log, sizeof log, "%s-wal", f->path);
	assert_int_equal(stat(log, &after), 0);
	assert_true(after.st_size < 2 * BLOB_CHUNK);
}

/* So that others can write in between; and what is deleted is out of sight at once. */
static void a_large_upload_goes_in_small_steps(void **state)
{
	struct fixture *f = *state;
	unsigned char *bytes = noise(80 * BLOB_CHUNK);
	struct upload *upload = begin(f, UINT64_MAX);
	struct blob blob;
	bool sealed, more = true;
	int steps = 0;
	ok(f, upload_write(upload, bytes, 80 * BLOB_CHUNK, &f->error));
	free(bytes);
	ok(f, upload_discard(f->store, TENANT_DEFAULT, upload_id(upload), &f->error));
	refused(f, upload_find(f->store, TENANT_DEFAULT, upload_id(upload), &blob, &sealed, &f->error),
		TW_ERROR_NOT_FOUND, "no-such-upload");
	refused(f, upload_seal(upload, &f->error), TW_ERROR_CONFLICT, "upload-conflict");
	upload_free(upload);
	for (int64_t left = 80, now = left; more; left = now, steps++) {
		ok(f, store_sweep(f->store, 5000, &more, &f->error));
		now = fixture_ask(f, "SELECT count(*) FROM chunk");
		assert_true(left - now <= 32);
	}
	assert_true(steps >= 3);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM chunk"), 0);
	assert_int_equal(fixture_ask(f, "SELECT count(*) FROM blob"), 0);
	fixture_is_sound(f);
}

/* Space of deleted data goes back to the file system, bit by bit. */
static void the_sweep_makes_the_file_smaller(void **state)
{
	struct fixture *f = *state;
	unsigned char *bytes = noise(8 * BLOB_CHUNK);
	struct upload *upload = begin(f, UINT64_MAX);
	ok(f, upload_write(upload, bytes, 8 * BLOB_CHUNK, &f->error));
	free(bytes);
	int64_t before = fixture_ask(f, "SELECT page_count FROM pragma_page_count");
	ok(f, upload_discard(f->store, TENANT_DEFAULT, upload_id(upload), &f->error));
	upload_free(upload);
	fixture_sweep(f, 0);
	ok(f, store_shrink(f->store, &f->error));
	assert_true(fixture_ask(f, "SELECT page_count FROM pragma_page_count") < before / 4);
}

/* Bit rot: whatever byte of a chunk is read, a wrong one is told, and nothing is handed out. */
static void damaged_bytes_are_told_and_not_handed_out(void **state)
{
	struct fixture *f = *state;
	size_t size = 2 * BLOB_CHUNK + 100000, got = 0;
	unsigned char *bytes = noise(size), *back = calloc(1, size);
	struct upload *upload = begin(f, UINT64_MAX);
	struct blob blob;
	bool sealed;
	ok(f, upload_write(upload, bytes, size, &f->error));
	ok(f, upload_seal(upload, &f->error));
	ok(f, upload_find(f->store, TENANT_DEFAULT, upload_id(upload), &blob, &sealed, &f->error));
	upload_free(upload);
	static const size_t places[] = {0, 65535, 65536, BLOB_CHUNK - 1, BLOB_CHUNK, 2 * BLOB_CHUNK + 99999};
	for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
		char text[256];
		snprintf(text, sizeof text,
			 "UPDATE chunk SET bytes = CAST(substr(bytes, 1, %zu) || x'%02x' || substr(bytes, %zu) AS BLOB)"
			 " WHERE position = %zu",
			 places[i] % BLOB_CHUNK, bytes[places[i]] ^ 1, places[i] % BLOB_CHUNK + 2,
			 places[i] / BLOB_CHUNK);
		assert_int_equal(sqlite3_exec(f->oracle, text, NULL, NULL, NULL), SQLITE_OK);
		refused(f, blob_read(f->store, blob.number, 0, back, size, &got, &f->error), TW_ERROR_IO, BLOB_DAMAGED);
		/* A part that reaches into the block of it, and parts before and behind that do not. */
		size_t block = places[i] / 65536 * 65536, end = block + 65536 < size ? block + 65536 : size;
		refused(f, blob_read(f->store, blob.number, end - 1, back, 1, &got, &f->error), TW_ERROR_IO,
			BLOB_DAMAGED);
		refused(f, blob_read(f->store, blob.number, block ? block - 7 : 0, back, 20, &got, &f->error),
			TW_ERROR_IO, BLOB_DAMAGED);
		if (block) {
			ok(f, blob_read(f->store, blob.number, 0, back, block, &got, &f->error));
			assert_memory_equal(back, bytes, block);
		}
		if (end < size) {
			ok(f, blob_read(f->store, blob.number, end, back, size - end, &got, &f->error));
			assert_memory_equal(back, bytes + end, size - end);
		}
		snprintf(text, sizeof text,
			 "UPDATE chunk SET bytes = CAST(substr(bytes, 1, %zu) || x'%02x' || substr(bytes, %zu) AS BLOB)"
			 " WHERE position = %zu",
			 places[i] % BLOB_CHUNK, bytes[places[i]], places[i] % BLOB_CHUNK + 2, places[i] / BLOB_CHUNK);
		assert_int_equal(sqlite3_exec(f->oracle, text, NULL, NULL, NULL), SQLITE_OK);
	}
	ok(f, blob_read(f->store, blob.number, 0, back, size, &got, &f->error));
	assert_memory_equal(back, bytes, size);
	free(bytes);
	free(back);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(an_upload_comes_back_byte_for_byte),        TEST(the_hash_is_that_of_b2sum),
		TEST(a_resumed_upload_is_the_same_upload),       TEST(two_writers_of_one_upload_do_not_mix),
		TEST(an_upload_beyond_its_limit_is_refused),     TEST(a_long_name_is_cut_between_characters),
		TEST(the_sweep_takes_what_nobody_used),          TEST(the_sweep_makes_the_file_smaller),
		TEST(damaged_bytes_are_told_and_not_handed_out), TEST(deleting_a_large_upload_writes_little),
		TEST(a_large_upload_goes_in_small_steps),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
