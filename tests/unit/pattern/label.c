/* Names beside points: what must hold of their places, on pages where it can. */
#include "solver/pattern/label.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <string.h>

#include <cmocka.h>

#include "tests/oracle/meshes.h"

static const struct label_box page_box = {0, 0, 1000, 1000};

static bool meet(const struct label_box *a, const struct label_box *b)
{
	return a->left < b->right && b->left < a->right && a->top < b->bottom && b->top < a->bottom;
}

static bool within(const struct label_box *inner, const struct label_box *outer)
{
	return inner->left >= outer->left && inner->top >= outer->top && inner->right <= outer->right &&
	       inner->bottom <= outer->bottom;
}

/* Points on a jittered grid, on which a name just fits between neighbours. */
static void scatter(struct label_page *page, struct arena *arena, double spacing, const char *name)
{
	uint64_t seed = 11;
	assert_int_equal(label_page_init(page, arena, page_box, 8, 400, 400, NULL), TW_OK);
	for (double y = 30; y <= 970; y += spacing)
		for (double x = 30; x <= 970; x += spacing) {
			struct vec2 at = {x + 6 * mesh_random(&seed), y + 6 * mesh_random(&seed)};
			label_page_add(page, at, name, 14);
			label_page_block(page, at, 8, LABEL_PRICE);
		}
	label_page_settle(page);
}

static void names_do_not_overlap_where_there_is_room(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct label_page page;
	scatter(&page, arena, 80, "forearm");
	assert_true(page.label_count >= 100);
	for (uint32_t i = 0; i < page.label_count; i++) {
		for (uint32_t k = 0; k < i; k++)
			assert_false(meet(&page.label[i].box, &page.label[k].box));
		for (uint32_t k = 0; k < page.block_count; k++)
			assert_false(meet(&page.label[i].box, &page.block[k].box));
	}
	arena_free(arena);
}

static void names_stay_on_the_page(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct label_page page;
	assert_int_equal(label_page_init(&page, arena, page_box, 8, 4, 0, NULL), TW_OK);
	for (int corner = 0; corner < 4; corner++)
		label_page_add(&page, (struct vec2){corner % 2 ? 996 : 4, corner / 2 ? 996 : 4}, "wrist", 20);
	label_page_settle(&page);
	for (uint32_t i = 0; i < 4; i++) {
		assert_true(within(&page.label[i].box, &page_box));
		assert_int_equal(page.label[i].anchor, i % 2 ? LABEL_END : LABEL_START);
	}
	arena_free(arena);
}

static void a_name_keeps_off_a_line(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct label_page page;
	assert_int_equal(label_page_init(&page, arena, page_box, 8, 1, 500, NULL), TW_OK);
	label_page_add(&page, (struct vec2){500, 500}, "sternum", 20);
	for (double t = 0; t < 400; t += 4)
		label_page_block(&page, (struct vec2){500 + t, 500 - t / 4}, 6, 1);
	label_page_settle(&page);
	for (uint32_t k = 0; k < page.block_count; k++)
		assert_false(meet(&page.label[0].box, &page.block[k].box));
	arena_free(arena);
}

static void a_crowd_gets_places_too_and_always_the_same(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct label_page page, again;
	scatter(&page, arena, 60, "gastrocnemius_outer_left");
	scatter(&again, arena, 60, "gastrocnemius_outer_left");
	assert_int_equal(page.label_count, again.label_count);
	for (uint32_t i = 0; i < page.label_count; i++) {
		assert_true(vec2_distance(page.label[i].text, page.label[i].at) < 80);
		assert_memory_equal(&page.label[i].box, &again.label[i].box, sizeof page.label[i].box);
	}
	arena_free(arena);
}

static void a_width_counts_characters_not_bytes(void **state)
{
	(void)state;
	assert_true(label_width("äöü", 10) == label_width("aou", 10));
	assert_true(label_width("", 10) == 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(names_do_not_overlap_where_there_is_room),
		cmocka_unit_test(names_stay_on_the_page),
		cmocka_unit_test(a_name_keeps_off_a_line),
		cmocka_unit_test(a_crowd_gets_places_too_and_always_the_same),
		cmocka_unit_test(a_width_counts_characters_not_bytes),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
