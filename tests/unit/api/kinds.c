/* The table of kinds against the routes and against itself. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "api/route.h"
#include "storage/kind.h"

#include <string.h>

static void every_link_leads_to_its_resource(void **state)
{
	(void)state;
	for (enum resource_kind kind = RESOURCE_MESH; kind < RESOURCE_KINDS; kind++) {
		char href[KIND_HREF_SIZE];
		struct route_match match;
		resource_kind_print_href(kind, "parent_1", "id_2", href);
		route_find("GET", href, &match);
		assert_non_null(match.route);
		bool nested = resource_kind_is_nested(kind);
		assert_string_equal(match.parameters[nested], "id_2");
		assert_string_equal(match.parameters[0], nested ? "parent_1" : "id_2");
		route_find("DELETE", href, &match);
		assert_non_null(match.route);
		/* The route calls its last parameter as the table calls the kind. */
		char braces[64];
		snprintf(braces, sizeof braces, "/{%s}", resource_kind_name(kind));
		assert_string_equal(strrchr(match.route->path, '/'), braces);
	}
}

static void every_kind_is_made_by_a_job_of_its_own_and_found_by_name(void **state)
{
	(void)state;
	for (enum resource_kind kind = RESOURCE_MESH; kind < RESOURCE_KINDS; kind++) {
		const struct resource_kind_row *row = resource_kind_row(kind);
		enum resource_kind found = RESOURCE_NONE;
		assert_int_equal(row->kind, kind);
		assert_true(row->version > 0);
		assert_int_equal(job_kind_row(row->job)->resource, kind);
		assert_true(resource_kind_by_name(row->name, &found));
		assert_int_equal(found, kind);
		for (unsigned i = 0; i < row->need_count; i++)
			assert_true(row->needs[i].kind < kind);
	}
	for (enum job_kind kind = JOB_IMPORT_MESH; kind < JOB_KINDS; kind++) {
		enum job_kind found = JOB_KINDS;
		assert_int_equal(job_kind_row(kind)->kind, kind);
		assert_true(job_kind_by_name(job_kind_name(kind), &found));
		assert_int_equal(found, kind);
	}
	enum resource_kind none;
	enum job_kind no_job;
	assert_false(resource_kind_by_name("meshes", &none));
	assert_false(job_kind_by_name("mesh", &no_job));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_link_leads_to_its_resource),
		cmocka_unit_test(every_kind_is_made_by_a_job_of_its_own_and_found_by_name),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
