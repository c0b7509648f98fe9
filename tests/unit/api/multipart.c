/* The form parser gives the same parts however the body is cut. The oracle looks at the whole body with memmem. */
#include "api/multipart.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define CONTENT_TYPE "multipart/form-data; boundary=\"--cut here\""
#define BOUNDARY "--cut here"

/* Everything the sink was told, as one text: "[name|file|type:data]". */
struct heard {
	char text[8192];
	size_t size;
	int refuse_after; /* calls; -1 never */
};

static enum tw_status count_call(struct heard *heard)
{
	return heard->refuse_after-- == 0 ? TW_ERROR_FULL : TW_OK;
}

static void append(struct heard *heard, const void *bytes, size_t size)
{
	assert_true(heard->size + size <= sizeof heard->text);
	memcpy(heard->text + heard->size, bytes, size);
	heard->size += size;
}

static enum tw_status hear_begin(void *context, const struct multipart_part *part, struct tw_error *error)
{
	char line[512];
	(void)error;
	int size = snprintf(line, sizeof line, "[%s|%s|%s:", part->name, part->file_name, part->media_type);
	append(context, line, (size_t)size);
	return count_call(context);
}

static enum tw_status hear_data(void *context, const void *bytes, size_t size, struct tw_error *error)
{
	(void)error;
	append(context, bytes, size);
	return count_call(context);
}

static enum tw_status hear_end(void *context, struct tw_error *error)
{
	(void)error;
	append(context, "]", 1);
	return count_call(context);
}

static enum tw_status parse(struct heard *heard, const char *body, size_t size, size_t step)
{
	struct multipart multipart;
	struct tw_error error = {0};
	heard->size = 0;
	assert_int_equal(multipart_init(&multipart, CONTENT_TYPE,
					(struct multipart_sink){hear_begin, hear_data, hear_end, heard}, &error),
			 TW_OK);
	for (size_t at = 0; at < size; at += step) {
		enum tw_status status =
			multipart_feed(&multipart, body + at, step < size - at ? step : size - at, &error);
		if (status)
			return status;
	}
	return multipart_finish(&multipart, &error);
}

static void expect(const char *body, size_t size, const char *parts, size_t parts_size)
{
	static struct heard heard;
	for (size_t step = 1; step <= size; step++) {
		heard.refuse_after = -1;
		assert_int_equal(parse(&heard, body, size, step), TW_OK);
		assert_int_equal(heard.size, parts_size);
		assert_memory_equal(heard.text, parts, parts_size);
	}
}

#define EXPECT(body, parts) expect(body, sizeof(body) - 1, parts, sizeof(parts) - 1)

static void parts_are_the_same_however_the_body_is_cut(void **state)
{
	(void)state;
	EXPECT("--" BOUNDARY "\r\nContent-Disposition: form-data; name=\"worn\"; filename=\"suit.obj\"\r\n"
	       "Content-Type: model/obj\r\n\r\nv 0 0 0\r\n\r\n--" BOUNDARY
	       "\r\ncontent-disposition:form-data;name=pattern\r\n\r\n\0\r\n--" BOUNDARY "--\r\n",
	       "[worn|suit.obj|model/obj:v 0 0 0\r\n][pattern||:\0]");
}

static void what_only_begins_like_a_boundary_is_data(void **state)
{
	(void)state;
	EXPECT("--" BOUNDARY "\r\nContent-Disposition: form-data; name=a\r\n\r\n"
	       "\r\r\n\r\n-\r\n--\r\n--"
	       "--cut her"
	       "\r\n--"
	       "--cut her\r\n--" BOUNDARY "--",
	       "[a||:\r\r\n\r\n-\r\n--\r\n--"
	       "--cut her"
	       "\r\n--"
	       "--cut her]");
}

static void preamble_and_epilogue_are_ignored(void **state)
{
	(void)state;
	EXPECT("This is MIME.\r\n--" BOUNDARY
	       " \t\r\nX: y\r\nContent-Disposition: form-data; name=a\r\n\r\n\r\n--" BOUNDARY "--\r\n--" BOUNDARY
	       "\r\nwhat is this",
	       "[a||:]");
}

static void a_random_body_comes_out_as_it_is(void **state)
{
	static const char letters[] = "\r\n-cut hereX";
	static char body[4096], parts[4096];
	(void)state;
	srand(7);
	for (int round = 0; round < 300; round++) {
		char data[200];
		size_t size = (size_t)rand() % sizeof data;
		for (size_t i = 0; i < size; i++)
			data[i] = letters[(size_t)rand() % (sizeof letters - 1)];
		if (memmem(data, size, "\r\n--" BOUNDARY, strlen(BOUNDARY) + 4))
			continue;
		size_t used = (size_t)snprintf(body, sizeof body,
					       "--" BOUNDARY "\r\nContent-Disposition: form-data; name=a\r\n\r\n");
		memcpy(body + used, data, size);
		used += size;
		used += (size_t)snprintf(body + used, sizeof body - used, "\r\n--" BOUNDARY "--\r\n");
		size_t expected = (size_t)snprintf(parts, sizeof parts, "[a||:");
		memcpy(parts + expected, data, size);
		expected += size;
		parts[expected++] = ']';
		expect(body, used, parts, expected);
	}
}

static void a_malformed_body_is_refused(void **state)
{
	static struct heard heard;
	(void)state;
	const char *bad[] = {
		"",
		"hello",
		"--" BOUNDARY,
		"--" BOUNDARY "xx",
		"--" BOUNDARY "\r\n\r\nno name\r\n--" BOUNDARY "--",
		"--" BOUNDARY "\r\nContent-Disposition: attachment; name=a\r\n\r\n\r\n--" BOUNDARY "--",
		"--" BOUNDARY "\r\nContent-Disposition: form-data; name=a\r\n\r\nno end",
		"--" BOUNDARY "\r\nContent-Disposition: form-data; name=a\r\n\r\nx\r\n--" BOUNDARY "\r\n",
	};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		for (size_t step = 1; step < 100; step += 7) {
			heard.refuse_after = -1;
			assert_int_equal(parse(&heard, bad[i], strlen(bad[i]), step), TW_ERROR_INPUT);
		}
}

static void headers_of_a_part_are_bounded(void **state)
{
	static char body[3 * MULTIPART_HEADER_MAX];
	static struct heard heard = {.refuse_after = -1};
	(void)state;
	memset(body, 'x', sizeof body);
	memcpy(body, "--" BOUNDARY "\r\n", strlen(BOUNDARY) + 4);
	assert_int_equal(parse(&heard, body, sizeof body, 100), TW_ERROR_INPUT);
}

static void an_error_of_the_sink_ends_the_parser(void **state)
{
	static struct heard heard;
	const char *body = "--" BOUNDARY "\r\nContent-Disposition: form-data; name=a\r\n\r\ndata\r\n--" BOUNDARY "--";
	(void)state;
	for (int call = 0; call < 3; call++) {
		heard.refuse_after = call;
		assert_int_equal(parse(&heard, body, strlen(body), strlen(body)), TW_ERROR_FULL);
	}
}

static void a_form_needs_a_boundary(void **state)
{
	struct multipart multipart;
	struct tw_error error = {0};
	(void)state;
	const char *bad[] = {
		"multipart/form-data", "multipart/form-data; boundary=", "multipart/form-data; boundary=\"\"",
		"multipart/form-data; boundary=0123456789012345678901234567890123456789012345678901234567890123456"
		"789x"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		assert_int_equal(multipart_init(&multipart, bad[i], (struct multipart_sink){0}, &error),
				 TW_ERROR_INPUT);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(parts_are_the_same_however_the_body_is_cut),
		cmocka_unit_test(what_only_begins_like_a_boundary_is_data),
		cmocka_unit_test(preamble_and_epilogue_are_ignored),
		cmocka_unit_test(a_random_body_comes_out_as_it_is),
		cmocka_unit_test(a_malformed_body_is_refused),
		cmocka_unit_test(headers_of_a_part_are_bounded),
		cmocka_unit_test(an_error_of_the_sink_ends_the_parser),
		cmocka_unit_test(a_form_needs_a_boundary),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
