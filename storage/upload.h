/* Uploads: blobs that are written as they arrive, before anything uses them. */
#ifndef STORAGE_UPLOAD_H
#define STORAGE_UPLOAD_H

#include "storage/blob.h"
#include "storage/tenant.h"

/* A blob in the making: buffers up to one chunk, and writes it in a transaction of its own. */
struct upload;

/* TW_ERROR_NOT_FOUND "no-such-tenant", and the limit of the owner's key (key_check_limits), also where bytes come.
 * `part` and the names are cut to BLOB_NAME_SIZE; `limit` is the largest size in bytes that is taken. */
enum tw_status upload_begin(struct upload **upload, struct store *store, struct owner owner, const char *part,
			    const char *file_name, const char *media_type, uint64_t limit,
			    struct tw_error *error) TW_NODISCARD;

/* Takes up an upload that a client or a process left; `*offset` is the byte to go on from. TW_ERROR_NOT_FOUND
 * "no-such-upload", TW_ERROR_CONFLICT "upload-sealed". */
enum tw_status upload_resume(struct upload **upload, struct store *store, int64_t tenant, const char *id,
			     uint64_t limit, uint64_t *offset, struct tw_error *error) TW_NODISCARD;

/* An upload that no resource owns yet: `blob` says part, names, media type and how many bytes are kept; whole chunks,
 * unless it is sealed. TW_ERROR_NOT_FOUND "no-such-upload". */
enum tw_status upload_find(struct store *store, int64_t tenant, const char *id, struct blob *blob, bool *sealed,
			   struct tw_error *error) TW_NODISCARD;

/* Appends. TW_ERROR_LIMIT "upload-too-large". After an error the upload can only be freed. */
enum tw_status upload_write(struct upload *upload, const void *bytes, size_t size, struct tw_error *error) TW_NODISCARD;

/* Ends it: size and hash are final, and resource_create may use it. TW_ERROR_INPUT "upload-empty" for no bytes. */
enum tw_status upload_seal(struct upload *upload, struct tw_error *error) TW_NODISCARD;

/* From now on it goes through this connection: the thread that writes it has changed. */
void upload_use(struct upload *upload, struct store *store);

const char *upload_id(const struct upload *upload);
uint64_t upload_size(const struct upload *upload);

/* Frees the writer; what was written stays and can be resumed, until store_sweep. NULL is allowed. */
void upload_free(struct upload *upload);

/* Removes what was written. Uploads that a resource owns are not touched: TW_ERROR_NOT_FOUND. */
enum tw_status upload_discard(struct store *store, int64_t tenant, const char *id, struct tw_error *error) TW_NODISCARD;

#endif
