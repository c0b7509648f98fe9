/* What a URL says of a serial line. */
#include "service/rig/line.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static void check(const char *place, const char *path, int baud, char parity, int data_bits, int stop_bits)
{
	struct rig_line line;
	struct tw_error error;
	assert_int_equal(rig_line_parse(place, &line, &error), TW_OK);
	assert_string_equal(line.path, path);
	assert_int_equal(line.baud, baud);
	assert_int_equal(line.parity, parity);
	assert_int_equal(line.data_bits, data_bits);
	assert_int_equal(line.stop_bits, stop_bits);
}

static void what_is_left_out_is_as_modbus_has_it(void **state)
{
	(void)state;
	check("/dev/ttyUSB0", "/dev/ttyUSB0", 115200, 'E', 8, 1);
	check("/dev/ttyUSB0?baud=57600", "/dev/ttyUSB0", 57600, 'E', 8, 1);
	check("/dev/ttyS1?stop=2&parity=none", "/dev/ttyS1", 115200, 'N', 8, 2);
	check("/dev/serial/by-id/a?parity=odd&data=7&stop=1&baud=9600", "/dev/serial/by-id/a", 9600, 'O', 7, 1);
	check("/dev/x?parity=even", "/dev/x", 115200, 'E', 8, 1);
}

static void what_no_line_has_is_refused_with_its_place(void **state)
{
	(void)state;
	static const struct {
		const char *place, *named;
	} cases[] = {
		{"", "names no line"},
		{"/dev/x?", "none of baud"},
		{"?baud=9600", "names no line"},
		{"/dev/x?baud=9", "baud=9"},
		{"/dev/x?baud=115201", "baud=115201"},
		{"/dev/x?baud=", "baud="},
		{"/dev/x?baud=9600x", "baud=9600x"},
		{"/dev/x?baud=-9600", "baud=-9600"},
		{"/dev/x?baud=99999999999999999999", "baud=99999"},
		{"/dev/x?parity=E", "parity=E"},
		{"/dev/x?parity=", "parity="},
		{"/dev/x?parity=evenly", "parity=evenly"},
		{"/dev/x?data=9", "data=9"},
		{"/dev/x?data=6", "data=6"},
		{"/dev/x?stop=0", "stop=0"},
		{"/dev/x?stop=3", "stop=3"},
		{"/dev/x?speed=9600", "speed=9600"},
		{"/dev/x?baud=9600&", "none of baud"},
		{"/dev/x?baud=9600?parity=odd", "baud=9600?parity=odd"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct rig_line line;
		struct tw_error error;
		assert_int_equal(rig_line_parse(cases[i].place, &line, &error), TW_ERROR_INPUT);
		assert_string_equal(error.type, "rig-device");
		assert_non_null(strstr(error.text, cases[i].named));
		assert_non_null(strstr(error.text, "device must be"));
	}
}

static void a_path_that_is_too_long_is_refused(void **state)
{
	(void)state;
	char place[400];
	struct rig_line line;
	struct tw_error error;
	memset(place, 'x', sizeof place);
	place[255] = '\0';
	assert_int_equal(rig_line_parse(place, &line, &error), TW_OK);
	place[255] = 'x';
	place[256] = '\0';
	assert_int_equal(rig_line_parse(place, &line, &error), TW_ERROR_INPUT);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_left_out_is_as_modbus_has_it),
		cmocka_unit_test(what_no_line_has_is_refused_with_its_place),
		cmocka_unit_test(a_path_that_is_too_long_is_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
