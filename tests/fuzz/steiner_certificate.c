/* Any bytes as a certificate: read, checked against a small graph, and written again. What the checker accepts must not
 * claim more than the optimum of that graph. */
#include "solver/steiner/certificate/file.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(int holds)
{
	if (!holds)
		abort();
}

/* A square 1-2-3-4 with a hub 5; the lightest tree of 1, 3 and 4 is 1-2-3-4. */
static const uint32_t ends[] = {0, 1, 1, 2, 2, 3, 0, 3, 0, 4, 2, 4, 3, 4, 1, 2};
static const uint64_t weight[] = {3, 4, 5, 20, 6, 5, 2, 9};
static const uint32_t terminals[] = {0, 2, 3};
enum { EDGES = 8, VERTICES = 5, OPTIMUM = 12 };

static void write_again(const struct steiner_certificate *certificate, struct arena *arena)
{
	struct steiner_certificate read;
	const char *bytes, *again;
	size_t length, length_again;
	if (certificate_write(certificate, arena, &bytes, &length, NULL) != TW_OK)
		return;
	check(certificate_read(&read, arena, bytes, length, NULL) == TW_OK);
	if (certificate_write(&read, arena, &again, &length_again, NULL) == TW_OK)
		check(length == length_again && !memcmp(bytes, again, length));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct arena *arena = arena_new((size_t)256 << 20);
	if (!arena)
		return 0;
	struct graph graph;
	struct steiner_certificate certificate;
	struct tw_error error = {0};
	check(graph_build(&graph, arena, VERTICES, EDGES, ends, weight, NULL) == TW_OK);
	if (certificate_read(&certificate, arena, (const char *)data, size, &error) == TW_OK) {
		const enum tw_status status = certificate_check(&certificate, &graph, terminals, 3, &error);
		check(status == TW_OK || *error.text);
		if (status == TW_OK)
			check(certificate.certified <= OPTIMUM && certificate.weight >= OPTIMUM);
		write_again(&certificate, arena);
	} else {
		check(error.status != TW_OK && *error.text);
	}
	arena_free(arena);
	return 0;
}
