/* A line at a time, a word at a time, over the borrowed bytes. The state machine has three states: between sections,
 * inside a section that is read (Graph, Terminals, Presolve), inside one that is passed over. Edges are collected in a
 * scratch arena, from which graph_build copies them. */
#include "solver/graph/steiner_file.h"

#include <string.h>

enum section { SECTION_NONE, SECTION_GRAPH, SECTION_TERMINALS, SECTION_PRESOLVE, SECTION_IGNORED };

enum { GRAPH_LINE_BYTES_MIN = 7 /* "E 1 2 0" */, TERMINAL_LINE_BYTES_MIN = 3 /* "T 1" */ };

static const uint64_t weight_total_max = (UINT64_C(1) << 62) - 1;

struct word {
	const char *text; /* borrowed from the bytes, not terminated */
	size_t length;
};

struct reader {
	const char *line, *line_end; /* the rest of the current line */
	const char *next, *end;      /* what follows it */
	size_t line_number;          /* 1-based */
	size_t length;               /* of the whole input */

	enum section section;
	int graph_done, terminals_done, file_done;
	int have_nodes, have_edges, have_terminals; /* the count was announced */
	uint32_t nodes, edges, terminals;           /* announced */
	uint32_t edge_count, terminal_count;        /* read */
	uint32_t loop_count;                        /* read and left out */
	size_t loop_line;                           /* of the first */
	uint32_t repeated_count;                    /* terminals that were listed before */
	size_t repeated_line;                       /* of the first */
	uint64_t weight_total;
	bool is_presolved, has_fixed;
	uint64_t fixed;

	struct arena *scratch; /* owned */
	uint32_t *ends;        /* [2 * edges] in scratch */
	uint64_t *weight;      /* [edges] in scratch */
	uint8_t *is_terminal;  /* [nodes] in scratch, a bit each */
	struct arena *arena;   /* borrowed: what the caller keeps */
	uint32_t *terminal;    /* [terminals] in arena */
	struct tw_error *error;
};

TW_PRINTF(4, 5)
static enum tw_status refuse(const struct reader *reader, enum tw_status status, const char *type, const char *format,
			     ...)
{
	char where[40];
	snprintf(where, sizeof where, "line %zu", reader->line_number);
	va_list arguments;
	va_start(arguments, format);
	tw_error_vfill(reader->error, status, type, where, format, arguments);
	va_end(arguments);
	return status;
}

static enum tw_status refuse_syntax(const struct reader *reader, const char *expected)
{
	return refuse(reader, TW_ERROR_INPUT, "steiner-file-syntax", "expected %s", expected);
}

static int next_line(struct reader *reader)
{
	if (reader->next == reader->end)
		return 0;
	reader->line = reader->next;
	/* Ends with a line feed, a carriage return, or the two. */
	const char *at = reader->line;
	while (at < reader->end && *at != '\n' && *at != '\r')
		at++;
	reader->line_end = at;
	at += at < reader->end && *at == '\r';
	at += at < reader->end && *at == '\n' && (at == reader->line_end || at[-1] == '\r');
	reader->next = at;
	reader->line_number++;
	return 1;
}

static int is_blank(char c)
{
	return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

/* The next word of the line; length 0 at its end. */
static struct word next_word(struct reader *reader)
{
	while (reader->line < reader->line_end && is_blank(*reader->line))
		reader->line++;
	struct word word = {reader->line, 0};
	while (reader->line < reader->line_end && !is_blank(*reader->line))
		reader->line++;
	word.length = (size_t)(reader->line - word.text);
	return word;
}

static char lower(char c)
{
	return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

/* Keywords are ASCII and, in SteinLib, of either case. `expected` is in lower case. */
static int word_is(struct word word, const char *expected)
{
	if (word.length != strlen(expected))
		return 0;
	for (size_t i = 0; i < word.length; i++)
		if (lower(word.text[i]) != expected[i])
			return 0;
	return 1;
}

static int read_number(struct reader *reader, uint64_t *value)
{
	const struct word word = next_word(reader);
	uint64_t sum = 0;
	for (size_t i = 0; i < word.length; i++) {
		const char c = word.text[i];
		if (c < '0' || c > '9' || __builtin_mul_overflow(sum, 10u, &sum) ||
		    __builtin_add_overflow(sum, (uint64_t)(c - '0'), &sum))
			return 0;
	}
	*value = sum;
	return word.length > 0;
}

/* A number whose fraction, if there is one, is zero. */
static int read_whole(struct reader *reader, uint64_t *value)
{
	const char *const start = reader->line;
	struct word word = next_word(reader);
	const char *const point = memchr(word.text, '.', word.length);
	const char *const end = word.text + word.length;
	for (const char *c = point ? point + 1 : end; c < end; c++)
		if (*c != '0')
			return 0;
	const char *const line_end = reader->line_end;
	reader->line = start;
	reader->line_end = point ? point : end;
	const int is_number = read_number(reader, value);
	reader->line = end;
	reader->line_end = line_end;
	return is_number;
}

static int line_is_over(struct reader *reader)
{
	return next_word(reader).length == 0;
}

/* A count that stands alone behind its keyword, at most `most`. */
static enum tw_status read_count(struct reader *reader, const char *what, uint32_t most, int *have, uint32_t *count)
{
	uint64_t value;
	if (*have)
		return refuse(reader, TW_ERROR_INPUT, "steiner-file-syntax", "%s stand here for the second time", what);
	if (!read_number(reader, &value) || !line_is_over(reader))
		return refuse(reader, TW_ERROR_INPUT, "steiner-file-syntax",
			      "expected the number of %s, and nothing behind it", what);
	if (value > most)
		return refuse(reader, TW_ERROR_LIMIT, "steiner-file-too-large",
			      "%llu %s are announced; at most %u are possible here", (unsigned long long)value, what,
			      most);
	*have = 1;
	*count = (uint32_t)value;
	return TW_OK;
}

/* How many lines of at least `bytes_min` bytes the input can hold at all: the bound on announced counts. */
static uint32_t lines_possible(const struct reader *reader, size_t bytes_min, uint32_t most)
{
	const size_t lines = reader->length / bytes_min + 1;
	return lines < most ? (uint32_t)lines : most;
}

static enum tw_status read_edge_count(struct reader *reader)
{
	const uint32_t most = lines_possible(reader, GRAPH_LINE_BYTES_MIN, STEINER_FILE_EDGES_MAX);
	const enum tw_status status = read_count(reader, "edges", most, &reader->have_edges, &reader->edges);
	if (status != TW_OK)
		return status;
	reader->ends = ARENA_ARRAY(reader->scratch, 2 * (size_t)reader->edges, uint32_t);
	reader->weight = ARENA_ARRAY(reader->scratch, reader->edges, uint64_t);
	return reader->ends && reader->weight ? TW_OK : tw_fail_memory(reader->error);
}

static enum tw_status read_vertex(struct reader *reader, uint32_t *vertex)
{
	uint64_t value;
	if (!read_number(reader, &value))
		return refuse_syntax(reader, "a vertex number");
	if (value < 1 || value > reader->nodes)
		return refuse(reader, TW_ERROR_INPUT, "steiner-file-vertex-range", "vertex %llu is not one of 1 to %u",
			      (unsigned long long)value, reader->nodes);
	*vertex = (uint32_t)(value - 1);
	return TW_OK;
}

static enum tw_status read_edge(struct reader *reader)
{
	uint32_t u, v;
	uint64_t weight;
	if (!reader->have_nodes || !reader->have_edges)
		return refuse_syntax(reader, "Nodes and Edges before the first edge");
	if (reader->edge_count + reader->loop_count == reader->edges)
		return refuse(reader, TW_ERROR_INPUT, "steiner-file-count",
			      "there are more edges than the %u announced", reader->edges);
	enum tw_status status = read_vertex(reader, &u);
	if (status == TW_OK)
		status = read_vertex(reader, &v);
	if (status != TW_OK)
		return status;
	if (!read_number(reader, &weight))
		return refuse_syntax(reader, "a whole, non-negative weight of at most 64 bits at the end of the edge");
	if (!line_is_over(reader))
		return refuse_syntax(reader, "nothing behind the edge's weight");
	if (u == v) {
		reader->loop_line = reader->loop_count++ == 0 ? reader->line_number : reader->loop_line;
		return TW_OK;
	}
	if (weight > weight_total_max - reader->weight_total)
		return refuse(reader, TW_ERROR_INPUT, "graph-weight-total",
			      "the weights sum to more than 62 bits hold; scale them down");
	reader->weight_total += weight;
	const size_t e = reader->edge_count++;
	reader->ends[2 * e] = u;
	reader->ends[2 * e + 1] = v;
	reader->weight[e] = weight;
	return TW_OK;
}

static enum tw_status read_graph_line(struct reader *reader, struct word word)
{
	if (word_is(word, "e"))
		return read_edge(reader);
	if (word_is(word, "nodes"))
		return read_count(reader, "nodes", STEINER_FILE_VERTICES_MAX, &reader->have_nodes, &reader->nodes);
	if (word_is(word, "edges"))
		return read_edge_count(reader);
	if (word_is(word, "arcs") || word_is(word, "a"))
		return refuse(reader, TW_ERROR_UNSUPPORTED, "steiner-file-directed",
			      "arcs of a directed instance; only undirected edges (E) are solved");
	if (word_is(word, "end")) {
		if (!reader->have_nodes || !reader->have_edges)
			return refuse_syntax(reader, "Nodes and Edges in the section Graph");
		if (reader->edge_count + reader->loop_count != reader->edges)
			return refuse(reader, TW_ERROR_INPUT, "steiner-file-count",
				      "%u edges were announced, %u stand here", reader->edges,
				      reader->edge_count + reader->loop_count);
		reader->section = SECTION_NONE;
		reader->graph_done = 1;
		return TW_OK;
	}
	return refuse_syntax(reader, "Nodes, Edges, E or END in the section Graph");
}

static enum tw_status read_terminal_count(struct reader *reader)
{
	const uint32_t most = lines_possible(reader, TERMINAL_LINE_BYTES_MIN, STEINER_FILE_VERTICES_MAX);
	const enum tw_status status =
		read_count(reader, "terminals", most, &reader->have_terminals, &reader->terminals);
	if (status != TW_OK)
		return status;
	reader->terminal = ARENA_ARRAY(reader->arena, reader->terminals, uint32_t);
	reader->is_terminal = ARENA_ZEROED(reader->scratch, reader->nodes / 8 + 1, uint8_t);
	return reader->terminal && reader->is_terminal ? TW_OK : tw_fail_memory(reader->error);
}

static void note_terminal(struct reader *reader, uint32_t vertex)
{
	uint8_t *byte = &reader->is_terminal[vertex / 8];
	const uint8_t bit = (uint8_t)(1u << vertex % 8);
	if (*byte & bit)
		reader->repeated_line = reader->repeated_count++ == 0 ? reader->line_number : reader->repeated_line;
	*byte |= bit;
}

static enum tw_status read_terminal_line(struct reader *reader, struct word word)
{
	if (word_is(word, "t")) {
		if (!reader->have_terminals)
			return refuse_syntax(reader, "the number of terminals before the first of them");
		if (reader->terminal_count == reader->terminals)
			return refuse(reader, TW_ERROR_INPUT, "steiner-file-count",
				      "there are more terminals than the %u announced", reader->terminals);
		const enum tw_status status = read_vertex(reader, &reader->terminal[reader->terminal_count]);
		if (status != TW_OK)
			return status;
		if (!line_is_over(reader))
			return refuse_syntax(reader, "nothing behind the terminal's vertex");
		note_terminal(reader, reader->terminal[reader->terminal_count++]);
		return TW_OK;
	}
	if (word_is(word, "terminals"))
		return read_terminal_count(reader);
	if (word_is(word, "end")) {
		if (!reader->have_terminals)
			return refuse_syntax(reader, "Terminals, with their number, in the section Terminals");
		if (reader->terminal_count != reader->terminals)
			return refuse(reader, TW_ERROR_INPUT, "steiner-file-count",
				      "%u terminals were announced, %u stand here", reader->terminals,
				      reader->terminal_count);
		reader->section = SECTION_NONE;
		reader->terminals_done = 1;
		return TW_OK;
	}
	return refuse(reader, TW_ERROR_UNSUPPORTED, "steiner-file-terminals",
		      "expected Terminals, T or END in the section Terminals; roots and prizes are not supported");
}

/* FIXED n: n may end in ".000". The other lines tell what was deleted and contracted, when, and in what time. */
static enum tw_status read_presolve_line(struct reader *reader, struct word word)
{
	static const char *const told[] = {"date",     "time", "lower", "upper", "orgnodes",
					   "orgedges", "ea",   "ec",    "ed",    "es"};
	if (word_is(word, "end")) {
		reader->section = SECTION_NONE;
		return TW_OK;
	}
	for (size_t i = 0; i < sizeof told / sizeof *told; i++)
		if (word_is(word, told[i]))
			return TW_OK;
	if (!word_is(word, "fixed"))
		return refuse(reader, TW_ERROR_UNSUPPORTED, "steiner-file-section",
			      "this line of the section Presolve is unknown, and may change the problem");
	if (reader->has_fixed)
		return refuse_syntax(reader, "one line FIXED in the section Presolve");
	reader->has_fixed = true;
	if (!read_whole(reader, &reader->fixed) || !line_is_over(reader) || reader->fixed > weight_total_max)
		return refuse_syntax(reader,
				     "a whole, non-negative number of at most 62 bits behind FIXED, and nothing else");
	return TW_OK;
}

static enum tw_status open_section(struct reader *reader)
{
	const struct word name = next_word(reader);
	if (word_is(name, "graph") && !reader->graph_done) {
		reader->section = SECTION_GRAPH;
	} else if (word_is(name, "terminals") && !reader->terminals_done) {
		if (!reader->graph_done)
			return refuse_syntax(reader, "the section Graph before the section Terminals");
		reader->section = SECTION_TERMINALS;
	} else if (word_is(name, "presolve") && !reader->is_presolved) {
		reader->section = SECTION_PRESOLVE;
		reader->is_presolved = true;
	} else if (word_is(name, "comment") || word_is(name, "coordinates")) {
		reader->section = SECTION_IGNORED;
	} else if (word_is(name, "tree")) {
		if (!word_is(next_word(reader), "decomposition"))
			return refuse_syntax(reader, "SECTION Tree Decomposition");
		reader->section = SECTION_IGNORED;
	} else {
		return refuse(reader, TW_ERROR_UNSUPPORTED, "steiner-file-section",
			      "this section is unknown, stands here for the second time, or would change the problem");
	}
	return line_is_over(reader) ? TW_OK : refuse_syntax(reader, "nothing behind the section's name");
}

static enum tw_status read_line(struct reader *reader)
{
	const struct word word = next_word(reader);
	if (reader->section == SECTION_IGNORED) {
		if (word_is(word, "end"))
			reader->section = SECTION_NONE;
		return TW_OK;
	}
	if (!word.length || *word.text == '#')
		return TW_OK;
	if (reader->section == SECTION_GRAPH)
		return read_graph_line(reader, word);
	if (reader->section == SECTION_TERMINALS)
		return read_terminal_line(reader, word);
	if (reader->section == SECTION_PRESOLVE)
		return read_presolve_line(reader, word);
	if (word_is(word, "section"))
		return open_section(reader);
	if (word_is(word, "eof")) {
		reader->file_done = 1;
		return TW_OK;
	}
	return refuse_syntax(reader, "SECTION or EOF");
}

static enum tw_status read_lines(struct reader *reader, enum steiner_format *format)
{
	static const char magic[] = "33d32945";
	int first = 1;
	while (!reader->file_done && next_line(reader)) {
		const char *start = reader->line;
		if (first && word_is(next_word(reader), magic)) {
			*format = STEINER_FORMAT_STP;
			first = 0;
			continue;
		}
		first = 0;
		reader->line = start;
		const enum tw_status status = read_line(reader);
		if (status != TW_OK)
			return status;
	}
	if (!reader->length)
		return tw_fail(reader->error, TW_ERROR_INPUT, "steiner-file-truncated", NULL, "the file is empty");
	if (!reader->file_done)
		return refuse(reader, TW_ERROR_INPUT, "steiner-file-truncated",
			      "the file ends here without EOF; is it cut off?");
	if (!reader->graph_done || !reader->terminals_done)
		return refuse_syntax(reader, "a section Graph and a section Terminals before EOF");
	if (!reader->terminal_count)
		return refuse(reader, TW_ERROR_INPUT, "steiner-file-terminals",
			      "there is no terminal; list at least one");
	return TW_OK;
}

enum tw_status steiner_file_read(struct steiner_file *file, struct arena *arena, const char *bytes, size_t length,
				 struct tw_error *error)
{
	*file = (struct steiner_file){0};
	const struct arena_mark mark = arena_mark(arena);
	const size_t mark_bytes = length >= 3 && memcmp(bytes, "\xef\xbb\xbf", 3) == 0 ? 3 : 0; /* of UTF-8 */
	struct reader reader = {
		.next = bytes + mark_bytes,
		.end = bytes + length,
		.length = length,
		.arena = arena,
		.scratch = arena_new(0),
		.error = error,
	};
	if (!reader.scratch)
		return tw_fail_memory(error);
	struct steiner_file read = {0};
	enum tw_status status = read_lines(&reader, &read.format);
	if (status == TW_OK)
		status = graph_build(&read.graph, arena, reader.nodes, reader.edge_count, reader.ends, reader.weight,
				     error);
	if (status == TW_OK) {
		read.terminals = reader.terminal;
		read.terminal_count = reader.terminal_count;
		read.is_presolved = reader.is_presolved;
		read.fixed = reader.fixed;
		read.loop_count = reader.loop_count;
		read.loop_line = reader.loop_line;
		read.repeated_count = reader.repeated_count;
		read.repeated_line = reader.repeated_line;
		*file = read;
	} else {
		arena_release(arena, mark);
	}
	arena_free(reader.scratch);
	return status;
}
