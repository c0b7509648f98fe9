/* Parts that one process at a time plays on a store. */
#ifndef STORAGE_ROLE_H
#define STORAGE_ROLE_H

#include "storage/store.h"

enum store_role { ROLE_RIG };

struct role;

/* Takes the part until role_release, or until the process ends, however it ends: who takes it after that knows that
 * the one before is gone. *role is NULL where another process has it. A lock of the kernel on a file beside the
 * database; where the file system knows none, everybody has the part. TW_ERROR_MEMORY. */
enum tw_status role_take(struct role **role, struct store *store, enum store_role part,
			 struct tw_error *error) TW_NODISCARD;
void role_release(struct role *role); /* NULL is allowed */

#endif
