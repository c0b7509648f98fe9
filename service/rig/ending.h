/* How a recording ends. */
#ifndef SERVICE_RIG_ENDING_H
#define SERVICE_RIG_ENDING_H

#include "storage/queue.h"
#include "storage/recording.h"

/* What the client asked of the recording that `ticket` makes. */
struct recording_options;
enum tw_status recording_asked(struct store *store, const char *resource_id, struct recording_options *options,
			       struct tw_error *error) TW_NODISCARD;

/* Ends it with what is in the store: succeeded; incomplete where more samples are missing than its tolerance allows;
 * failed with "rig-no-samples" where there is none. `course` as of the end. */
enum tw_status recording_end(struct store *store, const struct job_ticket *ticket,
			     const struct recording_course *course, struct tw_error *error) TW_NODISCARD;

/* Ends recordings whose time is over and whose process died and was not followed by another. For the daemon, every
 * second or so; cheap where there is none. */
enum tw_status recording_end_abandoned(struct store *store, struct tw_error *error) TW_NODISCARD;

#endif
