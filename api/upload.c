#include "api/upload.h"

#include "api/header.h"
#include "api/json.h"
#include "solver/names.h"

#include <string.h>

static enum tw_status begin_upload(struct body_upload *body, const char *part, const char *file_name,
				   const char *media_type, struct tw_error *error)
{
	enum tw_status status = upload_begin(&body->open, body->store, body->owner, part, file_name, media_type,
					     body->limit - body->taken, error);
	if (status != TW_OK)
		return status;
	size_t i = body->count++;
	snprintf(body->ids[i], sizeof body->ids[i], "%s", upload_id(body->open));
	snprintf(body->names[i], sizeof body->names[i], "%s", part);
	snprintf(body->file_names[i], sizeof body->file_names[i], "%s", file_name);
	return TW_OK;
}

/* What is not UTF-8 (the name of an old system's file, say) is replaced, as are control characters: names stand in JSON
 * and in logs. */
static const char *make_text(char *name)
{
	bool is_text = json_is_text(name);
	for (char *p = name; *p; p++)
		if ((unsigned char)*p < ' ' || *p == 127 || (!is_text && (unsigned char)*p > 126))
			*p = '?';
	return name;
}

static enum tw_status begin_part(void *context, const struct multipart_part *part, struct tw_error *error)
{
	struct body_upload *body = context;
	const char *const *known = body->parts;
	while (*known && strcmp(*known, part->name) != 0)
		known++;
	if (!*known) {
		const struct names names = names_of(body->parts);
		return names_refuse(&names, "part", part->name, "unknown-part", part->name, error);
	}
	for (size_t i = 0; i < body->count; i++)
		if (!strcmp(body->names[i], part->name))
			return tw_fail(error, TW_ERROR_INPUT, "part-twice", part->name,
				       "this part comes twice; send it once");
	if (body->count == BODY_UPLOADS_MAX)
		return tw_fail(error, TW_ERROR_INPUT, "unknown-part", part->name, "the form has too many parts");
	char file_name[sizeof part->file_name];
	memcpy(file_name, part->file_name, sizeof file_name);
	return begin_upload(body, part->name, make_text(file_name), part->media_type, error);
}

static enum tw_status write_part(void *context, const void *bytes, size_t size, struct tw_error *error)
{
	struct body_upload *body = context;
	body->taken += size;
	return upload_write(body->open, bytes, size, error);
}

static enum tw_status end_part(void *context, struct tw_error *error)
{
	struct body_upload *body = context;
	enum tw_status status = upload_seal(body->open, error);
	if (status != TW_OK && error && !error->where[0])
		snprintf(error->where, sizeof error->where, "part %.100s", body->names[body->count - 1]);
	upload_free(body->open);
	body->open = NULL;
	return status;
}

/* What a mesh or a point cache may be called; the content decides, in the worker. None of them is a type that a web
 * page may send without asking first: text/plain is. */
static bool is_raw_media_type(const char *media_type)
{
	static const char *const known[] = {"application/octet-stream", "application/x-tar", "application/x-tgif",
					    "application/x-ply", "application/sla"};
	for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
		if (!strcmp(media_type, known[i]))
			return true;
	return !strncmp(media_type, "model/", 6);
}

static enum tw_status refuse_media_type(const char *media_type, struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_UNSUPPORTED, "unsupported-media-type", "Content-Type",
		       "the body came as %.64s; send the file as it is, with -H 'Content-Type: "
		       "application/octet-stream' (or model/obj, …), or as multipart/form-data",
		       media_type);
}

enum tw_status body_upload_init(struct body_upload *body, struct store *store, struct owner owner,
				const char *const *parts, const char *content_type, const char *file_name,
				uint64_t limit, struct tw_error *error)
{
	*body = (struct body_upload){.store = store, .owner = owner, .parts = parts, .limit = limit};
	char media_type[BLOB_NAME_SIZE];
	if (!content_type)
		return refuse_media_type("no media type", error);
	if (!header_media_type(content_type, media_type, sizeof media_type))
		return tw_fail(error, TW_ERROR_INPUT, "malformed-header", "Content-Type",
			       "this is no media type of the form type/subtype");
	body->is_form = !strcmp(media_type, "multipart/form-data");
	if (body->is_form) {
		struct multipart_sink sink = {begin_part, write_part, end_part, body};
		return multipart_init(&body->multipart, content_type, sink, error);
	}
	if (!is_raw_media_type(media_type))
		return refuse_media_type(media_type, error);
	snprintf(body->media_type, sizeof body->media_type, "%s", media_type);
	snprintf(body->file_names[0], sizeof body->file_names[0], "%s", file_name ? file_name : "");
	return TW_OK;
}

/* The upload of a raw body is begun when its bytes come. */
static enum tw_status begin_raw(struct body_upload *body, struct tw_error *error)
{
	char file_name[BLOB_NAME_SIZE];
	if (body->open || body->count)
		return TW_OK;
	memcpy(file_name, body->file_names[0], sizeof file_name);
	return begin_upload(body, body->parts[0], file_name, body->media_type, error);
}

void body_upload_use(struct body_upload *body, struct store *store)
{
	body->store = store;
	if (body->open)
		upload_use(body->open, store);
}

enum tw_status body_upload_append(struct body_upload *body, struct store *store, int64_t tenant, const char *id,
				  uint64_t offset, bool completes, uint64_t limit, struct tw_error *error)
{
	uint64_t stands_at = 0;
	*body = (struct body_upload){.store = store, .limit = limit, .appends = true, .completes = completes};
	enum tw_status status = upload_resume(&body->open, store, tenant, id, limit, &stands_at, error);
	if (status == TW_OK && stands_at != offset)
		status = tw_fail(error, TW_ERROR_CONFLICT, "upload-offset", "Upload-Offset",
				 "the upload stands at byte %llu; go on from there", (unsigned long long)stands_at);
	return status;
}

enum tw_status body_upload_take(struct body_upload *body, struct store *store, int64_t tenant, const char *part,
				const char *id, struct tw_error *error)
{
	struct blob blob;
	bool sealed = false;
	body->store = store;
	body->named = true;
	enum tw_status status = upload_find(store, tenant, id, &blob, &sealed, error);
	if (status == TW_ERROR_NOT_FOUND)
		return tw_fail(error, TW_ERROR_INPUT, "no-such-upload", part,
			       "there is no such upload; make it with POST /v1/uploads");
	if (status != TW_OK)
		return status;
	if (!sealed)
		return tw_fail(error, TW_ERROR_INPUT, "upload-not-sealed", part, "the upload is not complete yet");
	if (strcmp(blob.name, part) != 0)
		return tw_fail(error, TW_ERROR_INPUT, "upload-part", part, "the upload was begun as the part \"%s\"",
			       blob.name);
	size_t i = body->count++;
	snprintf(body->ids[i], sizeof body->ids[i], "%s", id);
	snprintf(body->names[i], sizeof body->names[i], "%s", part);
	snprintf(body->file_names[i], sizeof body->file_names[i], "%s", blob.file_name);
	return TW_OK;
}

enum tw_status body_upload_write(struct body_upload *body, const void *bytes, size_t size, struct tw_error *error)
{
	if (body->named)
		return tw_fail(error, TW_ERROR_INPUT, "unexpected-body", NULL,
			       "the uploads stand in the query; send no body");
	if (body->is_form)
		return multipart_feed(&body->multipart, bytes, size, error);
	enum tw_status status = begin_raw(body, error);
	return status == TW_OK ? write_part(body, bytes, size, error) : status;
}

enum tw_status body_upload_finish(struct body_upload *body, struct tw_error *error)
{
	if (body->named || (body->appends && !body->completes))
		return TW_OK;
	if (body->appends)
		return upload_seal(body->open, error);
	enum tw_status status = body->is_form ? TW_OK : begin_raw(body, error);
	if (!body->is_form)
		return status == TW_OK ? end_part(body, error) : status;
	status = multipart_finish(&body->multipart, error);
	if (status != TW_OK)
		return status;
	for (size_t i = 0; i < body->count; i++)
		if (!strcmp(body->names[i], body->parts[0]))
			return TW_OK;
	return tw_fail(error, TW_ERROR_INPUT, "missing-part", body->parts[0], "the form has no part \"%s\"; add it",
		       body->parts[0]);
}

void body_upload_release(struct body_upload *body)
{
	body->count = 0;
}

void body_upload_clear(struct body_upload *body)
{
	upload_free(body->open);
	/* Where discarding fails, the store's sweep does it later. What the client named stays the client's. */
	for (size_t i = 0; i < body->count && !body->named; i++)
		if (upload_discard(body->store, body->owner.tenant, body->ids[i], NULL) != TW_OK)
			continue;
	*body = (struct body_upload){0};
}
