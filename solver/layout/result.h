/* A finished layout as its writers see it. Adding a kind of file is one function and one row in artifacts.c. */
#ifndef SOLVER_LAYOUT_RESULT_H
#define SOLVER_LAYOUT_RESULT_H

#include "solver/drawing/drawing.h"
#include "solver/layout/ground.h"
#include "solver/layout/metrics.h"
#include "solver/layout/rules.h"
#include "solver/layout/strips.h"
#include "solver/layout/summary.h"
#include "solver/steiner/steiner.h"
#include "solver/text.h"

/* A tree with all that follows from it. */
struct solved {
	struct steiner_tree tree;
	bool has_chords; /* it was searched on the mesh's edges and the flip chords: of that graph it is optimal */
	struct branch_set branches;
	struct wire_set wires;
	struct strip_areas *strips; /* [branches.branch_count] */
	struct trace trace;
	struct layout_metrics metrics;
	struct violation_list violations;
};

struct layout_result {
	const struct layout_input *input; /* with the ground's garment, topology and field */
	const struct ground *ground;      /* leads back to the caller's numbers, which are shown */
	const struct field *field;        /* the input's, or that with this layout's eta and constraints */
	const struct outline *outline;
	const struct locator *locator;
	const struct site_set *sites;
	const struct network *network;
	const struct wire_rules *rules;
	const struct wire_rules *baseline_rules;
	const struct solved *ours;
	const struct solved *baseline;        /* NULL without one */
	bool has_motions;                     /* the motions were asked: energies by motion may be there */
	bool has_elongation;                  /* and some have frames */
	const struct layout_summary *summary; /* its figures; of the seconds none is known yet */
};

/* The text's own failure is the only one. */
void write_layout_json(const struct layout_result *result, struct text *text);

/* Fill a drawing, whose arena becomes `arena`: the pattern with the wires, and the worn suit from both sides. */
void pattern_draw(const struct layout_result *result, struct drawing *drawing, struct arena *arena);
void suit_draw(const struct layout_result *result, struct drawing *drawing, struct arena *arena);

/* The name that a result calls a terminal: its own, or "T1", "T2", … by its index. `buffer` has at least 16 bytes. */
const char *terminal_name(const struct layout_request *request, uint32_t terminal, char *buffer);

#endif
