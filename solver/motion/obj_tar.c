/* A sequence of OBJ files in a tar. The archive is first gone through from header to header, which gives the frames;
 * they are read in the order of their names, digits compared as numbers, wherever they stand in the archive. One file
 * is in memory at a time; its faces are compared with those of the first, so that a tool which reorders vertices on
 * export is noticed. Files whose name begins with "._" are what macOS keeps beside the others, and no frames.
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

/* A frame's file in the archive. */
struct entry {
	uint64_t offset, size; /* of its data */
	size_t name;           /* where its name begins in names */
};

struct sequence {
	struct entry *entry; /* owned: [entry_count], in the order of their names once they are all known */
	uint32_t entry_count, entry_capacity;
	char *names; /* owned: each with its terminating 0 */
	size_t names_size, names_capacity;
	char long_name[NAME_BYTES]; /* for the next entry; "" for none */
	uint64_t at;                /* of the next header, while the entries are looked for */
	char *bytes;                /* owned: the data in hand */
	size_t capacity;
	struct arena *first; /* owned: holds first_soup */
	struct arena *frame; /* owned */
	struct soup first_soup;
};

static enum tw_status fail_tar(const struct motion_reader *reader, const char *type, const char *what,
			       struct tw_error *error)
{
	char where[32];
	snprintf(where, sizeof where, "frame %u", reader->frame);
	return tw_fail(error, TW_ERROR_INPUT, type, where, "%s", what);
}

static enum tw_status bad_tar(const struct motion_reader *reader, const char *what, struct tw_error *error)
{
	return fail_tar(reader, "motion-bad-tar", what, error);
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

static enum tw_status reserve(char **bytes, size_t *capacity, size_t size, struct tw_error *error)
{
	if (size <= *capacity)
		return TW_OK;
	size_t wanted = 2 * *capacity > size ? 2 * *capacity : size;
	char *grown = realloc(*bytes, wanted);
	if (!grown)
		return tw_fail_memory(error);
	*bytes = grown;
	*capacity = wanted;
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
		enum tw_status status = reserve(&sequence->bytes, &sequence->capacity, at + part, error);
		if (status == TW_OK)
			status = reader_fill(reader, sequence->bytes + at, part, error);
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

static void take_name(struct sequence *sequence, const unsigned char *header, char name[NAME_BYTES])
{
	if (sequence->long_name[0])
		memcpy(name, sequence->long_name, NAME_BYTES);
	else if (memcmp(header + 257, "ustar", 6) == 0 && header[345])
		snprintf(name, NAME_BYTES, "%.155s/%.100s", (const char *)header + 345, (const char *)header);
	else
		snprintf(name, NAME_BYTES, "%.100s", (const char *)header);
}

static bool is_frame(const char *name)
{
	const char *slash = strrchr(name, '/');
	size_t size = strlen(name);
	return size > 4 && mesh_format_of_name(name + size - 4) == MESH_OBJ &&
	       strncmp(slash ? slash + 1 : name, "._", 2) != 0;
}

static enum tw_status add_entry(struct motion_reader *reader, const char *name, uint64_t size, struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	size_t name_size = strlen(name) + 1;
	if (sequence->entry_count == TW_LIMIT_FRAMES)
		return tw_fail(error, TW_ERROR_LIMIT, "motion-too-large", NULL, "the tar has more than %u frames",
			       TW_LIMIT_FRAMES);
	enum tw_status status =
		reserve(&sequence->names, &sequence->names_capacity, sequence->names_size + name_size, error);
	if (status == TW_OK && sequence->entry_count == sequence->entry_capacity) {
		uint32_t capacity = 2 * sequence->entry_capacity + 16;
		struct entry *grown = realloc(sequence->entry, capacity * sizeof *grown);
		if (!grown)
			return tw_fail_memory(error);
		sequence->entry = grown;
		sequence->entry_capacity = capacity;
	}
	if (status != TW_OK)
		return status;
	memcpy(sequence->names + sequence->names_size, name, name_size);
	sequence->entry[sequence->entry_count++] = (struct entry){sequence->at, size, sequence->names_size};
	sequence->names_size += name_size;
	reader->frame = sequence->entry_count; /* where an error would be */
	return TW_OK;
}

/* What stands at sequence->at behind a header: a frame is noted, a name for the next entry read. */
static enum tw_status take_entry(struct motion_reader *reader, const unsigned char *header, uint64_t size,
				 struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	char name[NAME_BYTES];
	enum tw_status status = TW_OK;
	switch (header[156]) {
	case 'x':
		status = read_data(reader, size, error);
		if (status == TW_OK)
			take_pax_path(sequence, (size_t)size);
		return status;
	case 'L':
		if (size == 0 || size >= NAME_BYTES)
			return bad_tar(reader, "a file in the tar has a name of more than 1023 bytes", error);
		status = read_data(reader, size, error);
		if (status == TW_OK) {
			memcpy(sequence->long_name, sequence->bytes, (size_t)size);
			sequence->long_name[size] = '\0';
		}
		return status;
	case '0':
	case '\0':
		take_name(sequence, header, name);
		status = is_frame(name) ? add_entry(reader, name, size, error) : TW_OK;
		break;
	default: /* directories, owners, global settings */
		break;
	}
	sequence->long_name[0] = '\0';
	return status;
}

/* One header and what belongs to it; *end at the empty block. */
static enum tw_status pass_entry(struct motion_reader *reader, bool *end, struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	static const unsigned char zeros[BLOCK];
	unsigned char header[BLOCK];
	size_t got = 0;
	uint64_t size = 0;
	enum tw_status status = reader->source.seek(reader->source.context, sequence->at, error);
	if (status == TW_OK)
		status = reader_read(reader, header, sizeof header, &got, error);
	if (status != TW_OK)
		return status;
	if (got < BLOCK)
		return fail_tar(reader, "motion-truncated",
				"the tar ends without the empty block that closes it; send it whole", error);
	*end = memcmp(header, zeros, BLOCK) == 0;
	if (*end)
		return TW_OK;
	if (!checksum_fits(header))
		return bad_tar(reader, "a header of the tar has a wrong checksum; it is damaged or no tar", error);
	if (!octal(header + 124, 12, &size))
		return bad_tar(reader, "a file in the tar has no readable size", error);
	sequence->at += BLOCK;
	status = take_entry(reader, header, size, error);
	sequence->at += (size + BLOCK - 1) / BLOCK * BLOCK;
	return status;
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

static int compare_entries(const void *a, const void *b, void *context)
{
	const struct entry *p = a, *q = b;
	const char *names = context;
	int order = compare_names(names + p->name, names + q->name);
	return order != 0 ? order : (p->offset > q->offset) - (p->offset < q->offset);
}

static enum tw_status sort_entries(const struct motion_reader *reader, struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	if (sequence->entry_count == 0)
		return tw_fail(error, TW_ERROR_INPUT, "motion-empty", NULL, "there is no .obj file in the tar");
	qsort_r(sequence->entry, sequence->entry_count, sizeof *sequence->entry, compare_entries, sequence->names);
	for (uint32_t i = 1; i < sequence->entry_count; i++) {
		const char *before = sequence->names + sequence->entry[i - 1].name;
		const char *name = sequence->names + sequence->entry[i].name;
		char where[32];
		if (compare_names(before, name) != 0)
			continue;
		snprintf(where, sizeof where, "frame %u", i);
		return tw_fail(error, TW_ERROR_INPUT, "motion-frame-order", where,
			       "%.100s and %.100s in the tar have the same name or number, so that their order is not "
			       "known; number the frames",
			       before, name);
	}
	return TW_OK;
}

/* Of the frame that is read. */
static const char *name_in_hand(const struct motion_reader *reader)
{
	const struct sequence *sequence = reader->state;
	return sequence->names + sequence->entry[reader->frame].name;
}

static enum tw_status check_faces(const struct motion_reader *reader, const struct soup *soup, struct tw_error *error)
{
	const struct sequence *sequence = reader->state;
	const struct soup *first = &sequence->first_soup;
	char where[32];
	snprintf(where, sizeof where, "frame %u", reader->frame);
	if (soup->vertex_count != reader->info.vertex_count)
		return tw_fail(error, TW_ERROR_INPUT, "motion-vertex-count", where,
			       "%.100s has %u vertices, expected %u", name_in_hand(reader), soup->vertex_count,
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
			       name_in_hand(reader));
	return TW_OK;
}

/* Reads and parses the file of the frame in hand into `arena`; errors get the frame's number. */
static enum tw_status parse(struct motion_reader *reader, struct arena *arena, struct soup *soup,
			    struct tw_error *error)
{
	const struct sequence *sequence = reader->state;
	const struct entry *entry = &sequence->entry[reader->frame];
	struct garment_report unread = {0};
	enum tw_status status = reader->source.seek(reader->source.context, entry->offset, error);
	if (status == TW_OK)
		status = read_data(reader, entry->size, error);
	if (status != TW_OK)
		return status;
	struct text file = {sequence->bytes, sequence->bytes + entry->size};
	status = obj_parse(soup, arena, file, &unread, error);
	if (status != TW_OK && error) {
		char where[sizeof error->where];
		snprintf(where, sizeof where, "%s", error->where);
		snprintf(error->where, sizeof error->where, "frame %u%s%.90s", reader->frame, where[0] ? ", " : "",
			 where);
	}
	return status;
}

static enum tw_status next(struct motion_reader *reader, float *positions, bool *end, struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	*end = reader->frame == sequence->entry_count;
	if (*end)
		return TW_OK;
	struct soup soup;
	struct arena_mark mark = arena_mark(sequence->frame);
	enum tw_status status = parse(reader, sequence->frame, &soup, error);
	if (status == TW_OK)
		status = check_faces(reader, &soup, error);
	for (size_t i = 0; i < 3 * (size_t)reader->info.vertex_count && status == TW_OK; i++)
		positions[i] = (float)soup.position[i];
	arena_release(sequence->frame, mark);
	return status;
}

/* The frames, and from the first of them how many vertices there are. */
static enum tw_status read_first(struct motion_reader *reader, struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	enum tw_status status = TW_OK;
	for (bool end = false; status == TW_OK && !end;)
		status = pass_entry(reader, &end, error);
	if (status == TW_OK)
		status = sort_entries(reader, error);
	reader->frame = 0;
	if (status == TW_OK)
		status = parse(reader, sequence->first, &sequence->first_soup, error);
	if (status != TW_OK)
		return status;
	uint32_t vertices = sequence->first_soup.vertex_count;
	if (vertices == 0 || (reader->expected > 0 && vertices != reader->expected))
		return tw_fail(error, TW_ERROR_INPUT, "motion-vertex-count", "frame 0",
			       "the first frame has %u vertices, the garment's file %u; export both from the same mesh",
			       vertices, reader->expected);
	reader->info.vertex_count = vertices;
	reader->info.frame_count = sequence->entry_count;
	reader->info.frames_per_second = 30;
	return TW_OK;
}

static void close_sequence(void *state)
{
	struct sequence *sequence = state;
	if (!sequence)
		return;
	free(sequence->entry);
	free(sequence->names);
	free(sequence->bytes);
	arena_free(sequence->first);
	arena_free(sequence->frame);
	free(sequence);
}

static enum tw_status start(struct motion_reader *reader, struct tw_error *error)
{
	struct sequence *sequence = reader->state;
	if (sequence)
		return TW_OK;
	sequence = reader->state = calloc(1, sizeof *sequence);
	if (!sequence)
		return tw_fail_memory(error);
	sequence->first = arena_new(arena_limit);
	sequence->frame = arena_new(arena_limit);
	if (!sequence->first || !sequence->frame)
		return tw_fail_memory(error);
	enum tw_status status = reserve(&sequence->bytes, &sequence->capacity, BLOCK, error);
	return status == TW_OK ? read_first(reader, error) : status;
}

const struct motion_codec obj_tar_codec = {.start = start, .next = next, .close = close_sequence};
