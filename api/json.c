#include "api/json.h"

#include "solver/names.h"
#include "solver/option.h"

#include <string.h>
#include <time.h>

json_t *json_embed(const char *text)
{
	json_t *value = text && *text ? json_loads(text, JSON_DECODE_ANY, NULL) : NULL;
	return value ? value : json_null();
}

bool json_is_text(const char *text)
{
	json_t *string = json_string(text);
	json_decref(string);
	return string;
}

json_t *json_time(int64_t time_ms)
{
	if (!time_ms)
		return json_null();
	time_t seconds = (time_t)(time_ms / 1000);
	struct tm parts;
	char text[48];
	gmtime_r(&seconds, &parts);
	size_t length = strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts);
	snprintf(text + length, sizeof text - length, ".%03dZ", (int)(time_ms % 1000));
	return json_string(text);
}

json_t *json_words(const char *list)
{
	json_t *words = json_array();
	while (*list) {
		const size_t length = strcspn(list, ",");
		json_array_append_new(words, json_stringn(list, length));
		list += length + (list[length] == ',');
	}
	return words;
}

enum tw_status json_get_text(const json_t *object, const char *name, bool required, const char **text,
			     struct tw_error *error)
{
	json_t *value = json_object_get(object, name);
	*text = json_string_value(value);
	if ((!value && !required) || *text)
		return TW_OK;
	char pointer[64];
	snprintf(pointer, sizeof pointer, "/%s", name);
	return tw_fail(error, TW_ERROR_INPUT, value ? "json-type" : "json-missing-field", pointer,
		       value ? "%s must be a string" : "%s is missing; give a string", name);
}

enum tw_status json_get_name(const json_t *object, const char **name, struct tw_error *error)
{
	enum tw_status status = json_get_text(object, "name", false, name, error);
	return status == TW_OK && *name ? names_check(*name, "json-value", "/name", error) : status;
}

enum tw_status json_check_members(const json_t *object, const char *pointer, const char *const *known,
				  struct tw_error *error)
{
	const char *name = NULL;
	json_t *value = NULL;
	json_object_foreach((json_t *)object, name, value)
	{
		const char *const *k = known;
		while (*k && strcmp(*k, name) != 0)
			k++;
		char where[128];
		option_pointer(where, sizeof where, pointer, name);
		if (!*k)
			return names_refuse(&(struct names){known, names_of(known).count}, "member", name,
					    "json-unknown-field", where, error);
	}
	return TW_OK;
}
