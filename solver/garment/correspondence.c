/* A vertex that refinement made lies at a mean of vertices of one face of the file: source_vertex and source_share say
 * of which, and so where a part of a face lies in the whole. */
#include "solver/garment/correspondence.h"

#include <assert.h>

uint32_t garment_file_faces(const struct garment *garment)
{
	return garment->file_face ? garment->file_face_count : garment->face_count;
}

uint32_t garment_mesh_vertex(const struct garment *garment, uint32_t file_vertex)
{
	assert(file_vertex < garment_source_count(garment));
	return garment->mesh_vertex ? garment->mesh_vertex[file_vertex] : file_vertex;
}

uint32_t garment_file_vertex(const struct garment *garment, uint32_t vertex)
{
	assert(vertex < garment->vertex_count);
	if (!garment->source_vertex)
		return vertex;
	return garment->source_share[3 * (size_t)vertex] == 1 ? garment->source_vertex[3 * (size_t)vertex]
							      : GARMENT_NONE;
}

uint32_t garment_file_face(const struct garment *garment, uint32_t face)
{
	assert(face < garment->face_count);
	return garment->file_face ? garment->file_face[face] : face;
}

/* The first face that is part of `file_face` or of a later one. */
static uint32_t first_part(const struct garment *garment, uint32_t file_face)
{
	uint32_t low = 0, high = garment->face_count;
	while (low < high) {
		uint32_t middle = low + (high - low) / 2;
		if (garment->file_face[middle] < file_face)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

uint32_t garment_face_parts(const struct garment *garment, uint32_t file_face, uint32_t *first)
{
	assert(file_face < garment_file_faces(garment));
	*first = file_face;
	if (!garment->file_face)
		return 1;
	*first = first_part(garment, file_face);
	return first_part(garment, file_face + 1) - *first;
}

bool garment_file_corners(const struct garment *garment, uint32_t file_face, uint32_t corner[3])
{
	const uint32_t *from = garment->file_face ? garment->file_corner : garment->face_vertex;
	for (size_t k = 0; k < 3; k++)
		corner[k] = from[3 * (size_t)file_face + k];
	return corner[0] != GARMENT_NONE;
}

/* The file's vertices, as the garment's, that a vertex is the mean of, and their shares. Returns how many. */
static uint32_t origin_of(const struct garment *garment, uint32_t vertex, uint32_t of[3], double share[3])
{
	uint32_t count = 0;
	if (!garment->source_vertex) {
		of[0] = vertex;
		share[0] = 1;
		return 1;
	}
	for (size_t i = 3 * (size_t)vertex; i < 3 * (size_t)vertex + 3; i++) {
		if (garment->source_share[i] == 0)
			continue;
		of[count] = garment_mesh_vertex(garment, garment->source_vertex[i]);
		share[count++] = garment->source_share[i];
	}
	return count;
}

/* weights[k]: of the part's corner k in the triangle of the file with these corners. */
static void corner_weights(const struct garment *garment, const uint32_t corner[3], uint32_t part, double weights[3][3])
{
	for (size_t k = 0; k < 3; k++) {
		uint32_t of[3];
		double share[3];
		uint32_t count = origin_of(garment, garment->face_vertex[3 * (size_t)part + k], of, share);
		for (size_t c = 0; c < 3; c++) {
			weights[k][c] = 0;
			for (uint32_t i = 0; i < count; i++)
				weights[k][c] += of[i] == corner[c] ? share[i] : 0;
		}
	}
}

static double determinant(const double a[3], const double b[3], const double c[3])
{
	return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
	       a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* Solves sum over k of inner[k] * corner[k] = weights by Cramer's rule; the parts of a triangle are none that are thin.
 * Returns the least of them, which is negative outside the part. */
static double solve_inner(double corner[3][3], const double weights[3], double inner[3])
{
	double whole = determinant(corner[0], corner[1], corner[2]);
	inner[0] = determinant(weights, corner[1], corner[2]) / whole;
	inner[1] = determinant(corner[0], weights, corner[2]) / whole;
	inner[2] = determinant(corner[0], corner[1], weights) / whole;
	double least = inner[0] < inner[1] ? inner[0] : inner[1];
	return least < inner[2] ? least : inner[2];
}

static void normalise(double weights[3])
{
	double sum = 0;
	for (int k = 0; k < 3; k++) {
		weights[k] = weights[k] > 0 ? weights[k] : 0;
		sum += weights[k];
	}
	for (int k = 0; k < 3; k++)
		weights[k] /= sum;
}

bool garment_place_from_file(const struct garment *garment, uint32_t file_face, const double weights[3], uint32_t *face,
			     double barycentric[3])
{
	/* What rounding makes of a point on the edge between two parts. */
	const double slack = 1e-12;
	uint32_t corner[3], first = 0, parts = garment_face_parts(garment, file_face, &first);
	if (!garment_file_corners(garment, file_face, corner))
		return false;
	double best = -1;
	for (uint32_t part = first; part < first + parts && best < -slack; part++) {
		double within[3][3], inner[3];
		corner_weights(garment, corner, part, within);
		double least = parts == 1 ? 0 : solve_inner(within, weights, inner);
		if (least <= best)
			continue;
		best = least;
		*face = part;
		for (int k = 0; k < 3; k++)
			barycentric[k] = parts == 1 ? weights[k] : inner[k];
	}
	normalise(barycentric);
	return true;
}

bool garment_place_to_file(const struct garment *garment, uint32_t face, const double barycentric[3],
			   uint32_t *file_face, double weights[3])
{
	uint32_t corner[3];
	double within[3][3];
	*file_face = garment_file_face(garment, face);
	if (!garment_file_corners(garment, *file_face, corner))
		return false;
	corner_weights(garment, corner, face, within);
	for (size_t c = 0; c < 3; c++)
		weights[c] =
			barycentric[0] * within[0][c] + barycentric[1] * within[1][c] + barycentric[2] * within[2][c];
	return true;
}

bool garment_edge_to_file(const struct garment *garment, const uint32_t ends[2], uint32_t file_ends[2])
{
	uint32_t found = 0;
	for (int end = 0; end < 2; end++) {
		uint32_t of[3];
		double share[3];
		uint32_t count = origin_of(garment, ends[end], of, share);
		for (uint32_t i = 0; i < count; i++) {
			if (found > 0 && (file_ends[0] == of[i] || (found == 2 && file_ends[1] == of[i])))
				continue;
			if (found == 2)
				return false;
			file_ends[found++] = of[i];
		}
	}
	if (found < 2)
		return false;
	if (file_ends[0] > file_ends[1]) {
		uint32_t higher = file_ends[0];
		file_ends[0] = file_ends[1];
		file_ends[1] = higher;
	}
	return true;
}

const char *garment_vertex_name(const struct garment *garment, uint32_t vertex, char name[VERTEX_NAME_BYTES])
{
	uint32_t of[3] = {0}, file = garment_file_vertex(garment, vertex);
	double share[3];
	if (file != GARMENT_NONE) {
		snprintf(name, VERTEX_NAME_BYTES, "%u", file);
		return name;
	}
	uint32_t count = origin_of(garment, vertex, of, share);
	for (uint32_t i = 0; i < count; i++)
		of[i] = garment_file_vertex(garment, of[i]);
	if (count == 2)
		snprintf(name, VERTEX_NAME_BYTES, "between %u and %u", of[0], of[1]);
	else
		snprintf(name, VERTEX_NAME_BYTES, "between %u, %u and %u", of[0], of[1], of[2]);
	return name;
}
