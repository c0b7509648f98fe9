/* The content address of a draft: what makes two requests equal. Internal to this folder. */
#ifndef STORAGE_ADDRESS_H
#define STORAGE_ADDRESS_H

#include "storage/content_hash.h"
#include "storage/resource.h"

/* The hash of kind, options, needs, uploads (part, file type, bytes' hash) and, where it shows in the result, name.
 * TW_ERROR_NOT_FOUND "no-such-upload", TW_ERROR_CONFLICT "upload-not-sealed" | "upload-used". */
enum tw_status address_of_draft(struct store *store, const struct resource_draft *draft, struct content_hash *address,
				struct tw_error *error) TW_NODISCARD;

#endif
