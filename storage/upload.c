/* Uploads, written as they arrive: a chunk is one transaction, which also moves the size on. Two writers on one upload
 * cannot both do that: the second finds another size and is refused. */
#include "storage/upload.h"

#include "storage/chunk.h"
#include "storage/id.h"
#include "storage/key.h"
#include "storage/sql.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>

struct upload {
	struct store *store; /* borrowed */
	int64_t blob;
	int64_t client; /* whose limits it is held to */
	char id[STORE_ID_SIZE];
	uint64_t limit;
	uint64_t stored;              /* bytes in the store: whole chunks until it is sealed */
	size_t buffered;              /* bytes in `buffer` */
	bool broken;                  /* an error has happened */
	struct content_hasher hasher; /* of all bytes so far */
	char buffer[BLOB_CHUNK];
};

/* The hash so far is kept with every chunk, as it lies in libsodium's memory, so that going on with a large upload does
 * not mean reading it again. Another version of libsodium may lay it out otherwise. */
struct hash_state {
	char library[16];
	struct content_hasher hasher;
};

static struct hash_state hash_state_of(const struct upload *upload)
{
	struct hash_state kept;
	memset(&kept, 0, sizeof kept);
	snprintf(kept.library, sizeof kept.library, "%s", sodium_version_string());
	kept.hasher = upload->hasher;
	return kept;
}

static struct upload *new_upload(struct store *store, uint64_t limit)
{
	struct upload *upload = malloc(sizeof *upload);
	if (upload) {
		upload->store = store;
		upload->limit = limit;
		upload->stored = 0;
		upload->buffered = 0;
		upload->broken = false;
		content_hasher_init(&upload->hasher);
	}
	return upload;
}

static void cut(char out[BLOB_NAME_SIZE], const char *text)
{
	size_t size = text ? strnlen(text, BLOB_NAME_SIZE - 1) : 0;
	/* Not through the middle of a UTF-8 character. */
	if (text && text[size])
		while (size && ((unsigned char)text[size] & 0xc0) == 0x80)
			size--;
	if (size)
		memcpy(out, text, size);
	out[size] = '\0';
}

static enum tw_status insert_upload(struct upload *upload, struct owner owner, const char *part, const char *file_name,
				    const char *media_type, struct tw_error *error)
{
	char names[3][BLOB_NAME_SIZE];
	cut(names[0], part);
	cut(names[1], file_name);
	cut(names[2], media_type);
	struct sql q =
		sql_query(upload->store, "INSERT INTO blob(tenant, client, upload, role, name, file_name, media_type,"
					 " touched_ms) VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
	sql_bind_int(&q, owner.tenant);
	sql_bind_int(&q, owner.client);
	sql_bind_text(&q, upload->id);
	sql_bind_int(&q, BLOB_UPLOAD);
	for (int i = 0; i < 3; i++)
		sql_bind_text(&q, names[i]);
	sql_bind_int(&q, store_lease_now_ms(upload->store));
	return sql_run(&q, NULL, error);
}

enum tw_status upload_begin(struct upload **upload, struct store *store, struct owner owner, const char *part,
			    const char *file_name, const char *media_type, uint64_t limit, struct tw_error *error)
{
	struct upload *begun = new_upload(store, limit);
	if (!begun)
		return tw_fail_memory(error);
	id_random(begun->id, "upload");
	begun->client = owner.client;
	enum tw_status status = key_check_limits(store, owner.client, false, 1, error);
	if (status == TW_OK)
		status = transaction_begin(store, false, error);
	if (status == TW_OK) {
		status = tenant_check(store, owner.tenant, error);
		if (status == TW_OK)
			status = insert_upload(begun, owner, part, file_name, media_type, error);
		begun->blob = sql_inserted(store);
		status = transaction_end(store, status, error);
	}
	if (status == TW_OK)
		*upload = begun;
	else
		upload_free(begun);
	return status;
}

enum tw_status upload_find(struct store *store, int64_t tenant, const char *id, struct blob *blob, bool *sealed,
			   struct tw_error *error)
{
	struct sql q = sql_query(store, "SELECT number, name, file_name, media_type, size, hash IS NOT NULL FROM blob"
					" WHERE upload = ? AND tenant = ? AND resource IS NULL");
	sql_bind_text(&q, id);
	sql_bind_int(&q, tenant);
	bool found = sql_step(&q);
	if (found) {
		*blob = (struct blob){.number = sql_int(&q), .role = BLOB_UPLOAD};
		sql_copy_text(&q, blob->name, sizeof blob->name);
		sql_copy_text(&q, blob->file_name, sizeof blob->file_name);
		sql_copy_text(&q, blob->media_type, sizeof blob->media_type);
		blob->size = (uint64_t)sql_int(&q);
		*sealed = sql_int(&q);
	}
	enum tw_status status = sql_end(&q, error);
	if (status == TW_OK && !found)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-upload", NULL, "there is no upload %.64s", id);
	return status;
}

static enum tw_status find_upload(struct upload *upload, int64_t tenant, const char *id, struct tw_error *error)
{
	struct sql q = sql_query(upload->store, "SELECT number, client, size, hash IS NOT NULL FROM blob"
						" WHERE upload = ? AND tenant = ?");
	sql_bind_text(&q, id);
	sql_bind_int(&q, tenant);
	bool found = sql_step(&q);
	bool sealed = false;
	if (found) {
		upload->blob = sql_int(&q);
		upload->client = sql_int(&q);
		upload->stored = (uint64_t)sql_int(&q);
		sealed = sql_int(&q);
	}
	enum tw_status status = sql_end(&q, error);
	if (status != TW_OK)
		return status;
	if (!found)
		return tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-upload", NULL, "there is no upload %.64s", id);
	if (sealed)
		return tw_fail(error, TW_ERROR_CONFLICT, "upload-sealed", NULL, "the upload %.64s is complete", id);
	snprintf(upload->id, sizeof upload->id, "%s", id);
	return TW_OK;
}

/* Where no state was kept that this libsodium understands: over all that is stored. */
static enum tw_status hash_again(struct upload *upload, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	for (uint64_t at = 0; status == TW_OK && at < upload->stored; at += BLOB_CHUNK) {
		size_t got = 0;
		status = blob_read(upload->store, upload->blob, at, upload->buffer, BLOB_CHUNK, &got, error);
		content_hasher_add(&upload->hasher, upload->buffer, got);
	}
	return status;
}

static enum tw_status take_up_hash(struct upload *upload, struct tw_error *error)
{
	struct hash_state kept;
	struct hash_state current = hash_state_of(upload);
	size_t size = 0;
	struct sql q = sql_query(upload->store, "SELECT hash_state FROM blob WHERE number = ?");
	sql_bind_int(&q, upload->blob);
	const void *bytes = sql_step(&q) ? sql_bytes(&q, &size) : NULL;
	bool usable = bytes && size == sizeof kept;
	if (usable)
		memcpy(&kept, bytes, sizeof kept);
	enum tw_status status = sql_end(&q, error);
	if (status != TW_OK)
		return status;
	if (!usable || memcmp(kept.library, current.library, sizeof kept.library) != 0)
		return hash_again(upload, error);
	upload->hasher = kept.hasher;
	return TW_OK;
}

enum tw_status upload_resume(struct upload **upload, struct store *store, int64_t tenant, const char *id,
			     uint64_t limit, uint64_t *offset, struct tw_error *error)
{
	struct upload *resumed = new_upload(store, limit);
	if (!resumed)
		return tw_fail_memory(error);
	enum tw_status status = find_upload(resumed, tenant, id, error);
	if (status == TW_OK)
		status = take_up_hash(resumed, error);
	if (status != TW_OK) {
		upload_free(resumed);
		return status;
	}
	*offset = resumed->stored;
	*upload = resumed;
	return TW_OK;
}

/* Inside a transaction. */
static enum tw_status store_chunk(struct upload *upload, struct tw_error *error)
{
	int64_t changed = 0;
	struct hash_state hash = hash_state_of(upload);
	struct sql q =
		sql_query(upload->store, "UPDATE blob SET size = size + ?, touched_ms = ?, hash_state = ?"
					 " WHERE number = ? AND size = ? AND hash IS NULL AND upload IS NOT NULL");
	sql_bind_int(&q, (int64_t)upload->buffered);
	sql_bind_int(&q, store_lease_now_ms(upload->store));
	sql_bind_bytes(&q, &hash, sizeof hash);
	sql_bind_int(&q, upload->blob);
	sql_bind_int(&q, (int64_t)upload->stored);
	enum tw_status status = sql_run(&q, &changed, error);
	if (status == TW_OK && changed != 1)
		status = tw_fail(error, TW_ERROR_CONFLICT, "upload-conflict", NULL,
				 "the upload was continued or removed by somebody else");
	if (status == TW_OK && upload->buffered)
		status = chunk_add(upload->store, upload->blob, upload->stored / BLOB_CHUNK, upload->buffer,
				   upload->buffered, error);
	return status;
}

/* For what is buffered: on the disk, and in the client's limits. */
static enum tw_status check_room(struct upload *upload, struct tw_error *error)
{
	enum tw_status status = sql_check_room(upload->store, upload->buffered, error);
	return status == TW_OK ? key_check_limits(upload->store, upload->client, false, upload->buffered, error)
			       : status;
}

static enum tw_status flush(struct upload *upload, struct tw_error *error)
{
	enum tw_status status = check_room(upload, error);
	if (status == TW_OK)
		status = transaction_begin_alone(upload->store, error);
	if (status == TW_OK) {
		status = store_chunk(upload, error);
		status = transaction_end(upload->store, status, error);
	}
	if (status == TW_OK) {
		upload->stored += upload->buffered;
		upload->buffered = 0;
	}
	return status;
}

static enum tw_status refuse_broken(struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_CONFLICT, "upload-broken", NULL,
		       "the upload failed before; begin or resume it again");
}

enum tw_status upload_write(struct upload *upload, const void *bytes, size_t size, struct tw_error *error)
{
	if (upload->broken)
		return refuse_broken(error);
	enum tw_status status = TW_OK;
	if (size > upload->limit || upload_size(upload) > upload->limit - size)
		status = tw_fail(error, TW_ERROR_LIMIT, "upload-too-large", NULL,
				 "more than the %llu bytes that are taken", (unsigned long long)upload->limit);
	const char *from = bytes;
	while (status == TW_OK && size) {
		size_t part = BLOB_CHUNK - upload->buffered;
		part = part < size ? part : size;
		memcpy(upload->buffer + upload->buffered, from, part);
		content_hasher_add(&upload->hasher, from, part);
		upload->buffered += part;
		from += part;
		size -= part;
		if (upload->buffered == BLOB_CHUNK)
			status = flush(upload, error);
	}
	upload->broken = status != TW_OK;
	return status;
}

enum tw_status upload_seal(struct upload *upload, struct tw_error *error)
{
	if (upload->broken)
		return refuse_broken(error);
	if (upload_size(upload) == 0)
		return tw_fail(error, TW_ERROR_INPUT, "upload-empty", NULL, "no bytes came; send the file as the body");
	enum tw_status status = check_room(upload, error);
	if (status == TW_OK)
		status = transaction_begin(upload->store, true, error);
	if (status == TW_OK) {
		status = store_chunk(upload, error);
		struct content_hash hash = content_hasher_end(&upload->hasher);
		if (status == TW_OK)
			status = chunk_seal(upload->store, upload->blob, &hash, error);
		status = transaction_end(upload->store, status, error);
	}
	upload->stored += upload->buffered;
	upload->buffered = 0;
	upload->broken = true; /* nothing may follow */
	return status;
}

void upload_use(struct upload *upload, struct store *store)
{
	upload->store = store;
}

const char *upload_id(const struct upload *upload)
{
	return upload->id;
}

uint64_t upload_size(const struct upload *upload)
{
	return upload->stored + upload->buffered;
}

void upload_free(struct upload *upload)
{
	free(upload);
}

enum tw_status upload_discard(struct store *store, int64_t tenant, const char *id, struct tw_error *error)
{
	int64_t dropped = 0;
	enum tw_status status = transaction_begin(store, false, error);
	if (status != TW_OK)
		return status;
	struct sql q = sql_query(store, CHUNK_LET_GO " WHERE upload = ? AND tenant = ? AND resource IS NULL");
	sql_bind_text(&q, id);
	sql_bind_int(&q, tenant);
	status = sql_run(&q, &dropped, error);
	if (status == TW_OK && !dropped)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-upload", NULL, "there is no upload %.64s", id);
	return transaction_end(store, status, error);
}
