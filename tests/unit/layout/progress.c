/* What a layout says while it is computed, and how it is stopped. */
#include "solver/layout/layout.h"

#include "solver/layout/result.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/unit/layout/sheet.h"

/* `bench` first: it is what open_motion is handed. */
struct stopper {
	struct bench bench;
	const char *last_wanted; /* the stage from which on nobody wants it */
	bool stops;
};

static void stop_from_stage(void *context, const struct layout_progress *progress)
{
	struct stopper *stopper = context;
	stopper->stops |= !strcmp(progress->stage, stopper->last_wanted);
}

static bool has_stopped(void *context)
{
	const struct stopper *stopper = context;
	return stopper->stops;
}

static void a_cancelled_layout_says_so_at_every_stage(void **state)
{
	(void)state;
	static const char *const stages[] = {"terminals", "tree", "baseline", "curves", "elongation", "artifacts"};
	for (size_t i = 0; i < sizeof stages / sizeof *stages; i++) {
		struct stopper stopper = {.last_wanted = stages[i]};
		struct bench *bench = &stopper.bench;
		set_up(bench, 0, 0.2);
		set_motion(bench, NULL);
		const char *json =
			"{\"terminals\":[{\"vertex\":168},{\"vertex\":690},{\"vertex\":600},{\"vertex\":198}]}";
		assert_int_equal(layout_request_parse(&bench->request, json, strlen(json), NULL), TW_OK);
		static const char *const names[] = {"none"};
		struct layout_input input = {.garment = &bench->garment,
					     .topology = &bench->topology,
					     .field = &bench->field,
					     .request = &bench->request,
					     .motion_name = names,
					     .motion_count = 1,
					     .motion_open = open_motion,
					     .progress = stop_from_stage,
					     .cancelled = has_stopped,
					     .context = &stopper};
		struct tw_error error = {0};
		assert_int_equal(layout_compute(&input, bench->arena, &bench->output, &error), TW_ERROR_CANCELLED);
		assert_true(stopper.stops);
		tear_down(bench);
	}
}

struct watch {
	struct bench *bench;
	struct layout_progress last;
	uint32_t reports, eta_reports;
};

static void take_progress(void *context, const struct layout_progress *progress)
{
	struct watch *watch = context;
	assert_true(progress->share >= watch->last.share && progress->share <= 1);
	bool moved = !watch->last.stage || progress->share > watch->last.share;
	watch->eta_reports += !strcmp(progress->stage, "eta") && moved;
	watch->reports++;
	watch->last = *progress;
}

static enum tw_status open_watched_motion(void *context, uint32_t motion, struct motion_reader **reader,
					  struct tw_error *error)
{
	struct watch *watch = context;
	return open_motion(watch->bench, motion, reader, error);
}

static void progress_never_falls_and_ends_with_the_proven_tree(void **state)
{
	(void)state;
	struct bench bench;
	set_up(&bench, 0, 0.2);
	for (uint32_t f = 0; f < bench.garment.face_count; f++)
		((double *)bench.field.density)[f] *= 1 + f % 7;
	set_motion(&bench, NULL);
	struct watch watch = {.bench = &bench};
	const char *json = "{\"terminals\":[{\"vertex\":168},{\"vertex\":690},{\"vertex\":600},{\"vertex\":198}],"
			   "\"options\":{\"eta\":\"auto\"}}";
	assert_int_equal(layout_request_parse(&bench.request, json, strlen(json), NULL), TW_OK);
	static const char *const names[] = {"still"};
	struct layout_input input = {.garment = &bench.garment,
				     .topology = &bench.topology,
				     .field = &bench.field,
				     .request = &bench.request,
				     .motion_name = names,
				     .motion_count = 1,
				     .motion_open = open_watched_motion,
				     .progress = take_progress,
				     .context = &watch};
	assert_int_equal(layout_compute(&input, bench.arena, &bench.output, NULL), TW_OK);
	assert_true(watch.eta_reports >= 3);
	assert_int_equal(watch.last.weight, bench.output.summary.weight);
	assert_int_equal(watch.last.lower_bound, bench.output.summary.weight);
	tear_down(&bench);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_cancelled_layout_says_so_at_every_stage),
		cmocka_unit_test(progress_never_falls_and_ends_with_the_proven_tree),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
