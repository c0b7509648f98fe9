/* One byte of the lock file for each part. */
#include "storage/role.h"

#include "storage/gate.h"
#include "storage/sql.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

struct role {
	int file; /* owned; -1 where there is no lock to be had */
};

static bool lock(int file, enum store_role part)
{
	struct flock lock = {.l_type = F_WRLCK, .l_whence = SEEK_SET, .l_start = GATE_BYTES + (off_t)part, .l_len = 1};
	return fcntl(file, F_OFD_SETLK, &lock) == 0 || (errno != EAGAIN && errno != EACCES);
}

enum tw_status role_take(struct role **role, struct store *store, enum store_role part, struct tw_error *error)
{
	*role = NULL;
	struct role *taken = calloc(1, sizeof *taken);
	if (!taken)
		return tw_fail_memory(error);
	const char *database = sqlite3_db_filename(store->reads.db, "main");
	taken->file = database[0] ? gate_open_file(database) : -1; /* one in memory is this process's alone */
	if (taken->file >= 0 && !lock(taken->file, part)) {
		role_release(taken);
		return TW_OK;
	}
	*role = taken;
	return TW_OK;
}

void role_release(struct role *role)
{
	if (!role)
		return;
	if (role->file >= 0)
		close(role->file);
	free(role);
}
