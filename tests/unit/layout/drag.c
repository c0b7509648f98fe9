/* A designer drags a terminal: every layout from what is kept, a warm state and the field's base, has the
 * bytes of one from scratch. MOVES=n in the
 * environment for more of them. */
#include "solver/layout/base.h"
#include "solver/layout/layout.h"
#include "solver/splitmix.h"
#include "solver/steiner/warm/warm.h"
#include "tests/bench/suit.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

enum { MOVES = 40, TERMINALS_MOST = 16, VERTICES = 3000 };

struct desk {
	struct arena *arena;
	struct suit suit;
	struct layout_base base;
	struct steiner_warm *warm;
	uint64_t numbers;
	char terminal[TERMINALS_MOST][96]; /* as JSON */
	uint32_t terminal_count;
	uint32_t from_warm;
};

static uint32_t random_below(struct desk *desk, uint32_t most)
{
	return (uint32_t)(splitmix(desk->numbers += SPLITMIX_STEP) % most);
}

/* On a vertex, on a side of a face, or inside it. */
static void place(struct desk *desk, uint32_t terminal, uint32_t face)
{
	static const char *const inside[] = {"0, 0.375, 0.625", "0.25, 0.5, 0.25", "0.125, 0.125, 0.75"};
	char *text = desk->terminal[terminal];
	const size_t size = sizeof desk->terminal[terminal];
	const uint32_t kind = random_below(desk, 4);
	if (kind == 3)
		snprintf(text, size, "{\"vertex\": %u}", desk->suit.garment.face_vertex[3 * (size_t)face]);
	else
		snprintf(text, size, "{\"face\": %u, \"barycentric\": [%s]}", face, inside[kind]);
}

static struct layout_output lay_out(struct desk *desk, struct arena *arena, bool is_kept, const char *options)
{
	char text[TERMINALS_MOST * 100 + 200];
	struct layout_request request;
	struct layout_output output;
	struct tw_error error = {0};
	size_t used = (size_t)snprintf(text, sizeof text, "{\"options\": {%s}, \"terminals\": [", options);
	for (uint32_t i = 0; i < desk->terminal_count; i++)
		used += (size_t)snprintf(text + used, sizeof text - used, "%s%s", i ? ", " : "", desk->terminal[i]);
	used += (size_t)snprintf(text + used, sizeof text - used, "]}");
	assert_int_equal(layout_request_parse(&request, text, used, &error), TW_OK);
	const struct layout_input input = {
		.garment = &desk->suit.garment,
		.topology = &desk->suit.topology,
		.field = &desk->suit.field,
		.request = &request,
		.base = is_kept ? &desk->base : NULL,
		.warm = is_kept ? desk->warm : NULL,
	};
	if (layout_compute(&input, arena, &output, &error) != TW_OK)
		fail_msg("%s: %s\n%s", error.where, error.text, text);
	layout_request_clear(&request);
	return output;
}

static void expect_equal(const struct layout_output *a, const struct layout_output *b)
{
	assert_int_equal(a->artifact_count, b->artifact_count);
	for (uint32_t i = 0; i < a->artifact_count; i++) {
		assert_int_equal(a->artifacts[i].size, b->artifacts[i].size);
		assert_memory_equal(a->artifacts[i].bytes, b->artifacts[i].bytes, a->artifacts[i].size);
	}
}

static void move(struct desk *desk)
{
	const uint32_t faces = desk->suit.garment.face_count, what = random_below(desk, 10);
	if (what == 0 && desk->terminal_count < TERMINALS_MOST)
		place(desk, desk->terminal_count++, random_below(desk, faces));
	else if (what == 1 && desk->terminal_count > 3)
		desk->terminal_count--;
	else
		place(desk, random_below(desk, desk->terminal_count), random_below(desk, faces));
}

static void drag(struct desk *desk, const char *options, uint32_t moves)
{
	for (uint32_t i = 0; i < moves; i++) {
		struct arena *arena = arena_new(0);
		assert_non_null(arena);
		const struct layout_output scratch = lay_out(desk, arena, false, options);
		const struct layout_output warm = lay_out(desk, arena, true, options);
		expect_equal(&warm, &scratch);
		desk->from_warm += warm.found.tree.stats.is_from_warm;
		if (steiner_warm_is_due(desk->warm)) {
			const struct layout_found *found = &warm.found;
			assert_int_equal(steiner_warm_prepare(desk->warm, &found->graph, found->terminal,
							      found->terminal_count, &found->options, &found->tree),
					 TW_OK);
		}
		move(desk);
		arena_free(arena);
	}
}

static void a_dragged_terminal_gives_the_bytes_from_scratch(void **state)
{
	(void)state;
	static const char *const options[] = {
		"\"baseline\": \"none\"",
		"\"baseline\": \"none\", \"relaxation\": \"none\"",
	};
	const char *given = getenv("MOVES");
	const uint32_t moves = given ? (uint32_t)strtoul(given, NULL, 10) : MOVES;
	struct tw_error error = {0};
	for (uint32_t i = 0; i < 2; i++) {
		struct desk desk = {.arena = arena_new(0), .warm = steiner_warm_new(0), .numbers = 5 + i};
		assert_true(desk.arena && desk.warm);
		suit_make(&desk.suit, desk.arena, VERTICES, 0, "joints10");
		assert_int_equal(field_weigh_chords(&desk.suit.field, desk.arena, &desk.suit.garment,
						    &desk.suit.topology, NULL, 1, NULL, &error),
				 TW_OK);
		assert_int_equal(layout_base_build(&desk.base, desk.arena, &desk.suit.garment, &desk.suit.topology,
						   &desk.suit.field, &error),
				 TW_OK);
		for (desk.terminal_count = 0; desk.terminal_count < 10; desk.terminal_count++)
			place(&desk, desk.terminal_count, random_below(&desk, desk.suit.garment.face_count));
		drag(&desk, options[i], moves / 2);
		print_message("%u of %u from the warm state\n", desk.from_warm, moves / 2);
		assert_true(desk.from_warm > moves / 8);
		steiner_warm_free(desk.warm);
		arena_free(desk.arena);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_dragged_terminal_gives_the_bytes_from_scratch),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
