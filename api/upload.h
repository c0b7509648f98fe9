/* A request body that goes straight into the store: raw bytes as one upload, or the parts of a form as one each. At
 * most one chunk of it is in memory (storage/blob.h). */
#ifndef API_UPLOAD_H
#define API_UPLOAD_H

#include "api/multipart.h"
#include "storage/upload.h"

#define BODY_UPLOADS_MAX 2

struct body_upload {
	struct store *store;      /* borrowed */
	struct owner owner;       /* who sends it */
	const char *const *parts; /* allowed names, borrowed, NULL-terminated; the first is what a raw body is */
	uint64_t limit;           /* bytes of all parts together */
	uint64_t taken;
	bool is_form;
	bool appends;                    /* to an upload of the client's, which outlives this request */
	bool completes;                  /* and ends it */
	bool named;                      /* the uploads are the client's, named in the query: there is no body */
	char media_type[BLOB_NAME_SIZE]; /* of a raw body */
	struct multipart multipart;
	struct upload *open; /* owned; the part that is being written, NULL between parts */
	size_t count;        /* uploads begun; their ids are final once sealed */
	char ids[BODY_UPLOADS_MAX][STORE_ID_SIZE];
	char names[BODY_UPLOADS_MAX][BLOB_NAME_SIZE];      /* of the parts */
	char file_names[BODY_UPLOADS_MAX][BLOB_NAME_SIZE]; /* "" where not given */
};

/* Goes on with the client's upload `id` at `offset`; `completes`: with this body it ends. TW_ERROR_CONFLICT
 * "upload-offset" when it stands elsewhere (the text says where), and what storage fails with. */
enum tw_status body_upload_append(struct body_upload *body, struct store *store, int64_t tenant, const char *id,
				  uint64_t offset, bool completes, uint64_t limit, struct tw_error *error) TW_NODISCARD;

/* Takes a complete upload of the client's as a part, instead of a body. TW_ERROR_INPUT "no-such-upload" |
 * "upload-not-sealed" | "upload-part". */
enum tw_status body_upload_take(struct body_upload *body, struct store *store, int64_t tenant, const char *part,
				const char *id, struct tw_error *error) TW_NODISCARD;

/* Begins; writes nothing yet. `content_type` may be NULL: none was sent, which is refused. `file_name`: of a raw body,
 * may be NULL. Fails with "unsupported-media-type", "malformed-header", and what storage fails with. */
enum tw_status body_upload_init(struct body_upload *body, struct store *store, struct owner owner,
				const char *const *parts, const char *content_type, const char *file_name,
				uint64_t limit, struct tw_error *error) TW_NODISCARD;
enum tw_status body_upload_write(struct body_upload *body, const void *bytes, size_t size,
				 struct tw_error *error) TW_NODISCARD;

/* From now on it goes through this connection. */
void body_upload_use(struct body_upload *body, struct store *store);

/* Ends: every upload is sealed, and the first part of `parts` is among them, or it fails. */
enum tw_status body_upload_finish(struct body_upload *body, struct tw_error *error) TW_NODISCARD;

/* The resource has taken the uploads over: clear leaves them alone. */
void body_upload_release(struct body_upload *body);

/* Frees what is held and discards the uploads that nobody took over. All zeros is allowed. */
void body_upload_clear(struct body_upload *body);

#endif
