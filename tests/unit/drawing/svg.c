/* A drawing read back from its SVG by a reader of path data that knows nothing of the writer. */
#include "solver/drawing/svg.h"

#include <limits.h>
#include <locale.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tests/oracle/meshes.h"

static const struct drawing_style line_style = {.name = "line", .stroke = "#000000", .stroke_mm = 0.5};
static const struct drawing_style text_style = {.name = "text", .fill = "#ff0000"};

/* The drawing's SVG, which lies in the arena. */
static const char *write(struct arena *arena, struct drawing *drawing)
{
	static const char *bytes;
	struct text text = {0};
	size_t size;
	svg_write(drawing, &text);
	assert_int_equal(text_take(&text, arena, &bytes, &size, NULL), TW_OK);
	return bytes;
}

/* The centre of an SVG arc, as the standard's appendix has it (F.6.5), for circles without rotation. */
static void arc_centre(double x1, double y1, double r, int large, int sweep, double x2, double y2, double c[2])
{
	double dx = (x1 - x2) / 2, dy = (y1 - y2) / 2, square = dx * dx + dy * dy;
	double root = sqrt(fmax(0, (r * r - square) / square)) * (large == sweep ? -1 : 1);
	c[0] = root * dy + (x1 + x2) / 2;
	c[1] = -root * dx + (y1 + y2) / 2;
}

static void arcs_come_back_where_they_were(void **state)
{
	(void)state;
	for (int k = -11; k <= 11; k++) {
		double turn = k * 0.5, radius = 40, x1, y1, x2, y2, r, r2, centre[2];
		int large, sweep;
		if (k == 0)
			continue;
		struct arena *arena = arena_new(0);
		struct drawing drawing = {
			.arena = arena, .title = "t", .width = 300, .height = 200, .true_scale = true, .decimals = 3};
		struct vec2 from = {150, 60}, middle = {150, 60 + (turn > 0 ? radius : -radius)};
		struct vec2 to = vec2_add(middle, vec2_rotate(vec2_sub(from, middle), vec2_of_angle(turn)));
		drawing_begin_layer(&drawing, "layer", "layer");
		struct drawing_item *path = drawing_add_path(&drawing, &line_style, DRAWING_NONE, false);
		drawing_move_to(&drawing, path, from);
		drawing_arc_to(&drawing, path, to, turn);
		const char *svg = write(arena, &drawing), *data = strstr(svg, " d=\"");
		assert_int_equal(sscanf(data, " d=\"M%lf %lfA%lf %lf 0 %d %d %lf %lf\"", &x1, &y1, &r, &r2, &large,
					&sweep, &x2, &y2),
				 8);
		arc_centre(x1, y1, r, large, sweep, x2, y2, centre);
		assert_true(fabs(x1 - from.x) < 1e-3 && fabs(200 - y1 - from.y) < 1e-3);
		assert_true(fabs(x2 - to.x) < 1e-3 && fabs(200 - y2 - to.y) < 1e-3);
		/* The nearer to a half turn, the less the ends say of the centre. */
		assert_true(fabs(centre[0] - middle.x) < 0.05 && fabs(200 - centre[1] - middle.y) < 0.05);
		/* Upwards is downwards in SVG: to the left, positive, is sweep 0. */
		assert_int_equal(sweep, turn < 0);
		assert_int_equal(large, fabs(turn) > M_PI);
		arena_free(arena);
	}
}

static void layers_styles_and_texts_are_all_there(void **state)
{
	(void)state;
	struct arena *arena = arena_new(0);
	struct drawing drawing = {.arena = arena, .title = "a & b", .width = 100.5, .height = 50, .decimals = 2};
	drawing_begin_layer(&drawing, "first", "First");
	drawing_add_line(&drawing, &line_style, 0, (struct vec2){1, 2}, (struct vec2){3, 4});
	drawing_add_line(&drawing, &line_style, 0, (struct vec2){5, 6}, (struct vec2){7, 8});
	const struct drawing_text text = {.at = {10, 20}, .size_mm = 5, .anchor = DRAWING_END, .text = "<\"ü\">"};
	drawing_set_title(drawing_add_circle(&drawing, &text_style, 1, (struct vec2){1.005, 49}, 2), "'dot'");
	drawing_add_text(&drawing, &text_style, 1, &text);
	drawing_begin_layer(&drawing, "second", "Second");
	const char *svg = write(arena, &drawing);
	assert_non_null(strstr(svg, " viewBox=\"0 0 100.5 50\""));
	assert_null(strstr(svg, "mm\""));
	assert_non_null(strstr(svg, "<title>a &amp; b</title>"));
	assert_non_null(strstr(svg, "<g id=\"first\" inkscape:groupmode=\"layer\" inkscape:label=\"First\">\n"
				    "<g class=\"line\" fill=\"none\" stroke=\"#000000\" stroke-linejoin=\"round\" "
				    "stroke-width=\"0.5\">\n<path d=\"M1 48L3 46\"/>\n<path d=\"M5 44L7 42\"/>\n</g>\n"
				    "<g class=\"text\" fill=\"#ff0000\" fill-rule=\"evenodd\">\n"));
	assert_non_null(strstr(svg, "cy=\"1\" r=\"2\"><title>&#39;dot&#39;</title></circle>"));
	assert_non_null(strstr(svg, "<text x=\"10\" y=\"30\" font-size=\"5\" text-anchor=\"end\">"
				    "&lt;&quot;ü&quot;&gt;</text>\n</g>\n</g>\n<g id=\"second\""));
	arena_free(arena);
}

static void a_failure_sticks(void **state)
{
	(void)state;
	struct arena *arena = arena_new(200000);
	struct drawing drawing = {.arena = arena, .title = "t", .width = 1, .height = 1};
	drawing_begin_layer(&drawing, "layer", "layer");
	struct drawing_item *path = drawing_add_path(&drawing, &line_style, DRAWING_NONE, false);
	drawing_move_to(&drawing, path, (struct vec2){0, 0});
	for (int i = 0; i < 100000 && !drawing.failed; i++)
		drawing_line_to(&drawing, path, (struct vec2){i, 0});
	assert_true(drawing.failed);
	struct text text = {0};
	svg_write(&drawing, &text);
	assert_true(text.failed);
	text_clear(&text);
	arena_free(arena);
}

/* The C library's digits, without the zeros behind. */
static void numbers_are_rounded_as_printf_does(void **state)
{
	(void)state;
	static const double special[] = {0,      -0.0,  0.5,      1.5,      -0.004, 0.0005, 999.9995, 1e9,
					 -1e-12, 1e300, 123456.5, 0.000001, 1e15,   1e16,   2.675};
	uint64_t random = 3;
	for (int i = 0; i < 20000; i++) {
		char expected[400];
		int decimals = i % 10;
		double scale = pow(10, i % 13 - 4), value = (mesh_random(&random) - 0.5) * scale;
		if (i < 10 * (int)(sizeof special / sizeof *special))
			value = special[i / 10];
		struct text text = {0};
		text_number(&text, value, decimals);
		snprintf(expected, sizeof expected, "%.*f", decimals, value);
		size_t length = strlen(expected);
		while (decimals && expected[length - 1] == '0')
			length--;
		length -= decimals && expected[length - 1] == '.';
		expected[length] = 0;
		assert_string_equal(text.bytes, strcmp(expected, "-0") != 0 ? expected : "0");
		text_clear(&text);
	}
	struct text text = {0};
	text_integer(&text, 0);
	text_integer(&text, -70);
	text_integer(&text, LONG_MIN);
	assert_string_equal(text.bytes, "0-70-9223372036854775808");
	text_clear(&text);
}

static void numbers_have_a_point_in_every_locale(void **state)
{
	(void)state;
	static const char *const locales[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "ps_AF.UTF-8", "de_DE", "ru_RU.UTF-8"};
	bool tried = false;
	for (size_t i = 0; i < sizeof locales / sizeof *locales; i++) {
		if (!setlocale(LC_NUMERIC, locales[i]))
			continue;
		struct text text = {0};
		tried = true;
		text_number(&text, -1234.5625, 3);
		text_add(&text, " ");
		text_number(&text, 17, 3);
		setlocale(LC_NUMERIC, "C");
		assert_string_equal(text.bytes, "-1234.562 17");
		text_clear(&text);
	}
	if (!tried)
		skip();
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(arcs_come_back_where_they_were),
		cmocka_unit_test(layers_styles_and_texts_are_all_there),
		cmocka_unit_test(a_failure_sticks),
		cmocka_unit_test(numbers_are_rounded_as_printf_does),
		cmocka_unit_test(numbers_have_a_point_in_every_locale),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
