/* The published optima: instances of INSTANCES (README there), where they are. Each gets a second; what is proven by
 * then must be the optimum, and what is not must have it between bound and weight. `make bench-steiner` runs all of
 * them to the end. */
#include "solver/graph/steiner_file.h"
#include "solver/steiner/steiner.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { COMMAND_BYTES = 1024 };

static char *read_command(const char *command, size_t *length)
{
	FILE *in = popen(command, "r");
	assert_non_null(in);
	size_t capacity = 1 << 20;
	char *bytes = malloc(capacity);
	*length = 0;
	size_t got;
	while (bytes && (got = fread(bytes + *length, 1, capacity - *length, in)) > 0) {
		*length += got;
		if (*length == capacity)
			bytes = realloc(bytes, capacity *= 2);
	}
	assert_non_null(bytes);
	assert_int_equal(pclose(in), 0);
	return bytes;
}

/* Returns whether it was proven. */
static int check_instance(const char *command, const char *name, uint64_t optimum, double time_limit_s)
{
	struct arena *arena = arena_new(0);
	struct steiner_file file;
	struct steiner_tree tree;
	struct tw_error error = {0};
	size_t length;
	char *bytes = read_command(command, &length);
	enum tw_status status = steiner_file_read(&file, arena, bytes, length, &error);
	free(bytes);
	const struct steiner_options options = {.time_limit_s = time_limit_s};
	if (status == TW_OK)
		status =
			steiner_solve(&file.graph, file.terminals, file.terminal_count, &options, arena, &tree, &error);
	if (status != TW_OK)
		fail_msg("%s: %s %s", name, error.where, error.text);
	const int proven = tree.outcome == STEINER_OPTIMAL;
	if (tree.lower_bound > optimum || tree.weight < optimum || (proven && tree.weight != optimum))
		fail_msg("%s: bound %llu, weight %llu, but the optimum is %llu", name,
			 (unsigned long long)tree.lower_bound, (unsigned long long)tree.weight,
			 (unsigned long long)optimum);
	arena_free(arena);
	return proven;
}

/* The rows `name,…,optimum` of a list; `step`: every step-th row. */
static void check_list(const char *list, const char *command_format, uint32_t step, double time_limit_s,
		       uint32_t proven_at_least)
{
	const char *folder = getenv("INSTANCES");
	char path[COMMAND_BYTES], line[256];
	snprintf(path, sizeof path, "%s/%s", folder ? folder : "", list);
	FILE *in = folder ? fopen(path, "r") : NULL;
	if (!in) {
		skip();
		return;
	}
	uint32_t row = 0, proven = 0;
	while (fgets(line, sizeof line, in)) {
		const char *comma = strrchr(line, ',');
		const uint64_t optimum = comma ? strtoull(comma + 1, NULL, 10) : 0;
		line[strcspn(line, ",")] = '\0';
		if (!optimum || row++ % step)
			continue;
		char command[2 * COMMAND_BYTES];
		snprintf(command, sizeof command, command_format, folder, line);
		proven += (uint32_t)check_instance(command, line, optimum, time_limit_s);
	}
	fclose(in);
	if (proven < proven_at_least)
		fail_msg("%s: only %u of %u proven", list, proven, row);
}

static void meshes_have_their_listed_optima(void **state)
{
	(void)state;
	check_list("optima.csv", "sh '%s/join.sh' '%s'", 1, 1.0, 0);
}

static void pace_instances_have_their_published_optima(void **state)
{
	(void)state;
	check_list("pace2018/optima.csv", "zcat '%s/pace2018/%s.gr.gz'", 1, 0.5, 50);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(meshes_have_their_listed_optima),
		cmocka_unit_test(pace_instances_have_their_published_optima),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
