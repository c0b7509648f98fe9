#include "solver/layout/json.h"

#include "solver/names.h"

#include <math.h>
#include <string.h>

#define COORDINATE_LIMIT 1e6 /* mm: a garment a kilometre away is a mistake of units */

enum tw_status json_read_text(char **text, const json_t *value, const char *where, struct tw_error *error)
{
	const char *string = json_string_value(value);
	if (!string)
		return tw_fail(error, TW_ERROR_INPUT, "json-type", where, "must be a text");
	if (!string[0])
		return tw_fail(error, TW_ERROR_INPUT, "json-value", where, "must have 1 to %d bytes", NAME_BYTES_MAX);
	enum tw_status status = names_check(string, "json-value", where, error);
	if (status != TW_OK)
		return status;
	*text = strdup(string);
	return *text ? TW_OK : tw_fail_memory(error);
}

enum tw_status json_read_index(uint32_t *index, const json_t *value, const char *where, struct tw_error *error)
{
	json_int_t number = json_integer_value(value);
	if (!json_is_integer(value) || number < 0 || number >= UINT32_MAX)
		return tw_fail(error, TW_ERROR_INPUT, "json-type", where, "must be a whole number from 0");
	*index = (uint32_t)number;
	return TW_OK;
}

enum tw_status json_read_numbers(double *numbers, size_t count, const json_t *value, const char *where,
				 struct tw_error *error)
{
	if (!json_is_array(value) || json_array_size(value) != count)
		return tw_fail(error, TW_ERROR_INPUT, "json-type", where, "must be an array of %zu numbers", count);
	for (size_t i = 0; i < count; i++) {
		const json_t *item = json_array_get(value, i);
		double number = json_number_value(item);
		if (!json_is_number(item) || !isfinite(number) || fabs(number) > COORDINATE_LIMIT) {
			char place[128];
			snprintf(place, sizeof place, "%.100s/%zu", where, i);
			return tw_fail(error, TW_ERROR_INPUT, "json-value", place, "must be a number within ±%.0f",
				       COORDINATE_LIMIT);
		}
		numbers[i] = number;
	}
	return TW_OK;
}
