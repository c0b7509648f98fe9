/* The energy densities of a face, written once for one face a lane and for one frame a lane. Elementwise IEEE
 * operations in a fixed order: how many lanes a machine takes at once does not show. */
#ifndef SOLVER_FIELD_DENSITY_H
#define SOLVER_FIELD_DENSITY_H

#include "solver/field/options.h"

#include <math.h>

/* The fabric of the paper's suit: 82 % nylon, 18 % polyester. */
#define STRAIN_YOUNG_MPA 5.4
#define STRAIN_POISSON 0.33
#define STRAIN_MU (STRAIN_YOUNG_MPA / (2 * (1 + STRAIN_POISSON)))
#define STRAIN_LAMBDA (STRAIN_YOUNG_MPA * STRAIN_POISSON / ((1 + STRAIN_POISSON) * (1 - 2 * STRAIN_POISSON)))
/* The modulus of a pull that may contract across itself as it likes. */
#define STRAIN_UNIAXIAL (4 * STRAIN_MU * (STRAIN_MU + STRAIN_LAMBDA) / (2 * STRAIN_MU + STRAIN_LAMBDA))

/* What all three densities of a face are made of. With C = F^T F: t = tr(C - I), r2 = the squared difference of the
 * eigenvalues of C. */
struct invariants {
	float t, r2;
};

/* From the two sides of a face in a frame, and its rest shape. */
static inline __attribute__((always_inline)) struct invariants
side_invariants(const float first[3], const float second[3], const float inverse[3])
{
	float f1x = first[0] * inverse[0], f2x = first[0] * inverse[1] + second[0] * inverse[2];
	float f1y = first[1] * inverse[0], f2y = first[1] * inverse[1] + second[1] * inverse[2];
	float f1z = first[2] * inverse[0], f2z = first[2] * inverse[1] + second[2] * inverse[2];
	float c11 = f1x * f1x + f1y * f1y + f1z * f1z - 1;
	float c22 = f2x * f2x + f2y * f2y + f2z * f2z - 1;
	float c12 = f1x * f2x + f1y * f2y + f1z * f2z;
	float d = c11 - c22, s = c12 + c12;
	return (struct invariants){c11 + c22, d * d + s * s};
}

struct energies {
	float model[STRAIN_MODELS];
};

/* The principal strains are (t + r) / 4 and (t - r) / 4, so that |G|_F^2 = (t^2 + r^2) / 8 and |G|_2 = (|t| + r) / 4.
 * The smaller principal stress 2 mu (t - r) / 4 + lambda t / 2 pulls where (mu + lambda) t > mu r; elsewhere the cloth
 * wrinkles, and `tension` keeps what a pull by the larger strain alone costs. */
static inline __attribute__((always_inline)) struct energies densities(float t, float r2)
{
	const float stvk_t = (float)(STRAIN_MU / 8 + STRAIN_LAMBDA / 8), stvk_r = (float)(STRAIN_MU / 8);
	const float printed_s = (float)(STRAIN_MU / 4), printed_t = (float)(STRAIN_LAMBDA / 4);
	const float pull_t = (float)(STRAIN_MU + STRAIN_LAMBDA), pull_r = (float)STRAIN_MU;
	const float tension_h = (float)(STRAIN_UNIAXIAL / 32);
	float r = sqrtf(r2);
	float high = t + r > 0 ? t + r : 0;
	float stvk = stvk_t * (t * t) + stvk_r * r2;
	float printed = printed_s * (fabsf(t) + r) + printed_t * t;
	return (struct energies){{
		[STRAIN_STVK] = stvk,
		[STRAIN_PRINTED] = printed > 0 ? printed : 0,
		[STRAIN_TENSION] = pull_t * t > pull_r * r ? stvk : tension_h * (high * high),
	}};
}

#endif
