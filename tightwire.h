/* The vocabulary that every room shares: status, error and limits. It knows no room. */
#ifndef TIGHTWIRE_H
#define TIGHTWIRE_H

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#define TW_VERSION "0.2.0"

#define TW_NODISCARD __attribute__((warn_unused_result))
#define TW_PRINTF(format_index, first_index) __attribute__((format(printf, format_index, first_index)))

/* What a function that can fail returns. 0 is success; results come through out-parameters. Infeasible, cancelled and
 * time-limit are outcomes of a computation, not errors, and stand in the result of that computation. */
enum tw_status {
	TW_OK = 0,
	TW_ERROR_INPUT,       /* what the user gave is wrong; the error names the place */
	TW_ERROR_NOT_FOUND,   /* the named thing does not exist */
	TW_ERROR_CONFLICT,    /* the thing is in a state that does not allow this */
	TW_ERROR_LIMIT,       /* larger than a limit of tw_limit */
	TW_ERROR_MEMORY,      /* the allocator or the arena's budget said no */
	TW_ERROR_IO,          /* a file, socket or device failed */
	TW_ERROR_FULL,        /* the disk or the store is full */
	TW_ERROR_CANCELLED,   /* somebody asked to stop */
	TW_ERROR_UNSUPPORTED, /* understood, but not offered by this build or format */
	TW_ERROR_INTERNAL     /* a bug of ours */
};

/* Filled once, where the error arises, and passed through unchanged. `type` is a stable slug (RFC 9457 `type` is made
 * from it: "urn:tightwire:problem:" type); it must point to static storage. */
struct tw_error {
	enum tw_status status;
	const char *type; /* borrowed, static: "mesh-non-manifold-edge" */
	char where[128];  /* JSON Pointer into the request ("/terminals/3/vertex"), or "line 12", "face 7", "byte 40" */
	char text[384];   /* one sentence: what was wrong and what to do */
};

/* Fills *error (may be NULL). `where` may be NULL. The text is cut, never overrun. */
TW_PRINTF(5, 0)
static inline void tw_error_vfill(struct tw_error *error, enum tw_status status, const char *type, const char *where,
				  const char *format, va_list arguments)
{
	if (!error)
		return;
	error->status = status;
	error->type = type;
	snprintf(error->where, sizeof error->where, "%s", where ? where : "");
	vsnprintf(error->text, sizeof error->text, format, arguments);
}

TW_PRINTF(5, 6)
static inline void tw_error_fill(struct tw_error *error, enum tw_status status, const char *type, const char *where,
				 const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	tw_error_vfill(error, status, type, where, format, arguments);
	va_end(arguments);
}

/* tw_error_fill(error, status, type, where, format, …) with `status` as its value: `return tw_fail(error, …)`. A macro,
 * so that compilers and analysers see which status it is. */
#define tw_fail(error, status, ...) (tw_error_fill((error), (status), __VA_ARGS__), (enum tw_status)(status))

/* The failure that needs no explanation. */
static inline enum tw_status tw_fail_memory(struct tw_error *error)
{
	return tw_fail(error, TW_ERROR_MEMORY, "out-of-memory", NULL, "not enough memory for this request");
}

/* A named array, the form in which computed data crosses between rooms, is stored as a BLOB and served to viewers:
 * little-endian, row by row. */
enum tw_type { TW_F32, TW_F64, TW_U8, TW_U32, TW_U64 };

struct tw_array {
	const char *name; /* borrowed: "position" */
	enum tw_type type;
	uint32_t columns; /* 3 for a list of points */
	uint64_t rows;
	const void *data; /* borrowed: rows * columns values */
};

static inline size_t tw_type_size(enum tw_type type)
{
	return type == TW_U8 ? 1 : type == TW_F32 || type == TW_U32 ? 4 : 8;
}

/* Limits that every parser checks before it allocates. */
#define TW_LIMIT_VERTICES 4000000u /* of a garment */
#define TW_LIMIT_FACES 8000000u
#define TW_LIMIT_TERMINALS 4096u
#define TW_LIMIT_FRAMES 1000000u /* of a motion */
#define TW_LIMIT_MOTIONS 4096u   /* of a motion set */
#define TW_LIMIT_JSON_BYTES (4u << 20)
#define TW_LIMIT_JSON_DEPTH 32u
#define TW_LIMIT_UPLOAD_BYTES (16ull << 30)

#endif
