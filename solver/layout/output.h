/* What a layout gives: files, and the figures of a summary. */
#ifndef SOLVER_LAYOUT_OUTPUT_H
#define SOLVER_LAYOUT_OUTPUT_H

#include "solver/layout/summary.h"

#include <stddef.h>
#include <stdint.h>

/* A file that the layout gives. */
struct layout_artifact {
	const char *name;       /* borrowed, static: "layout.json", "pattern.svg", "suit.svg" */
	const char *media_type; /* borrowed, static */
	const char *bytes;      /* borrowed from the caller's arena; a NUL stands behind the last byte */
	size_t size;
};

enum { LAYOUT_ARTIFACTS_MAX = 8 };

struct layout_output {
	struct layout_artifact artifacts[LAYOUT_ARTIFACTS_MAX];
	uint32_t artifact_count;
	struct layout_summary summary;
};

#endif
