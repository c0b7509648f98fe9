#include "storage/kind.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

#define UPLOADS (1u << BLOB_UPLOAD)
#define ARRAYS (1u << BLOB_ARRAY)
#define ARTIFACTS (1u << BLOB_ARTIFACT)

/* Computation versions; 1 is what 0.1.0 computed. */
enum {
	MESH_VERSION = 2,   /* 2: keeps the numbers of the file, and the edges */
	MOTION_VERSION = 2, /* of the mean densities that an import leaves; 2: tension is the relaxed energy */
	/* A field is computed from means of today's version, whatever the import left: so its version grows with
	 * theirs. 1: bent seams and missing fabric count once. */
	FIELD_VERSION = 1 + MOTION_VERSION,
	LAYOUT_VERSION = 2,    /* 2: numbers are the file's */
	RECORDING_VERSION = 2, /* 2: gaps, exceptions and dropped samples are counted */
};

static const struct resource_kind_row resource_kinds[] = {
	{
		.kind = RESOURCE_MESH,
		.name = "mesh",
		.job = JOB_IMPORT_MESH,
		.version = MESH_VERSION,
		.addressed = true,
		.href = "/v1/meshes/{id}",
		.options_member = "options",
		.contains = UPLOADS | ARRAYS,
	},
	{
		.kind = RESOURCE_MOTION,
		.name = "motion",
		.job = JOB_IMPORT_MOTION,
		.version = MOTION_VERSION,
		.addressed = true,
		.name_counts = true,
		.href = "/v1/meshes/{mesh}/motions/{id}",
		.options_member = "options",
		.needs = {{.kind = RESOURCE_MESH, .member = "mesh"}},
		.need_count = 1,
		.contains = UPLOADS | ARRAYS,
	},
	{
		.kind = RESOURCE_FIELD,
		.name = "field",
		.job = JOB_COMPUTE_FIELD,
		.version = FIELD_VERSION,
		.addressed = true,
		.href = "/v1/fields/{id}",
		.options_member = "options",
		.needs = {{.kind = RESOURCE_MESH, .member = "mesh"},
			  {.kind = RESOURCE_MOTION, .member = "motions", .many = true}},
		.need_count = 2,
		.contains = ARRAYS,
	},
	{
		.kind = RESOURCE_LAYOUT,
		.name = "layout",
		.job = JOB_COMPUTE_LAYOUT,
		.version = LAYOUT_VERSION,
		.name_counts = true,
		.href = "/v1/layouts/{id}",
		.options_member = "request",
		.needs = {{.kind = RESOURCE_FIELD, .member = "field", .outdates = true}},
		.need_count = 1,
		.contains = ARTIFACTS,
	},
	{
		.kind = RESOURCE_RECORDING,
		.name = "recording",
		.job = JOB_RECORD,
		.version = RECORDING_VERSION,
		.name_counts = true,
		.href = "/v1/rig/recordings/{id}",
		.options_member = "options",
	},
};

#define MIB (UINT64_C(1) << 20)

/* Room: what comes on top of the size of uploads and arrays that it is made from (job_state_expect_room); a layout of
 * 36 terminals with drawings, and a recording of an hour. */
static const struct job_kind_row job_kinds[] = {
	{JOB_IMPORT_MESH, "import_mesh", RESOURCE_MESH, JOB_POOL_WORKERS, 2 * MIB, RESOURCE_NONE, NULL},
	{JOB_IMPORT_MOTION, "import_motion", RESOURCE_MOTION, JOB_POOL_WORKERS, 2 * MIB, RESOURCE_NONE, NULL},
	{JOB_COMPUTE_FIELD, "compute_field", RESOURCE_FIELD, JOB_POOL_WORKERS, 2 * MIB, RESOURCE_NONE, NULL},
	{JOB_COMPUTE_LAYOUT, "compute_layout", RESOURCE_LAYOUT, JOB_POOL_WORKERS, 8 * MIB, RESOURCE_NONE, NULL},
	{JOB_RECORD, "record", RESOURCE_RECORDING, JOB_POOL_RIG, 16 * MIB, RESOURCE_NONE, NULL},
	{JOB_DRAW, "draw", RESOURCE_NONE, JOB_POOL_WORKERS, 4 * MIB, RESOURCE_LAYOUT, "trees"},
};

static_assert(sizeof resource_kinds / sizeof *resource_kinds == RESOURCE_KINDS, "a row for each kind of resource");
static_assert(sizeof job_kinds / sizeof *job_kinds == JOB_KINDS, "a row for each kind of job");

const struct resource_kind_row *resource_kind_row(enum resource_kind kind)
{
	assert(kind < RESOURCE_KINDS && resource_kinds[kind].kind == kind);
	return &resource_kinds[kind];
}

const struct job_kind_row *job_kind_row(enum job_kind kind)
{
	static const struct job_kind_row unknown = {JOB_KINDS, "unknown",     RESOURCE_NONE, JOB_POOL_WORKERS,
						    0,         RESOURCE_NONE, NULL};
	assert(kind >= JOB_KINDS || job_kinds[kind].kind == kind);
	return kind < JOB_KINDS ? &job_kinds[kind] : &unknown;
}

const char *resource_kind_name(enum resource_kind kind)
{
	return kind == RESOURCE_NONE ? "unknown" : resource_kind_row(kind)->name;
}

const char *job_kind_name(enum job_kind kind)
{
	return job_kind_row(kind)->name;
}

bool resource_kind_by_name(const char *name, enum resource_kind *kind)
{
	for (int i = 0; i < RESOURCE_KINDS; i++)
		if (!strcmp(resource_kinds[i].name, name)) {
			*kind = resource_kinds[i].kind;
			return true;
		}
	return false;
}

bool job_kind_by_name(const char *name, enum job_kind *kind)
{
	for (int i = 0; i < JOB_KINDS; i++)
		if (!strcmp(job_kinds[i].name, name)) {
			*kind = job_kinds[i].kind;
			return true;
		}
	return false;
}

bool resource_kind_is_nested(enum resource_kind kind)
{
	return strncmp(strchr(resource_kind_row(kind)->href, '{'), "{id}", 4) != 0;
}

void resource_kind_print_href(enum resource_kind kind, const char *parent, const char *id, char href[KIND_HREF_SIZE])
{
	const char *from = resource_kind_row(kind)->href;
	size_t used = 0;
	href[0] = '\0';
	while (*from && used < KIND_HREF_SIZE) {
		size_t plain = strcspn(from, "{");
		used += (size_t)snprintf(href + used, KIND_HREF_SIZE - used, "%.*s", (int)plain, from);
		from += plain;
		if (*from != '{' || used >= KIND_HREF_SIZE)
			continue;
		const char *value = strncmp(from, "{id}", 4) == 0 ? id : parent;
		assert(value);
		used += (size_t)snprintf(href + used, KIND_HREF_SIZE - used, "%s", value);
		from = strchr(from, '}') + 1;
	}
	assert(used < KIND_HREF_SIZE);
}
