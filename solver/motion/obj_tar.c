/* A sequence of OBJ files in a tar. One file is in memory at a time; its faces are compared with those of the first, so
 * that a tool which reorders vertices on export is noticed.
 *
 * tar: 512-byte headers, each followed by its data padded to 512, and an empty one at the end (POSIX.1-2017, pax). Long
 * names come in an entry before their file: type L (GNU) or a path record of type x (pax). */
#include "solver/garment/import.h"
#include "solver/garment/soup.h"
#include "solver/motion/reader.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 512, NAME_BYTES = 1024 };
static const uint64_t file_limit = (uint64_t)1 << 29; /* bytes of one OBJ */
static const size_t arena_limit = (size_t)2 << 30;

struct sequence {
	char name[NAME_BYTES];        /* of the entry in hand */
	char name_before[NAME_BYTES]; /* of the frame before */
	char long_name[NAME_BYTES];   /* for the next entry; "" for none */
	char *bytes;                  /* owned: the entry's data */
	size_t capacity;
	struct arena *first; /* owned: holds first_soup */
	struct arena *frame; /* owned */
	struct soup first_soup;
};

static enum tw_status bad_tar(const struct motion_reader *reader, const char *what, struct tw_error *error)
{
	char where[32];
	snprintf(where, sizeof where, "frame %u", reader->frame);
	return tw_fail(error, TW_ERROR_INPUT, "motion-bad-tar", where, "%s", what);
}

/* An octal field; false where it is none. */
static bool octal(const unsigned char *field, size_t size, uint64_t *number)
{
	size_t i = 0;
	*number = 0;
	while (i < size && field[i] == ' ')
		i++;
	size_t first = i;
	for (; i < size && field[i] >= '0' && field[i] <= '7'; i++)
		*number = *number << 3 | (uint64_t)(field[i] - '0');
	return i > first && (i == size || field[i] == ' ' || field[i] == '\0');
}

static bool checksum_fits(const unsigned char *header)
{
	uint64_t stated = 0, sum = 0;
	for (size_t i = 0; i < BLOCK; i++)
		sum += i >= 148 && i < 156 ? ' ' : header[i];
	return octal(header + 148, 8, &stated) && stated == sum;
}

static enum tw_status reserve(struct sequence *sequence, size_t size, struct tw_error *error)
{
	if (size <= sequence->capacity)
		return TW_OK;
	char *bytes = realloc(sequence->bytes, size);
	if (!bytes)
		return tw_fail_memory(error);
	sequence->bytes = bytes;
	sequence->capacity = size;
	return TW_OK;
}

/* The data of an entry, whole. */
static enum tw_status read_data(struct motion_reader *reader, uint64_t size, struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	if (size > file_limit)
		return tw_fail(error, TW_ERROR_LIMIT, "motion-too-large", NULL,
			       "a file in the tar has %llu bytes; at most %llu are accepted", (unsigned long long)size,
			       (unsigned long long)file_limit);
	size_t padded = ((size_t)size + BLOCK - 1) / BLOCK * BLOCK;
	/* Memory grows as bytes arrive, not as the header claims. */
	for (size_t at = 0; at < padded;) {
		size_t part = padded - at < (size_t)1 << 20 ? padded - at : (size_t)1 << 20;
		if (at + part > sequence->capacity) {
			size_t wanted = 2 * sequence->capacity > at + part ? 2 * sequence->capacity : at + part;
			enum tw_status status = reserve(sequence, wanted, error);
			if (status != TW_OK)
				return status;
		}
		enum tw_status status = reader_fill(reader, sequence->bytes + at, part, error);
		if (status != TW_OK)
			return status;
		at += part;
	}
	return TW_OK;
}

/* The path record of a pax header: "LENGTH path=NAME\n". */
static void take_pax_path(struct sequence *sequence, size_t size)
{
	for (size_t at = 0; at < size;) {
		size_t length = 0, digits = at;
		while (digits < size && isdigit((unsigned char)sequence->bytes[digits]) && length <= size)
			length = 10 * length + (size_t)(sequence->bytes[digits++] - '0');
		if (length <= digits - at + 1 || length > size - at)
			return;
		const char *record = sequence->bytes + digits + 1;
		size_t record_size = length - (digits - at) - 2; /* without the blank and the line end */
		if (record_size > 5 && record_size < NAME_BYTES && memcmp(record, "path=", 5) == 0) {
			memcpy(sequence->long_name, record + 5, record_size - 5);
			sequence->long_name[record_size - 5] = '\0';
		}
		at += length;
	}
}

static void take_name(struct sequence *sequence, const unsigned char *header)
{
	if (sequence->long_name[0])
		memcpy(sequence->name, sequence->long_name, NAME_BYTES);
	else if (memcmp(header + 257, "ustar", 6) == 0 && header[345])
		snprintf(sequence->name, NAME_BYTES, "%.155s/%.100s", (const char *)header + 345, (const char *)header);
	else
		snprintf(sequence->name, NAME_BYTES, "%.100s", (const char *)header);
	sequence->long_name[0] = '\0';
}

static bool is_obj(const char *name)
{
	size_t size = strlen(name);
	return size > 4 && mesh_format_of_name(name + size - 4) == MESH_OBJ;
}

/* One entry: *size of its OBJ file, now in bytes; *found false where it was something else; *end at the end. */
static enum tw_status read_entry(struct motion_reader *reader, bool *found, bool *end, size_t *size,
				 struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	unsigned char header[BLOCK];
	size_t got = 0;
	uint64_t bytes = 0;
	*found = false;
	enum tw_status status = reader_read(reader, header, sizeof header, &got, error);
	if (status != TW_OK)
		return status;
	static const unsigned char zeros[BLOCK];
	if (got < BLOCK)
		return bad_tar(reader, "the tar ends without the empty block that closes it; send it whole", error);
	*end = memcmp(header, zeros, BLOCK) == 0;
	if (*end)
		return TW_OK;
	if (!checksum_fits(header))
		return bad_tar(reader, "a header of the tar has a wrong checksum; it is damaged or no tar", error);
	if (!octal(header + 124, 12, &bytes))
		return bad_tar(reader, "a file in the tar has no readable size", error);
	status = read_data(reader, bytes, error);
	if (status != TW_OK)
		return status;
	switch (header[156]) {
	case 'x':
		take_pax_path(sequence, (size_t)bytes);
		return TW_OK;
	case 'L':
		if (bytes == 0 || bytes >= NAME_BYTES)
			return bad_tar(reader, "a file in the tar has a name of more than 1023 bytes", error);
		memcpy(sequence->long_name, sequence->bytes, (size_t)bytes);
		sequence->long_name[bytes] = '\0';
		return TW_OK;
	case '0':
	case '\0':
		take_name(sequence, header);
		*found = is_obj(sequence->name);
		*size = (size_t)bytes;
		return TW_OK;
	default: /* directories, owners, global settings */
		sequence->long_name[0] = '\0';
		return TW_OK;
	}
}

/* Orders names with runs of digits as numbers: frame2 before frame10. */
static int compare_names(const char *a, const char *b)
{
	while (*a && *b) {
		if (isdigit((unsigned char)*a) && isdigit((unsigned char)*b)) {
			a += strspn(a, "0");
			b += strspn(b, "0");
			size_t m = strspn(a, "0123456789"), n = strspn(b, "0123456789");
			int order = m != n ? (m > n) - (m < n) : memcmp(a, b, m);
			if (order != 0)
				return order;
			a += m;
			b += n;
			continue;
		}
		if (*a != *b)
			return (unsigned char)*a < (unsigned char)*b ? -1 : 1;
		a++;
		b++;
	}
	return (*a != '\0') - (*b != '\0');
}

static enum tw_status check_order(const struct motion_reader *reader, struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	if (reader->frame > 0 && compare_names(sequence->name_before, sequence->name) >= 0) {
		char where[32];
		snprintf(where, sizeof where, "frame %u", reader->frame);
		return tw_fail(error, TW_ERROR_INPUT, "motion-frame-order", where,
			       "%.100s stands behind %.100s in the tar; pack the frames in the order of their names "
			       "(tar --sort=name)",
			       sequence->name, sequence->name_before);
	}
	memcpy(sequence->name_before, sequence->name, NAME_BYTES);
	return TW_OK;
}

static enum tw_status check_faces(const struct motion_reader *reader, const struct soup *soup, struct tw_error *error)
{
	const struct sequence *sequence = reader->state;
	const struct soup *first = &sequence->first_soup;
	char where[32];
	snprintf(where, sizeof where, "frame %u", reader->frame);
	if (soup->vertex_count != reader->info.vertex_count)
		return tw_fail(error, TW_ERROR_INPUT, "motion-vertex-count", where,
			       "%.100s has %u vertices, expected %u", sequence->name, soup->vertex_count,
			       reader->info.vertex_count);
	bool same = soup->polygon_count == first->polygon_count && soup->corner_count == first->corner_count &&
		    memcmp(soup->polygon_start, first->polygon_start,
			   ((size_t)soup->polygon_count + 1) * sizeof(uint32_t)) == 0 &&
		    memcmp(soup->corner_vertex, first->corner_vertex, soup->corner_count * sizeof(uint32_t)) == 0;
	if (!same)
		return tw_fail(error, TW_ERROR_INPUT, "motion-vertex-order", where,
			       "the faces of %.100s are not those of the first frame: the vertices were reordered; "
			       "export with the "
			       "order of vertices kept",
			       sequence->name);
	return TW_OK;
}

/* Parses the file in hand into `arena`; errors get the frame's name. */
static enum tw_status parse(const struct motion_reader *reader, struct arena *arena, size_t size, struct soup *soup,
			    struct tw_error *error)
{
	const struct sequence *sequence = reader->state;
	struct garment_report unread = {0};
	struct text file = {sequence->bytes, sequence->bytes + size};
	enum tw_status status = obj_parse(soup, arena, file, &unread, error);
	if (status != TW_OK && error) {
		char where[sizeof error->where];
		snprintf(where, sizeof where, "%s", error->where);
		snprintf(error->where, sizeof error->where, "frame %u%s%.90s", reader->frame, where[0] ? ", " : "",
			 where);
	}
	return status;
}

static enum tw_status next_file(struct motion_reader *reader, bool *end, size_t *size, struct tw_error *error)
{
	bool found = false;
	*end = false;
	while (!found && !*end) {
		enum tw_status status = read_entry(reader, &found, end, size, error);
		if (status != TW_OK)
			return status;
	}
	return *end ? TW_OK : check_order(reader, error);
}

static enum tw_status next(struct motion_reader *reader, float *positions, bool *end, struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	size_t size = 0;
	enum tw_status status = next_file(reader, end, &size, error);
	if (status != TW_OK)
		return status;
	if (*end) {
		reader->info.frame_count = reader->frame;
		return TW_OK;
	}
	if (reader->frame >= TW_LIMIT_FRAMES)
		return tw_fail(error, TW_ERROR_LIMIT, "motion-too-large", NULL, "the tar has more than %u frames",
			       TW_LIMIT_FRAMES);
	struct soup soup;
	struct arena_mark mark = arena_mark(sequence->frame);
	status = parse(reader, sequence->frame, size, &soup, error);
	if (status == TW_OK)
		status = check_faces(reader, &soup, error);
	for (size_t i = 0; i < 3 * (size_t)reader->info.vertex_count && status == TW_OK; i++)
		positions[i] = (float)soup.position[i];
	arena_release(sequence->frame, mark);
	return status;
}

/* The first frame says how many vertices there are; then the stream starts again. */
static enum tw_status read_first(struct motion_reader *reader, struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	bool end = false;
	size_t size = 0;
	enum tw_status status = next_file(reader, &end, &size, error);
	if (status == TW_OK && end)
		status = tw_fail(error, TW_ERROR_INPUT, "motion-empty", NULL, "there is no .obj file in the tar");
	if (status == TW_OK)
		status = parse(reader, sequence->first, size, &sequence->first_soup, error);
	if (status != TW_OK)
		return status;
	uint32_t vertices = sequence->first_soup.vertex_count;
	if (vertices == 0 || (reader->expected > 0 && vertices != reader->expected))
		return tw_fail(error, TW_ERROR_INPUT, "motion-vertex-count", "frame 0",
			       "the first frame has %u vertices, the garment's file %u; export both from the same mesh",
			       vertices, reader->expected);
	reader->info.vertex_count = vertices;
	reader->info.frames_per_second = 30;
	return reader->source.rewind(reader->source.context, error);
}

static void close_sequence(void *state)
{
	struct sequence *sequence = state;
	if (!sequence)
		return;
	free(sequence->bytes);
	arena_free(sequence->first);
	arena_free(sequence->frame);
	free(sequence);
}

static enum tw_status start(struct motion_reader *reader, struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	if (sequence) {
		sequence->long_name[0] = '\0';
		return TW_OK;
	}
	sequence = reader->state = calloc(1, sizeof *sequence);
	if (!sequence)
		return tw_fail_memory(error);
	sequence->first = arena_new(arena_limit);
	sequence->frame = arena_new(arena_limit);
	if (!sequence->first || !sequence->frame)
		return tw_fail_memory(error);
	enum tw_status status = reserve(sequence, BLOCK, error);
	return status == TW_OK ? read_first(reader, error) : status;
}

const struct motion_codec obj_tar_codec = {.start = start, .next = next, .close = close_sequence};
