/* Jobs that make no resource, but a file of one that is there: a drawing of a layout. Their argument is the file's
 * name. They are made when somebody asks for the file; and the file may be dropped again where room is short, because
 * it can be made once more. */
#ifndef STORAGE_TASK_H
#define STORAGE_TASK_H

#include "storage/resource.h"

/* The job of this kind that makes the file `argument` of a resource: one that is queued or runs, now at least as urgent
 * as `request` says; or the last one, where that has failed; else a new one. `*added`: it is new. TW_ERROR_NOT_FOUND
 * "no-such-resource", and the limit of the owner's key (key_check_limits). */
enum tw_status task_ask(struct store *store, struct owner owner, enum job_kind kind, const char *resource_id,
			const char *argument, const struct job_request *request, struct job *job, bool *added,
			struct tw_error *error) TW_NODISCARD;

/* Where less than `room_bytes` are free, some of the files that such jobs have made are dropped, those first that
 * nobody has read for the longest time, none of the last seconds'. store_sweep then makes room of them. A step: where
 * it does not suffice, there is another. */
enum tw_status task_drop_files(struct store *store, uint64_t room_bytes, struct tw_error *error) TW_NODISCARD;

/* Whether nobody has read the file lately, so that it should be noted that somebody does; and that. */
bool task_is_read_seldom(const struct store *store, const struct blob *file);
enum tw_status task_note_read(struct store *store, const struct blob *file, struct tw_error *error) TW_NODISCARD;

#endif
