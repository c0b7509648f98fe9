/* Prints what the code offers, as JSON: its routes and its option tables. The HTTP tests hold openapi.yaml to it. */
#include "api/json.h"
#include "api/recording.h"
#include "api/route.h"
#include "solver/field/options.h"
#include "solver/garment/options.h"
#include "solver/layout/options.h"
#include "solver/motion/options.h"
#include "storage/key.h"

#include <jansson.h>
#include <math.h>
#include <string.h>

/* [] for what needs no key. */
static json_t *show_scopes(unsigned scopes)
{
	char text[KEY_SCOPES_SIZE];
	key_print_scopes(scopes, text);
	return json_words(text);
}

static json_t *show_routes(void)
{
	static const char *const bodies[] = {"none", "json", "upload", "upload"};
	json_t *routes = json_array();
	for (const struct route *r = api_routes; r->method; r++) {
		json_t *route = json_object();
		json_object_set_new(route, "method", json_string(r->method));
		json_object_set_new(route, "path", json_string(r->path));
		json_object_set_new(route, "body", json_string(bodies[r->body]));
		json_object_set_new(route, "operator", json_boolean(r->flags & ROUTE_OPERATOR));
		json_object_set_new(route, "scopes", show_scopes(r->scopes));
		json_array_append_new(routes, route);
	}
	return routes;
}

static json_t *show_option(const struct option *option)
{
	static const char *const kinds[] = {"number", "number-or-auto", "integer", "choice", "flag"};
	json_t *json = json_object(), *choices = json_array();
	json_object_set_new(json, "kind", json_string(kinds[option->kind]));
	json_object_set_new(json, "default",
			    isnan(option->fallback) ? json_string("auto") : json_real(option->fallback));
	json_object_set_new(json, "minimum", json_real(option->minimum));
	json_object_set_new(json, "maximum", json_real(option->maximum));
	for (const char *const *choice = option->choices; choice && *choice; choice++)
		json_array_append_new(choices, json_string(*choice));
	json_object_set_new(json, "choices", choices);
	return json;
}

static json_t *show_table(const struct option_table *table)
{
	json_t *json = json_object();
	for (size_t i = 0; i < table->count; i++)
		json_object_set_new(json, table->rows[i].name, show_option(&table->rows[i]));
	return json;
}

int main(void)
{
	json_t *options = json_object(), *contract = json_object();
	json_object_set_new(options, "ImportOptions", show_table(&import_option_table));
	json_object_set_new(options, "MotionOptions", show_table(&motion_option_table));
	json_object_set_new(options, "FieldOptions", show_table(&field_option_table));
	json_object_set_new(options, "LayoutOptions", show_table(&layout_option_table));
	json_object_set_new(options, "RecordingOptions", show_table(&recording_option_table));
	json_object_set_new(contract, "routes", show_routes());
	json_object_set_new(contract, "options", options);
	int code = json_dumpf(contract, stdout, JSON_INDENT(2));
	json_decref(contract);
	return code;
}
