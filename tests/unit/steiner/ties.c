/* With tie-breaks from the caller the optimum is one tree, whatever the numbering, the width of the weights and the
 * stages that are switched off. The oracle sees weight and tie-break as one number. */
#include "oracle.h"
#include "solver/steiner/steiner.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { CASES = 12000, MESHES = 300, SHUFFLES = 3000, TIE_BITS = 20, FEATURES = 14 };

struct answer {
	struct steiner_tree tree;
	uint64_t ties; /* sum over the tree */
};

static struct answer solve(const struct instance_case *c, const uint32_t *ties, struct steiner_options options,
			   struct arena *arena)
{
	struct graph graph;
	struct tw_error error = {0};
	struct answer answer = {0};
	options.ties = ties;
	enum tw_status status = graph_build(&graph, arena, c->vertex_count, c->edge_count, c->ends, c->weight, &error);
	if (status == TW_OK)
		status = steiner_solve(&graph, c->terminal, c->terminal_count, &options, arena, &answer.tree, &error);
	if (status != TW_OK)
		fail_msg("%s", error.text);
	for (uint32_t i = 0; i < answer.tree.edge_count; i++)
		answer.ties += ties[answer.tree.edges[i]];
	return answer;
}

static void check_least(struct instance_case *c, uint64_t seed, uint64_t *numbers, struct arena *arena)
{
	const struct arena_mark mark = arena_mark(arena);
	const uint32_t most = 1u << (seed % 3 == 0 ? 1 : seed % 3 == 1 ? 4 : 12);
	uint32_t ties[CASE_EDGES];
	struct instance_case whole = *c;
	for (uint32_t e = 0; e < c->edge_count; e++) {
		ties[e] = random_below(numbers, most);
		whole.weight[e] = c->weight[e] << TIE_BITS | ties[e];
	}
	const uint64_t expected = oracle_dreyfus(&whole);
	struct steiner_options options = {.threads = 1 + (unsigned)(seed % 2)};
	if (seed % 4)
		options.disable = random_next(numbers) & ((1u << FEATURES) - 1) &
				  ~(uint64_t)(STEINER_DYNAMIC | STEINER_PERTURBATION);
	const struct answer answer = solve(c, ties, options, arena);
	if (expected >= UNREACHED) {
		assert_int_equal(answer.tree.outcome, STEINER_INFEASIBLE);
	} else {
		assert_int_equal(answer.tree.outcome, STEINER_OPTIMAL);
		if (!answer.tree.is_unique || answer.tree.weight << TIE_BITS != expected - answer.ties)
			fail_msg("case %llu, disabled %#llx: weight %llu, ties %llu, unique %d; the oracle says %llu, "
				 "%llu",
				 (unsigned long long)seed, (unsigned long long)options.disable,
				 (unsigned long long)answer.tree.weight, (unsigned long long)answer.ties,
				 (int)answer.tree.is_unique, (unsigned long long)(expected >> TIE_BITS),
				 (unsigned long long)(expected & ((1u << TIE_BITS) - 1)));
	}
	arena_release(arena, mark);
}

static void of_the_lightest_trees_the_one_of_least_tie_breaks_is_found(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	for (uint64_t seed = 0; seed < CASES + MESHES; seed++) {
		uint64_t numbers = seed + 3000000;
		struct instance_case c;
		if (seed < CASES)
			case_random(&c, 8, &numbers);
		else
			case_mesh(&c, &numbers);
		/* Weights that leave room for the oracle: none, few, many ties. */
		weigh(&c, (uint32_t)(seed % 5), &numbers);
		check_least(&c, seed, &numbers, arena);
	}
	arena_free(arena);
}

static int compare_ties(const void *a, const void *b)
{
	const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
	return (x > y) - (x < y);
}

static uint32_t list_ties(const struct steiner_tree *tree, const uint32_t *ties, uint32_t *list)
{
	for (uint32_t i = 0; i < tree->edge_count; i++)
		list[i] = ties[tree->edges[i]];
	qsort(list, tree->edge_count, sizeof *list, compare_ties);
	return tree->edge_count;
}

/* Shuffles a case together with its tie-breaks: a second case with the same ends, which is shuffled in the same way,
 * carries them as its weights. */
static void shuffle(struct instance_case *c, uint32_t *ties, uint64_t *numbers)
{
	struct instance_case carrier = *c;
	uint64_t again = *numbers;
	for (uint32_t e = 0; e < c->edge_count; e++)
		carrier.weight[e] = ties[e];
	case_shuffle(c, numbers);
	case_shuffle(&carrier, &again);
	for (uint32_t e = 0; e < c->edge_count; e++)
		ties[e] = (uint32_t)carrier.weight[e];
}

static void the_tree_is_the_same_for_every_numbering_and_any_weights(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	uint32_t compared = 0;
	for (uint64_t seed = 0; seed < SHUFFLES; seed++) {
		const struct arena_mark mark = arena_mark(arena);
		uint64_t numbers = seed + 4000000;
		struct instance_case c;
		uint32_t ties[CASE_EDGES], before[CASE_EDGES], after[CASE_EDGES];
		if (seed % 10)
			case_random(&c, 10, &numbers);
		else
			case_mesh(&c, &numbers);
		for (uint32_t e = 0; e < c.edge_count; e++)
			ties[e] = (uint32_t)random_next(&numbers);
		/* Sums of 62 bits, all of them ties but for the last digit. */
		if (seed % 3 == 0)
			for (uint32_t e = 0; e < c.edge_count; e++)
				c.weight[e] = (UINT64_C(1) << 51) + c.weight[e] % 2;
		const struct answer first = solve(&c, ties, (struct steiner_options){0}, arena);
		const uint32_t count = list_ties(&first.tree, ties, before);
		shuffle(&c, ties, &numbers);
		const struct answer second = solve(&c, ties, (struct steiner_options){.threads = 2}, arena);
		assert_int_equal(second.tree.outcome, first.tree.outcome);
		if (first.tree.outcome == STEINER_OPTIMAL) {
			assert_true(first.tree.is_unique && second.tree.is_unique);
			assert_true(first.tree.is_reproducible && second.tree.is_reproducible);
			assert_int_equal(list_ties(&second.tree, ties, after), count);
			assert_memory_equal(after, before, count * sizeof *after);
			compared++;
		}
		arena_release(arena, mark);
	}
	assert_true(compared > SHUFFLES / 2);
	arena_free(arena);
}

/* A linear program does not see tie-breaks: it proves the weight, and says no more. */
static void branch_and_cut_alone_proves_the_weight_and_claims_no_more(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	assert_non_null(arena);
	const uint64_t most = (1u << FEATURES) - 1;
	uint32_t pivoted = 0;
	for (uint64_t seed = 0; seed < 1000; seed++) {
		const struct arena_mark mark = arena_mark(arena);
		uint64_t numbers = seed + 5000000;
		struct instance_case c;
		uint32_t ties[CASE_EDGES];
		case_random(&c, 8, &numbers);
		weigh(&c, (uint32_t)(seed % 5), &numbers);
		for (uint32_t e = 0; e < c.edge_count; e++)
			ties[e] = random_below(&numbers, 4);
		const struct steiner_options options = {.disable = most & ~(uint64_t)STEINER_CUTS &
								   ~(uint64_t)STEINER_PERTURBATION};
		const struct answer answer = solve(&c, ties, options, arena);
		const uint64_t expected = oracle_dreyfus(&c);
		if (expected < UNREACHED) {
			assert_int_equal(answer.tree.outcome, STEINER_OPTIMAL);
			assert_int_equal(answer.tree.weight, expected);
		}
		for (uint32_t e = 0; e < c.edge_count; e++)
			c.weight[e] = c.weight[e] << TIE_BITS | ties[e];
		if (answer.tree.is_unique)
			assert_int_equal(oracle_dreyfus(&c), (expected << TIE_BITS) + answer.ties);
		pivoted += !answer.tree.is_reproducible;
		arena_release(arena, mark);
	}
	assert_true(pivoted > 30);
	arena_free(arena);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(of_the_lightest_trees_the_one_of_least_tie_breaks_is_found),
		cmocka_unit_test(the_tree_is_the_same_for_every_numbering_and_any_weights),
		cmocka_unit_test(branch_and_cut_alone_proves_the_weight_and_claims_no_more),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
