/* Edges, kinds and components against a quadratic search; arrays there and back. */
#include "solver/garment/garment.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MAX_FACES = 40, MAX_VERTICES = 24 };

struct fixture {
	struct arena *arena;
	struct garment garment;
	double position[3 * MAX_VERTICES];
	double pattern[2 * 3 * MAX_FACES];
	uint32_t face_vertex[3 * MAX_FACES];
	uint32_t face_coord[3 * MAX_FACES];
	uint32_t face_piece[MAX_FACES];
	char *piece_name[1];
	char name[8];
};

static int setup(void **state)
{
	struct fixture *f = calloc(1, sizeof *f);
	f->arena = arena_new(0);
	strcpy(f->name, "front");
	f->piece_name[0] = f->name;
	f->garment = (struct garment){
		.piece_count = 1,
		.position = f->position,
		.pattern = f->pattern,
		.face_vertex = f->face_vertex,
		.face_coord = f->face_coord,
		.face_piece = f->face_piece,
		.piece_name = f->piece_name,
	};
	*state = f;
	return 0;
}

static int teardown(void **state)
{
	struct fixture *f = *state;
	arena_free(f->arena);
	free(f);
	return 0;
}

static uint32_t random_below(uint64_t *seed, uint32_t limit)
{
	*seed = *seed * 6364136223846793005u + 1442695040888963407u;
	return (uint32_t)(*seed >> 33) % limit;
}

/* Faces one by one, each only where its edges have room, with pattern positions that are shared or not. */
static void make_random(struct fixture *f, uint64_t seed)
{
	f->garment.vertex_count = 4 + random_below(&seed, MAX_VERTICES - 4);
	f->garment.coord_count = 2 * f->garment.vertex_count;
	f->garment.face_count = 0;
	int used[MAX_VERTICES][MAX_VERTICES] = {0};
	for (int attempt = 0; attempt < 200 && f->garment.face_count < MAX_FACES; attempt++) {
		uint32_t v[3];
		for (int k = 0; k < 3; k++)
			v[k] = random_below(&seed, f->garment.vertex_count);
		if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
			continue;
		if (used[v[0]][v[1]] > 1 || used[v[1]][v[2]] > 1 || used[v[2]][v[0]] > 1)
			continue;
		for (int k = 0; k < 3; k++) {
			uint32_t a = v[k], b = v[(k + 1) % 3];
			used[a][b]++;
			used[b][a]++;
			f->face_vertex[3 * f->garment.face_count + (uint32_t)k] = a;
			f->face_coord[3 * f->garment.face_count + (uint32_t)k] =
				a + f->garment.vertex_count * (random_below(&seed, 5) == 0);
		}
		f->garment.face_count++;
	}
}

static bool side_is(const struct garment *g, uint32_t side, uint32_t a, uint32_t b, uint32_t *ca, uint32_t *cb)
{
	uint32_t to = side % 3 == 2 ? side - 2 : side + 1;
	bool forward = g->face_vertex[side] == a && g->face_vertex[to] == b;
	bool backward = g->face_vertex[side] == b && g->face_vertex[to] == a;
	*ca = g->face_coord[forward ? side : to];
	*cb = g->face_coord[forward ? to : side];
	return forward || backward;
}

static void edges_are_those_of_a_quadratic_search(void **state)
{
	struct fixture *f = *state;
	for (uint64_t seed = 1; seed <= 500; seed++) {
		make_random(f, seed);
		struct arena_mark mark = arena_mark(f->arena);
		struct topology t;
		struct tw_error error;
		assert_int_equal(topology_build(&t, f->arena, &f->garment, &error), TW_OK);
		uint32_t next = 0;
		for (uint32_t side = 0; side < 3 * f->garment.face_count; side++) {
			uint32_t a = f->face_vertex[side], b = f->face_vertex[side % 3 == 2 ? side - 2 : side + 1];
			uint32_t sides[3], ca[3], cb[3], count = 0;
			for (uint32_t s = 0; s < 3 * f->garment.face_count; s++) {
				if (side_is(&f->garment, s, a, b, &ca[count], &cb[count]))
					sides[count++] = s;
			}
			assert_in_range(count, 1, 2);
			uint32_t e = t.face_edge[side];
			assert_int_equal(e, sides[0] == side ? next : t.face_edge[sides[0]]);
			next += sides[0] == side;
			assert_int_equal(t.edge_vertex[2 * e], a < b ? a : b);
			assert_int_equal(t.edge_vertex[2 * e + 1], a < b ? b : a);
			assert_int_equal(t.edge_face[2 * e], sides[0] / 3);
			assert_int_equal(t.edge_side[2 * e], sides[0] % 3);
			if (count == 1) {
				assert_int_equal(t.edge_kind[e], EDGE_HEM);
				assert_int_equal(t.edge_face[2 * e + 1], GARMENT_NONE);
				continue;
			}
			assert_int_equal(t.edge_face[2 * e + 1], sides[1] / 3);
			assert_int_equal(t.edge_side[2 * e + 1], sides[1] % 3);
			assert_int_equal(t.edge_kind[e], ca[0] == ca[1] && cb[0] == cb[1] ? EDGE_INNER : EDGE_SEAM);
		}
		assert_int_equal(next, t.edge_count);
		arena_release(f->arena, mark);
	}
}

static void components_are_numbered_by_their_lowest_vertex(void **state)
{
	struct fixture *f = *state;
	for (uint64_t seed = 1000; seed < 1200; seed++) {
		make_random(f, seed);
		uint32_t label[MAX_VERTICES];
		for (uint32_t v = 0; v < f->garment.vertex_count; v++)
			label[v] = v;
		for (bool changed = true; changed;) {
			changed = false;
			for (uint32_t i = 0; i < 9 * f->garment.face_count; i++) {
				uint32_t a = f->face_vertex[3 * (i / 9) + i % 3];
				uint32_t b = f->face_vertex[3 * (i / 9) + i / 3 % 3];
				if (label[b] > label[a]) {
					label[b] = label[a];
					changed = true;
				}
			}
		}
		struct topology t;
		assert_int_equal(topology_build(&t, f->arena, &f->garment, NULL), TW_OK);
		uint32_t count = 0;
		for (uint32_t v = 0; v < f->garment.vertex_count; v++) {
			if (label[v] == v)
				assert_int_equal(t.vertex_component[v], count++);
			else
				assert_int_equal(t.vertex_component[v], t.vertex_component[label[v]]);
		}
		assert_int_equal(t.component_count, count);
	}
}

static void third_face_on_an_edge_is_named(void **state)
{
	struct fixture *f = *state;
	const uint32_t faces[] = {0, 1, 2, 2, 1, 3, 1, 2, 4};
	memcpy(f->face_vertex, faces, sizeof faces);
	memcpy(f->face_coord, faces, sizeof faces);
	f->garment.vertex_count = f->garment.coord_count = 5;
	f->garment.face_count = 3;
	struct topology t;
	struct tw_error error = {0};
	assert_int_equal(topology_build(&t, f->arena, &f->garment, &error), TW_ERROR_INPUT);
	assert_string_equal(error.type, "mesh-non-manifold-edge");
	assert_string_equal(error.where, "face 2");
	assert_non_null(strstr(error.text, "faces 0, 1 and 2"));
	assert_non_null(strstr(error.text, "vertices 1 and 2"));
}

static void arrays_give_the_same_garment_back(void **state)
{
	struct fixture *f = *state;
	make_random(f, 7);
	struct tw_array arrays[GARMENT_ARRAYS];
	struct topology t;
	size_t count = 0;
	assert_int_equal(topology_build(&t, f->arena, &f->garment, NULL), TW_OK);
	assert_int_equal(garment_to_arrays(&f->garment, &t, f->arena, arrays, &count, NULL), TW_OK);
	struct garment again;
	assert_int_equal(garment_from_arrays(&again, f->arena, arrays, count, NULL), TW_OK);
	assert_int_equal(again.vertex_count, f->garment.vertex_count);
	assert_int_equal(again.coord_count, f->garment.coord_count);
	assert_int_equal(again.face_count, f->garment.face_count);
	assert_int_equal(again.piece_count, 1);
	assert_string_equal(again.piece_name[0], "front");
	assert_ptr_equal(again.face_coord, f->garment.face_coord);
	assert_null(again.source_vertex);
	assert_int_equal(garment_source_count(&again), f->garment.vertex_count);
}

static void damaged_arrays_are_errors(void **state)
{
	struct fixture *f = *state;
	make_random(f, 7);
	for (size_t broken = 0; broken < 6; broken++) {
		struct tw_array arrays[GARMENT_ARRAYS];
		struct topology t;
		size_t count = 0;
		assert_int_equal(topology_build(&t, f->arena, &f->garment, NULL), TW_OK);
		assert_int_equal(garment_to_arrays(&f->garment, &t, f->arena, arrays, &count, NULL), TW_OK);
		arrays[broken].rows =
			broken == 5 ? 3 : 2; /* indexes now point outside, faces disagree, a name has no end */
		struct garment again;
		struct tw_error error = {0};
		assert_int_equal(garment_from_arrays(&again, f->arena, arrays, count, &error), TW_ERROR_INPUT);
		assert_string_equal(error.type, "garment-damaged");
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(edges_are_those_of_a_quadratic_search, setup, teardown),
		cmocka_unit_test_setup_teardown(components_are_numbered_by_their_lowest_vertex, setup, teardown),
		cmocka_unit_test_setup_teardown(third_face_on_an_edge_is_named, setup, teardown),
		cmocka_unit_test_setup_teardown(arrays_give_the_same_garment_back, setup, teardown),
		cmocka_unit_test_setup_teardown(damaged_arrays_are_errors, setup, teardown),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
