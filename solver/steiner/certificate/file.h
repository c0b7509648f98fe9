/* Certificates as text files, easy to read for a checker in any language:
 *
 *     TIGHTWIRE STEINER CERTIFICATE 1
 *     INSTANCE vertices edges terminals
 *     WEIGHT weight
 *     BOUND bound
 *     CERTIFIED certified
 *     TREE edges                                         then a line `u v weight` for each
 *     DUAL root scale total potentials members           then for each potential
 *     POTENTIAL terminal radius members                  and a line `v value` for each of its members
 *     END
 *
 * Whole numbers without sign, vertices counted from 1 as in the instance's file; `#` opens a comment up to the end of
 * its line. What the numbers mean, and why they prove a bound, stands in certificate.h. */
#ifndef SOLVER_STEINER_CERTIFICATE_FILE_H
#define SOLVER_STEINER_CERTIFICATE_FILE_H

#include "solver/steiner/certificate/certificate.h"

/* Writes the text into `arena`. TW_ERROR_MEMORY. */
enum tw_status certificate_write(const struct steiner_certificate *certificate, struct arena *arena, const char **bytes,
				 size_t *length, struct tw_error *error) TW_NODISCARD;

/* Reads `length` bytes (they need no terminator). Every array is sized by what the bytes can hold, not by what they
 * announce. What was read need not be true: certificate_check says. TW_ERROR_INPUT names the line; TW_ERROR_MEMORY. */
enum tw_status certificate_read(struct steiner_certificate *certificate, struct arena *arena, const char *bytes,
				size_t length, struct tw_error *error) TW_NODISCARD;

#endif
