/* What a layout gives: files, the figures of a summary, and what it takes to make more files later. */
#ifndef SOLVER_LAYOUT_OUTPUT_H
#define SOLVER_LAYOUT_OUTPUT_H

#include "solver/layout/summary.h"
#include "solver/layout/trees.h"

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
	struct layout_trees trees; /* lies in the caller's arena */
};

/* The files that there are, by name, the first of them "layout.json"; NULL from `i` = their number on. And the media
 * type of one; NULL where there is no such file. */
const char *layout_file_name(uint32_t i);
const char *layout_file_media_type(const char *name);

#endif
