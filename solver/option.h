/* Options as tables: one row gives an option's name, type, unit, default, range and explanation, and from that row come
 * the default, the parsing of command lines and of JSON, the help text and the echo in a result. */
#ifndef SOLVER_OPTION_H
#define SOLVER_OPTION_H

#include "tightwire.h"

#include <jansson.h>
#include <stdbool.h>

enum option_kind {
	OPTION_NUMBER,         /* double, finite */
	OPTION_NUMBER_OR_AUTO, /* double; "auto" is NaN */
	OPTION_INTEGER,        /* uint32_t */
	OPTION_CHOICE,         /* int: index into choices */
	OPTION_FLAG,           /* bool */
};

struct option {
	const char *name; /* snake_case as in JSON, with its unit: "strip_width_mm"; the flag is --strip-width-mm */
	enum option_kind kind;
	size_t offset;    /* offsetof in the struct that the table describes */
	const char *unit; /* for the help; NULL for none */
	double fallback;  /* default: number, integer, index of the choice, or 0 and 1; NAN for "auto", of an integer
			     UINT32_MAX for none */
	double minimum, maximum;    /* inclusive; of numbers and integers */
	const char *const *choices; /* NULL-terminated; of a choice */
	const char *help;           /* one line */
};

struct option_table {
	const struct option *rows;
	size_t count;
};

/* Sets every option of the struct at `values` to its default. */
void option_defaults(const struct option_table *table, void *values);

/* Whether the table has the option `name` (with _ or -). */
bool option_is_known(const struct option_table *table, const char *name);

/* Adds the options' names, borrowed, behind the *count that are there. `names` has room for OPTION_NAMES_MAX. */
#define OPTION_NAMES_MAX 128
void option_add_names(const struct option_table *table, const char *names[OPTION_NAMES_MAX], size_t *count);

/* Sets the option `name` (with _ or -) from text. TW_ERROR_INPUT "option-unknown" when the table has no such option,
 * "option-value" when the text does not fit; error->where is the name. */
enum tw_status option_from_text(const struct option_table *table, void *values, const char *name, const char *text,
				struct tw_error *error) TW_NODISCARD;

/* Reads `--name value` or `--name=value` (a flag option stands alone, or with =true or =false) at argv[*index]. *taken
 * says whether the argument was one of the table's; *index then stands on the last argument used. */
enum tw_status option_from_arguments(const struct option_table *table, void *values, int argc, char *const *argv,
				     int *index, bool *taken, struct tw_error *error) TW_NODISCARD;

/* Writes the JSON Pointer (RFC 6901) of a member of what `pointer` points to; its ~ and / are escaped, and what does
 * not fit is cut. */
void option_pointer(char *where, size_t size, const char *pointer, const char *member);

/* Sets the options that stand in a JSON object. A member that is neither in the table nor among `others`
 * (NULL-terminated, may be NULL) is an error. error->where is the JSON Pointer `pointer`/name. */
enum tw_status option_from_json(const struct option_table *table, void *values, const json_t *object,
				const char *pointer, const char *const *others, struct tw_error *error) TW_NODISCARD;

/* All options in the table's order; a new reference, NULL when out of memory. */
json_t *option_to_json(const struct option_table *table, const void *values) TW_NODISCARD;

/* One line or two an option, for --help. */
void option_print_help(const struct option_table *table, FILE *out);

#endif
