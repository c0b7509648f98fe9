/* Jansson's tree is read field by field. A terminal's form is the row of `forms` whose fields it has. */
#include "solver/layout/request.h"

#include "solver/layout/json.h"
#include "solver/names.h"
#include "solver/option_json.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POINTER_SIZE = 96 };

/* The forms in the order of enum terminal_kind: which fields must be there. */
static const char *const forms[][2] = {
	{"vertex", NULL},
	{"face", "barycentric"},
	{"point_mm", NULL},
	{"piece", "uv_mm"},
};
enum { FORM_COUNT = sizeof forms / sizeof *forms };

/* Weights that are off by rounding are normalised; weights that are not of this face are an error. */
static enum tw_status read_barycentric(double weights[3], const json_t *value, const char *where,
				       struct tw_error *error)
{
	const double slack = 1e-4;
	enum tw_status status = json_read_numbers(weights, 3, value, where, error);
	if (status != TW_OK)
		return status;
	double sum = 0;
	for (int i = 0; i < 3; i++) {
		if (weights[i] < -slack || weights[i] > 1 + slack)
			return tw_fail(error, TW_ERROR_INPUT, "json-value", where,
				       "barycentric weights lie between 0 and 1");
		weights[i] = weights[i] < 0 ? 0 : weights[i];
		sum += weights[i];
	}
	if (fabs(sum - 1) > 3 * slack)
		return tw_fail(error, TW_ERROR_INPUT, "json-value", where, "barycentric weights must sum to 1, not %g",
			       sum);
	for (int i = 0; i < 3; i++)
		weights[i] /= sum;
	return TW_OK;
}

static enum tw_status read_field(struct layout_terminal *terminal, const char *key, const json_t *value,
				 const char *where, struct tw_error *error)
{
	if (!strcmp(key, "name"))
		return json_read_text(&terminal->name, value, where, error);
	if (!strcmp(key, "piece"))
		return json_read_text(&terminal->piece, value, where, error);
	if (!strcmp(key, "vertex"))
		return json_read_index(&terminal->vertex, value, where, error);
	if (!strcmp(key, "face"))
		return json_read_index(&terminal->face, value, where, error);
	if (!strcmp(key, "barycentric"))
		return read_barycentric(terminal->barycentric, value, where, error);
	if (!strcmp(key, "point_mm"))
		return json_read_numbers(terminal->point_mm, 3, value, where, error);
	if (!strcmp(key, "uv_mm"))
		return json_read_numbers(terminal->uv_mm, 2, value, where, error);
	static const char *const known[] = {"name", "vertex", "face", "barycentric", "point_mm", "piece", "uv_mm"};
	const struct names names = {known, sizeof known / sizeof *known};
	return names_refuse(&names, "member of a terminal", key, "json-unknown-field", where, error);
}

/* Exactly one form, whole. */
static enum tw_status find_form(struct layout_terminal *terminal, const json_t *object, const char *where,
				struct tw_error *error)
{
	int found = -1;
	const char *field = NULL, *missing = NULL; /* of the form found */
	for (int f = 0; f < FORM_COUNT; f++) {
		const char *first = forms[f][0], *second = forms[f][1];
		bool has_first = json_object_get(object, first) != NULL;
		bool has_second = second && json_object_get(object, second);
		if (!has_first && !has_second)
			continue;
		const char *here = has_first ? first : second;
		if (found >= 0)
			return tw_fail(error, TW_ERROR_INPUT, "json-value", where,
				       "the terminal has two placements at once, \"%s\" and \"%s\"; leave one out",
				       field, here);
		found = f;
		field = here;
		missing = !has_first ? first : has_second ? NULL : second;
	}
	if (found < 0)
		return tw_fail(error, TW_ERROR_INPUT, "json-missing-field", where,
			       "say where the terminal is: \"vertex\", \"face\" and \"barycentric\", \"point_mm\", or "
			       "\"piece\" and \"uv_mm\"");
	if (missing)
		return tw_fail(error, TW_ERROR_INPUT, "json-missing-field", where,
			       "a terminal with \"%s\" needs \"%s\" too", field, missing);
	terminal->kind = (enum terminal_kind)found;
	return TW_OK;
}

static enum tw_status read_terminal(struct layout_terminal *terminal, const json_t *object, const char *where,
				    struct tw_error *error)
{
	if (!json_is_object(object))
		return tw_fail(error, TW_ERROR_INPUT, "json-type", where, "a terminal must be an object");
	const char *key;
	json_t *value;
	json_object_foreach((json_t *)(uintptr_t)object, key, value)
	{
		char place[POINTER_SIZE];
		option_pointer(place, sizeof place, where, key);
		enum tw_status status = read_field(terminal, key, value, place, error);
		if (status != TW_OK)
			return status;
	}
	return find_form(terminal, object, where, error);
}

struct named {
	const char *name;
	uint32_t terminal;
};

static int compare_names(const void *a, const void *b)
{
	const struct named *p = a, *q = b;
	int order = strcmp(p->name, q->name);
	return order ? order : (p->terminal < q->terminal ? -1 : 1);
}

/* A name is how a result speaks of a terminal, so it must mean one. */
static enum tw_status check_names(const struct layout_request *request, struct tw_error *error)
{
	struct named *named = malloc(request->terminal_count * sizeof(struct named));
	if (!named)
		return tw_fail_memory(error);
	size_t count = 0;
	for (uint32_t i = 0; i < request->terminal_count; i++)
		if (request->terminals[i].name)
			named[count++] = (struct named){request->terminals[i].name, i};
	qsort(named, count, sizeof(struct named), compare_names);
	enum tw_status status = TW_OK;
	for (size_t i = 1; i < count && status == TW_OK; i++) {
		if (strcmp(named[i - 1].name, named[i].name) != 0)
			continue;
		char where[64];
		snprintf(where, sizeof where, "/terminals/%u/name", named[i].terminal);
		status = tw_fail(error, TW_ERROR_INPUT, "terminal-name-taken", where,
				 "terminal %u has the name \"%.80s\" already", named[i - 1].terminal, named[i].name);
	}
	free(named);
	return status;
}

static enum tw_status read_terminals(struct layout_request *request, const json_t *array, struct tw_error *error)
{
	if (!array)
		return tw_fail(error, TW_ERROR_INPUT, "json-missing-field", "/terminals",
			       "a layout needs \"terminals\"");
	if (!json_is_array(array))
		return tw_fail(error, TW_ERROR_INPUT, "json-type", "/terminals", "must be an array");
	size_t count = json_array_size(array);
	if (count == 0)
		return tw_fail(error, TW_ERROR_INPUT, "json-value", "/terminals", "name at least one terminal");
	if (count > TW_LIMIT_TERMINALS)
		return tw_fail(error, TW_ERROR_LIMIT, "too-many-terminals", "/terminals",
			       "%zu terminals are more than %u", count, TW_LIMIT_TERMINALS);
	request->terminals = calloc(count, sizeof *request->terminals);
	if (!request->terminals)
		return tw_fail_memory(error);
	request->terminal_count = (uint32_t)count;
	for (size_t i = 0; i < count; i++) {
		char where[32];
		snprintf(where, sizeof where, "/terminals/%zu", i);
		enum tw_status status = read_terminal(&request->terminals[i], json_array_get(array, i), where, error);
		if (status != TW_OK)
			return status;
	}
	return check_names(request, error);
}

static enum tw_status read_root(struct layout_request *request, const json_t *root, struct tw_error *error)
{
	static const char *const known[] = {"field", "terminals", "options", "constraints"};
	const struct names names = {known, sizeof known / sizeof *known};
	const char *key;
	json_t *value;
	json_object_foreach((json_t *)(uintptr_t)root, key, value)
	{
		size_t k = 0;
		while (k < names.count && strcmp(known[k], key) != 0)
			k++;
		if (k < names.count)
			continue;
		char where[POINTER_SIZE];
		option_pointer(where, sizeof where, "", key);
		return names_refuse(&names, "member of a layout request", key, "json-unknown-field", where, error);
	}
	const json_t *field = json_object_get(root, "field");
	enum tw_status status = field ? json_read_text(&request->field, field, "/field", error) : TW_OK;
	if (status == TW_OK)
		status = read_terminals(request, json_object_get(root, "terminals"), error);
	const json_t *options = json_object_get(root, "options");
	if (status == TW_OK && options)
		status = option_from_json(&layout_option_table, &request->options, options, "/options", NULL, error);
	const json_t *constraints = json_object_get(root, "constraints");
	if (status == TW_OK && constraints)
		status = layout_constraints_parse(&request->constraints, constraints, "/constraints", error);
	return status;
}

enum tw_status layout_request_parse(struct layout_request *request, const char *bytes, size_t size,
				    struct tw_error *error)
{
	*request = (struct layout_request){0};
	option_defaults(&layout_option_table, &request->options);
	json_t *root;
	enum tw_status status = option_json_parse(&root, bytes, size, error);
	if (status != TW_OK)
		return status;
	status = read_root(request, root, error);
	json_decref(root);
	if (status != TW_OK)
		layout_request_clear(request);
	return status;
}

static bool any_by_faces(const struct face_region *regions, uint32_t count)
{
	for (uint32_t i = 0; i < count; i++)
		if (regions[i].face_count > 0)
			return true;
	return false;
}

bool layout_request_has_numbers(const struct layout_request *request)
{
	const struct layout_constraints *constraints = &request->constraints;
	for (uint32_t i = 0; i < request->terminal_count; i++)
		if (request->terminals[i].kind == TERMINAL_VERTEX || request->terminals[i].kind == TERMINAL_FACE)
			return true;
	return constraints->free_edge_count > 0 || any_by_faces(constraints->keep_out, constraints->keep_out_count) ||
	       any_by_faces(constraints->multiplier, constraints->multiplier_count);
}

void layout_request_clear(struct layout_request *request)
{
	for (uint32_t i = 0; i < request->terminal_count; i++) {
		free(request->terminals[i].name);
		free(request->terminals[i].piece);
	}
	free(request->terminals);
	layout_constraints_clear(&request->constraints);
	free(request->field);
	*request = (struct layout_request){0};
}
