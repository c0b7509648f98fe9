#include "solver/option.h"

#include "solver/names.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The struct that a table describes is any struct: values are copied by offset. */
static void store(const struct option *option, void *values, double value)
{
	char *place = (char *)values + option->offset;
	switch (option->kind) {
	case OPTION_NUMBER:
	case OPTION_NUMBER_OR_AUTO:
		memcpy(place, &value, sizeof value);
		break;
	case OPTION_INTEGER:
		memcpy(place, &(uint32_t){(uint32_t)value}, sizeof(uint32_t));
		break;
	case OPTION_CHOICE:
		memcpy(place, &(int){(int)value}, sizeof(int));
		break;
	case OPTION_FLAG:
		memcpy(place, &(bool){value != 0}, sizeof(bool));
		break;
	}
}

static double load(const struct option *option, const void *values)
{
	const char *place = (const char *)values + option->offset;
	double number = 0;
	uint32_t integer = 0;
	int choice = 0;
	bool flag = false;
	switch (option->kind) {
	case OPTION_NUMBER:
	case OPTION_NUMBER_OR_AUTO:
		memcpy(&number, place, sizeof number);
		return number;
	case OPTION_INTEGER:
		memcpy(&integer, place, sizeof integer);
		return integer;
	case OPTION_CHOICE:
		memcpy(&choice, place, sizeof choice);
		return choice;
	case OPTION_FLAG:
		memcpy(&flag, place, sizeof flag);
		return flag;
	}
	return 0;
}

void option_defaults(const struct option_table *table, void *values)
{
	for (size_t i = 0; i < table->count; i++)
		store(&table->rows[i], values, table->rows[i].fallback);
}

/* Names are equal where - and _ count as the same. */
static bool same_name(const char *name, const char *text, size_t length)
{
	if (strlen(name) != length)
		return false;
	for (size_t i = 0; i < length; i++)
		if (name[i] != (text[i] == '-' ? '_' : text[i]))
			return false;
	return true;
}

static const struct option *find(const struct option_table *table, const char *name, size_t length)
{
	for (size_t i = 0; i < table->count; i++)
		if (same_name(table->rows[i].name, name, length))
			return &table->rows[i];
	return NULL;
}

/* "charge, ignore or forbid" */
static const char *choice_list(const struct option *option, char *text, size_t size)
{
	size_t used = 0;
	text[0] = 0;
	for (size_t i = 0; option->choices[i] && used < size; i++) {
		const char *glue = i == 0 ? "" : option->choices[i + 1] ? ", " : " or ";
		used += (size_t)snprintf(text + used, size - used, "%s%s", glue, option->choices[i]);
	}
	return text;
}

static enum tw_status fail_value(const struct option *option, const char *where, struct tw_error *error)
{
	char list[160];
	switch (option->kind) {
	case OPTION_CHOICE:
		return tw_fail(error, TW_ERROR_INPUT, "option-value", where, "%s must be one of %s", option->name,
			       choice_list(option, list, sizeof list));
	case OPTION_FLAG:
		return tw_fail(error, TW_ERROR_INPUT, "option-value", where, "%s must be true or false", option->name);
	default:
		return tw_fail(error, TW_ERROR_INPUT, "option-value", where, "%s must be %s from %.10g to %.10g%s%s%s",
			       option->name, option->kind == OPTION_INTEGER ? "a whole number" : "a number",
			       option->minimum, option->maximum, option->unit ? " " : "",
			       option->unit ? option->unit : "",
			       option->kind == OPTION_NUMBER_OR_AUTO ? ", or \"auto\"" : "");
	}
}

static enum tw_status store_number(const struct option *option, void *values, double value, const char *where,
				   struct tw_error *error)
{
	bool whole = option->kind != OPTION_INTEGER || value == floor(value);
	if (!isfinite(value) || !whole || value < option->minimum || value > option->maximum)
		return fail_value(option, where, error);
	store(option, values, value);
	return TW_OK;
}

static enum tw_status store_text(const struct option *option, void *values, const char *text, const char *where,
				 struct tw_error *error)
{
	if (option->kind == OPTION_NUMBER_OR_AUTO && !strcmp(text, "auto")) {
		store(option, values, NAN);
		return TW_OK;
	}
	for (int i = 0; option->kind == OPTION_CHOICE && option->choices[i]; i++) {
		if (!strcmp(option->choices[i], text)) {
			store(option, values, i);
			return TW_OK;
		}
	}
	return fail_value(option, where, error);
}

static enum tw_status parse_text(const struct option *option, void *values, const char *text, const char *where,
				 struct tw_error *error)
{
	if (option->kind == OPTION_FLAG) {
		bool yes = !strcmp(text, "true");
		if (!yes && strcmp(text, "false") != 0)
			return fail_value(option, where, error);
		store(option, values, yes);
		return TW_OK;
	}
	char *end;
	double value = strtod(text, &end);
	if (end == text || *end || option->kind == OPTION_CHOICE)
		return store_text(option, values, text, where, error);
	return store_number(option, values, value, where, error);
}

bool option_is_known(const struct option_table *table, const char *name)
{
	return find(table, name, strlen(name)) != NULL;
}

void option_add_names(const struct option_table *table, const char *names[OPTION_NAMES_MAX], size_t *count)
{
	for (size_t i = 0; i < table->count; i++) {
		assert(*count < OPTION_NAMES_MAX);
		names[(*count)++] = table->rows[i].name;
	}
}

/* `others`: what may stand beside the options; NULL-terminated, may be NULL. */
static enum tw_status refuse(const struct option_table *table, const char *const *others, const char *what,
			     const char *given, const char *type, const char *where, struct tw_error *error)
{
	const char *names[OPTION_NAMES_MAX];
	size_t count = 0;
	for (; others && *others; others++) {
		assert(count < OPTION_NAMES_MAX);
		names[count++] = *others;
	}
	option_add_names(table, names, &count);
	return names_refuse(&(struct names){names, count}, what, given, type, where, error);
}

enum tw_status option_from_text(const struct option_table *table, void *values, const char *name, const char *text,
				struct tw_error *error)
{
	const struct option *option = find(table, name, strlen(name));
	if (!option)
		return refuse(table, NULL, "option", name, "option-unknown", name, error);
	return parse_text(option, values, text, name, error);
}

enum tw_status option_from_arguments(const struct option_table *table, void *values, int argc, char *const *argv,
				     int *index, bool *taken, struct tw_error *error)
{
	const char *argument = argv[*index];
	*taken = false;
	if (strncmp(argument, "--", 2) != 0)
		return TW_OK;
	const char *name = argument + 2;
	size_t length = strcspn(name, "=");
	const struct option *option = find(table, name, length);
	if (!option)
		return TW_OK;
	*taken = true;
	if (name[length] == '=')
		return parse_text(option, values, name + length + 1, argument, error);
	if (option->kind == OPTION_FLAG)
		return parse_text(option, values, "true", argument, error);
	if (*index + 1 >= argc)
		return tw_fail(error, TW_ERROR_INPUT, "option-value", argument, "needs a value");
	*index += 1;
	return parse_text(option, values, argv[*index], argument, error);
}

static bool among(const char *const *names, const char *name)
{
	for (; names && *names; names++)
		if (!strcmp(*names, name))
			return true;
	return false;
}

static enum tw_status parse_json(const struct option *option, void *values, const json_t *value, const char *where,
				 struct tw_error *error)
{
	if (json_is_number(value) && option->kind != OPTION_CHOICE && option->kind != OPTION_FLAG)
		return store_number(option, values, json_number_value(value), where, error);
	if (json_is_boolean(value) && option->kind == OPTION_FLAG) {
		store(option, values, json_is_true(value));
		return TW_OK;
	}
	if (json_is_string(value))
		return store_text(option, values, json_string_value(value), where, error);
	return fail_value(option, where, error);
}

void option_pointer(char *where, size_t size, const char *pointer, const char *member)
{
	size_t used = (size_t)snprintf(where, size, "%s/", pointer);
	for (; *member && used + 3 <= size; member++) {
		if (*member == '~' || *member == '/') {
			where[used++] = '~';
			where[used++] = *member == '~' ? '0' : '1';
		} else {
			where[used++] = *member;
		}
		where[used] = 0;
	}
}

enum tw_status option_from_json(const struct option_table *table, void *values, const json_t *object,
				const char *pointer, const char *const *others, struct tw_error *error)
{
	if (!json_is_object(object))
		return tw_fail(error, TW_ERROR_INPUT, "json-type", pointer, "must be an object");
	const char *key;
	json_t *value;
	json_object_foreach((json_t *)(uintptr_t)object, key, value)
	{
		char where[128];
		option_pointer(where, sizeof where, pointer, key);
		const struct option *option = strchr(key, '-') ? NULL : find(table, key, strlen(key));
		if (!option && among(others, key))
			continue;
		if (!option)
			return refuse(table, others, others ? "member" : "option", key, "json-unknown-field", where,
				      error);
		enum tw_status status = parse_json(option, values, value, where, error);
		if (status != TW_OK)
			return status;
	}
	return TW_OK;
}

static json_t *value_to_json(const struct option *option, double value)
{
	switch (option->kind) {
	case OPTION_INTEGER:
		return json_integer((json_int_t)value);
	case OPTION_CHOICE:
		return json_string(option->choices[(int)value]);
	case OPTION_FLAG:
		return json_boolean(value != 0);
	default:
		return isnan(value) ? json_string("auto") : json_real(value);
	}
}

json_t *option_to_json(const struct option_table *table, const void *values)
{
	json_t *object = json_object();
	for (size_t i = 0; object && i < table->count; i++) {
		const struct option *option = &table->rows[i];
		if (json_object_set_new(object, option->name, value_to_json(option, load(option, values)))) {
			json_decref(object);
			return NULL;
		}
	}
	return object;
}

static void print_default(const struct option *option, FILE *out)
{
	if (option->kind == OPTION_CHOICE)
		fprintf(out, "default %s", option->choices[(int)option->fallback]);
	else if (option->kind == OPTION_FLAG)
		fprintf(out, "default %s", option->fallback != 0 ? "true" : "false");
	else if (isnan(option->fallback))
		fprintf(out, "default auto");
	else if (option->kind == OPTION_INTEGER && option->fallback == UINT32_MAX)
		fprintf(out, "default none");
	else
		fprintf(out, "default %.10g%s%s", option->fallback, option->unit ? " " : "",
			option->unit ? option->unit : "");
}

static void print_value(const struct option *option, char *text, size_t size)
{
	size_t used = 0;
	text[0] = 0;
	if (option->kind == OPTION_CHOICE)
		for (size_t i = 0; option->choices[i] && used < size; i++)
			used += (size_t)snprintf(text + used, size - used, "%s%s", i ? "|" : " ", option->choices[i]);
	else if (option->kind == OPTION_INTEGER)
		snprintf(text, size, " N");
	else if (option->kind == OPTION_NUMBER)
		snprintf(text, size, " X");
	else if (option->kind == OPTION_NUMBER_OR_AUTO)
		snprintf(text, size, " X|auto");
	else if (option->fallback != 0)
		snprintf(text, size, "=true|false");
}

void option_print_help(const struct option_table *table, FILE *out)
{
	for (size_t i = 0; i < table->count; i++) {
		const struct option *option = &table->rows[i];
		char flag[64], value[128];
		snprintf(flag, sizeof flag, "%s", option->name);
		for (char *c = flag; *c; c++)
			*c = *c == '_' ? '-' : *c;
		print_value(option, value, sizeof value);
		fprintf(out, "  --%s%s\n      %s (", flag, value, option->help);
		print_default(option, out);
		fprintf(out, ")\n");
	}
}
