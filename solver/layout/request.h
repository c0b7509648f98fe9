/* The layout request: which terminals to connect, and the options. One parser for the service's API, its workers and
 * the command line.
 *
 *   {"field": "fld_…",                                      the service's; the command line leaves it out
 *    "terminals": [{"name": "left elbow", "vertex": 17},
 *                  {"face": 5, "barycentric": [0.2, 0.3, 0.5]},
 *                  {"point_mm": [12.0, 1310.5, -88.1]},
 *                  {"piece": "front", "uv_mm": [310.0, 45.5]}],
 *    "options": {"baseline": "unit"},
 *    "constraints": {"keep_out": [{"faces": [7, 8]}, {"piece": "front", "polygon_mm": [[0, 0], [80, 0], [0, 60]]}],
 *                    "face_multipliers": [{"faces": [20, 21], "factor": 2.5}],
 *                    "seam_price_mpa_mm2": 40.0,
 *                    "free_edges": [[17, 18], [18, 44]]}}
 */
#ifndef SOLVER_LAYOUT_REQUEST_H
#define SOLVER_LAYOUT_REQUEST_H

#include "solver/layout/constraints.h"
#include "solver/layout/options.h"
#include "tightwire.h"

#include <stdbool.h>

/* The four ways to say where a terminal is. */
enum terminal_kind { TERMINAL_VERTEX, TERMINAL_FACE, TERMINAL_POINT, TERMINAL_PATTERN };

struct layout_terminal {
	enum terminal_kind kind;
	char *name;            /* owned by the request; NULL when it has none */
	uint32_t vertex;       /* TERMINAL_VERTEX: 0-based */
	uint32_t face;         /* TERMINAL_FACE: 0-based */
	double barycentric[3]; /* TERMINAL_FACE: of the face's corners in order, each 0…1, sum 1 (normalised here) */
	double point_mm[3];    /* TERMINAL_POINT: in the space of the worn mesh; snapped to the nearest fabric */
	char *piece;           /* TERMINAL_PATTERN: owned by the request; name of a pattern piece */
	double uv_mm[2];       /* TERMINAL_PATTERN: in the pattern's coordinates */
};

struct layout_request {
	char *field;                       /* owned; opaque id, NULL when the request has none */
	struct layout_terminal *terminals; /* owned; [terminal_count], 1…TW_LIMIT_TERMINALS, in the request's order */
	uint32_t terminal_count;
	struct layout_options options;
	struct layout_constraints constraints; /* owned */
};

/* Parses and checks everything that can be checked without the garment. Every failure names its place as a JSON
 * Pointer (malformed JSON: line and column). TW_ERROR_INPUT "json-malformed", "json-too-deep", "json-type",
 * "json-value", "json-missing-field", "json-unknown-field", "option-value", "terminal-name-taken"; TW_ERROR_LIMIT
 * "json-too-large", "too-many-terminals"; TW_ERROR_MEMORY. On failure *request is empty and needs no clearing. */
enum tw_status layout_request_parse(struct layout_request *request, const char *bytes, size_t size,
				    struct tw_error *error) TW_NODISCARD;

/* Whether it names vertices, faces or edges by number. */
bool layout_request_has_numbers(const struct layout_request *request);

/* Frees what the request owns. */
void layout_request_clear(struct layout_request *request);

/* The files that a layout may be asked for, by name, the first of them "layout.json"; NULL from `i` = their number on.
 * And the media type of one; NULL where there is no such file. */
enum { LAYOUT_ARTIFACTS_MAX = 8 };
const char *layout_file_name(uint32_t i);
const char *layout_file_media_type(const char *name);

#endif
