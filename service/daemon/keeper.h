/* The thread that looks after the store once a second: what is deleted goes, also of whole tenants, the use of keys is
 * told, leases that ran out are ended though no
 * worker asks for work, recordings whose reader is gone are ended, free pages go back to the file system. Each may have
 * to wait for the store's writer, and so nothing else of the daemon waits with it. */
#ifndef SERVICE_DAEMON_KEEPER_H
#define SERVICE_DAEMON_KEEPER_H

#include "api/api.h"
#include "tightwire.h"

struct keeper;

/* Opens the store, which is there already; the api is borrowed. What fails later is logged and tried again. */
enum tw_status keeper_start(struct keeper **keeper, const char *store_url, struct api *api,
			    struct tw_error *error) TW_NODISCARD;

/* Waits for the step that is under way. NULL is allowed. */
void keeper_stop(struct keeper *keeper);

#endif
