/* Angles by series: an angle is first halved until the series converges in a few terms, then doubled back. */
#include "solver/curve/vector.h"

enum { HALVINGS = 5 };

struct vec2 vec2_of_angle(double angle)
{
	double x = angle / (1 << HALVINGS), square = x * x;
	double sine = x * (1 - square / 6 * (1 - square / 20 * (1 - square / 42 * (1 - square / 72))));
	double cosine = 1 - square / 2 * (1 - square / 12 * (1 - square / 30 * (1 - square / 56 * (1 - square / 90))));
	struct vec2 turn = {cosine, sine};
	for (int i = 0; i < HALVINGS; i++)
		turn = vec2_rotate(turn, turn);
	return vec2_unit(turn);
}

double vec2_angle(struct vec2 a, struct vec2 b)
{
	struct vec2 turn = vec2_unit((struct vec2){vec2_dot(a, b), vec2_cross(a, b)});
	double sign = turn.y < 0 ? -1 : 1;
	turn.y *= sign;
	/* Half angles: tan(t/2) = sin / (1 + cos), written so that it holds near pi too. */
	double factor = 1;
	for (int i = 0; i < HALVINGS; i++) {
		turn = i == 0 && turn.x < 0 ? vec2_unit((struct vec2){turn.y, 1 - turn.x})
					    : vec2_unit((struct vec2){1 + turn.x, turn.y});
		factor *= 2;
	}
	double t = turn.y / turn.x, square = t * t, sum = 0;
	for (int k = 12; k >= 0; k--)
		sum = 1.0 / (2 * k + 1) - square * sum;
	return sign * factor * t * sum;
}

double vec2_nearest(struct vec2 a, struct vec2 b, struct vec2 p)
{
	struct vec2 d = vec2_sub(b, a);
	double square = vec2_dot(d, d);
	double t = square > 0 ? vec2_dot(vec2_sub(p, a), d) / square : 0;
	return t < 0 ? 0 : t > 1 ? 1 : t;
}
