/* Content addresses. Every field goes into the hash behind its length, so that no two drafts run together. */
#include "storage/address.h"

#include "storage/sql.h"

#include <ctype.h>
#include <string.h>

static void add_number(struct content_hasher *hasher, uint64_t number)
{
	uint8_t bytes[8];
	for (unsigned i = 0; i < sizeof bytes; i++)
		bytes[i] = (uint8_t)(number >> 8 * i);
	content_hasher_add(hasher, bytes, sizeof bytes);
}

static void add_bytes(struct content_hasher *hasher, const void *bytes, size_t size)
{
	add_number(hasher, size);
	content_hasher_add(hasher, bytes, size);
}

static void add_text(struct content_hasher *hasher, const char *text)
{
	add_bytes(hasher, text ? text : "", text ? strlen(text) : 0);
}

/* How a reader will tell the format: by the ending of the name, else by the media type. */
static void add_file_type(struct content_hasher *hasher, const char *file_name, const char *media_type)
{
	char ending[16] = "";
	const char *dot = strrchr(file_name, '.');
	for (size_t i = 0; dot && dot[1 + i] && i + 1 < sizeof ending; i++)
		ending[i] = (char)tolower((unsigned char)dot[1 + i]);
	add_text(hasher, ending[0] ? ending : media_type);
}

static enum tw_status add_upload(struct store *store, struct content_hasher *hasher, int64_t tenant, const char *id,
				 struct tw_error *error)
{
	size_t hash_size = 0;
	bool used = false;
	struct sql q = sql_query(store, "SELECT hash, name, file_name, media_type, resource IS NOT NULL FROM blob"
					" WHERE upload = ? AND tenant = ?");
	sql_bind_text(&q, id);
	sql_bind_int(&q, tenant);
	bool found = sql_step(&q);
	if (found) {
		const void *hash = sql_bytes(&q, &hash_size);
		add_bytes(hasher, hash, hash_size);
		add_text(hasher, sql_text(&q));
		const char *file_name = sql_text(&q);
		add_file_type(hasher, file_name, sql_text(&q));
		used = sql_int(&q);
	}
	enum tw_status status = sql_end(&q, error);
	if (status != TW_OK)
		return status;
	if (!found)
		return tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-upload", NULL, "there is no upload %.64s", id);
	if (hash_size != CONTENT_HASH_SIZE)
		return tw_fail(error, TW_ERROR_CONFLICT, "upload-not-sealed", NULL, "the upload %.64s is not complete",
			       id);
	if (used)
		return tw_fail(error, TW_ERROR_CONFLICT, "upload-used", NULL, "the upload %.64s belongs to a resource",
			       id);
	return TW_OK;
}

enum tw_status address_fingerprint(struct store *store, const struct resource_draft *draft,
				   struct content_hash *fingerprint, struct tw_error *error)
{
	enum tw_status status = TW_OK;
	struct content_hasher hasher;
	const struct resource_kind_row *kind = resource_kind_row(draft->kind);
	content_hasher_init(&hasher);
	add_text(&hasher, kind->name);
	add_text(&hasher, kind->name_counts ? draft->name : "");
	add_text(&hasher, draft->asked ? draft->asked : draft->options ? draft->options : "{}");
	for (size_t i = 0; i < draft->need_count; i++)
		add_text(&hasher, draft->needs[i]);
	add_text(&hasher, "uploads");
	for (size_t i = 0; status == TW_OK && i < draft->upload_count; i++)
		status = add_upload(store, &hasher, draft->owner.tenant, draft->uploads[i], error);
	*fingerprint = content_hasher_end(&hasher);
	return status;
}

static enum tw_status add_salt(struct store *store, struct content_hasher *hasher, int64_t tenant,
			       struct tw_error *error)
{
	size_t size = 0;
	struct sql q = sql_query(store, "SELECT salt FROM tenant WHERE number = ? AND name IS NOT NULL");
	sql_bind_int(&q, tenant);
	bool found = sql_step(&q);
	if (found) {
		const void *salt = sql_bytes(&q, &size);
		add_bytes(hasher, salt, size);
	}
	enum tw_status status = sql_end(&q, error);
	if (status == TW_OK && !found)
		status = tw_fail(error, TW_ERROR_NOT_FOUND, "no-such-tenant", NULL, "the tenant has been deleted");
	return status;
}

enum tw_status address_of(struct store *store, const struct resource_draft *draft,
			  const struct content_hash *fingerprint, struct content_hash *address, struct tw_error *error)
{
	struct content_hasher hasher;
	content_hasher_init(&hasher);
	enum tw_status status = add_salt(store, &hasher, draft->owner.tenant, error);
	add_number(&hasher, resource_kind_row(draft->kind)->version);
	content_hasher_add(&hasher, fingerprint->bytes, sizeof fingerprint->bytes);
	*address = content_hasher_end(&hasher);
	return status;
}
