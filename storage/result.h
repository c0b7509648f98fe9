/* What a job leaves on its resource: a summary, arrays, artifacts. */
#ifndef STORAGE_RESULT_H
#define STORAGE_RESULT_H

#include "storage/blob.h"

struct job_artifact {
	const char *name;
	const char *media_type;
	const void *bytes;
	size_t size;
};

/* All borrowed. */
struct job_result {
	const char *summary; /* JSON: what clients see on the resource; may be NULL */
	bool incomplete;     /* the job ends as incomplete rather than succeeded */
	const struct tw_array *arrays;
	size_t array_count;
	const struct job_artifact *artifacts;
	size_t artifact_count;
	/* Id of a sealed upload that the resource takes over: what is too large for memory; or NULL. */
	const char *upload;
	const char *dropped_part; /* of its uploads, what is not needed any more; or NULL */
};

/* Bytes that its arrays and artifacts take. */
uint64_t result_size(const struct job_result *result);

/* --- internal to this folder ------------------------------------------------------------------------------------- */

/* A result on its way into the store. What is large is written ahead, in transactions of its own, so that nobody has to
 * wait for all of it; what is small with the rest. */
struct result_draft {
	const struct job_result *result; /* borrowed */
	int64_t *staged; /* owned; numbers of the blobs that were written ahead, arrays first; NULL: none */
	size_t staged_count;
};

/* Outside a transaction. result_discard, whatever comes of it. */
enum tw_status result_stage(struct store *store, const struct job_result *result, struct result_draft *draft,
			    struct tw_error *error) TW_NODISCARD;

/* Within the transaction that ends the job. `version` is that of the computation. */
enum tw_status result_write(struct store *store, int64_t resource, uint32_t version, const struct result_draft *draft,
			    struct tw_error *error) TW_NODISCARD;

/* The same for the one artifact of a task (task.h): a file of a resource that is there, which may be dropped again. */
enum tw_status result_write_file(struct store *store, int64_t resource, const struct result_draft *draft,
				 struct tw_error *error) TW_NODISCARD;

/* Frees the draft, outside a transaction; what was written ahead and is nobody's is let go of. */
void result_discard(struct store *store, struct result_draft *draft);

#endif
