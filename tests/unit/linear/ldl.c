/* The sparse factorisation against dense Gaussian elimination, and against the equations themselves. */
#include "solver/linear/ldl.h"
#include "../steiner/oracle.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { COLUMNS = 24, MATRICES = 300, MOST_COLUMNS = 120 };

struct system {
	struct instance_case c;
	struct ldl_graph graph;
	double weight[CASE_EDGES];
	struct ldl ldl;
	uint32_t ground;
};

static void make_system(struct system *s, struct arena *arena, uint64_t seed)
{
	uint64_t numbers = seed + 8000000;
	*s = (struct system){0};
	if (seed % 3)
		case_random(&s->c, 2, &numbers);
	else
		case_mesh(&s->c, &numbers);
	/* A path through all vertices, so that the graph is connected. */
	for (uint32_t v = 1; v < s->c.vertex_count; v++)
		case_edge(&s->c, v - 1, v);
	for (uint32_t e = 0; e < s->c.edge_count; e++)
		s->weight[e] = 0.01 + (double)(random_next(&numbers) % 10000) / (seed % 2 ? 10000 : 10);
	s->graph = (struct ldl_graph){s->c.vertex_count, s->c.edge_count, s->c.ends};
	s->ground = random_below(&numbers, s->c.vertex_count);
	assert_int_equal(ldl_analyse(&s->ldl, arena, &s->graph, SIZE_MAX), TW_OK);
	const size_t used = arena_used(arena);
	assert_int_equal(ldl_factorise(&s->ldl, arena, &s->graph, s->weight, s->ground, NULL, NULL), TW_OK);
	assert_int_equal(arena_used(arena), used);
}

static void solve(const struct ldl *ldl, struct arena *arena, float *x, uint32_t stride)
{
	const struct arena_mark mark = arena_mark(arena);
	const struct ldl_top top = {ARENA_ARRAY(arena, ldl_top_size(ldl, stride), float), stride};
	assert_non_null(top.value);
	ldl_solve(ldl, x, &top, stride);
	arena_release(arena, mark);
}

/* Fills right-hand sides, 0 at the ground; `by_vertex` has them by the caller's numbers. */
static void fill(const struct system *s, float *x, double (*by_vertex)[COLUMNS], uint64_t seed)
{
	for (uint32_t v = 0; v < s->c.vertex_count; v++)
		for (uint32_t i = 0; i < COLUMNS; i++) {
			by_vertex[v][i] = v == s->ground ? 0 : (double)(random_next(&seed) % 2001) / 1000 - 1;
			x[(size_t)s->ldl.rank[v] * COLUMNS + i] = (float)by_vertex[v][i];
			by_vertex[v][i] = x[(size_t)s->ldl.rank[v] * COLUMNS + i];
		}
}

/* Solves the dense system for one column by elimination without pivots, in place. */
static void eliminate(const struct system *s, double (*a)[CASE_VERTICES], double *b)
{
	const uint32_t n = s->c.vertex_count;
	memset(a, 0, sizeof(double[CASE_VERTICES][CASE_VERTICES]));
	for (uint32_t e = 0; e < s->c.edge_count; e++) {
		const uint32_t u = s->c.ends[2 * e], v = s->c.ends[2 * e + 1];
		a[u][u] += s->weight[e], a[v][v] += s->weight[e];
		a[u][v] -= s->weight[e], a[v][u] -= s->weight[e];
	}
	for (uint32_t v = 0; v < n; v++)
		a[v][s->ground] = a[s->ground][v] = v == s->ground;
	for (uint32_t k = 0; k < n; k++)
		for (uint32_t i = k + 1; i < n; i++) {
			const double factor = a[i][k] / a[k][k];
			for (uint32_t j = k; j < n && factor != 0; j++)
				a[i][j] -= factor * a[k][j];
			b[i] -= factor * b[k];
		}
	for (uint32_t k = n; k-- > 0;) {
		for (uint32_t j = k + 1; j < n; j++)
			b[k] -= a[k][j] * b[j];
		b[k] /= a[k][k];
	}
}

static void it_solves_what_dense_elimination_solves(void **state)
{
	(void)state;
	static double dense[CASE_VERTICES][CASE_VERTICES], by_vertex[CASE_VERTICES][COLUMNS];
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	for (uint64_t seed = 0; seed < MATRICES; seed++) {
		const struct arena_mark mark = arena_mark(arena);
		struct system s;
		make_system(&s, arena, seed);
		float *x = ARENA_ZEROED(arena, (size_t)s.ldl.place_count * COLUMNS, float);
		assert_non_null(x);
		fill(&s, x, by_vertex, seed);
		solve(&s.ldl, arena, x, COLUMNS);
		double column[CASE_VERTICES], largest = 0;
		const uint32_t i = (uint32_t)(seed % COLUMNS);
		for (uint32_t v = 0; v < s.c.vertex_count; v++)
			column[v] = by_vertex[v][i];
		eliminate(&s, dense, column);
		for (uint32_t v = 0; v < s.c.vertex_count; v++)
			largest = fabs(column[v]) > largest ? fabs(column[v]) : largest;
		for (uint32_t v = 0; v < s.c.vertex_count; v++)
			assert_true(fabs(x[(size_t)s.ldl.rank[v] * COLUMNS + i] - column[v]) <= 1e-4 * largest);
		assert_true(x[(size_t)s.ldl.rank[s.ground] * COLUMNS + i] == 0);
		arena_release(arena, mark);
	}
	arena_free(arena);
}

/* Random numbers in the vertices' rows, 0 at the ground; 0 in the copies'. */
static void scatter(const struct system *s, float *x, uint32_t columns, uint64_t seed)
{
	memset(x, 0, (size_t)s->ldl.place_count * columns * sizeof *x);
	for (uint32_t v = 0; v < s->c.vertex_count; v++)
		for (uint32_t i = 0; i < columns && v != s->ground; i++)
			x[(size_t)s->ldl.rank[v] * columns + i] = (float)random_below(&seed, 2001) / 1000 - 1;
}

/* The column by itself, with whatever the machine has at least. */
static void expect_column(struct system *s, struct arena *arena, const float *before, const float *after,
			  uint32_t columns, uint32_t column)
{
	const struct arena_mark mark = arena_mark(arena);
	const enum isa isa = s->ldl.isa;
	float *alone = ARENA_ZEROED(arena, (size_t)s->ldl.place_count * LANES_BLOCK, float);
	assert_non_null(alone);
	for (uint32_t p = 0; p < s->ldl.place_count; p++)
		alone[(size_t)p * LANES_BLOCK] = before[(size_t)p * columns + column];
	s->ldl.isa = ISA_BASE;
	solve(&s->ldl, arena, alone, LANES_BLOCK);
	s->ldl.isa = isa;
	for (uint32_t p = 0; p < s->ldl.place_count; p++)
		assert_memory_equal(&alone[(size_t)p * LANES_BLOCK], &after[(size_t)p * columns + column],
				    sizeof(float));
	arena_release(arena, mark);
}

static void a_column_is_the_same_bits_whatever_is_beside_it_and_whichever_kernels_work(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	for (uint64_t seed = 0; seed < MATRICES / 5; seed++) {
		struct system s;
		const struct arena_mark mark = arena_mark(arena);
		make_system(&s, arena, seed);
		for (enum isa isa = ISA_BASE; isa < ISA_COUNT; isa++) {
			uint64_t numbers = seed;
			const uint32_t columns = LANES_BLOCK * (1 + random_below(&numbers, MOST_COLUMNS / LANES_BLOCK));
			const size_t count = (size_t)s.ldl.place_count * columns;
			if (!isa_is_there(isa))
				continue;
			float *x = ARENA_ARRAY(arena, count, float), *y = ARENA_ARRAY(arena, count, float);
			assert_true(x && y);
			scatter(&s, x, columns, seed);
			memcpy(y, x, count * sizeof *y);
			s.ldl.isa = isa;
			solve(&s.ldl, arena, x, columns);
			for (uint32_t i = 0; i < columns; i += 1 + columns / 7)
				expect_column(&s, arena, y, x, columns, i);
		}
		arena_release(arena, mark);
	}
	arena_free(arena);
}

static void a_factor_is_the_same_bits_whichever_kernels_work(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	for (uint64_t seed = 0; seed < MATRICES / 5; seed++) {
		struct system s;
		const struct arena_mark mark = arena_mark(arena);
		float *base = NULL, *diagonal = NULL;
		make_system(&s, arena, seed);
		for (s.ldl.isa = ISA_BASE; s.ldl.isa < ISA_COUNT && isa_is_there(s.ldl.isa); s.ldl.isa++) {
			const struct ldl *l = &s.ldl;
			assert_int_equal(ldl_factorise(&s.ldl, arena, &s.graph, s.weight, s.ground, NULL, NULL), TW_OK);
			if (!base) {
				base = ARENA_ARRAY(arena, l->value_count, float);
				diagonal = ARENA_ARRAY(arena, l->place_count, float);
				assert_true(base && diagonal);
				memcpy(base, l->value, l->value_count * sizeof *base);
				memcpy(diagonal, l->inverse, l->place_count * sizeof *diagonal);
			}
			assert_memory_equal(base, l->value, l->value_count * sizeof *base);
			assert_memory_equal(diagonal, l->inverse, l->place_count * sizeof *diagonal);
		}
		arena_release(arena, mark);
	}
	arena_free(arena);
}

/* Threads take parts in any order, and chunks of columns in the top. */
static void parts_in_any_order_give_the_same_bits(void **state)
{
	(void)state;
	uint32_t in_parts = 0;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	for (uint64_t seed = 0; seed < MATRICES / 5; seed++) {
		struct system s;
		const struct arena_mark mark = arena_mark(arena);
		make_system(&s, arena, seed);
		const size_t count = (size_t)s.ldl.place_count * COLUMNS;
		float *x = ARENA_ARRAY(arena, count, float), *y = ARENA_ARRAY(arena, count, float);
		assert_true(x && y);
		scatter(&s, x, COLUMNS, seed);
		memcpy(y, x, count * sizeof *y);
		solve(&s.ldl, arena, x, COLUMNS);
		for (uint32_t part = s.ldl.part_count; part-- > 0;)
			ldl_forward(&s.ldl, y, COLUMNS, part);
		const struct ldl_top top = {ARENA_ARRAY(arena, ldl_top_size(&s.ldl, COLUMNS), float),
					    LANES_BLOCK * (1 + (uint32_t)(seed % (COLUMNS / LANES_BLOCK)))};
		assert_non_null(top.value);
		for (uint32_t chunk = (COLUMNS + top.width - 1) / top.width; chunk-- > 0;)
			ldl_solve_top(&s.ldl, y, &top, COLUMNS, chunk);
		for (uint32_t part = s.ldl.part_count + 1; part-- > 0;)
			ldl_backward(&s.ldl, y, &top, COLUMNS, part);
		assert_memory_equal(x, y, count * sizeof *x);
		in_parts += s.ldl.part_count > 1 && s.ldl.place_count > s.c.vertex_count;
		arena_release(arena, mark);
	}
	assert_true(in_parts > MATRICES / 20);
	arena_free(arena);
}

/* Copies stand for the rows of the top that a part's panels name, ascending, and are found by them. */
static void a_part_finds_its_copies(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	for (uint64_t seed = 0; seed < MATRICES; seed++) {
		struct system s;
		const struct arena_mark mark = arena_mark(arena);
		make_system(&s, arena, seed);
		const struct ldl *l = &s.ldl;
		for (uint32_t part = 0; part < l->part_count; part++)
			for (uint32_t p = l->part[part].first; p < l->part[part].copies_end; p++) {
				assert_int_equal(ldl_place_in(l, part, l->original[p]), p);
				assert_int_equal(l->original[p] == p, p < l->part[part].end);
				assert_int_equal(ldl_part_of(l, p), part);
			}
		for (uint32_t e = 0; e < s.c.edge_count; e++) {
			const uint32_t u = l->rank[s.c.ends[2 * e]], v = l->rank[s.c.ends[2 * e + 1]];
			const uint32_t part = ldl_part_of(l, u < v ? u : v);
			assert_int_equal(l->original[ldl_place_in(l, part, u < v ? v : u)], u < v ? v : u);
		}
		arena_release(arena, mark);
	}
	arena_free(arena);
}

static void what_is_too_dense_or_does_not_fit_is_refused(void **state)
{
	(void)state;
	struct instance_case c = {0};
	struct ldl ldl;
	shape_complete(&c, 40);
	const struct ldl_graph graph = {c.vertex_count, c.edge_count, c.ends};
	struct arena *arena = arena_new(0), *small = arena_new(3000);
	assert_true(arena && small);
	assert_int_equal(ldl_analyse(&ldl, arena, &graph, 40 * 39 / 2 - 1), TW_ERROR_MEMORY);
	assert_int_equal(ldl_analyse(&ldl, arena, &graph, 40 * 39 / 2), TW_OK);
	assert_int_equal(ldl_analyse(&ldl, small, &graph, SIZE_MAX), TW_ERROR_MEMORY);
	arena_free(arena);
	arena_free(small);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(it_solves_what_dense_elimination_solves),
		cmocka_unit_test(a_column_is_the_same_bits_whatever_is_beside_it_and_whichever_kernels_work),
		cmocka_unit_test(a_factor_is_the_same_bits_whichever_kernels_work),
		cmocka_unit_test(parts_in_any_order_give_the_same_bits),
		cmocka_unit_test(a_part_finds_its_copies),
		cmocka_unit_test(what_is_too_dense_or_does_not_fit_is_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
