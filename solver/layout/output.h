/* What a layout gives: files, the figures of a summary, and what it takes to make more files later. */
#ifndef SOLVER_LAYOUT_OUTPUT_H
#define SOLVER_LAYOUT_OUTPUT_H

#include "solver/layout/request.h"
#include "solver/layout/summary.h"
#include "solver/layout/trees.h"
#include "solver/steiner/steiner.h"

#include <stddef.h>
#include <stdint.h>

/* A file that the layout gives. */
struct layout_artifact {
	const char *name;       /* borrowed, static: "layout.json", "pattern.svg", "suit.svg" */
	const char *media_type; /* borrowed, static */
	const char *bytes;      /* borrowed from the caller's arena; a NUL stands behind the last byte */
	size_t size;
};

/* Our tree as it was found, and in what: a warm state can be prepared for it (steiner_warm_prepare). All borrowed from
 * the caller's arena. */
struct layout_found {
	struct graph graph;
	const uint32_t *terminal; /* [terminal_count] */
	uint32_t terminal_count;
	struct steiner_options options; /* without callbacks */
	struct steiner_tree tree;
};

struct layout_output {
	struct layout_artifact artifacts[LAYOUT_ARTIFACTS_MAX];
	uint32_t artifact_count;
	struct layout_summary summary;
	struct layout_trees trees; /* lies in the caller's arena */
	struct layout_found found;
};

#endif
