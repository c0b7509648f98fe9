/* Claims about certificates: what the solver writes holds, what somebody changed does not, and no certificate that the
 * checker accepts ever proves more than the optimum. */
#include "oracle.h"
#include "solver/steiner/certificate/file.h"
#include "solver/steiner/steiner.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

static struct arena *arena;

static int setup(void **state)
{
	(void)state;
	arena = arena_new(0);
	return arena == NULL;
}

static int teardown(void **state)
{
	(void)state;
	arena_free(arena);
	return 0;
}

struct solved {
	struct instance_case c;
	struct graph graph;
	struct steiner_tree tree;
	struct steiner_certificate certificate;
};

/* Solves the case, and certifies the tree unless there is none. */
static void solve(struct solved *solved, const struct steiner_options *options)
{
	const struct instance_case *c = &solved->c;
	struct tw_error error = {0};
	assert_int_equal(graph_build(&solved->graph, arena, c->vertex_count, c->edge_count, c->ends, c->weight, &error),
			 TW_OK);
	assert_int_equal(
		steiner_solve(&solved->graph, c->terminal, c->terminal_count, options, arena, &solved->tree, &error),
		TW_OK);
	if (solved->tree.outcome == STEINER_INFEASIBLE)
		return;
	assert_int_equal(steiner_certify(&solved->graph, c->terminal, c->terminal_count, &solved->tree, 0, arena,
					 &solved->certificate, &error),
			 TW_OK);
}

static enum tw_status check(const struct solved *solved, const struct steiner_certificate *certificate,
			    struct tw_error *error)
{
	*error = (struct tw_error){0};
	return certificate_check(certificate, &solved->graph, solved->c.terminal, solved->c.terminal_count, error);
}

static void expect_holds(const struct solved *solved)
{
	struct tw_error error;
	if (check(solved, &solved->certificate, &error) != TW_OK)
		fail_msg("%s: %s", error.where, error.text);
}

/* The certificate, with arrays of its own that a test may change. */
static struct steiner_certificate copy(const struct steiner_certificate *c)
{
	struct steiner_certificate to = *c;
	to.tree = ARENA_ARRAY(arena, c->tree_count, struct certificate_edge);
	to.potential = ARENA_ARRAY(arena, c->potential_count, struct certificate_potential);
	to.member = ARENA_ARRAY(arena, c->member_count, struct certificate_member);
	memcpy(to.tree, c->tree, c->tree_count * sizeof *c->tree);
	memcpy(to.potential, c->potential, c->potential_count * sizeof *c->potential);
	memcpy(to.member, c->member, c->member_count * sizeof *c->member);
	return to;
}

/* Makes total and certified follow from the radii again, so that only the potentials themselves can be wrong. */
static void sum_up(struct steiner_certificate *c)
{
	c->total = 0;
	for (uint32_t i = 0; i < c->potential_count; i++)
		c->total += c->potential[i].radius;
	c->certified = (c->total + c->scale - 1) / c->scale;
}

static void certificates_hold_and_prove_most_of_the_optimum(void **state)
{
	(void)state;
	double certified = 0, optimum = 0;
	for (uint64_t seed = 0; seed < 600; seed++) {
		const struct arena_mark mark = arena_mark(arena);
		uint64_t numbers = seed;
		static struct solved solved;
		if (seed % 8)
			case_random(&solved.c, 9, &numbers);
		else
			case_mesh(&solved.c, &numbers);
		solve(&solved, &(struct steiner_options){0});
		if (solved.tree.outcome != STEINER_INFEASIBLE) {
			expect_holds(&solved);
			assert_true(solved.certificate.certified <= solved.tree.weight);
			certified += solved.tree.weight
					     ? (double)solved.certificate.certified / (double)solved.tree.weight
					     : 1;
			optimum += 1;
		}
		arena_release(arena, mark);
	}
	assert_true(certified > 0.99 * optimum);
}

static void a_tree_found_in_a_hurry_gets_a_certificate_too(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 60; seed++) {
		const struct arena_mark mark = arena_mark(arena);
		uint64_t numbers = seed;
		static struct solved solved;
		case_mesh(&solved.c, &numbers);
		solve(&solved, &(struct steiner_options){.work_limit = 1});
		if (solved.tree.outcome != STEINER_INFEASIBLE) {
			expect_holds(&solved);
			assert_int_equal(solved.certificate.weight, solved.tree.weight);
			assert_true(solved.certificate.certified <= oracle_dreyfus(&solved.c));
			assert_true(solved.certificate.bound >= solved.tree.lower_bound);
		}
		arena_release(arena, mark);
	}
}

static void a_written_certificate_reads_back_the_same(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 50; seed++) {
		uint64_t numbers = seed;
		static struct solved solved;
		struct steiner_certificate read;
		struct tw_error error = {0};
		const char *bytes, *again;
		size_t length, length_again;
		case_mesh(&solved.c, &numbers);
		solve(&solved, &(struct steiner_options){0});
		if (solved.tree.outcome == STEINER_INFEASIBLE)
			continue;
		assert_int_equal(certificate_write(&solved.certificate, arena, &bytes, &length, &error), TW_OK);
		assert_int_equal(certificate_read(&read, arena, bytes, length, &error), TW_OK);
		assert_int_equal(check(&solved, &read, &error), TW_OK);
		assert_int_equal(certificate_write(&read, arena, &again, &length_again, &error), TW_OK);
		assert_int_equal(length, length_again);
		assert_memory_equal(bytes, again, length);
	}
}

static void degenerate_instances_have_certificates(void **state)
{
	(void)state;
	static struct solved solved;
	/* One terminal, and the same one thrice. */
	solved.c = (struct instance_case){0};
	shape_grid(&solved.c, 4, 4, 0, 1);
	memset(solved.c.weight, 0, sizeof solved.c.weight);
	memcpy(solved.c.terminal, (uint32_t[]){5, 5, 5}, 3 * sizeof(uint32_t));
	for (solved.c.terminal_count = 1; solved.c.terminal_count <= 3; solved.c.terminal_count++) {
		solve(&solved, &(struct steiner_options){0});
		expect_holds(&solved);
		assert_int_equal(solved.certificate.potential_count, 0);
	}
	/* Nothing weighs anything. */
	memcpy(solved.c.terminal, (uint32_t[]){0, 3, 15}, 3 * sizeof(uint32_t));
	solved.c.terminal_count = 3;
	solve(&solved, &(struct steiner_options){0});
	expect_holds(&solved);
	assert_int_equal(solved.certificate.certified, 0);
	/* As heavy as can be: no room for fractions, 32 bits of the solver's costs are coarser than the weights. */
	for (uint32_t e = 0; e < solved.c.edge_count; e++)
		solved.c.weight[e] = (UINT64_C(1) << 62) / solved.c.edge_count - 1 - e % 7;
	solve(&solved, &(struct steiner_options){0});
	expect_holds(&solved);
	assert_true(solved.certificate.certified > solved.tree.weight / 10 * 9);
	/* No tree, no certificate. */
	solved.c = (struct instance_case){.vertex_count = 3, .terminal_count = 2, .terminal = {0, 2}};
	case_edge(&solved.c, 0, 1);
	solve(&solved, &(struct steiner_options){0});
	assert_int_equal(solved.tree.outcome, STEINER_INFEASIBLE);
	struct tw_error error = {0};
	assert_int_equal(steiner_certify(&solved.graph, solved.c.terminal, 2, &solved.tree, 0, arena,
					 &solved.certificate, &error),
			 TW_ERROR_INPUT);
}

static void too_little_memory_is_said(void **state)
{
	(void)state;
	static struct solved solved;
	uint64_t numbers = 4;
	struct tw_error error = {0};
	case_mesh(&solved.c, &numbers);
	solve(&solved, &(struct steiner_options){0});
	assert_int_equal(steiner_certify(&solved.graph, solved.c.terminal, solved.c.terminal_count, &solved.tree, 20000,
					 arena, &solved.certificate, &error),
			 TW_ERROR_MEMORY);
	assert_true(*error.text != '\0');
}

/* The case of the tests that tamper: a mesh whose certificate is worth something. */
static void solve_mesh(struct solved *solved)
{
	uint64_t numbers = 12;
	solved->c = (struct instance_case){0};
	shape_grid(&solved->c, 12, 12, 0, 1);
	weigh(&solved->c, 6, &numbers);
	place_terminals(&solved->c, 8, &numbers);
	solve(solved, &(struct steiner_options){0});
	expect_holds(solved);
}

static void expect_refused(const struct solved *solved, const struct steiner_certificate *c, const char *where)
{
	struct tw_error error;
	assert_int_equal(check(solved, c, &error), TW_ERROR_INPUT);
	if (strncmp(error.where, where, strlen(where)) != 0)
		fail_msg("refused at %s (%s), expected %s", error.where, error.text, where);
}

static void a_raised_radius_is_refused(void **state)
{
	(void)state;
	static struct solved solved;
	solve_mesh(&solved);
	for (uint32_t i = 0; i < solved.certificate.potential_count; i++) {
		struct steiner_certificate c = copy(&solved.certificate);
		c.potential[i].radius++;
		expect_refused(&solved, &c, "total");
		sum_up(&c);
		expect_refused(&solved, &c, c.certified > c.bound ? "bound" : "potentials");
	}
}

/* Outside of a member's place the potential is the radius: where the member bridges a difference that an edge just
 * bears, the edge breaks. A member at which nothing is tight may go: what is left proves as much. */
static void a_dropped_member_is_refused_where_it_matters(void **state)
{
	(void)state;
	static struct solved solved;
	uint32_t refused = 0;
	solve_mesh(&solved);
	for (uint32_t i = 0; i < solved.certificate.potential_count; i++) {
		const struct certificate_potential *whole = &solved.certificate.potential[i];
		for (uint32_t j = 0; j < whole->count; j++) {
			struct steiner_certificate c = copy(&solved.certificate);
			struct tw_error error;
			c.member[whole->start + j] = c.member[whole->start + whole->count - 1];
			c.potential[i].count--;
			const enum tw_status status = check(&solved, &c, &error);
			refused += status != TW_OK;
			if (solved.certificate.member[whole->start + j].vertex == whole->terminal)
				assert_int_equal(status, TW_ERROR_INPUT);
		}
	}
	assert_true(refused > solved.certificate.member_count / 2);
}

static void a_wrong_tree_is_refused(void **state)
{
	(void)state;
	static struct solved solved;
	solve_mesh(&solved);
	for (uint32_t i = 0; i < solved.certificate.tree_count; i++) {
		struct steiner_certificate c = copy(&solved.certificate);
		const uint64_t weight = c.tree[i].weight;
		c.tree[i] = c.tree[--c.tree_count];
		expect_refused(&solved, &c, "tree");
		c.weight -= weight;
		expect_refused(&solved, &c, c.bound > c.weight ? "bound" : "tree");
		c = copy(&solved.certificate);
		c.tree[i].weight--;
		expect_refused(&solved, &c, "tree edge");
		c = copy(&solved.certificate);
		c.tree[i].ends[0] = c.vertex_count;
		expect_refused(&solved, &c, "tree edge");
		c = copy(&solved.certificate);
		c.tree[i] = c.tree[(i + 1) % c.tree_count];
		expect_refused(&solved, &c, "tree edge");
	}
	struct steiner_certificate c = copy(&solved.certificate);
	c.weight++;
	expect_refused(&solved, &c, "tree");
	c.weight -= 2;
	expect_refused(&solved, &c, "bound");
}

static void a_wrong_claim_is_refused(void **state)
{
	(void)state;
	static struct solved solved;
	solve_mesh(&solved);
	struct steiner_certificate c = solved.certificate;
	c.certified++;
	expect_refused(&solved, &c, "certified");
	c = solved.certificate;
	c.scale = 0;
	expect_refused(&solved, &c, "certified");
	c = solved.certificate;
	c.scale /= 2;
	c.certified = (c.total + c.scale - 1) / c.scale;
	expect_refused(&solved, &c, "bound");
	c.bound = c.weight = c.certified;
	expect_refused(&solved, &c, "tree");
	c = solved.certificate;
	c.bound = c.weight + 1;
	expect_refused(&solved, &c, "bound");
	c = solved.certificate;
	c.edge_count--;
	expect_refused(&solved, &c, "instance");
	c = solved.certificate;
	c.root = c.vertex_count;
	expect_refused(&solved, &c, "root");
	c = copy(&solved.certificate);
	c.root = c.potential[0].terminal;
	expect_refused(&solved, &c, "potential 1");
	c = copy(&solved.certificate);
	c.potential[1].terminal = c.potential[0].terminal;
	expect_refused(&solved, &c, "potential 2");
	c = copy(&solved.certificate);
	c.potential[1].count = UINT32_MAX;
	expect_refused(&solved, &c, "potential 2");
	c = copy(&solved.certificate);
	c.member[c.potential[1].start] = c.member[c.potential[1].start + 1];
	expect_refused(&solved, &c, "potential 2");
	c = copy(&solved.certificate);
	c.member[c.potential[0].start + 1].value = c.potential[0].radius;
	expect_refused(&solved, &c, "potential 1");
	c = copy(&solved.certificate);
	c.member[c.potential[0].start + 1].vertex = c.root;
	expect_refused(&solved, &c, "potential 1");
}

static void mutate(struct steiner_certificate *c, uint64_t *numbers)
{
	struct certificate_potential *potential = &c->potential[random_below(numbers, c->potential_count)];
	struct certificate_member *member = &c->member[random_below(numbers, (uint32_t)c->member_count)];
	const uint64_t step = (uint64_t)1 << random_below(numbers, 40);
	switch (random_below(numbers, 7)) {
	case 0:
		potential->radius += step;
		break;
	case 1:
		member->value += step;
		break;
	case 2:
		member->value -= step;
		break;
	case 3:
		member->vertex = random_below(numbers, c->vertex_count);
		break;
	case 4:
		potential->count -= potential->count > 0;
		break;
	case 5:
		c->scale -= c->scale > 1;
		break;
	default:
		c->root = random_below(numbers, c->vertex_count);
		break;
	}
}

static void no_certificate_that_is_accepted_proves_too_much(void **state)
{
	(void)state;
	uint32_t accepted = 0, refused = 0;
	for (uint64_t seed = 0; seed < 300; seed++) {
		const struct arena_mark mark = arena_mark(arena);
		uint64_t numbers = seed + 4000;
		static struct solved solved;
		case_random(&solved.c, 7, &numbers);
		solve(&solved, &(struct steiner_options){0});
		const struct steiner_certificate *whole = &solved.certificate;
		if (solved.tree.outcome != STEINER_INFEASIBLE && whole->potential_count && whole->member_count) {
			const uint64_t optimum = oracle_dreyfus(&solved.c);
			for (uint32_t i = 0; i < 100; i++) {
				struct steiner_certificate c = copy(whole);
				struct tw_error error;
				for (uint32_t j = random_below(&numbers, 3) + 1; j > 0; j--)
					mutate(&c, &numbers);
				sum_up(&c);
				const enum tw_status status = check(&solved, &c, &error);
				accepted += status == TW_OK;
				refused += status != TW_OK;
				assert_true(status == TW_OK || *error.text);
				assert_true(status != TW_OK || c.certified <= optimum);
			}
		}
		arena_release(arena, mark);
	}
	assert_true(accepted > 100 && refused > 10000);
}

static const char small[] = "# a path 1 - 2 - 3, terminals 1 and 3\nTIGHTWIRE STEINER CERTIFICATE 1\nINSTANCE 3 2 2\n"
			    "WEIGHT 7\nBOUND 7\nCERTIFIED 7\nTREE 2\n1 2 3\n2 3 4\nDUAL 1 2 14 1 2\n"
			    "POTENTIAL 3 14 2\n3 0\n2 8 # half of 4\nEND\n";

static void a_certificate_written_by_hand_holds(void **state)
{
	(void)state;
	struct solved solved = {.c = {.vertex_count = 3, .terminal_count = 2, .terminal = {0, 2}}};
	struct tw_error error = {0};
	case_edge(&solved.c, 0, 1);
	case_edge(&solved.c, 1, 2);
	solved.c.weight[0] = 3;
	solved.c.weight[1] = 4;
	solve(&solved, &(struct steiner_options){0});
	assert_int_equal(certificate_read(&solved.certificate, arena, small, sizeof small - 1, &error), TW_OK);
	expect_holds(&solved);
	solved.certificate.member[1].value--;
	expect_refused(&solved, &solved.certificate, "potentials");
	solved.certificate.member[1].value += 2;
	expect_refused(&solved, &solved.certificate, "potentials");
}

static void the_reader_names_the_line_of_every_mistake(void **state)
{
	(void)state;
	static const struct {
		const char *from, *to, *where;
	} mistakes[] = {
		{"TIGHTWIRE", "TIGHT", "line 2"},
		{"CERTIFICATE 1", "CERTIFICATE 2", "line 2"},
		{"INSTANCE 3 2 2", "INSTANCE 3 2 -2", "line 3"},
		{"INSTANCE 3 2 2", "INSTANCE 3 2 5000000000", "line 3"},
		{"WEIGHT 7", "WEIGHT 7.5", "line 4"},
		{"WEIGHT 7", "WEIGHT 18446744073709551616", "line 4"},
		{"TREE 2", "TREE 1", "line 9"},
		{"TREE 2", "TREE 4000000000", "line 7"},
		{"2 3 4\n", "2 4 4\n", "line 9"},
		{"2 3 4\n", "0 3 4\n", "line 9"},
		{"DUAL 1 2 14 1 2", "DUAL 1 2 14 1 1", "line 11"},
		{"DUAL 1 2 14 1 2", "DUAL 1 2 14 1 3", "line 13"},
		{"DUAL 1 2 14 1 2", "DUAL 1 2 14 1 4000000000", "line 10"},
		{"3 14 2", "3 14 1", "line 12"},
		{"3 14 2", "3 14 3", "line 11"},
		{"END", "", "line 15"},
		{"END", "END END", "line 14"},
	};
	for (size_t i = 0; i < sizeof mistakes / sizeof *mistakes; i++) {
		char text[sizeof small + 32];
		const char *at = strstr(small, mistakes[i].from);
		assert_non_null(at);
		const int length = snprintf(text, sizeof text, "%.*s%s%s", (int)(at - small), small, mistakes[i].to,
					    at + strlen(mistakes[i].from));
		struct steiner_certificate c;
		struct tw_error error = {0};
		assert_int_equal(certificate_read(&c, arena, text, (size_t)length, &error), TW_ERROR_INPUT);
		if (strcmp(error.where, mistakes[i].where) != 0)
			fail_msg("%s: %s (%s), expected %s", mistakes[i].to, error.where, error.text,
				 mistakes[i].where);
	}
	for (size_t length = 0; length < sizeof small - 4; length++) {
		char *cut = malloc(length + 1);
		struct steiner_certificate c;
		assert_non_null(cut);
		memcpy(cut, small, length);
		assert_int_equal(certificate_read(&c, arena, cut, length, NULL), TW_ERROR_INPUT);
		free(cut);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(certificates_hold_and_prove_most_of_the_optimum),
		cmocka_unit_test(a_tree_found_in_a_hurry_gets_a_certificate_too),
		cmocka_unit_test(a_written_certificate_reads_back_the_same),
		cmocka_unit_test(degenerate_instances_have_certificates),
		cmocka_unit_test(too_little_memory_is_said),
		cmocka_unit_test(a_raised_radius_is_refused),
		cmocka_unit_test(a_dropped_member_is_refused_where_it_matters),
		cmocka_unit_test(a_wrong_tree_is_refused),
		cmocka_unit_test(a_wrong_claim_is_refused),
		cmocka_unit_test(no_certificate_that_is_accepted_proves_too_much),
		cmocka_unit_test(a_certificate_written_by_hand_holds),
		cmocka_unit_test(the_reader_names_the_line_of_every_mistake),
	};
	return cmocka_run_group_tests(tests, setup, teardown);
}
