/* A designer drags a terminal over the sample suit: what a worker that keeps the field's base and the drag's warm state
 * needs from a request to its proven tree. Each of the moves takes one terminal, in turn, up to 60 mm from where it was
 * at first, into a face. */
#include "solver/layout/base.h"
#include "solver/layout/layout.h"
#include "solver/splitmix.h"
#include "solver/steiner/warm/warm.h"

#include "tests/bench/bench.h"
#include "tests/bench/suit.h"

#include <math.h>

enum { VERTICES = 23500, MOVES = 30, TERMINALS_MOST = 40 };
static const double reach_mm = 60;

struct desk {
	struct arena *arena;
	struct suit suit;
	struct layout_base base;
	struct steiner_warm *warm;
	const char *options;
	uint64_t numbers;
	uint32_t face[TERMINALS_MOST];
};

static double distance_mm(const struct garment *garment, uint32_t face, uint32_t other)
{
	const double *a = &garment->position[3 * (size_t)garment->face_vertex[3 * (size_t)face]];
	const double *b = &garment->position[3 * (size_t)garment->face_vertex[3 * (size_t)other]];
	return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

static uint32_t face_near(struct desk *desk, uint32_t face)
{
	for (;;) {
		const uint64_t number = splitmix(desk->numbers += SPLITMIX_STEP);
		const uint32_t other = (uint32_t)(number % desk->suit.garment.face_count);
		if (distance_mm(&desk->suit.garment, face, other) <= reach_mm)
			return other;
	}
}

/* Seconds to the tree. */
static double lay_out(struct desk *desk, bool prepare)
{
	char text[TERMINALS_MOST * 80 + 200];
	struct layout_request request;
	struct layout_output output;
	struct arena *arena = arena_new(0);
	size_t used = (size_t)snprintf(text, sizeof text, "{\"options\": {%s}, \"terminals\": [", desk->options);
	for (uint32_t i = 0; i < desk->suit.terminal_count; i++)
		used += (size_t)snprintf(text + used, sizeof text - used,
					 "%s{\"face\": %u, \"barycentric\": [0.25, 0.25, 0.5]}", i ? ", " : "",
					 desk->face[i]);
	used += (size_t)snprintf(text + used, sizeof text - used, "]}");
	struct tw_error error = {0};
	suit_must(layout_request_parse(&request, text, used, &error), &error);
	const struct layout_input input = {
		.garment = &desk->suit.garment,
		.topology = &desk->suit.topology,
		.field = &desk->suit.field,
		.base = &desk->base,
		.request = &request,
		.warm = desk->warm,
	};
	suit_must(layout_compute(&input, arena, &output, &error), &error);
	if (prepare)
		suit_must(steiner_warm_prepare(desk->warm, &output.found.graph, output.found.terminal,
					       output.found.terminal_count, &output.found.options, &output.found.tree),
			  &error);
	layout_request_clear(&request);
	arena_free(arena);
	return output.summary.seconds_terminals + output.summary.seconds_tree;
}

static int compare(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

static void drag(const char *set, const char *relaxation, double median_goal_ms, double p95_goal_ms)
{
	struct desk desk = {.arena = arena_new(0), .warm = steiner_warm_new(0), .numbers = 1};
	struct tw_error error = {0};
	char options[200], name[64];
	double seconds[MOVES];
	snprintf(options, sizeof options, "\"baseline\": \"none\", \"elongation\": false, \"relaxation\": \"%s\"",
		 relaxation);
	desk.options = options;
	suit_make(&desk.suit, desk.arena, VERTICES, 0, set);
	suit_must(field_weigh_chords(&desk.suit.field, desk.arena, &desk.suit.garment, &desk.suit.topology, NULL, 2,
				     NULL, &error),
		  &error);
	suit_must(layout_base_build(&desk.base, desk.arena, &desk.suit.garment, &desk.suit.topology, &desk.suit.field,
				    &error),
		  &error);
	for (uint32_t i = 0; i < desk.suit.terminal_count; i++)
		desk.face[i] = face_near(&desk, (uint32_t)(splitmix(i + 1) % desk.suit.garment.face_count));
	for (uint32_t i = 0; i < desk.suit.terminal_count; i++)
		for (uint32_t f = 0; f < desk.suit.garment.face_count; f++)
			if (desk.suit.garment.face_vertex[3 * (size_t)f] == desk.suit.terminal[i])
				desk.face[i] = f;
	lay_out(&desk, true);
	for (uint32_t i = 0; i < MOVES; i++) {
		const uint32_t moved = i % desk.suit.terminal_count, home = desk.face[moved];
		desk.face[moved] = face_near(&desk, home);
		seconds[i] = lay_out(&desk, false);
		desk.face[moved] = home;
	}
	qsort(seconds, MOVES, sizeof *seconds, compare);
	snprintf(name, sizeof name, "drag.%s_%s_median", set, relaxation);
	bench_line(name, 1e3 * seconds[MOVES / 2], "ms", median_goal_ms);
	snprintf(name, sizeof name, "drag.%s_%s_p95", set, relaxation);
	bench_line(name, 1e3 * seconds[MOVES * 95 / 100], "ms", p95_goal_ms);
	steiner_warm_free(desk.warm);
	arena_free(desk.arena);
}

int main(void)
{
	drag("joints10", "chords", 32, 72);
	drag("segments17", "chords", 32, 72);
	drag("muscles36", "chords", 112, 112);
	drag("muscles36", "none", 112, 112);
	return 0;
}
