/* The options of a weight field, one table for command line, requests and workers. `make help`'s words are the table's;
 * method 2 and 3 say what they mean. */
#ifndef SOLVER_FIELD_OPTIONS_H
#define SOLVER_FIELD_OPTIONS_H

#include "solver/option.h"

enum strain_model {
	STRAIN_STVK,    /* St. Venant-Kirchhoff: mu |G|_F^2 + lambda/2 tr(G)^2 */
	STRAIN_PRINTED, /* as the paper prints it, clamped: max(0, mu |G|_2 + lambda/2 tr(G)) */
	STRAIN_TENSION, /* STRAIN_STVK relaxed: what is left when cloth that would be compressed wrinkles instead */
	STRAIN_MODELS
};

enum field_preset { FIELD_PRESET_NONE, FIELD_PRESET_PAPER };

/* What counts as undeformed. */
enum field_reference {
	FIELD_REFERENCE_PATTERN, /* the flat pattern */
	FIELD_REFERENCE_WORN,    /* the garment as worn in its rest pose */
	FIELD_REFERENCE_FRAME    /* one frame of each motion, `reference_frame` */
};

/* What an edge costs. */
enum field_weighting {
	FIELD_DEFORMATION, /* the strip integral of method 3 */
	FIELD_UNIT,        /* 1, the paper's minimum-length baseline */
	FIELD_LENGTH       /* its rest length in mm; of a seam edge the mean of its two sides */
};

/* What fabric costs that a strip needs and that is not there. */
enum field_overhang {
	FIELD_OVERHANG_CHARGE, /* the strip's own largest density plus eta */
	FIELD_OVERHANG_IGNORE, /* nothing */
	FIELD_OVERHANG_FORBID  /* charged up to `overhang_share` of the strip; beyond it the edge is not in the graph */
};

struct field_options {
	int preset;    /* enum field_preset */
	int energy;    /* enum strain_model */
	int reference; /* enum field_reference */
	uint32_t reference_frame;
	int weight; /* enum field_weighting */
	double strip_width_mm;
	double eta_mpa;
	int overhang; /* enum field_overhang */
	double overhang_share;
};

extern const struct option_table field_option_table;

/* "pattern", "worn", "frame". */
const char *field_reference_name(enum field_reference reference);

/* The defaults with a preset, which is nothing but other defaults: whatever is set explicitly, before it or behind it,
 * stays as it was set. */
void field_options_defaults(struct field_options *options, enum field_preset preset);

/* Reads options of a request: those of `object`, over the defaults of the preset that it names. Errors as
 * option_from_json. */
enum tw_status field_options_from_json(struct field_options *options, const json_t *object, const char *pointer,
				       struct tw_error *error) TW_NODISCARD;

/* What of the options is as it is because of the preset: {"energy": "printed", …}, empty without one. A new reference;
 * NULL when out of memory. */
json_t *field_options_changes(const struct field_options *options) TW_NODISCARD;

#endif
