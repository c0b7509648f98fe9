#include "service/daemon/http/chunk.h"

#define EXTENSION_MAX 1024u /* bytes of one chunk's; what a client says beside the data has to end */
#define TRAILERS_MAX 8192u

static int hex_digit(char c)
{
	if (c >= '0' && c <= '9')
		return c - '0';
	if (c >= 'a' && c <= 'f')
		return c - 'a' + 10;
	return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

static bool is_text(char c)
{
	return c == '\t' || ((unsigned char)c >= ' ' && c != 127);
}

static enum chunk_state after_size(const struct chunk *chunk, char c)
{
	if (!chunk->digits)
		return CHUNK_BROKEN;
	return c == '\r'               ? CHUNK_SIZE_LF
	       : c == ';'              ? CHUNK_EXTENSION
	       : c == ' ' || c == '\t' ? CHUNK_BLANK
				       : CHUNK_BROKEN;
}

static enum chunk_state take_digit(struct chunk *chunk, char c)
{
	int digit = hex_digit(c);
	if (digit < 0)
		return after_size(chunk, c);
	if (++chunk->digits > 16)
		return CHUNK_BROKEN;
	chunk->left = chunk->left * 16 + (unsigned)digit;
	return CHUNK_SIZE;
}

/* A line of text until its CR, within `limit` bytes. */
static enum chunk_state take_text(struct chunk *chunk, char c, unsigned limit, enum chunk_state then)
{
	if (c == '\r')
		return then;
	return is_text(c) && ++chunk->extra <= limit ? chunk->state : CHUNK_BROKEN;
}

static enum chunk_state expect(char c, char wanted, enum chunk_state then)
{
	return c == wanted ? then : CHUNK_BROKEN;
}

static enum chunk_state begin_data(struct chunk *chunk)
{
	chunk->extra = 0;
	return chunk->left ? CHUNK_DATA : CHUNK_TRAILER_START;
}

static enum chunk_state begin_size(struct chunk *chunk)
{
	chunk->left = 0;
	chunk->digits = 0;
	return CHUNK_SIZE;
}

/* One byte that is not data. */
static enum chunk_state step(struct chunk *chunk, char c)
{
	switch (chunk->state) {
	case CHUNK_SIZE:
		return take_digit(chunk, c);
	case CHUNK_BLANK:
		return c == ' ' || c == '\t' ? take_text(chunk, c, EXTENSION_MAX, CHUNK_BROKEN)
					     : expect(c, ';', CHUNK_EXTENSION);
	case CHUNK_EXTENSION:
		return take_text(chunk, c, EXTENSION_MAX, CHUNK_SIZE_LF);
	case CHUNK_SIZE_LF:
		return c == '\n' ? begin_data(chunk) : CHUNK_BROKEN;
	case CHUNK_DATA_CR:
		return expect(c, '\r', CHUNK_DATA_LF);
	case CHUNK_DATA_LF:
		return c == '\n' ? begin_size(chunk) : CHUNK_BROKEN;
	case CHUNK_TRAILER_START:
		if (c == '\r')
			return CHUNK_LAST_LF;
		chunk->state = CHUNK_TRAILER;
		return take_text(chunk, c, TRAILERS_MAX, CHUNK_BROKEN);
	case CHUNK_TRAILER:
		return take_text(chunk, c, TRAILERS_MAX, CHUNK_TRAILER_LF);
	case CHUNK_TRAILER_LF:
		return expect(c, '\n', CHUNK_TRAILER_START);
	case CHUNK_LAST_LF:
		return expect(c, '\n', CHUNK_END);
	default:
		return CHUNK_BROKEN;
	}
}

size_t chunk_take(struct chunk *chunk, const char *bytes, size_t size, const char **data, size_t *data_size)
{
	size_t used = 0;
	*data_size = 0;
	while (used < size && chunk->state != CHUNK_DATA && chunk->state != CHUNK_END && chunk->state != CHUNK_BROKEN)
		chunk->state = step(chunk, bytes[used++]);
	if (chunk->state != CHUNK_DATA)
		return used;
	*data = bytes + used;
	*data_size = size - used < chunk->left ? size - used : (size_t)chunk->left;
	chunk->left -= *data_size;
	if (!chunk->left)
		chunk->state = CHUNK_DATA_CR;
	return used + *data_size;
}
