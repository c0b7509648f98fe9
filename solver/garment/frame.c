/* From the points of a motion's frame to the garment's vertices. */
#include "solver/garment/garment.h"

uint32_t garment_source_count(const struct garment *garment)
{
	return garment->source_vertex ? garment->source_count : garment->vertex_count;
}

const float *garment_frame(const struct garment *garment, const float *frame, float *moved)
{
	if (!garment->source_vertex)
		return frame;
	const uint32_t *restrict source = garment->source_vertex;
	const double *restrict share = garment->source_share;
	for (uint32_t v = 0; v < garment->vertex_count; v++) {
		for (uint32_t axis = 0; axis < 3; axis++) {
			double sum = 0;
			for (uint32_t k = 3 * v; k < 3 * v + 3; k++)
				sum += share[k] * (double)frame[3 * (size_t)source[k] + axis];
			moved[3 * (size_t)v + axis] = (float)sum;
		}
	}
	return moved;
}
