#include "solver/field/options.h"

static const char *const presets[] = {"none", "paper", NULL};
static const char *const models[] = {"stvk", "printed", "tension", NULL};
static const char *const references[] = {"pattern", "worn", "frame", NULL};
static const char *const weightings[] = {"deformation", "unit", "length", NULL};
static const char *const overhangs[] = {"charge", "ignore", "forbid", NULL};

#define PLACE(member) offsetof(struct field_options, member)
#define CHOICE(name, member, choices, help)                                                                            \
	{                                                                                                              \
		name, OPTION_CHOICE, PLACE(member), NULL, 0, 0, 0, choices, help                                       \
	}

static const struct option rows[] = {
	CHOICE("preset", preset, presets,
	       "paper: energy printed and overhang ignore, where they are not set otherwise"),
	CHOICE("energy", energy, models,
	       "energy density: St. Venant-Kirchhoff, the paper's printed formula, or relaxed: cloth wrinkles, not "
	       "compresses"),
	CHOICE("reference", reference, references,
	       "what counts as undeformed: flat pattern, worn rest pose, or a frame"),
	{"reference_frame", OPTION_INTEGER, PLACE(reference_frame), NULL, 0, 0, TW_LIMIT_FRAMES - 1, NULL,
	 "frame of each motion that counts as undeformed, from 0, with reference frame"},
	CHOICE("weight", weight, weightings,
	       "what an edge costs: deformation of its strip, 1 (fewest edges), or its length"),
	{"strip_width_mm", OPTION_NUMBER, PLACE(strip_width_mm), "mm", 15, 0.1, 200, NULL,
	 "width of the strip that carries the wire"},
	{"eta_mpa", OPTION_NUMBER, PLACE(eta_mpa), "MPa", 0.1, 0, 1e6, NULL,
	 "price of covered fabric that does not deform: larger makes shorter wires; a layout can find its own"},
	CHOICE("overhang", overhang, overhangs,
	       "fabric that a strip misses: charged at the strip's largest density, ignored, or the edge forbidden"),
	{"overhang_share", OPTION_NUMBER, PLACE(overhang_share), NULL, 0.25, 0, 1, NULL,
	 "share of a strip that may leave the fabric, with overhang forbid"},
};

const struct option_table field_option_table = {rows, sizeof rows / sizeof *rows};

const char *field_reference_name(enum field_reference reference)
{
	return references[reference];
}

/* What a preset is: other defaults. */
static void apply_preset(struct field_options *options)
{
	if (options->preset != FIELD_PRESET_PAPER)
		return;
	options->energy = STRAIN_PRINTED;
	options->overhang = FIELD_OVERHANG_IGNORE;
}

void field_options_defaults(struct field_options *options, enum field_preset preset)
{
	option_defaults(&field_option_table, options);
	options->preset = (int)preset;
	apply_preset(options);
}

enum tw_status field_options_from_json(struct field_options *options, const json_t *object, const char *pointer,
				       struct tw_error *error)
{
	field_options_defaults(options, FIELD_PRESET_NONE);
	enum tw_status status = option_from_json(&field_option_table, options, object, pointer, NULL, error);
	if (status != TW_OK || options->preset == FIELD_PRESET_NONE)
		return status;
	field_options_defaults(options, (enum field_preset)options->preset);
	return option_from_json(&field_option_table, options, object, pointer, NULL, error);
}

json_t *field_options_changes(const struct field_options *options)
{
	struct field_options plain, preset;
	field_options_defaults(&plain, FIELD_PRESET_NONE);
	field_options_defaults(&preset, (enum field_preset)options->preset);
	plain.preset = preset.preset;
	json_t *before = option_to_json(&field_option_table, &plain),
	       *after = option_to_json(&field_option_table, &preset);
	json_t *now = option_to_json(&field_option_table, options);
	json_t *changes = before && after && now ? json_object() : NULL;
	const char *name;
	json_t *value;
	json_object_foreach(after, name, value)
	{
		if (changes && !json_equal(value, json_object_get(before, name)) &&
		    json_equal(value, json_object_get(now, name)) && json_object_set(changes, name, value)) {
			json_decref(changes);
			changes = NULL;
		}
	}
	json_decref(before);
	json_decref(after);
	json_decref(now);
	return changes;
}
