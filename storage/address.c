/* Content addresses. Every field goes into the hash behind its length, so that no two drafts run together. */
#include "storage/address.h"

#include "storage/sql.h"

#include <ctype.h>
#include <sodium.h>
#include <string.h>

static void add_bytes(crypto_generichash_state *state, const void *bytes, size_t size)
{
	uint8_t length[8];
	for (unsigned i = 0; i < sizeof length; i++)
		length[i] = (uint8_t)((uint64_t)size >> 8 * i);
	crypto_generichash_update(state, length, sizeof length);
	crypto_generichash_update(state, bytes, size);
}

static void add_text(crypto_generichash_state *state, const char *text)
{
	add_bytes(state, text ? text : "", text ? strlen(text) : 0);
}

/* How a reader will tell the format: by the ending of the name, else by the media type. */
static void add_file_type(crypto_generichash_state *state, const char *file_name, const char *media_type)
{
	char ending[16] = "";
	const char *dot = strrchr(file_name, '.');
	for (size_t i = 0; dot && dot[1 + i] && i + 1 < sizeof ending; i++)
		ending[i] = (char)tolower((unsigned char)dot[1 + i]);
	add_text(state, ending[0] ? ending : media_type);
}

static enum tw_status add_upload(struct store *store, crypto_generichash_state *state, const char *id,
				 struct tw_error *error)
{
	size_t hash_size = 0;
	bool used = false;
	struct sql q = sql_query(store, "SELECT hash, name, file_name, media_type, resource IS NOT NULL FROM blob"
					" WHERE upload = ?");
	sql_bind_text(&q, id);
	bool found = sql_step(&q);
	if (found) {
		const void *hash = sql_bytes(&q, &hash_size);
		add_bytes(state, hash, hash_size);
		add_text(state, sql_text(&q));
		const char *file_name = sql_text(&q);
		add_file_type(state, file_name, sql_text(&q));
		used = sql_int(&q);
	}
	enum tw_status status = sql_end(&q, error);
	if (status != TW_OK)
		return status;
	if (!found)
		return tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-upload", NULL, "there is no upload %.64s", id);
	if (hash_size != BLOB_HASH_SIZE)
		return tw_fail(error, TW_ERROR_CONFLICT, "upload-not-sealed", NULL, "the upload %.64s is not complete",
			       id);
	if (used)
		return tw_fail(error, TW_ERROR_CONFLICT, "upload-used", NULL, "the upload %.64s belongs to a resource",
			       id);
	return TW_OK;
}

enum tw_status address_of_draft(struct store *store, const struct resource_draft *draft,
				uint8_t address[BLOB_HASH_SIZE], struct tw_error *error)
{
	enum tw_status status = TW_OK;
	crypto_generichash_state state;
	const struct resource_kind_row *kind = resource_kind_row(draft->kind);
	crypto_generichash_init(&state, NULL, 0, BLOB_HASH_SIZE);
	add_text(&state, kind->name);
	add_text(&state, kind->name_counts ? draft->name : "");
	add_text(&state, draft->options ? draft->options : "{}");
	for (size_t i = 0; i < draft->need_count; i++)
		add_text(&state, draft->needs[i]);
	add_text(&state, "uploads");
	for (size_t i = 0; status == TW_OK && i < draft->upload_count; i++)
		status = add_upload(store, &state, draft->uploads[i], error);
	crypto_generichash_final(&state, address, BLOB_HASH_SIZE);
	return status;
}
