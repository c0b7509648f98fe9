/* Terminals on the fabric: where each of a request's terminals lies, with equal ones merged (method 4). */
#ifndef SOLVER_LAYOUT_TERMINALS_H
#define SOLVER_LAYOUT_TERMINALS_H

#include "solver/garment/garment.h"
#include "solver/layout/request.h"
#include "solver/pattern/locate.h"

enum site_kind {
	SITE_VERTEX, /* at a mesh vertex */
	SITE_EDGE,   /* inside an edge */
	SITE_FACE,   /* inside a face */
};

/* Where a site lies on the pattern: on a seam it does so more than once, on every piece that meets there. */
struct site_mark {
	uint32_t piece;
	struct vec2 at; /* mm, in the pattern's coordinates */
};

/* A place that carries one terminal, or several that coincide. */
struct site {
	enum site_kind kind;
	uint32_t vertex;        /* SITE_VERTEX */
	uint32_t edge;          /* SITE_EDGE */
	double along;           /* SITE_EDGE: share of the way from the edge's first end to its second, 0 < along < 1 */
	struct place place;     /* a face it lies in, with the barycentric weights */
	struct site_mark *mark; /* [mark_count] the one of `place` first, then by face; no two are the same */
	uint32_t mark_count;
	uint32_t terminal;     /* the first request terminal that lies here */
	uint32_t merged_count; /* further ones */
};

struct site_set {
	struct site *site; /* [count], in the order of first mention */
	uint32_t count;
	uint32_t *site_of;  /* [terminal_count of the request] */
	double *snapped_mm; /* [terminal_count of the request] how far each was from the fabric */
};

/* Places and merges. Vertices and faces are the uploaded file's; a point in a face needs a triangle of the file. A
 * point is snapped to the nearest fabric when that is at most `snap_mm` away. Places within 1e-3 mm of a vertex or an
 * edge lie on it. `locator` may be NULL where no terminal is given by its piece. Errors, with a JSON Pointer:
 * "terminal-out-of-range", "terminal-in-polygon", "terminal-off-fabric", "terminal-unknown-piece", "terminals-apart"
 * (TW_ERROR_INPUT); TW_ERROR_MEMORY. */
enum tw_status terminals_place(struct site_set *set, struct arena *arena, const struct garment *garment,
			       const struct topology *topology, const struct locator *locator,
			       const struct layout_request *request, double snap_mm,
			       struct tw_error *error) TW_NODISCARD;

#endif
