/* The cloth slides on the skin: where a joint stretches it, it draws from the cloth around. Computed on a coarse net of
 * its own, the same for every mesh of the suit, and carried over smoothly, so that all resolutions move alike. */
#ifndef SOLVER_SAMPLE_SLIDE_H
#define SOLVER_SAMPLE_SLIDE_H

#include "solver/arena.h"
#include "solver/sample/body.h"

#include <stdbool.h>
#include <stdint.h>

struct slide;

/* `rest` [count][3]: the vertices that will be carried, of a wearer scaled by `scale`. False when memory is out. */
bool slide_build(struct slide **slide, struct arena *arena, const struct body *body, struct vec3 scale,
		 const double *rest, uint32_t count) TW_NODISCARD;

/* The net's vertices in rest; `*count` of them. */
const struct vec3 *slide_rest(const struct slide *slide, uint32_t *count);

/* Lets the net slide from where the bones alone put it, `posed` [net count]. Not for two threads at once. */
void slide_relax(struct slide *slide, const struct vec3 *posed);

/* How far carried vertex v slid in the last slide_relax. */
struct vec3 slide_shift(const struct slide *slide, uint32_t v);

#endif
