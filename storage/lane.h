/* Whose turn it is. Internal to this folder; each function works inside the caller's transaction.
 *
 *     class ──► share: a client's place in the class ──► lane: its jobs of one kind and group ──► jobs
 *
 * Clients take turns by start-time fair queueing (Goyal, Vin, Cheng 1996): a share has a turn, a number that grows with
 * every claim by LANE_TURN over its weight while others wait, and the lowest is next. A share that opens comes in where
 * the first of the others is: what it did not use is not saved up, and what it was given while nobody else waited is
 * not held against it.
 *
 * What is written down only ever errs in one direction, so that little has to be written: a share that is not open has
 * no open lane; a lane that is not open has no ready job or a group that is full; and no ready job of a lane comes
 * before its head. Who makes a job ready says so (lane_offer); who finds less than was written down corrects it
 * (pick.c). So to cancel ten thousand queued jobs touches no lane, and neither counts of ready jobs nor their order are
 * kept twice. */
#ifndef STORAGE_LANE_H
#define STORAGE_LANE_H

#include "storage/job_request.h"
#include "storage/kind.h"
#include "storage/owner.h"
#include "storage/sql.h"

enum { LANE_TURN = 1000000 };

/* The lane of a job that is asked for like this, made where it is not there; what the request says of its group and its
 * client's weight is kept. */
enum tw_status lane_find(struct store *store, struct owner owner, const struct job_request *request, enum job_kind kind,
			 int64_t *lane, struct tw_error *error) TW_NODISCARD;

/* A job of the lane has become ready. */
enum tw_status lane_offer(struct store *store, int64_t lane, int64_t priority, int64_t job,
			  struct tw_error *error) TW_NODISCARD;

/* A job runs now; or is about to run no more, and nothing where it does not run: the lanes of its group are blocked and
 * freed. */
enum tw_status lane_enter(struct store *store, int64_t job, struct tw_error *error) TW_NODISCARD;
enum tw_status lane_leave(struct store *store, int64_t job, struct tw_error *error) TW_NODISCARD;

#endif
