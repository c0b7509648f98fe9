#include "storage/base32.h"

static unsigned byte_at(const uint8_t *bytes, size_t size, size_t i)
{
	return i < size ? bytes[i] : 0;
}

void base32_print(char *text, size_t digits, const uint8_t *bytes, size_t size)
{
	static const char alphabet[] = "0123456789abcdefghjkmnpqrstvwxyz";
	for (size_t digit = 0; digit < digits; digit++) {
		size_t bit = 5 * digit;
		unsigned pair = byte_at(bytes, size, bit / 8) << 8 | byte_at(bytes, size, bit / 8 + 1);
		text[digit] = alphabet[pair >> (11 - bit % 8) & 31];
	}
}
