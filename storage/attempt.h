/* What became of the attempts of a job that left no result: the whole history, also of those before a redrive. */
#ifndef STORAGE_ATTEMPT_H
#define STORAGE_ATTEMPT_H

#include "storage/store.h"

/* The numbers stand in the store. */
enum attempt_ending {
	ATTEMPT_FAILED,      /* the job said so, or what it computes from does not suffice */
	ATTEMPT_CRASHED,     /* its worker died, or its lease ran out */
	ATTEMPT_INTERRUPTED, /* its worker went with the service or the machine */
	ATTEMPT_RELEASED,    /* its worker was asked to leave */
	ATTEMPT_PUT_OFF,     /* the store was full, or could not be written */
	ATTEMPT_CANCELLED,
	ATTEMPT_ENDINGS
};

const char *attempt_ending_name(enum attempt_ending ending); /* "failed" */

struct attempt {
	enum attempt_ending ending;
	uint32_t times;   /* so many in a row ended like this; the rest is of the last of them */
	uint32_t attempt; /* which of its attempts_max it was; 0 where it cost none */
	char worker[64];
	int64_t started_ms, ended_ms;
	char failure_type[64]; /* "" where there is nothing to tell */
	char failure_text[384];
};

enum { ATTEMPTS_KEPT = 100 }; /* of a job; older ones are forgotten */

/* Those of the job, oldest first. *attempts is heap memory, to be freed. No error where the job is not there. */
enum tw_status attempt_list(struct store *store, const char *job_id, struct attempt **attempts, size_t *count,
			    struct tw_error *error) TW_NODISCARD;

/* --- internal to this folder ------------------------------------------------------------------------------------- */

/* A running job ends an attempt: while it is still running. Nothing, where it is not. */
enum tw_status attempt_note(struct store *store, int64_t job, enum attempt_ending ending,
			    const struct tw_error *failure, struct tw_error *error) TW_NODISCARD;

#endif
