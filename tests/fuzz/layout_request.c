/* Any bytes as a layout request: a request that is taken has everything in its range, and one that is not says where.
 */
#include "solver/layout/request.h"

#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct layout_request request;
	struct tw_error error = {0};
	enum tw_status status = layout_request_parse(&request, (const char *)data, size, &error);
	if (status) {
		if (!error.type || !*error.text)
			abort();
		return 0;
	}
	if (request.terminal_count == 0 || request.terminal_count > TW_LIMIT_TERMINALS)
		abort();
	for (uint32_t i = 0; i < request.terminal_count; i++) {
		const struct layout_terminal *terminal = &request.terminals[i];
		const double *w = terminal->barycentric;
		if (terminal->kind == TERMINAL_FACE && !(fabs(w[0] + w[1] + w[2] - 1) < 1e-9))
			abort();
		if (terminal->kind == TERMINAL_PATTERN && !terminal->piece)
			abort();
	}
	layout_request_clear(&request);
	return 0;
}
