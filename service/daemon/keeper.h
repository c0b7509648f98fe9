/* The thread that looks after the store. What is due is ended at its time, though no worker asks for work: leases,
 * pauses, deadlines. Once a second what is deleted goes, also of whole tenants, the use of keys is told, recordings
 * whose reader is gone are ended, drawings that nobody reads are dropped where room is short; and free pages go back to
 * the file system now and then. Each may have to wait for the store's writer, and so nothing else of the daemon waits
 * with it. */
#ifndef SERVICE_DAEMON_KEEPER_H
#define SERVICE_DAEMON_KEEPER_H

#include "api/api.h"
#include "tightwire.h"

struct keeper;

struct keeper_settings {
	const char *store_url;      /* borrowed until keeper_start returns */
	struct api *api;            /* borrowed */
	void (*due)(void *context); /* jobs may be claimed that could not, or are to stop. From the keeper's thread */
	void *context;              /* borrowed, handed to it */
};

/* Opens the store, which is there already. What fails later is logged and tried again. */
enum tw_status keeper_start(struct keeper **keeper, const struct keeper_settings *settings,
			    struct tw_error *error) TW_NODISCARD;

/* Waits for the step that is under way. NULL is allowed. */
void keeper_stop(struct keeper *keeper);

#endif
