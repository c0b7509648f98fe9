/* The kinds of resources, and of the jobs that work on them: all that tells one kind from another, a row each. What
 * makes, addresses, shows or computes resources reads it here; a new kind of job is a row and its handler. */
#ifndef STORAGE_KIND_H
#define STORAGE_KIND_H

#include "storage/blob.h"

/* The numbers stand in the store: a new one goes to the end. */
enum resource_kind {
	RESOURCE_MESH,
	RESOURCE_MOTION,
	RESOURCE_FIELD,
	RESOURCE_LAYOUT,
	RESOURCE_RECORDING,
	RESOURCE_KINDS,
	RESOURCE_NONE = RESOURCE_KINDS, /* of a job that makes no resource */
};

enum job_kind {
	JOB_IMPORT_MESH,
	JOB_IMPORT_MOTION,
	JOB_COMPUTE_FIELD,
	JOB_COMPUTE_LAYOUT,
	JOB_RECORD,
	JOB_DRAW,
	JOB_KINDS,
};
#define JOB_KIND_BIT(kind) (1u << (kind))
#define JOB_KINDS_ALL ((1u << JOB_KINDS) - 1)

enum { KIND_NEEDS_MAX = 2, KIND_HREF_SIZE = 128 };

/* Who works on a kind of job. */
enum job_pool {
	JOB_POOL_WORKERS,
	JOB_POOL_RIG,
	JOB_POOLS,
};

/* What a resource is made from. */
struct kind_need {
	enum resource_kind kind;
	const char *member; /* what it is called where a resource is shown: "mesh", an id; "motions", a list of them */
	bool many;
	bool outdates; /* where it is outdated, so is what is made from it */
};

struct resource_kind_row {
	enum resource_kind kind;
	const char *name;  /* "mesh": also the word that its ids begin with */
	enum job_kind job; /* what makes it */
	/* Grows when a release computes something differently from the same request: equal requests are computed anew
	 * then, and what older versions made stays, and is shown as outdated. */
	uint32_t version;
	/* Its id is a hash of what was asked, so that equal requests find the same resource; else it is new each time.
	 */
	bool addressed;
	bool name_counts; /* its name is part of what was asked: a motion's stands in layouts */
	/* The path of its link; in braces "id", and where a kind lives within another the name of that. */
	const char *href;
	const char *options_member; /* what its options are called where it is shown */
	struct kind_need needs[KIND_NEEDS_MAX];
	unsigned need_count;
	unsigned contains; /* 1u << enum blob_role…: what it shows of its blobs */
};

struct job_kind_row {
	enum job_kind kind;
	const char *name;            /* "import_mesh" */
	enum resource_kind resource; /* what it makes, or RESOURCE_NONE */
	enum job_pool pool;
	uint64_t room_bytes; /* what its result takes beside what grows with its input, rounded up */
	/* Of a job that makes no resource but a file of one (task.h): of which kind that is, and which array of it the
	 * file is made from; a resource without it has no such jobs. Else RESOURCE_NONE and NULL. */
	enum resource_kind subject;
	const char *source;
};

const struct resource_kind_row *resource_kind_row(enum resource_kind kind);

/* Of a kind that only a newer release knows, which works on the same store: one named "unknown", that makes nothing. */
const struct job_kind_row *job_kind_row(enum job_kind kind);

const char *resource_kind_name(enum resource_kind kind); /* "mesh"; "unknown" of RESOURCE_NONE */
const char *job_kind_name(enum job_kind kind);           /* "import_mesh" */
bool resource_kind_by_name(const char *name, enum resource_kind *kind);
bool job_kind_by_name(const char *name, enum job_kind *kind);

/* Whether its link names the resource within which it lives: the first of those that it is made from. */
bool resource_kind_is_nested(enum resource_kind kind);

/* The link of a resource; `parent` is the id of what it lives within, and may be NULL where it lives on its own. */
void resource_kind_print_href(enum resource_kind kind, const char *parent, const char *id, char href[KIND_HREF_SIZE]);

#endif
