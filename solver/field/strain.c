/* Rest shapes, and the strain energy density of one frame: faces are gathered into lanes and evaluated together. */
#include "solver/field/strain.h"

#include "solver/garment/correspondence.h"

#include "solver/field/clones.h"
#include "solver/field/density.h"
#include "solver/garment/first_corner.h"

#include <string.h>

enum { LANES = 16 };

struct sides {
	double first[3], second[3];
};

/* The triangle laid into the plane with its first side on the first axis: Dm = (l m; 0 h). */
static enum tw_status invert_sides(const struct sides *sides, const struct garment *garment, uint32_t face,
				   float inverse[3], struct tw_error *error)
{
	const double *s = sides->first, *t = sides->second;
	double l = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
	double m = (s[0] * t[0] + s[1] * t[1] + s[2] * t[2]) / l;
	double c[3] = {s[1] * t[2] - s[2] * t[1], s[2] * t[0] - s[0] * t[2], s[0] * t[1] - s[1] * t[0]};
	double h = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]) / l;
	inverse[0] = (float)(1 / l);
	inverse[1] = (float)(-m / (l * h));
	inverse[2] = (float)(1 / h);
	if (isfinite(inverse[0]) && isfinite(inverse[1]) && isfinite(inverse[2]))
		return TW_OK;
	char where[32];
	snprintf(where, sizeof where, "face %u", garment_file_face(garment, face));
	return tw_fail(error, TW_ERROR_INPUT, "reference-degenerate-face", where,
		       "the face has no area in the reference state; choose another reference");
}

static enum tw_status rest_init(struct strain_rest *rest, struct arena *arena, const struct garment *garment,
				struct tw_error *error)
{
	*rest = (struct strain_rest){
		.face_count = garment->face_count,
		.vertex_count = garment->vertex_count,
		.corner = ARENA_ARRAY(arena, 3 * (size_t)garment->face_count, uint32_t),
		.inverse = ARENA_ARRAY(arena, 3 * (size_t)garment->face_count, float),
	};
	if (!rest->corner || !rest->inverse)
		return tw_fail_memory(error);
	for (uint32_t f = 0; f < rest->face_count; f++)
		for (uint32_t k = 0, first = face_first_corner(garment, f); k < 3; k++)
			rest->corner[3 * (size_t)f + k] = garment->face_vertex[3 * (size_t)f + (first + k) % 3];
	return TW_OK;
}

enum tw_status strain_rest_from_pattern(struct strain_rest *rest, struct arena *arena, const struct garment *garment,
					struct tw_error *error)
{
	enum tw_status status = rest_init(rest, arena, garment, error);
	for (uint32_t f = 0; status == TW_OK && f < rest->face_count; f++) {
		const uint32_t *coord = garment->face_coord + 3 * (size_t)f, first = face_first_corner(garment, f);
		const uint32_t c[3] = {coord[first], coord[(first + 1) % 3], coord[(first + 2) % 3]};
		const double *u = garment->pattern;
		struct sides sides = {{0}, {0}};
		for (size_t d = 0; d < 2; d++) {
			sides.first[d] = u[2 * (size_t)c[1] + d] - u[2 * (size_t)c[0] + d];
			sides.second[d] = u[2 * (size_t)c[2] + d] - u[2 * (size_t)c[0] + d];
		}
		status = invert_sides(&sides, garment, f, rest->inverse + 3 * (size_t)f, error);
	}
	return status;
}

enum tw_status strain_rest_from_worn(struct strain_rest *rest, struct arena *arena, const struct garment *garment,
				     struct tw_error *error)
{
	enum tw_status status = rest_init(rest, arena, garment, error);
	for (uint32_t f = 0; status == TW_OK && f < rest->face_count; f++) {
		const uint32_t *c = rest->corner + 3 * (size_t)f;
		const double *x = garment->position;
		struct sides sides;
		for (size_t d = 0; d < 3; d++) {
			sides.first[d] = x[3 * (size_t)c[1] + d] - x[3 * (size_t)c[0] + d];
			sides.second[d] = x[3 * (size_t)c[2] + d] - x[3 * (size_t)c[0] + d];
		}
		status = invert_sides(&sides, garment, f, rest->inverse + 3 * (size_t)f, error);
	}
	return status;
}

enum tw_status strain_rest_from_frame(struct strain_rest *rest, struct arena *arena, const struct garment *garment,
				      const float *position, struct tw_error *error)
{
	enum tw_status status = rest_init(rest, arena, garment, error);
	for (uint32_t f = 0; status == TW_OK && f < rest->face_count; f++) {
		const uint32_t *c = rest->corner + 3 * (size_t)f;
		struct sides sides;
		for (size_t d = 0; d < 3; d++) {
			double origin = position[3 * (size_t)c[0] + d];
			sides.first[d] = position[3 * (size_t)c[1] + d] - origin;
			sides.second[d] = position[3 * (size_t)c[2] + d] - origin;
		}
		status = invert_sides(&sides, garment, f, rest->inverse + 3 * (size_t)f, error);
	}
	return status;
}

/* Faces, one a lane. */
struct lane_faces {
	_Alignas(64) float first[3][LANES], second[3][LANES], inverse[3][LANES];
};

static inline __attribute__((always_inline)) void fill_lane(struct lane_faces *faces, const struct strain_rest *rest,
							    const float *position, uint32_t face, uint32_t lane)
{
	const uint32_t *corner = rest->corner + 3 * (size_t)face;
	const float *p = position + 3 * (size_t)corner[0];
	const float *q = position + 3 * (size_t)corner[1];
	const float *r = position + 3 * (size_t)corner[2];
	for (size_t d = 0; d < 3; d++) {
		faces->first[d][lane] = q[d] - p[d];
		faces->second[d][lane] = r[d] - p[d];
		faces->inverse[d][lane] = rest->inverse[3 * (size_t)face + d];
	}
}

CLONES void strain_density(const struct strain_rest *rest, enum strain_model model, const float *position,
			   double *density)
{
	struct lane_faces faces = {0};
	for (uint32_t face = 0; face < rest->face_count; face += LANES) {
		uint32_t lanes = rest->face_count - face < LANES ? rest->face_count - face : LANES;
		for (uint32_t l = 0; l < lanes; l++)
			fill_lane(&faces, rest, position, face + l, l);
		float energy[STRAIN_MODELS][LANES];
		for (int l = 0; l < LANES; l++) {
			float first[3] = {faces.first[0][l], faces.first[1][l], faces.first[2][l]};
			float second[3] = {faces.second[0][l], faces.second[1][l], faces.second[2][l]};
			float inverse[3] = {faces.inverse[0][l], faces.inverse[1][l], faces.inverse[2][l]};
			struct invariants i = side_invariants(first, second, inverse);
			struct energies e = densities(i.t, i.r2);
			for (int m = 0; m < STRAIN_MODELS; m++)
				energy[m][l] = e.model[m];
		}
		for (uint32_t l = 0; l < lanes; l++)
			density[face + l] = (double)energy[model][l];
	}
}

/* What is not a number stays: the field refuses it, and names the face. */
void strain_raise(double *density, const double *mean, uint32_t face_count)
{
	for (uint32_t f = 0; f < face_count; f++)
		density[f] = mean[f] <= density[f] || density[f] != density[f] ? density[f] : mean[f];
}

void strain_worst(const double *const *mean, size_t motion_count, uint32_t face_count, double *density)
{
	memset(density, 0, face_count * sizeof *density);
	for (size_t m = 0; m < motion_count; m++)
		strain_raise(density, mean[m], face_count);
}
