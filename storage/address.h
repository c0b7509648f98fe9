/* What makes two requests equal, and what they are stored under. Internal to this folder. */
#ifndef STORAGE_ADDRESS_H
#define STORAGE_ADDRESS_H

#include "storage/content_hash.h"
#include "storage/resource.h"

/* What was asked: the hash of kind, options, needs, uploads (part, file type, bytes' hash) and, where it shows in the
 * result, name. The same in every release, so that a client who asks again with the idempotency key of an old request
 * gets the old answer. TW_ERROR_NOT_FOUND "no-such-upload", TW_ERROR_CONFLICT "upload-not-sealed" | "upload-used". */
enum tw_status address_fingerprint(struct store *store, const struct resource_draft *draft,
				   struct content_hash *fingerprint, struct tw_error *error) TW_NODISCARD;

/* The content address: of the fingerprint, the tenant's salt, and the computation version of the kind.
 * TW_ERROR_NOT_FOUND "no-such-tenant", also while its data are being deleted. */
enum tw_status address_of(struct store *store, const struct resource_draft *draft,
			  const struct content_hash *fingerprint, struct content_hash *address,
			  struct tw_error *error) TW_NODISCARD;

#endif
