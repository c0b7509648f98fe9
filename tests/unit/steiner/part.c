/* Parts: the tree that is found is the optimum of the edges that were kept, and of nothing else. */
#include "solver/steiner/part.h"
#include "setting.h"

enum { GRAPHS = 3000, MESH_ONE_IN = 4 };
static const uint64_t enough = 1000000000;

/* A setting, edges to keep, and the case of these alone. */
struct part_case {
	struct setting s;
	struct instance_case kept;
	uint8_t *keep;
	uint64_t optimum;
};

/* False where there is nothing to connect. */
static bool open_case(struct part_case *p, uint64_t seed)
{
	uint64_t numbers = seed + 9000000;
	*p = (struct part_case){0};
	if (seed % MESH_ONE_IN)
		case_random(&p->s.c, 8, &numbers);
	else
		case_mesh(&p->s.c, &numbers);
	if (oracle_dreyfus(&p->s.c) >= UNREACHED)
		return false;
	setting_open(&p->s, STEINER_PRIMAL); /* a first tree that leaves something to be found */
	const struct instance *instance = &p->s.search.instance;
	p->keep = ARENA_ZEROED(p->s.arena, instance->edge_count, uint8_t);
	assert_non_null(p->keep);
	if (seed % 2)
		assert_int_equal(search_mark_best(&p->s.search, p->keep), TW_OK);
	const uint32_t percent = 50 + random_below(&numbers, 50);
	p->kept = p->s.c;
	p->kept.edge_count = 0;
	for (uint32_t e = 0; e < instance->edge_count; e++) {
		p->keep[e] |= random_below(&numbers, 100) < percent;
		if (!p->keep[e])
			continue;
		const uint32_t leaf = instance->origin[e], i = p->kept.edge_count++;
		p->kept.ends[2 * i] = p->s.c.ends[2 * leaf];
		p->kept.ends[2 * i + 1] = p->s.c.ends[2 * leaf + 1];
		p->kept.weight[i] = p->s.c.weight[leaf];
	}
	p->optimum = oracle_dreyfus(&p->kept);
	return instance->terminal_count > 1;
}

static void the_tree_of_a_part_is_its_optimum(void **state)
{
	(void)state;
	uint32_t better = 0, apart = 0;
	for (uint64_t seed = 0; seed < GRAPHS; seed++) {
		struct part_case p;
		bool is_solved = false;
		if (!open_case(&p, seed)) {
			arena_free(p.s.arena);
			continue;
		}
		struct search *search = &p.s.search;
		const uint64_t before = search->best_weight, bound = search->lower_bound, work = search->work;
		const uint32_t vertices = search->instance.vertex_count, edges = search->instance.edge_count;
		assert_int_equal(part_solve(search, p.keep, enough, &is_solved), TW_OK);
		if (is_solved != (p.optimum < UNREACHED))
			fail_msg("case %llu: solved %d", (unsigned long long)seed, is_solved);
		if (search->best_weight != (p.optimum < before ? p.optimum : before))
			fail_msg("case %llu: weight %llu, the oracle says %llu", (unsigned long long)seed,
				 (unsigned long long)search->best_weight, (unsigned long long)p.optimum);
		/* Nothing is known about the whole but the tree. */
		assert_int_equal(search->lower_bound, bound);
		assert_int_equal(search->instance.vertex_count, vertices);
		assert_int_equal(search->instance.edge_count, edges);
		assert_int_equal(search->budget_end, 0);
		assert_true(search->work > work && !search->stop);
		better += p.optimum < before;
		apart += p.optimum >= UNREACHED;
		arena_free(p.s.arena);
	}
	assert_true(better > GRAPHS / 20 && apart > GRAPHS / 30);
}

static void with_too_little_effort_the_tree_is_no_worse_than_before(void **state)
{
	(void)state;
	uint32_t unsolved = 0;
	for (uint64_t seed = 0; seed < GRAPHS; seed += 3) {
		struct part_case p;
		bool is_solved = false;
		if (open_case(&p, seed)) {
			struct search *search = &p.s.search;
			const uint64_t before = search->best_weight;
			assert_int_equal(part_solve(search, p.keep, seed % 200, &is_solved), TW_OK);
			assert_true(search->best_weight <= before);
			assert_true(search->best_weight == before || search->best_weight >= p.optimum);
			assert_int_equal(steiner_verify(&p.s.graph, p.s.c.terminal, p.s.c.terminal_count,
							search->best_edges, search->best_count, search->best_weight,
							NULL),
					 TW_OK);
			assert_true(!search->stop && !search->budget_end);
			unsolved += !is_solved;
		}
		arena_free(p.s.arena);
	}
	assert_true(unsolved > 20);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_tree_of_a_part_is_its_optimum),
		cmocka_unit_test(with_too_little_effort_the_tree_is_no_worse_than_before),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
