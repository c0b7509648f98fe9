/* Which job a claim takes: the order that job_request.h promises, in a few steps in an index each, however many jobs,
 * clients and groups there are. Internal to this folder. */
#ifndef STORAGE_PICK_H
#define STORAGE_PICK_H

#include "storage/claim.h"
#include "storage/kind.h"
#include "storage/sql.h"

struct pick {
	int64_t job; /* 0: none */
	int64_t lane, share;
	int64_t turn;   /* of the share */
	int64_t passed; /* the job that another is preferred to; 0: none */
	enum job_pool pool;
	enum job_class class;
	bool is_last;                    /* of its lane */
	bool has_rivals;                 /* other shares of the class are open */
	bool has_skipped;                /* some of them had an earlier turn, but nothing that could be claimed */
	int64_t passes[JOB_CLASSES_END]; /* how often each class was passed over before */
	/* What was written down promised more than there was. Then nothing may have been found though there is
	 * something: it is corrected within a transaction, a bounded number of steps at a time. */
	bool stale;
};

/* What could be claimed, without changing anything: for a first look without the write lock, which need not be exact.
 * `room`: bytes that a result may take. */
enum tw_status pick_look(struct store *store, const struct claim_query *query, uint64_t room, struct pick *pick,
			 struct tw_error *error) TW_NODISCARD;

/* The job to take, within a transaction; corrects what it finds to be out of date. Where `stale` is set and no job was
 * found, there is more to correct: to be called again in another transaction. */
enum tw_status pick_find(struct store *store, const struct claim_query *query, uint64_t room, struct pick *pick,
			 struct tw_error *error) TW_NODISCARD;

/* The job has been taken: what follows for the others' turns. */
enum tw_status pick_taken(struct store *store, const struct claim_query *query, struct pick *pick,
			  struct tw_error *error) TW_NODISCARD;

#endif
