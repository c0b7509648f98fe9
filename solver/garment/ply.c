/* The strict reader of PLY (ASCII, little- and big-endian).
 *
 * The header is read in full; then every vertex and face is read, so that no count of the header is believed that the
 * bytes do not bear out. Accepted: element vertex with scalars, among them x y z (and, as the flat pattern, s t or u
 * v); element face with a list vertex_indices and anything else, among it, as the flat pattern, a list texcoord with
 * two numbers for each corner, which goes before what the vertices say; further elements behind the faces are not
 * looked at.
 *
 * OpenMesh is not asked: its reader does not advance over binary doubles and 16-bit indexes, and takes what follows for
 * them. */
#include "solver/garment/soup.h"

#include <math.h>
#include <string.h>

enum encoding { ENCODING_ASCII, ENCODING_LITTLE, ENCODING_BIG };
enum scalar {
	SCALAR_INT8,
	SCALAR_UINT8,
	SCALAR_INT16,
	SCALAR_UINT16,
	SCALAR_INT32,
	SCALAR_UINT32,
	SCALAR_FLOAT,
	SCALAR_DOUBLE
};
enum { PROPERTY_LIMIT = 64, USE_COORD = 3, USE_NONE = 5, USE_INDICES, USE_WEDGE };

struct property {
	enum scalar type;
	enum scalar count_type; /* of a list */
	bool is_list;
	int use; /* of a vertex: an axis 0…2, a pattern axis USE_COORD + 0…1, or USE_NONE; of a face: USE_INDICES,
		    USE_WEDGE or USE_NONE */
};

struct element {
	uint64_t count;
	uint32_t property_count;
	struct property property[PROPERTY_LIMIT];
};

struct ply {
	struct text text; /* what was not read yet */
	enum encoding encoding;
	struct element vertex, face;
	struct element *open; /* the element whose properties come */
	uint32_t line;
	bool has[USE_NONE]; /* x y z, and the two of the pattern */
	bool has_list, has_wedge;
	enum scalar index_type, wedge_type; /* of vertex_indices and texcoord */
	double wedge[2 * POLYGON_CORNERS];  /* of the face in hand */
	uint32_t wedge_count;
	bool has_other; /* an element that is neither */
	struct soup *soup;
	struct tw_error *error;
};

bool ply_is(struct text file)
{
	struct text word;
	return text_first_word(file, &word) && text_equals(&word, "ply");
}

static enum tw_status bad_header(const struct ply *ply, const char *what)
{
	return fail_at_line(ply->error, "mesh-bad-header", ply->line, "%s", what);
}

static bool scalar_of(const struct text *word, enum scalar *scalar)
{
	static const struct {
		const char *name;
		enum scalar scalar;
	} names[] = {
		{"char", SCALAR_INT8},      {"int8", SCALAR_INT8},     {"uchar", SCALAR_UINT8},
		{"uint8", SCALAR_UINT8},    {"short", SCALAR_INT16},   {"int16", SCALAR_INT16},
		{"ushort", SCALAR_UINT16},  {"uint16", SCALAR_UINT16}, {"int", SCALAR_INT32},
		{"int32", SCALAR_INT32},    {"uint", SCALAR_UINT32},   {"uint32", SCALAR_UINT32},
		{"float", SCALAR_FLOAT},    {"float32", SCALAR_FLOAT}, {"double", SCALAR_DOUBLE},
		{"float64", SCALAR_DOUBLE},
	};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		if (text_equals(word, names[i].name)) {
			*scalar = names[i].scalar;
			return true;
		}
	}
	return false;
}

static size_t scalar_size(enum scalar scalar)
{
	static const size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
	return sizes[scalar];
}

static enum tw_status read_format(struct ply *ply, struct text line)
{
	struct text name, version;
	if (!text_next_word(&line, &name) || !text_next_word(&line, &version) || !text_equals(&version, "1.0"))
		return bad_header(ply, "expected `format ascii|binary_little_endian|binary_big_endian 1.0`");
	if (text_equals(&name, "ascii"))
		ply->encoding = ENCODING_ASCII;
	else if (text_equals(&name, "binary_little_endian"))
		ply->encoding = ENCODING_LITTLE;
	else if (text_equals(&name, "binary_big_endian"))
		ply->encoding = ENCODING_BIG;
	else
		return bad_header(ply, "the format is none of ascii, binary_little_endian, binary_big_endian");
	return TW_OK;
}

static enum tw_status read_element(struct ply *ply, struct text line)
{
	struct text name, number;
	int64_t count = 0;
	if (!text_next_word(&line, &name) || !text_next_word(&line, &number) || !text_take_integer(&number, &count) ||
	    count < 0)
		return bad_header(ply, "expected `element NAME COUNT`");
	if (text_equals(&name, "vertex") && !ply->open && !ply->has_other)
		ply->open = &ply->vertex;
	else if (text_equals(&name, "face") && ply->open == &ply->vertex)
		ply->open = &ply->face;
	else if (ply->open != &ply->face)
		return bad_header(ply, "the first element must be `vertex`, the second `face`");
	else
		ply->has_other = true;
	if (!ply->has_other)
		ply->open->count = (uint64_t)count;
	return TW_OK;
}

static enum tw_status note_face_property(struct ply *ply, struct property *property, const struct text *name)
{
	bool indices = text_equals(name, "vertex_indices") || text_equals(name, "vertex_index");
	bool wedge = property->is_list && text_equals(name, "texcoord");
	property->use = indices ? USE_INDICES : wedge ? USE_WEDGE : USE_NONE;
	if (property->is_list && property->count_type >= SCALAR_FLOAT)
		return bad_header(ply, "the length of a list must be an integer");
	if (indices && (!property->is_list || property->type >= SCALAR_FLOAT))
		return bad_header(ply, "vertex_indices must be a list of integers");
	if ((indices && ply->has_list) || (wedge && ply->has_wedge))
		return bad_header(ply, "a list of the faces is named twice");
	ply->has_list |= indices;
	ply->has_wedge |= wedge;
	ply->index_type = indices ? property->type : ply->index_type;
	ply->wedge_type = wedge ? property->type : ply->wedge_type;
	return TW_OK;
}

/* What the property means: its name decides. */
static enum tw_status note_property(struct ply *ply, struct property *property, const struct text *name)
{
	static const struct {
		const char *name;
		int use;
	} uses[] = {
		{"x", 0},
		{"y", 1},
		{"z", 2},
		{"s", USE_COORD},
		{"t", USE_COORD + 1},
		{"u", USE_COORD},
		{"v", USE_COORD + 1},
		{"texture_u", USE_COORD},
		{"texture_v", USE_COORD + 1},
	};
	if (ply->open == &ply->face)
		return note_face_property(ply, property, name);
	if (property->is_list)
		return bad_header(ply, "a vertex may have no lists");
	property->use = USE_NONE;
	for (size_t i = 0; i < sizeof uses / sizeof *uses; i++) {
		if (!text_equals(name, uses[i].name))
			continue;
		if (ply->has[uses[i].use])
			return bad_header(ply, "a coordinate is named twice");
		ply->has[uses[i].use] = true;
		property->use = uses[i].use;
	}
	return TW_OK;
}

static enum tw_status read_property(struct ply *ply, struct text line)
{
	if (ply->has_other)
		return TW_OK;
	if (!ply->open)
		return bad_header(ply, "a property stands before the first element");
	if (ply->open->property_count == PROPERTY_LIMIT)
		return bad_header(ply, "an element has more than 64 properties");
	struct property *property = &ply->open->property[ply->open->property_count++];
	struct text word;
	bool known = text_next_word(&line, &word);
	if (known && text_equals(&word, "list")) {
		property->is_list = true;
		known = text_next_word(&line, &word) && scalar_of(&word, &property->count_type) &&
			text_next_word(&line, &word);
	}
	if (!known || !scalar_of(&word, &property->type) || !text_next_word(&line, &word))
		return bad_header(ply, "expected `property TYPE NAME` or `property list TYPE TYPE NAME`");
	return note_property(ply, property, &word);
}

/* Where lines end in a carriage return alone, a line feed behind the header's last one is the body's first byte. */
static void text_end_header(struct ply *ply, struct text header)
{
	const char *first = memchr(header.at, '\r', (size_t)(ply->text.at - header.at));
	if (ply->encoding != ENCODING_ASCII && first && first[1] != '\n' && ply->text.at[-1] == '\n')
		ply->text.at--;
}

static enum tw_status read_header(struct ply *ply)
{
	const struct text header = ply->text;
	struct text line, word;
	bool has_format = false;
	while (text_next_line(&ply->text, &line, &ply->line)) {
		enum tw_status status = TW_OK;
		if (!text_next_word(&line, &word) || text_equals(&word, "comment") || text_equals(&word, "obj_info"))
			continue;
		if (text_equals(&word, "end_header")) {
			text_end_header(ply, header);
			if (!has_format || !ply->has[0] || !ply->has[1] || !ply->has[2] || !ply->has_list)
				return bad_header(ply,
						  "the header lacks the format, vertices with x y z, or faces with "
						  "vertex_indices");
			return check_counts(ply->vertex.count, ply->face.count, ply->error);
		}
		if (text_equals(&word, "format")) {
			status = read_format(ply, line);
			has_format = true;
		} else if (text_equals(&word, "element")) {
			status = read_element(ply, line);
		} else if (text_equals(&word, "property")) {
			status = read_property(ply, line);
		} else if (ply->line > 1) {
			status = bad_header(ply, "expected format, element, property, comment or end_header");
		}
		if (status != TW_OK)
			return status;
	}
	return bad_header(ply, "the header has no end_header; is the file truncated?");
}

static enum tw_status fail_at(const struct ply *ply, const char *type, const char *what, uint64_t number,
			      const char *text)
{
	char where[48];
	snprintf(where, sizeof where, "%s %llu", what, (unsigned long long)number);
	return tw_fail(ply->error, TW_ERROR_INPUT, type, where, "%s %llu %s", what, (unsigned long long)number, text);
}

/* The next number of the body; false at its end and where it is none (NaN). */
static bool next_number(struct ply *ply, enum scalar type, double *number)
{
	if (ply->encoding == ENCODING_ASCII) {
		struct text word;
		*number = NAN;
		if (!text_next_word(&ply->text, &word))
			return false;
		if (!text_to_number(&word, number))
			*number = NAN;
		return true;
	}
	size_t size = scalar_size(type);
	if ((size_t)(ply->text.end - ply->text.at) < size)
		return false;
	uint64_t bits = 0;
	for (size_t i = 0; i < size; i++) {
		uint64_t byte = (unsigned char)ply->text.at[i];
		bits |= byte << (8 * (ply->encoding == ENCODING_LITTLE ? i : size - 1 - i));
	}
	ply->text.at += size;
	switch (type) {
	case SCALAR_INT8:
		*number = (int8_t)bits;
		break;
	case SCALAR_INT16:
		*number = (int16_t)bits;
		break;
	case SCALAR_INT32:
		*number = (int32_t)bits;
		break;
	case SCALAR_UINT8:
	case SCALAR_UINT16:
	case SCALAR_UINT32:
		*number = (double)bits;
		break;
	case SCALAR_FLOAT: {
		float value;
		memcpy(&value, &(uint32_t){(uint32_t)bits}, sizeof value);
		*number = (double)value;
		break;
	}
	case SCALAR_DOUBLE:
		memcpy(number, &bits, sizeof *number);
		break;
	}
	return true;
}

static enum tw_status read_vertices(struct ply *ply)
{
	struct soup *soup = ply->soup;
	for (uint64_t v = 0; v < ply->vertex.count; v++) {
		for (uint32_t i = 0; i < ply->vertex.property_count; i++) {
			const struct property *property = &ply->vertex.property[i];
			double number = 0;
			if (!next_number(ply, property->type, &number))
				return fail_at(ply, "mesh-truncated", "vertex", v,
					       "is missing: the file ends before it");
			if (!isfinite(number) && (property->use != USE_NONE || ply->encoding == ENCODING_ASCII))
				return fail_at(ply, "mesh-not-a-number", "vertex", v,
					       "has a coordinate that is not a finite number");
			if (property->use < USE_COORD)
				soup->position[3 * v + (uint64_t)property->use] = number;
			else if (property->use < USE_NONE && soup->coord && !ply->has_wedge)
				soup->coord[2 * v + (uint64_t)property->use - USE_COORD] = number;
		}
	}
	return TW_OK;
}

/* A list that says nothing about the garment is read over. */
static enum tw_status read_other_list(struct ply *ply, const struct property *property, uint64_t face)
{
	double count = 0, number = 0;
	if (!next_number(ply, property->count_type, &count))
		return fail_at(ply, "mesh-truncated", "face", face, "is missing: the file ends before it");
	if (!(count >= 0 && count <= UINT32_MAX) || count != floor(count))
		return fail_at(ply, "mesh-bad-face", "face", face, "has a list whose length is no whole number");
	if (property->use == USE_WEDGE)
		ply->wedge_count = 0;
	for (uint64_t i = 0; i < (uint64_t)count; i++) {
		if (!next_number(ply, property->type, &number))
			return fail_at(ply, "mesh-truncated", "face", face, "is cut off: the file ends within it");
		if (property->use != USE_WEDGE)
			continue;
		if (!isfinite(number))
			return fail_at(ply, "mesh-not-a-number", "face", face,
				       "has a texture coordinate that is not a finite number");
		if (ply->wedge_count < 2 * POLYGON_CORNERS)
			ply->wedge[ply->wedge_count] = number;
		ply->wedge_count += ply->wedge_count <= 2 * POLYGON_CORNERS;
	}
	return TW_OK;
}

/* The texture coordinates of the face's corners become pattern positions, one for each. */
static enum tw_status take_wedge(struct ply *ply, uint64_t face)
{
	struct soup *soup = ply->soup;
	uint32_t first = soup->polygon_start[face], corners = soup->corner_count - first;
	if (ply->wedge_count != 2 * corners)
		return fail_at(ply, "mesh-mixed-coords", "face", face,
			       "has another number of texture coordinates than two for each corner");
	memcpy(soup->coord + 2 * (size_t)first, ply->wedge, 2 * corners * sizeof *ply->wedge);
	for (uint32_t i = first; i < first + corners; i++)
		soup->corner_coord[i] = i;
	soup->coord_count = soup->corner_count;
	return TW_OK;
}

/* Corners grow with the file, not with a claim: a face has at least four bytes in it. */
static enum tw_status read_list(struct ply *ply, const struct property *property, uint64_t face, uint64_t capacity)
{
	struct soup *soup = ply->soup;
	double corners = 0, index = 0;
	if (!next_number(ply, property->count_type, &corners))
		return fail_at(ply, "mesh-truncated", "face", face, "is missing: the file ends before it");
	if (!(corners >= 3 && corners <= POLYGON_CORNERS) || corners != floor(corners))
		return fail_at(ply, "mesh-bad-face", "face", face, "has fewer than 3 or more than 64 corners");
	if (soup->corner_count + (uint64_t)corners > capacity)
		return fail_at(ply, "mesh-truncated", "face", face, "is cut off: the file ends within it");
	for (uint32_t k = 0; k < (uint32_t)corners; k++) {
		if (!next_number(ply, property->type, &index))
			return fail_at(ply, "mesh-truncated", "face", face, "is cut off: the file ends within it");
		if (!(index >= 0 && index < (double)ply->vertex.count) || index != floor(index))
			return fail_at(ply, "mesh-bad-index", "face", face, "has a vertex index that is out of range");
		soup->corner_vertex[soup->corner_count++] = (uint32_t)index;
	}
	return TW_OK;
}

static enum tw_status read_faces(struct ply *ply, uint64_t capacity)
{
	for (uint64_t f = 0; f < ply->face.count; f++) {
		for (uint32_t i = 0; i < ply->face.property_count; i++) {
			const struct property *property = &ply->face.property[i];
			double ignored = 0;
			enum tw_status status = TW_OK;
			if (property->use == USE_INDICES)
				status = read_list(ply, property, f, capacity);
			else if (property->is_list)
				status = read_other_list(ply, property, f);
			else if (!next_number(ply, property->type, &ignored))
				status = fail_at(ply, "mesh-truncated", "face", f,
						 "is cut off: the file ends within it");
			else if (ply->encoding == ENCODING_ASCII && isnan(ignored))
				status = fail_at(ply, "mesh-not-a-number", "face", f,
						 "has a property that is not a number");
			if (status != TW_OK)
				return status;
		}
		ply->soup->polygon_start[f + 1] = ply->soup->corner_count;
		enum tw_status status = ply->has_wedge ? take_wedge(ply, f) : TW_OK;
		if (status != TW_OK)
			return status;
	}
	struct text word;
	if (!ply->has_other && text_next_word(&ply->text, &word))
		return tw_fail(ply->error, TW_ERROR_INPUT, "mesh-trailing-bytes", NULL,
			       "there is something behind the last of %llu faces; the header and the file disagree",
			       (unsigned long long)ply->face.count);
	return TW_OK;
}

/* Bytes of a vertex or face at least: in ASCII every number has a digit. */
static uint64_t least_bytes(const struct ply *ply, const struct element *element)
{
	uint64_t bytes = 0;
	for (uint32_t i = 0; i < element->property_count; i++) {
		const struct property *property = &element->property[i];
		uint64_t number = ply->encoding == ENCODING_ASCII ? 1 : scalar_size(property->type);
		uint64_t length = ply->encoding == ENCODING_ASCII ? 1 : scalar_size(property->count_type);
		bytes += !property->is_list ? number : property->use == USE_INDICES ? length + 3 * number : length;
	}
	return bytes;
}

/* Arrays for what the header claims, where the rest of the file can hold it. *corners: room for corners. */
static enum tw_status allocate(struct ply *ply, struct arena *arena, uint64_t *corners)
{
	struct soup *soup = ply->soup;
	uint64_t left = (uint64_t)(ply->text.end - ply->text.at);
	uint64_t needed =
		ply->vertex.count * least_bytes(ply, &ply->vertex) + ply->face.count * least_bytes(ply, &ply->face);
	if (needed > left)
		return tw_fail(ply->error, TW_ERROR_INPUT, "mesh-truncated", NULL,
			       "the header claims %llu vertices and %llu faces, at least %llu bytes; %llu follow",
			       (unsigned long long)ply->vertex.count, (unsigned long long)ply->face.count,
			       (unsigned long long)needed, (unsigned long long)left);
	/* In ASCII a number has a digit and a blank. */
	bool ascii = ply->encoding == ENCODING_ASCII;
	uint64_t corner_bytes = ascii ? 2 : scalar_size(ply->index_type);
	if (ply->has_wedge)
		corner_bytes += 2 * (ascii ? 2 : scalar_size(ply->wedge_type));
	*corners = left / corner_bytes + 1;
	if (*corners > ply->face.count * POLYGON_CORNERS)
		*corners = ply->face.count * POLYGON_CORNERS;
	soup->vertex_count = (uint32_t)ply->vertex.count;
	soup->polygon_count = (uint32_t)ply->face.count;
	soup->position = ARENA_ARRAY(arena, 3 * ply->vertex.count, double);
	soup->polygon_start = ARENA_ZEROED(arena, ply->face.count + 1, uint32_t);
	soup->corner_vertex = ARENA_ARRAY(arena, *corners, uint32_t);
	bool has_coords = ply->has_wedge || (ply->has[USE_COORD] && ply->has[USE_COORD + 1]);
	if (ply->has_wedge) {
		soup->coord = ARENA_ARRAY(arena, 2 * *corners, double);
		soup->corner_coord = ARENA_ARRAY(arena, *corners, uint32_t);
	} else if (has_coords) {
		soup->coord_count = soup->vertex_count;
		soup->coord = ARENA_ARRAY(arena, 2 * ply->vertex.count, double);
		soup->corner_coord = soup->corner_vertex;
	}
	if (!soup->position || !soup->polygon_start || !soup->corner_vertex ||
	    (has_coords && (!soup->coord || !soup->corner_coord)))
		return tw_fail_memory(ply->error);
	return TW_OK;
}

enum tw_status ply_read(struct soup *soup, struct arena *arena, struct text file, struct tw_error *error)
{
	*soup = (struct soup){0};
	text_skip_mark(&file);
	struct ply ply = {.text = file, .soup = soup, .error = error};
	uint64_t corners = 0;
	if (!ply_is(file))
		return tw_fail(error, TW_ERROR_INPUT, "mesh-bad-header", "line 1",
			       "a PLY file begins with the line `ply`");
	enum tw_status status = read_header(&ply);
	if (status == TW_OK)
		status = allocate(&ply, arena, &corners);
	if (status == TW_OK)
		status = read_vertices(&ply);
	if (status == TW_OK)
		status = read_faces(&ply, corners);
	if (status == TW_OK)
		status = check_polygons(soup, error);
	return status;
}
