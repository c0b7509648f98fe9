/* The queue as workers see it: claim, heartbeat, and the ways to end. job.h draws the states.
 *
 * Exactly once: a claim gives a lease and a fence, a number that grows with every claim of the job. Whatever a worker
 * writes about a job names its fence; once the lease has run out and somebody else has claimed, the old fence is
 * refused with TW_ERROR_CONFLICT "lease-lost", so a result is written by one worker only, in the transaction that ends
 * the job. A worker that dies leaves nothing but a lease that runs out.
 *
 * An attempt is charged when the job is claimed, and given back when it was not the job's fault that nothing came of
 * it: the worker was asked to leave, the service or the machine went down with it, the disk was full or failed. What
 * remains charged is what the job itself may have done: its worker crashed or hung, or its memory did not suffice. */
#ifndef STORAGE_QUEUE_H
#define STORAGE_QUEUE_H

#include "storage/claim.h"
#include "storage/job.h"
#include "storage/result.h"

/* Takes the first job of the kinds and classes, in the order that job_request.h promises, for `lease_ms`. What is due
 * is seen to first (job_expire). Where there is no room for what a job is expected to leave, it is passed over, and
 * claimed when there is. `*found` false when there is none. An idle call takes no write lock. */
enum tw_status job_claim(struct store *store, const struct claim_query *query, struct job_ticket *ticket, bool *found,
			 struct tw_error *error) TW_NODISCARD;

/* Takes the job that makes this resource, where it is queued or its lease has run out; *found is false where it is not.
 */
enum tw_status job_claim_resource(struct store *store, const char *resource_id, const char *worker, int64_t lease_ms,
				  struct job_ticket *ticket, bool *found, struct tw_error *error) TW_NODISCARD;

/* Sees to all that is due: leases that have run out are put back, those whose pause is over or whose time has come may
 * be claimed, those whose deadline has passed are cancelled. A claim does so too, a step at a time; this is for a
 * service whose workers are all busy, or none. */
enum tw_status job_expire(struct store *store, struct tw_error *error) TW_NODISCARD;

/* In how many milliseconds something is due: who has found nothing to claim need not look again before, unless told
 * that there is something new. 0: now; -1: nothing is awaited. */
enum tw_status job_next_due(struct store *store, int64_t *wait_ms, struct tw_error *error) TW_NODISCARD;

/* Renews the lease and tells progress. `stage` and `partial` (JSON) may be NULL: unchanged. `*cancel` is set when
 * somebody asked the job to stop. TW_ERROR_CONFLICT "lease-lost". */
enum tw_status job_heartbeat(struct store *store, const struct job_ticket *ticket, double progress, const char *stage,
			     const char *partial, bool *cancel, struct tw_error *error) TW_NODISCARD;

/* The same without a write: whether somebody asked the job to stop. TW_ERROR_CONFLICT "lease-lost". */
enum tw_status job_is_cancelled(struct store *store, const struct job_ticket *ticket, bool *cancel,
				struct tw_error *error) TW_NODISCARD;

/* Writes the result and ends the job, in one durable transaction; wakes what waited for it. Where somebody asked the
 * job to stop before that, it ends as cancelled and the result is dropped. TW_ERROR_CONFLICT "lease-lost", and then
 * nothing is written. */
enum tw_status job_finish(struct store *store, const struct job_ticket *ticket, const struct job_result *result,
			  struct tw_error *error) TW_NODISCARD;

/* Ends the job as failed because of `failure`. With `retry` it goes back to the queue, after a pause that doubles with
 * each attempt (and is up to half as long again, so that what failed together is not tried again together), unless its
 * attempts are used; the attempt counts. A job that was asked to stop ends as cancelled; where that was taken back in
 * the meantime (job_state_join), TW_ERROR_CANCELLED as the failure's status gives it back as job_release does. */
enum tw_status job_fail(struct store *store, const struct job_ticket *ticket, const struct tw_error *failure,
			bool retry, struct tw_error *error) TW_NODISCARD;

/* Gives an unfinished job back, and the attempt with it: the worker is asked to leave. */
enum tw_status job_release(struct store *store, const struct job_ticket *ticket, struct tw_error *error) TW_NODISCARD;

/* The same because the store failed: it is full, or cannot be written. The job is claimed again after a short pause,
 * once there is room for `room_bytes`: what its result would have taken (result_size), 0 where that is not known. */
enum tw_status job_put_off(struct store *store, const struct job_ticket *ticket, uint64_t room_bytes,
			   struct tw_error *error) TW_NODISCARD;

/* Takes back what a worker holds that is known to be dead, so that nobody waits for its leases to run out. `crashed`:
 * it died by itself, with the job perhaps to blame, and the attempt counts; else it went with its service. */
enum tw_status job_abandon(struct store *store, const char *worker, bool crashed, struct tw_error *error) TW_NODISCARD;

#endif
