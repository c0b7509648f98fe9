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

/* Internal to this folder: writes it, inside the caller's transaction. `version` is that of the computation. */
enum tw_status result_write(struct store *store, int64_t resource, uint32_t version, const struct job_result *result,
			    struct tw_error *error) TW_NODISCARD;

#endif
