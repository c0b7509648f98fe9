/* No figure and no curve depends on how a file numbers its vertices, pattern positions, faces, corners and pieces, nor
 * on the order of the terminals: the same suit is written down in another order, goes the whole way from frames to
 * layout.json, and every number of it must be the same, but for those that are numbers of things. */
#include "solver/field/field.h"
#include "solver/field/means.h"
#include "solver/garment/import.h"
#include "solver/layout/layout.h"
#include "solver/motion/motion.h"
#include "solver/sample/sample.h"
#include "tests/oracle/meshes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { MOTIONS = 2, FRAMES = 5, TERMINALS = 12 };

/* What is put in another order. */
enum shuffle { VERTICES = 1, COORDS = 2, FACES = 4, CORNERS = 8, PIECES = 16, ORDER = 32, ALL = 63 };

struct suit {
	struct arena *arena;
	struct garment garment;
	struct topology topology;
	struct field field;
	double *mean[MOTIONS];
	char *motion[MOTIONS]; /* PC2 bytes */
	size_t motion_size[MOTIONS];
	struct byte_memory memory;
	uint32_t *vertex_to, *face_to; /* where those of the first suit are */
	uint8_t *turn;                 /* by how much the corners of a face of the first suit were turned */
	json_t *json;
};

static uint32_t *permutation(struct arena *arena, uint32_t count, bool shuffled, uint64_t *random)
{
	uint32_t *to = ARENA_ARRAY(arena, count, uint32_t);
	assert_non_null(to);
	for (uint32_t i = 0; i < count; i++)
		to[i] = i;
	for (uint32_t i = count; shuffled && i-- > 1;) {
		uint32_t j = (uint32_t)(mesh_random(random) * (i + 1.0)), swap = to[i];
		to[i] = to[j];
		to[j] = swap;
	}
	return to;
}

/* Writes `from` down in another order. */
static void shuffle(struct suit *suit, const struct garment *from, unsigned what, uint64_t seed)
{
	struct garment *g = &suit->garment;
	uint64_t random = seed;
	suit->arena = arena_new(0);
	*g = *from;
	g->position = ARENA_ARRAY(suit->arena, 3 * (size_t)g->vertex_count, double);
	g->pattern = ARENA_ARRAY(suit->arena, 2 * (size_t)g->coord_count, double);
	g->face_vertex = ARENA_ARRAY(suit->arena, 3 * (size_t)g->face_count, uint32_t);
	g->face_coord = ARENA_ARRAY(suit->arena, 3 * (size_t)g->face_count, uint32_t);
	g->face_piece = ARENA_ARRAY(suit->arena, g->face_count, uint32_t);
	g->piece_name = ARENA_ARRAY(suit->arena, g->piece_count, char *);
	suit->vertex_to = permutation(suit->arena, g->vertex_count, what & VERTICES, &random);
	suit->face_to = permutation(suit->arena, g->face_count, what & FACES, &random);
	suit->turn = ARENA_ZEROED(suit->arena, g->face_count, uint8_t);
	uint32_t *coord_to = permutation(suit->arena, g->coord_count, what & COORDS, &random);
	uint32_t *piece_to = permutation(suit->arena, g->piece_count, what & PIECES, &random);
	for (uint32_t v = 0; v < g->vertex_count; v++)
		memcpy(g->position + 3 * (size_t)suit->vertex_to[v], from->position + 3 * (size_t)v,
		       3 * sizeof(double));
	for (uint32_t c = 0; c < g->coord_count; c++)
		memcpy(g->pattern + 2 * (size_t)coord_to[c], from->pattern + 2 * (size_t)c, 2 * sizeof(double));
	for (uint32_t p = 0; p < g->piece_count; p++)
		g->piece_name[piece_to[p]] = from->piece_name[p];
	for (uint32_t f = 0; f < g->face_count; f++) {
		size_t to = suit->face_to[f];
		suit->turn[f] = what & CORNERS ? (uint8_t)(3 * mesh_random(&random)) : 0;
		g->face_piece[to] = piece_to[from->face_piece[f]];
		for (size_t k = 0; k < 3; k++) {
			size_t corner = 3 * to + (k + suit->turn[f]) % 3;
			g->face_vertex[corner] = suit->vertex_to[from->face_vertex[3 * (size_t)f + k]];
			g->face_coord[corner] = coord_to[from->face_coord[3 * (size_t)f + k]];
		}
	}
}

/* Where a point of the worn suit is in a frame: the body bends and swells. */
static void move(const double x[3], int motion, int frame, float out[3])
{
	double t = (frame + 1.0) / FRAMES, bend = (motion ? 0.0009 : 0.0004) * t;
	out[0] = (float)(x[0] * (1 + 0.1 * t * sin(x[1] / 90)));
	out[1] = (float)(x[1] * (1 + (motion ? 0.05 : -0.03) * t) + 20 * t * cos(x[0] / 60));
	out[2] = (float)(x[2] + bend * x[1] * x[1] / 4 + 15 * t * sin(x[1] / 150 + motion));
}

/* Recorded frames of the first suit, [frames][vertex_count][3]; made up where there are none. */
struct recording {
	const float *frames;
	uint32_t count;
};

static void take_recordings(struct suit *suit, const struct recording *recording)
{
	const struct garment *g = &suit->garment;
	size_t floats = 3 * (size_t)g->vertex_count;
	for (int m = 0; m < MOTIONS; m++) {
		suit->motion_size[m] = PC2_HEADER_BYTES + recording[m].count * floats * sizeof(float);
		suit->motion[m] = malloc(suit->motion_size[m]);
		assert_non_null(suit->motion[m]);
		float *out = (float *)(void *)(suit->motion[m] +
					       pc2_write_header(suit->motion[m], g->vertex_count, recording[m].count));
		for (uint32_t j = 0; j < recording[m].count; j++)
			for (size_t v = 0; v < g->vertex_count; v++)
				memcpy(out + j * floats + 3 * (size_t)suit->vertex_to[v],
				       recording[m].frames + j * floats + 3 * v, 3 * sizeof(float));
	}
}

static void make_motions(struct suit *suit)
{
	const struct garment *g = &suit->garment;
	size_t floats = 3 * (size_t)g->vertex_count;
	for (int m = 0; m < MOTIONS; m++) {
		suit->motion_size[m] = PC2_HEADER_BYTES + FRAMES * floats * sizeof(float);
		suit->motion[m] = malloc(suit->motion_size[m]);
		assert_non_null(suit->motion[m]);
		float *out =
			(float *)(void *)(suit->motion[m] + pc2_write_header(suit->motion[m], g->vertex_count, FRAMES));
		for (int j = 0; j < FRAMES; j++)
			for (size_t v = 0; v < g->vertex_count; v++, out += 3)
				move(g->position + 3 * v, m, j, out);
	}
}

static enum tw_status open_frames(void *context, uint32_t motion, struct motion_reader **reader, struct tw_error *error)
{
	struct suit *suit = context;
	suit->memory = (struct byte_memory){.bytes = suit->motion[motion], .size = suit->motion_size[motion]};
	struct byte_source source = byte_source_memory(&suit->memory);
	return motion_open(reader, &source, MOTION_SNIFF, UNIT_MM, suit->garment.vertex_count, error);
}

static enum tw_status take_mean(void *context, uint32_t motion, double *density, struct tw_error *error)
{
	const struct suit *suit = context;
	(void)error;
	memcpy(density, suit->mean[motion], suit->garment.face_count * sizeof *density);
	return TW_OK;
}

static void make_field(struct suit *suit, const struct field_options *options)
{
	struct tw_error error = {0};
	assert_int_equal(topology_build(&suit->topology, suit->arena, &suit->garment, NULL), TW_OK);
	for (uint32_t m = 0; m < MOTIONS; m++) {
		struct motion_reader *reader = NULL;
		struct means_report report = {0};
		double *means[STRAIN_MODELS] = {0};
		suit->mean[m] = means[options->energy] = ARENA_ARRAY(suit->arena, suit->garment.face_count, double);
		assert_int_equal(open_frames(suit, m, &reader, &error), TW_OK);
		if (means_of_motion(means, &report, suit->arena, &suit->garment, reader, options, NULL, NULL, &error))
			fail_msg("%s: %s", error.where, error.text);
		motion_close(reader);
	}
	assert_int_equal(field_compute(&suit->field, suit->arena, &suit->garment, &suit->topology,
				       (const double *const *)suit->mean, MOTIONS, options, 1, NULL),
			 TW_OK);
}

/* Vertices, points in faces and on their sides, points in space and on the pattern, in the numbers of this suit. */
static json_t *terminal_of(const struct suit *suit, const struct garment *first, uint32_t index)
{
	uint32_t face = (index + 1) * 149 % first->face_count;
	char name[16];
	snprintf(name, sizeof name, "t%u", index);
	const double inside[3] = {0.25, 0.5, 0.25}, side[3] = {0, 0.375, 0.625};
	const double *given = index % 5 == 1 ? inside : side;
	double turned[3], point[3] = {0}, uv[2] = {0};
	for (size_t k = 0; k < 3; k++) {
		size_t corner = 3 * (size_t)face + k;
		turned[(k + suit->turn[face]) % 3] = given[k];
		for (size_t d = 0; d < 3; d++)
			point[d] += inside[k] * first->position[3 * (size_t)first->face_vertex[corner] + d];
		for (size_t d = 0; d < 2; d++)
			uv[d] += inside[k] * first->pattern[2 * (size_t)first->face_coord[corner] + d];
	}
	switch (index % 5) {
	case 0:
		return json_pack("{s:s, s:i}", "name", name, "vertex",
				 (int)suit->vertex_to[first->face_vertex[3 * (size_t)face]]);
	case 1:
	case 2:
		return json_pack("{s:s, s:i, s:[f, f, f]}", "name", name, "face", (int)suit->face_to[face],
				 "barycentric", turned[0], turned[1], turned[2]);
	case 3:
		return json_pack("{s:s, s:[f, f, f]}", "name", name, "point_mm", point[0], point[1], point[2]);
	default:
		return json_pack("{s:s, s:s, s:[f, f]}", "name", name, "piece",
				 first->piece_name[first->face_piece[face]], "uv_mm", uv[0], uv[1]);
	}
}

static void lay_out(struct suit *suit, const struct garment *first, const char *options, const uint32_t *order,
		    uint32_t terminals)
{
	static const char *const names[MOTIONS] = {"bend", "swell"};
	json_t *object = json_pack("{s:o, s:o}", "terminals", json_array(), "options", json_loads(options, 0, NULL));
	for (uint32_t i = 0; i < terminals; i++)
		json_array_append_new(json_object_get(object, "terminals"), terminal_of(suit, first, order[i]));
	char *text = json_dumps(object, JSON_REAL_PRECISION(17));
	struct layout_request request;
	struct layout_output output;
	struct tw_error error = {0};
	if (layout_request_parse(&request, text, strlen(text), &error))
		fail_msg("%s: %s", error.where, error.text);
	struct layout_input input = {.garment = &suit->garment,
				     .topology = &suit->topology,
				     .field = &suit->field,
				     .request = &request,
				     .motion_name = names,
				     .motion_count = MOTIONS,
				     .threads = 1,
				     .motion_open = open_frames,
				     .motion_mean = take_mean,
				     .context = suit};
	if (layout_compute(&input, suit->arena, &output, &error))
		fail_msg("%s: %s", error.where, error.text);
	suit->json = json_loads(output.artifacts[0].bytes, 0, NULL);
	assert_non_null(suit->json);
	layout_request_clear(&request);
	free(text);
	json_decref(object);
}

static void tear_down(struct suit *suit)
{
	for (int m = 0; m < MOTIONS; m++)
		free(suit->motion[m]);
	json_decref(suit->json);
	arena_free(suit->arena);
}

/* Numbers of things, which must differ. */
static bool is_number_of_a_thing(const char *key)
{
	static const char *const keys[] = {"vertex",        "mesh_vertex",        "face",
					   "mesh_face",     "barycentric",        "mesh_barycentric",
					   "tree_vertices", "tree_mesh_vertices", "merged_with"};
	for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
		if (!strcmp(key, keys[i]))
			return true;
	return false;
}

/* Terminals by their names: `order` says which one stands where. */
static void name_terminals(json_t *json, const json_t *terminals)
{
	const char *key;
	json_t *value;
	size_t i;
	json_object_foreach(json, key, value)
	{
		if (!strcmp(key, "terminal") && json_is_integer(value))
			json_object_set(
				json, key,
				json_object_get(json_array_get(terminals, (size_t)json_integer_value(value)), "name"));
		else
			name_terminals(value, terminals);
	}
	json_array_foreach(json, i, value) name_terminals(value, terminals);
}

static int by_name(const void *a, const void *b)
{
	return strcmp(json_string_value(json_object_get(*(json_t *const *)a, "name")),
		      json_string_value(json_object_get(*(json_t *const *)b, "name")));
}

static void sort_terminals(json_t *json)
{
	json_t *terminals = json_object_get(json, "terminals"), *list[64];
	size_t count = json_array_size(terminals);
	assert_true(count <= 64);
	name_terminals(json, terminals);
	for (size_t i = 0; i < count; i++)
		list[i] = json_incref(json_array_get(terminals, i));
	qsort(list, count, sizeof *list, by_name);
	json_array_clear(terminals);
	for (size_t i = 0; i < count; i++)
		json_array_append_new(terminals, list[i]);
}

/* To the last digit that is written. Elongation alone may differ in that one: frames have the file's vertices, and the
 * corners of a face are summed in the file's order. */
static void expect_same(const json_t *a, const json_t *b, const char *path)
{
	char inner[256];
	if (json_is_object(a)) {
		const char *key;
		json_t *value;
		assert_int_equal(json_object_size(a), json_object_size(b));
		json_object_foreach((json_t *)(uintptr_t)a, key, value)
		{
			snprintf(inner, sizeof inner, "%s/%s", path, key);
			if (!is_number_of_a_thing(key))
				expect_same(value, json_object_get(b, key), inner);
		}
	} else if (json_is_array(a)) {
		if (json_array_size(a) != json_array_size(b))
			fail_msg("%s: %zu are not %zu", path, json_array_size(a), json_array_size(b));
		for (size_t i = 0; i < json_array_size(a); i++) {
			snprintf(inner, sizeof inner, "%s/%zu", path, i);
			expect_same(json_array_get(a, i), json_array_get(b, i), inner);
		}
	} else if (json_is_real(a) && strstr(path, "elongation")) {
		double x = json_number_value(a), y = json_number_value(b),
		       slack = strstr(path, "percent") ? 1e-3 : 1e-8;
		if (!(fabs(x - y) <= 1.01 * slack))
			fail_msg("%s: %.12g is not %.12g", path, x, y);
	} else if (!json_equal(a, b)) {
		fail_msg("%s: %s is not %s", path, json_dumps(a, JSON_ENCODE_ANY), json_dumps(b, JSON_ENCODE_ANY));
	}
}

static void expect_no_numbering(const struct garment *first, const struct recording *recording,
				const char *options_text, uint32_t terminals, const unsigned *what, size_t count)
{
	struct field_options options;
	struct suit base = {0};
	uint64_t random = 5;
	field_options_defaults(&options, FIELD_PRESET_NONE);
	shuffle(&base, first, 0, 1);
	if (recording)
		take_recordings(&base, recording);
	else
		make_motions(&base);
	make_field(&base, &options);
	uint32_t *plain = permutation(base.arena, terminals, false, &random);
	lay_out(&base, first, options_text, plain, terminals);
	sort_terminals(base.json);
	for (size_t i = 0; i < count; i++) {
		struct suit other = {0};
		shuffle(&other, first, what[i], 77 + i);
		if (recording)
			take_recordings(&other, recording);
		else
			make_motions(&other);
		make_field(&other, &options);
		assert_true(other.field.scale == base.field.scale);
		for (uint32_t f = 0; f < first->face_count; f++)
			assert_true(other.field.density[other.face_to[f]] == base.field.density[base.face_to[f]]);
		lay_out(&other, first, options_text, permutation(other.arena, terminals, what[i] & ORDER, &random),
			terminals);
		sort_terminals(other.json);
		expect_same(base.json, other.json, "");
		tear_down(&other);
	}
	tear_down(&base);
}

static void a_suit_in_any_order_has_the_same_layout(void **state)
{
	(void)state;
	static const unsigned what[] = {ORDER, VERTICES, COORDS, FACES, CORNERS, PIECES, ALL, ALL};
	struct arena *arena = arena_new(0);
	struct garment garment;
	assert_int_equal(sample_garment(&garment, arena, 3000, SAMPLE_L, NULL), TW_OK);
	expect_no_numbering(&garment, NULL, "{}", TERMINALS, what, sizeof what / sizeof *what);
	expect_no_numbering(&garment, NULL, "{\"baseline\":\"length\",\"eta\":\"auto\"}", 5, what + 6, 1);
	arena_free(arena);
}

/* A file of DATA; NULL where it is not there. */
static char *read_data(const char *path, size_t *size)
{
	char name[512];
	const char *data = getenv("DATA");
	snprintf(name, sizeof name, "%s/%s", data ? data : "", path);
	FILE *file = data ? fopen(name, "rb") : NULL;
	if (!file)
		return NULL;
	assert_int_equal(fseek(file, 0, SEEK_END), 0);
	*size = (size_t)ftell(file);
	rewind(file);
	char *bytes = malloc(*size + 1);
	assert_non_null(bytes);
	assert_int_equal(fread(bytes, 1, *size, file), *size);
	fclose(file);
	return bytes;
}

static void a_real_suit_in_any_order_has_the_same_layout(void **state)
{
	(void)state;
	static const unsigned what[] = {VERTICES | FACES | ORDER, ALL};
	static const char *const paths[MOTIONS] = {"motions/L_coarse/back_squat.pc2", "motions/L_coarse/hook.pc2"};
	size_t size;
	char *bytes = read_data("suits/L_coarse/suit.obj", &size), *motion[MOTIONS];
	if (!bytes)
		skip();
	struct garment_source source = {bytes, size, MESH_OBJ, NULL};
	struct import_options options;
	struct garment_report report;
	struct tw_error error = {0};
	struct garment garment;
	struct recording recording[MOTIONS];
	struct arena *arena = arena_new(0);
	option_defaults(&import_option_table, &options);
	if (garment_import(&garment, arena, &source, NULL, &options, &report, &error))
		fail_msg("%s: %s", error.where, error.text);
	for (int m = 0; m < MOTIONS; m++) {
		motion[m] = read_data(paths[m], &size);
		assert_non_null(motion[m]);
		recording[m] = (struct recording){
			(const float *)(const void *)(motion[m] + PC2_HEADER_BYTES),
			(uint32_t)((size - PC2_HEADER_BYTES) / (3 * sizeof(float) * garment.vertex_count))};
		assert_true(recording[m].count >= 30);
	}
	expect_no_numbering(&garment, recording, "{}", TERMINALS, what, sizeof what / sizeof *what);
	for (int m = 0; m < MOTIONS; m++)
		free(motion[m]);
	free(bytes);
	arena_free(arena);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_suit_in_any_order_has_the_same_layout),
		cmocka_unit_test(a_real_suit_in_any_order_has_the_same_layout),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
