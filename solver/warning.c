#include "solver/warning.h"

#include <string.h>

/* The warning of a type, made with its text where it is new; NULL where the list is full. */
static struct warning *find(struct warning_list *list, const char *type, const char *place_kind, const char *format,
			    va_list arguments)
{
	for (uint32_t i = 0; i < list->count; i++) {
		if (strcmp(list->warning[i].type, type) == 0)
			return &list->warning[i];
	}
	if (list->count == WARNINGS_MAX)
		return NULL;
	struct warning *warning = &list->warning[list->count++];
	*warning = (struct warning){.type = type, .place_kind = place_kind};
	vsnprintf(warning->text, sizeof warning->text, format, arguments);
	return warning;
}

void warning_add(struct warning_list *list, const char *type, const char *place_kind, uint32_t place,
		 const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	struct warning *warning = find(list, type, place_kind, format, arguments);
	va_end(arguments);
	if (!warning)
		return;
	warning->count++;
	if (warning->place_count < WARNING_PLACES)
		warning->place[warning->place_count++] = place;
}

void warning_add_whole(struct warning_list *list, const char *type, const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	struct warning *warning = find(list, type, "", format, arguments);
	va_end(arguments);
	if (warning)
		warning->count++;
}

static json_t *show(const struct warning *warning)
{
	json_t *places = json_array();
	for (uint32_t i = 0; i < warning->place_count; i++)
		json_array_append_new(places, json_integer(warning->place[i]));
	return json_pack("{s:s, s:I, s:s, s:o, s:s}", "type", warning->type, "count", (json_int_t)warning->count,
			 "place_kind", warning->place_kind, "places", places, "text", warning->text);
}

json_t *warning_list_show(const struct warning_list *list)
{
	json_t *array = json_array();
	for (uint32_t i = 0; i < list->count; i++) {
		if (!array || json_array_append_new(array, show(&list->warning[i])) != 0) {
			json_decref(array);
			return NULL;
		}
	}
	return array;
}
