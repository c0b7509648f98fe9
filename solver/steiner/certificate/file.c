/* A stream of words: keywords and whole numbers, apart by blanks and line ends. The order is fixed, so that the reader
 * is a list of what it expects. */
#include "solver/steiner/certificate/file.h"

#include "solver/text.h"

#include <string.h>

enum { EDGE_BYTES_MIN = 6 /* "1 2 0\n" */, MEMBER_BYTES_MIN = 4 /* "1 0\n" */, POTENTIAL_BYTES_MIN = 16 };

static const char preamble[] = "# A Steiner tree and a lower bound that can be checked by adding up:\n"
			       "#   tightwire certificate INSTANCE THIS_FILE; its --help says how.\n";

struct reader {
	const char *at, *end;
	size_t line_number; /* 1-based */
	size_t length;      /* of the whole input */
	struct tw_error *error;
};

TW_PRINTF(3, 4)
static enum tw_status refuse(const struct reader *reader, const char *type, const char *format, ...)
{
	char where[40];
	snprintf(where, sizeof where, "line %zu", reader->line_number);
	va_list arguments;
	va_start(arguments, format);
	tw_error_vfill(reader->error, TW_ERROR_INPUT, type, where, format, arguments);
	va_end(arguments);
	return TW_ERROR_INPUT;
}

static int is_space(char c)
{
	return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

/* The next word; length 0 at the end. */
static size_t next_word(struct reader *reader, const char **word)
{
	while (reader->at < reader->end && (is_space(*reader->at) || *reader->at == '#')) {
		if (*reader->at == '#') {
			const char *newline = memchr(reader->at, '\n', (size_t)(reader->end - reader->at));
			reader->at = newline ? newline : reader->end;
			continue;
		}
		reader->line_number += *reader->at++ == '\n';
	}
	*word = reader->at;
	while (reader->at < reader->end && !is_space(*reader->at) && *reader->at != '#')
		reader->at++;
	return (size_t)(reader->at - *word);
}

static enum tw_status read_keyword(struct reader *reader, const char *expected)
{
	const char *word;
	const size_t length = next_word(reader, &word);
	if (length == strlen(expected) && !memcmp(word, expected, length))
		return TW_OK;
	if (!length)
		return refuse(reader, "steiner-certificate-truncated", "the file ends where %s should stand", expected);
	return refuse(reader, "steiner-certificate-syntax", "expected %s", expected);
}

/* A number of at most `most`. */
static enum tw_status read_number(struct reader *reader, const char *what, uint64_t most, uint64_t *value)
{
	const char *word;
	const size_t length = next_word(reader, &word);
	uint64_t sum = 0;
	int whole = length > 0;
	for (size_t i = 0; i < length && whole; i++)
		whole = word[i] >= '0' && word[i] <= '9' && !__builtin_mul_overflow(sum, 10u, &sum) &&
			!__builtin_add_overflow(sum, (uint64_t)(word[i] - '0'), &sum);
	if (!whole)
		return refuse(reader, "steiner-certificate-syntax", "expected %s, a whole number of at most 64 bits",
			      what);
	if (sum > most)
		return refuse(reader, "steiner-certificate-range", "%s is %llu; at most %llu is possible here", what,
			      (unsigned long long)sum, (unsigned long long)most);
	*value = sum;
	return TW_OK;
}

static enum tw_status read_count(struct reader *reader, const char *what, uint32_t most, uint32_t *count)
{
	uint64_t value = 0;
	const enum tw_status status = read_number(reader, what, most, &value);
	*count = (uint32_t)value;
	return status;
}

/* A vertex, counted from 1. */
static enum tw_status read_vertex(struct reader *reader, const struct steiner_certificate *certificate,
				  uint32_t *vertex)
{
	uint64_t value = 0;
	const enum tw_status status = read_number(reader, "a vertex", certificate->vertex_count, &value);
	if (status != TW_OK)
		return status;
	if (!value)
		return refuse(reader, "steiner-certificate-range", "vertices are counted from 1");
	*vertex = (uint32_t)(value - 1);
	return TW_OK;
}

/* How many items of at least `bytes_min` bytes the input can hold at all. */
static uint32_t items_possible(const struct reader *reader, size_t bytes_min)
{
	const size_t items = reader->length / bytes_min + 1;
	return items < UINT32_MAX ? (uint32_t)items : UINT32_MAX;
}

static enum tw_status read_head(struct reader *reader, struct steiner_certificate *c)
{
	enum tw_status status = read_keyword(reader, "TIGHTWIRE");
	if (status == TW_OK)
		status = read_keyword(reader, "STEINER");
	if (status == TW_OK)
		status = read_keyword(reader, "CERTIFICATE");
	if (status == TW_OK)
		status = read_keyword(reader, "1");
	if (status == TW_OK)
		status = read_keyword(reader, "INSTANCE");
	if (status == TW_OK)
		status = read_count(reader, "the number of vertices", UINT32_MAX - 1, &c->vertex_count);
	if (status == TW_OK)
		status = read_count(reader, "the number of edges", UINT32_MAX - 1, &c->edge_count);
	if (status == TW_OK)
		status = read_count(reader, "the number of terminals", UINT32_MAX - 1, &c->terminal_count);
	if (status == TW_OK)
		status = read_keyword(reader, "WEIGHT");
	if (status == TW_OK)
		status = read_number(reader, "the weight", UINT64_MAX, &c->weight);
	if (status == TW_OK)
		status = read_keyword(reader, "BOUND");
	if (status == TW_OK)
		status = read_number(reader, "the bound", UINT64_MAX, &c->bound);
	if (status == TW_OK)
		status = read_keyword(reader, "CERTIFIED");
	if (status == TW_OK)
		status = read_number(reader, "what is certified", UINT64_MAX, &c->certified);
	return status;
}

static enum tw_status read_tree(struct reader *reader, struct arena *arena, struct steiner_certificate *c)
{
	enum tw_status status = read_keyword(reader, "TREE");
	if (status == TW_OK)
		status = read_count(reader, "the number of the tree's edges", items_possible(reader, EDGE_BYTES_MIN),
				    &c->tree_count);
	if (status != TW_OK)
		return status;
	c->tree = ARENA_ARRAY(arena, c->tree_count, struct certificate_edge);
	if (!c->tree)
		return tw_fail_memory(reader->error);
	for (uint32_t i = 0; i < c->tree_count && status == TW_OK; i++) {
		status = read_vertex(reader, c, &c->tree[i].ends[0]);
		if (status == TW_OK)
			status = read_vertex(reader, c, &c->tree[i].ends[1]);
		if (status == TW_OK)
			status = read_number(reader, "an edge's weight", UINT64_MAX, &c->tree[i].weight);
	}
	return status;
}

static enum tw_status read_potential(struct reader *reader, struct steiner_certificate *c,
				     struct certificate_potential *potential, size_t room)
{
	const uint32_t most = room < UINT32_MAX ? (uint32_t)room : UINT32_MAX;
	potential->start = c->member_count - room;
	enum tw_status status = read_keyword(reader, "POTENTIAL");
	if (status == TW_OK)
		status = read_vertex(reader, c, &potential->terminal);
	if (status == TW_OK)
		status = read_number(reader, "a radius", UINT64_MAX, &potential->radius);
	if (status == TW_OK)
		status = read_count(reader, "the number of the potential's members", most, &potential->count);
	if (status != TW_OK)
		return status;
	struct certificate_member *member = c->member + potential->start;
	for (uint32_t i = 0; i < potential->count && status == TW_OK; i++) {
		status = read_vertex(reader, c, &member[i].vertex);
		if (status == TW_OK)
			status = read_number(reader, "a member's value", UINT64_MAX, &member[i].value);
	}
	return status;
}

static enum tw_status read_dual_head(struct reader *reader, struct steiner_certificate *c)
{
	enum tw_status status = read_keyword(reader, "DUAL");
	uint64_t members = 0;
	if (status == TW_OK)
		status = read_vertex(reader, c, &c->root);
	if (status == TW_OK)
		status = read_number(reader, "the scale", UINT64_MAX, &c->scale);
	if (status == TW_OK)
		status = read_number(reader, "the total", UINT64_MAX, &c->total);
	if (status == TW_OK)
		status = read_count(reader, "the number of potentials", items_possible(reader, POTENTIAL_BYTES_MIN),
				    &c->potential_count);
	if (status == TW_OK)
		status = read_number(reader, "the number of members", reader->length / MEMBER_BYTES_MIN + 1, &members);
	c->member_count = members;
	return status;
}

static enum tw_status read_dual(struct reader *reader, struct arena *arena, struct steiner_certificate *c)
{
	enum tw_status status = read_dual_head(reader, c);
	if (status != TW_OK)
		return status;
	c->potential = ARENA_ZEROED(arena, c->potential_count, struct certificate_potential);
	c->member = ARENA_ARRAY(arena, c->member_count, struct certificate_member);
	if (!c->potential || !c->member)
		return tw_fail_memory(reader->error);
	size_t room = c->member_count;
	for (uint32_t i = 0; i < c->potential_count && status == TW_OK; i++) {
		status = read_potential(reader, c, &c->potential[i], room);
		room -= c->potential[i].count;
	}
	if (status == TW_OK && room)
		return refuse(reader, "steiner-certificate-count", "%zu members were announced, %zu stand here",
			      c->member_count, c->member_count - room);
	return status;
}

enum tw_status certificate_read(struct steiner_certificate *certificate, struct arena *arena, const char *bytes,
				size_t length, struct tw_error *error)
{
	struct reader reader = {
		.at = bytes,
		.end = bytes + length,
		.line_number = 1,
		.length = length,
		.error = error,
	};
	const struct arena_mark mark = arena_mark(arena);
	const char *word;
	*certificate = (struct steiner_certificate){0};
	enum tw_status status = read_head(&reader, certificate);
	if (status == TW_OK)
		status = read_tree(&reader, arena, certificate);
	if (status == TW_OK)
		status = read_dual(&reader, arena, certificate);
	if (status == TW_OK)
		status = read_keyword(&reader, "END");
	if (status == TW_OK && next_word(&reader, &word))
		status = refuse(&reader, "steiner-certificate-syntax", "expected nothing behind END");
	if (status != TW_OK) {
		*certificate = (struct steiner_certificate){0};
		arena_release(arena, mark);
	}
	return status;
}

static void write_dual(struct text *text, const struct steiner_certificate *c)
{
	text_format(text, "DUAL %u %llu %llu %u %zu\n", c->root + 1, (unsigned long long)c->scale,
		    (unsigned long long)c->total, c->potential_count, c->member_count);
	for (uint32_t i = 0; i < c->potential_count; i++) {
		const struct certificate_potential *potential = &c->potential[i];
		text_format(text, "POTENTIAL %u %llu %u\n", potential->terminal + 1,
			    (unsigned long long)potential->radius, potential->count);
		for (uint32_t j = 0; j < potential->count; j++) {
			const struct certificate_member *member = &c->member[potential->start + j];
			text_format(text, "%u %llu\n", member->vertex + 1, (unsigned long long)member->value);
		}
	}
}

enum tw_status certificate_write(const struct steiner_certificate *certificate, struct arena *arena, const char **bytes,
				 size_t *length, struct tw_error *error)
{
	const struct steiner_certificate *c = certificate;
	struct text text = {0};
	text_add(&text, preamble);
	text_format(&text,
		    "TIGHTWIRE STEINER CERTIFICATE 1\nINSTANCE %u %u %u\nWEIGHT %llu\nBOUND %llu\nCERTIFIED %llu\n",
		    c->vertex_count, c->edge_count, c->terminal_count, (unsigned long long)c->weight,
		    (unsigned long long)c->bound, (unsigned long long)c->certified);
	text_format(&text, "TREE %u\n", c->tree_count);
	for (uint32_t i = 0; i < c->tree_count; i++)
		text_format(&text, "%u %u %llu\n", c->tree[i].ends[0] + 1, c->tree[i].ends[1] + 1,
			    (unsigned long long)c->tree[i].weight);
	write_dual(&text, c);
	text_add(&text, "END\n");
	return text_take(&text, arena, bytes, length, error);
}
