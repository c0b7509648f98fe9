/* Claims about the readers of PACE and SteinLib files. */
#include "solver/graph/steiner_file.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char square[] = "SECTION Graph\nNodes 4\nEdges 4\nE 1 2 3\nE 2 3 0\nE 3 4 5\nE 1 4 7\nEND\n\n"
			     "SECTION Terminals\nTerminals 2\nT 1\nT 3\nEND\n\nEOF\n";

static int setup(void **state)
{
	*state = arena_new(0);
	return *state == NULL;
}

static int teardown(void **state)
{
	arena_free(*state);
	return 0;
}

static enum tw_status read_text(void **state, struct steiner_file *file, const char *text, struct tw_error *error)
{
	/* A block of exactly the text's size lets the sanitizer see a read beyond it. */
	const size_t length = strlen(text);
	char *exact = malloc(length ? length : 1);
	assert_non_null(exact);
	memcpy(exact, text, length);
	const enum tw_status status = steiner_file_read(file, *state, exact, length, error);
	free(exact);
	return status;
}

static void reads_a_pace_file(void **state)
{
	struct steiner_file file;
	struct tw_error error = {0};
	assert_int_equal(read_text(state, &file, square, &error), TW_OK);
	assert_int_equal(file.format, STEINER_FORMAT_GR);
	assert_int_equal(file.graph.vertex_count, 4);
	assert_int_equal(file.graph.edge_count, 4);
	assert_int_equal(file.graph.weight[3], 7);
	assert_int_equal(file.terminal_count, 2);
	assert_int_equal(file.terminals[1], 2);
	const uint32_t first[] = {0, 2, 4, 6, 8}, head[] = {1, 3, 0, 2, 1, 3, 2, 0}, edge[] = {0, 3, 0, 1, 1, 2, 2, 3};
	assert_memory_equal(file.graph.first, first, sizeof first);
	assert_memory_equal(file.graph.head, head, sizeof head);
	assert_memory_equal(file.graph.edge, edge, sizeof edge);
}

static void reads_a_steinlib_file_of_any_case_and_line_end(void **state)
{
	struct steiner_file file;
	struct tw_error error = {0};
	const char *text =
		"33d32945 STP File, STP Format Version 1.0\r\n\r\nSECTION Comment\r\nName \"E 1 2\"\r\nEND\r\n"
		"Section Graph\r\nnodes 3\r\nEDGES 2\r\ne 1 2 1\r\nE\t3  2 1 \r\nEnd\r\n"
		"section Terminals\r\nTerminals 1\r\nT 2\r\nEnd\r\nSECTION Coordinates\r\nDD 1 2 3\r\nEND\r\neof";
	assert_int_equal(read_text(state, &file, text, &error), TW_OK);
	assert_int_equal(file.format, STEINER_FORMAT_STP);
	assert_int_equal(file.graph.edge_count, 2);
	assert_int_equal(file.graph.ends[2], 2);
}

/* No tree has one, so that leaving it out changes nothing; announced counts still hold. */
static void leaves_out_edges_from_a_vertex_to_itself(void **state)
{
	static const char *const heads[] = {"", "33D32945 STP File\n"};
	for (int stp = 0; stp < 2; stp++) {
		struct steiner_file file;
		struct tw_error error = {0};
		char text[512];
		snprintf(text, sizeof text,
			 "%sSECTION Graph\nNodes 3\nEdges 4\nE 1 2 1\nE 2 2 5\nE 2 3 1\nE 3 3 0\nEND\nSECTION "
			 "Terminals\n"
			 "Terminals 2\nT 1\nT 3\nEND\nEOF\n",
			 heads[stp]);
		assert_int_equal(read_text(state, &file, text, &error), TW_OK);
		assert_int_equal(file.graph.edge_count, 2);
		assert_int_equal(file.loop_count, 2);
		assert_int_equal(file.loop_line, 5 + stp);
		const uint32_t ends[] = {0, 1, 1, 2};
		assert_memory_equal(file.graph.ends, ends, sizeof ends);
		text[strlen(text) - 5] = '\0';
		char *count = strstr(text, "Edges 4");
		count[6] = '3';
		assert_int_equal(read_text(state, &file, text, &error), TW_ERROR_INPUT);
		assert_string_equal(error.type, "steiner-file-count");
	}
}

/* They stay, for a tree that joins a terminal joins it however often it was listed; but somebody may have mistyped. */
static void notes_terminals_that_were_listed_before(void **state)
{
	static const struct {
		const char *terminals;
		uint32_t count, repeated;
		size_t line;
	} cases[] = {
		{"Terminals 2\nT 1\nT 9\n", 2, 0, 0},
		{"Terminals 3\nT 9\nT 1\nT 9\n", 3, 1, 10},
		{"Terminals 5\nT 8\nT 8\nT 1\nT 1\nT 8\n", 5, 3, 9},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct steiner_file file;
		struct tw_error error = {0};
		char text[512];
		snprintf(text, sizeof text, "SECTION Graph\nNodes 9\nEdges 0\nEND\n\nSECTION Terminals\n%sEND\nEOF\n",
			 cases[i].terminals);
		assert_int_equal(read_text(state, &file, text, &error), TW_OK);
		assert_int_equal(file.terminal_count, cases[i].count);
		assert_int_equal(file.repeated_count, cases[i].repeated);
		assert_int_equal(file.repeated_line, cases[i].line);
	}
}

/* A mark, line ends and blanks of any kind, keywords in any case. */
static void reads_a_file_however_its_lines_are_written(void **state)
{
	static const char *const ends[] = {"\n", "\r\n", "\r", " \t\n\n"};
	for (size_t e = 0; e < sizeof ends / sizeof *ends; e++) {
		for (int mark = 0; mark < 2; mark++) {
			struct steiner_file file;
			struct tw_error error = {0};
			char text[1024] = "";
			size_t size = (size_t)snprintf(text, sizeof text, "%s", mark ? "\xef\xbb\xbf" : "");
			for (const char *c = square; *c; c++)
				size += (size_t)snprintf(text + size, sizeof text - size, *c == '\n' ? "%s" : "%.1s",
							 *c == '\n'            ? ends[e]
							 : *c == ' ' && e == 3 ? "\v"
									       : c);
			if (read_text(state, &file, text, &error) != TW_OK)
				fail_msg("end %zu mark %d: %s %s", e, mark, error.where, error.text);
			assert_int_equal(file.graph.edge_count, 4);
			assert_int_equal(file.graph.weight[3], 7);
		}
	}
}

/* What reductions took is told; a fraction, or what nobody knows, is refused. */
static void reads_what_a_presolver_took(void **state)
{
	static const char *const frame =
		"33D32945 STP File\nSECTION Presolve\nDATE Tue, 7 Jul 1998\n%s\nORGNODES 9\nEA 1 2 3 4\n"
		"END\nSECTION Graph\nNodes 2\nEdges 3\nE 1 2 5\nE 2 1 3\nE 1 2 3\nEND\n"
		"SECTION Terminals\nTerminals 2\nT 1\nT 2\nEND\nEOF\n";
	static const struct {
		const char *line;
		enum tw_status status;
		uint64_t fixed;
	} cases[] = {
		{"FIXED 17", TW_OK, 17},
		{"fixed 17.000", TW_OK, 17},
		{"Fixed\t0.0", TW_OK, 0},
		{"TIME 0.5", TW_OK, 0},
		{"", TW_OK, 0},
		{"FIXED 17.5", TW_ERROR_INPUT, 0},
		{"FIXED 17 3", TW_ERROR_INPUT, 0},
		{"FIXED", TW_ERROR_INPUT, 0},
		{"FIXED .", TW_ERROR_INPUT, 0},
		{"FIXED -1", TW_ERROR_INPUT, 0},
		{"FIXED 1e3", TW_ERROR_INPUT, 0},
		{"FIXED 9223372036854775807", TW_ERROR_INPUT, 0},
		{"FIXED 1\nFIXED 1", TW_ERROR_INPUT, 0},
		{"SCALE 2", TW_ERROR_UNSUPPORTED, 0},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct steiner_file file;
		struct tw_error error = {0};
		char text[1024];
		snprintf(text, sizeof text, frame, cases[i].line);
		const enum tw_status status = read_text(state, &file, text, &error);
		if (status != cases[i].status)
			fail_msg("%s: %d %s %s", cases[i].line, (int)status, error.where, error.text);
		if (status != TW_OK) {
			assert_memory_equal(error.where, "line ", 5);
			continue;
		}
		assert_true(file.is_presolved);
		assert_int_equal(file.fixed, cases[i].fixed);
		assert_int_equal(file.graph.edge_count, 3); /* parallel edges stay */
	}
}

static void passes_over_a_tree_decomposition(void **state)
{
	struct steiner_file file;
	struct tw_error error = {0};
	const char *text = "SECTION Graph\nNodes 1\nEdges 0\nEND\nSECTION Terminals\nTerminals 1\nT 1\nEND\n"
			   "SECTION Tree Decomposition\ns td 1 1 1\nb 1 1\nEND\nEOF\n";
	assert_int_equal(read_text(state, &file, text, &error), TW_OK);
}

static void names_the_line_of_every_mistake(void **state)
{
#define GRAPH_HEAD "SECTION Graph\nNodes 3\nEdges 2\n"
	static const struct {
		const char *text, *where, *type;
		enum tw_status status;
	} mistakes[] = {
		{"", "", "steiner-file-truncated", TW_ERROR_INPUT},
		{"hello", "line 1", "steiner-file-syntax", TW_ERROR_INPUT},
		{"EOF", "line 1", "steiner-file-syntax", TW_ERROR_INPUT},
		{GRAPH_HEAD "E 1 2 1\n", "line 4", "steiner-file-truncated", TW_ERROR_INPUT},
		{GRAPH_HEAD "E 1 4 1\n", "line 4", "steiner-file-vertex-range", TW_ERROR_INPUT},
		{GRAPH_HEAD "E 0 1 1\n", "line 4", "steiner-file-vertex-range", TW_ERROR_INPUT},
		{GRAPH_HEAD "E 1 2 -1\n", "line 4", "steiner-file-syntax", TW_ERROR_INPUT},
		{GRAPH_HEAD "E 1 2 1.5\n", "line 4", "steiner-file-syntax", TW_ERROR_INPUT},
		{GRAPH_HEAD "E 1 2\n", "line 4", "steiner-file-syntax", TW_ERROR_INPUT},
		{GRAPH_HEAD "E 1 2 3 4\n", "line 4", "steiner-file-syntax", TW_ERROR_INPUT},
		{GRAPH_HEAD "E 1 2 18446744073709551616\n", "line 4", "steiner-file-syntax", TW_ERROR_INPUT},
		{GRAPH_HEAD "E 1 2 18446744073709551615\n", "line 4", "graph-weight-total", TW_ERROR_INPUT},
		{GRAPH_HEAD "E 1 2 4611686018427387903\nE 2 3 1\n", "line 5", "graph-weight-total", TW_ERROR_INPUT},
		{GRAPH_HEAD "E 1 2 1\nEND\n", "line 5", "steiner-file-count", TW_ERROR_INPUT},
		{GRAPH_HEAD "E 1 2 1\nE 1 2 1\nE 1 2 1\n", "line 6", "steiner-file-count", TW_ERROR_INPUT},
		{GRAPH_HEAD "Nodes 5\n", "line 4", "steiner-file-syntax", TW_ERROR_INPUT},
		{"SECTION Graph\nE 1 2 1\n", "line 2", "steiner-file-syntax", TW_ERROR_INPUT},
		{"SECTION Graph\nNodes 99999999999\n", "line 2", "steiner-file-too-large", TW_ERROR_LIMIT},
		{"SECTION Graph\nNodes 3\nEdges 1000000\n", "line 3", "steiner-file-too-large", TW_ERROR_LIMIT},
		{"SECTION Graph\nNodes 3\nArcs 1\n", "line 3", "steiner-file-directed", TW_ERROR_UNSUPPORTED},
		{"SECTION Terminals\n", "line 1", "steiner-file-syntax", TW_ERROR_INPUT},
		{"SECTION MaximumDegrees\n", "line 1", "steiner-file-section", TW_ERROR_UNSUPPORTED},
		{"SECTION Graph\nNodes 1\nEdges 0\nEND\nSECTION Graph\n", "line 5", "steiner-file-section",
		 TW_ERROR_UNSUPPORTED},
		{"SECTION Graph\nNodes 1\nEdges 0\nEND\nEOF\n", "line 5", "steiner-file-syntax", TW_ERROR_INPUT},
		{"SECTION Graph\nNodes 1\nEdges 0\nEND\nSECTION Terminals\nTerminals 0\nEND\nEOF\n", "line 8",
		 "steiner-file-terminals", TW_ERROR_INPUT},
		{"SECTION Graph\nNodes 1\nEdges 0\nEND\nSECTION Terminals\nEND\n", "line 6", "steiner-file-syntax",
		 TW_ERROR_INPUT},
		{"SECTION Graph\nNodes 1\nEdges 0\nEND\nSECTION Terminals\nTerminals 2\nT 1\nEND\n", "line 8",
		 "steiner-file-count", TW_ERROR_INPUT},
		{"SECTION Graph\nNodes 1\nEdges 0\nEND\nSECTION Terminals\nTerminals 1\nT 2\n", "line 7",
		 "steiner-file-vertex-range", TW_ERROR_INPUT},
		{"SECTION Graph\nNodes 1\nEdges 0\nEND\nSECTION Terminals\nTerminals 1\nRoot 1\n", "line 7",
		 "steiner-file-terminals", TW_ERROR_UNSUPPORTED},
	};
	for (size_t i = 0; i < sizeof mistakes / sizeof *mistakes; i++) {
		struct steiner_file file;
		struct tw_error error = {0};
		const size_t used = arena_used(*state);
		assert_int_equal(read_text(state, &file, mistakes[i].text, &error), mistakes[i].status);
		assert_string_equal(error.where, mistakes[i].where);
		assert_string_equal(error.type, mistakes[i].type);
		assert_int_equal(arena_used(*state), used);
	}
}

static void survives_every_truncation_and_every_changed_byte(void **state)
{
	char text[sizeof square];
	for (size_t cut = 0; cut < sizeof square - 1; cut++) {
		memcpy(text, square, sizeof square);
		text[cut] = '\0';
		struct steiner_file file;
		struct tw_error error = {0};
		const enum tw_status status = read_text(state, &file, text, &error);
		assert_true(status == TW_OK ? cut >= sizeof square - 2 : *error.text != '\0');
		for (int value = 1; value < 256; value += 3) {
			memcpy(text, square, sizeof square);
			text[cut] = (char)value;
			if (read_text(state, &file, text, &error) == TW_OK)
				assert_int_equal(file.terminal_count, 2);
		}
	}
}

static void a_budget_too_small_is_a_clear_status(void **state)
{
	(void)state;
	for (size_t budget = 64; budget < 1024; budget += 64) {
		struct arena *arena = arena_new(budget);
		struct steiner_file file;
		struct tw_error error = {0};
		const enum tw_status status = steiner_file_read(&file, arena, square, sizeof square - 1, &error);
		assert_true(status == TW_OK || (status == TW_ERROR_MEMORY && arena_used(arena) == 0));
		arena_free(arena);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(reads_a_pace_file, setup, teardown),
		cmocka_unit_test_setup_teardown(reads_a_steinlib_file_of_any_case_and_line_end, setup, teardown),
		cmocka_unit_test_setup_teardown(leaves_out_edges_from_a_vertex_to_itself, setup, teardown),
		cmocka_unit_test_setup_teardown(notes_terminals_that_were_listed_before, setup, teardown),
		cmocka_unit_test_setup_teardown(reads_a_file_however_its_lines_are_written, setup, teardown),
		cmocka_unit_test_setup_teardown(reads_what_a_presolver_took, setup, teardown),
		cmocka_unit_test_setup_teardown(passes_over_a_tree_decomposition, setup, teardown),
		cmocka_unit_test_setup_teardown(names_the_line_of_every_mistake, setup, teardown),
		cmocka_unit_test_setup_teardown(survives_every_truncation_and_every_changed_byte, setup, teardown),
		cmocka_unit_test(a_budget_too_small_is_a_clear_status),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
