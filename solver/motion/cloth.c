#include "solver/motion/cloth.h"

#include "solver/garment/correspondence.h"

#include <math.h>

static double square_between(const double *a, const double *b, int axes)
{
	double square = 0;
	for (int axis = 0; axis < axes; axis++)
		square += (b[axis] - a[axis]) * (b[axis] - a[axis]);
	return square;
}

/* What is shorter than this share of the mean edge is not told from nothing. */
static const double sliver_share = 0.25;

/* Sides shorter than that count as that long. Returns the mean. */
static double lift_slivers(float *rest, size_t sides)
{
	double sum = 0;
	for (size_t i = 0; i < sides; i++)
		sum += sqrt((double)rest[i]);
	double least = sliver_share * sum / (double)sides;
	for (size_t i = 0; i < sides; i++)
		rest[i] = rest[i] > (float)(least * least) ? rest[i] : (float)(least * least);
	return sum / (double)sides;
}

static enum tw_status list_copies(struct cloth *cloth, struct arena *arena, struct tw_error *error)
{
	const struct garment *garment = cloth->garment;
	if (!garment->mesh_vertex)
		return TW_OK;
	uint32_t count = 0, vertices = garment_source_count(garment);
	for (uint32_t v = 0; v < vertices; v++)
		count += garment_file_vertex(garment, garment_mesh_vertex(garment, v)) != v;
	uint32_t(*copy)[2] = arena_array(arena, count, sizeof *copy);
	if (!copy)
		return tw_fail_memory(error);
	for (uint32_t v = 0; v < vertices; v++) {
		uint32_t root = garment_file_vertex(garment, garment_mesh_vertex(garment, v));
		if (root == v)
			continue;
		copy[cloth->copy_count][0] = v;
		copy[cloth->copy_count++][1] = root;
	}
	cloth->copy = (const uint32_t(*)[2])copy;
	return TW_OK;
}

enum tw_status cloth_init(struct cloth *cloth, struct arena *arena, const struct garment *garment,
			  struct warning_list *warnings, struct tw_error *error)
{
	const size_t sides = 3 * (size_t)garment->face_count;
	float *rest = ARENA_ARRAY(arena, sides, float);
	*cloth = (struct cloth){.garment = garment, .rest = rest, .warnings = warnings};
	if (!rest)
		return tw_fail_memory(error);
	for (size_t i = 0; i < sides; i++) {
		size_t j = i % 3 == 2 ? i - 2 : i + 1;
		const uint32_t *vertex = garment->face_vertex, *coord = garment->face_coord;
		double worn = square_between(garment->position + 3 * (size_t)vertex[i],
					     garment->position + 3 * (size_t)vertex[j], 3);
		double flat = square_between(garment->pattern + 2 * (size_t)coord[i],
					     garment->pattern + 2 * (size_t)coord[j], 2);
		rest[i] = (float)(worn > flat ? worn : flat);
	}
	cloth->mean_mm = lift_slivers(rest, sides);
	return list_copies(cloth, arena, error);
}

/* What a frame shows, of the sides of all faces: an edge between two faces counts for each. */
struct finding {
	size_t longest, shortest; /* sides; squares over the rest's */
	float longest_ratio, shortest_ratio;
	uint32_t short_sides, collapsed;
};

/* Squares of the lengths of a face's sides in a frame, over those of the rest. */
static inline void side_ratios(const struct cloth *cloth, const float *position, size_t face, float ratio[3])
{
	const uint32_t *vertex = cloth->garment->face_vertex + 3 * face;
	const float *rest = cloth->rest + 3 * face;
	const float *a = position + 3 * (size_t)vertex[0], *b = position + 3 * (size_t)vertex[1];
	const float *c = position + 3 * (size_t)vertex[2];
	float square[3] = {0, 0, 0};
	for (int axis = 0; axis < 3; axis++) {
		square[0] += (b[axis] - a[axis]) * (b[axis] - a[axis]);
		square[1] += (c[axis] - b[axis]) * (c[axis] - b[axis]);
		square[2] += (a[axis] - c[axis]) * (a[axis] - c[axis]);
	}
	for (int side = 0; side < 3; side++)
		ratio[side] = square[side] / rest[side];
}

static struct finding look(const struct cloth *cloth, const float *position)
{
	const float is_short = (float)(CLOTH_SHORT * CLOTH_SHORT);
	const float is_collapsed = (float)(CLOTH_COLLAPSED * CLOTH_COLLAPSED);
	struct finding found = {.longest_ratio = -1, .shortest_ratio = INFINITY};
	for (size_t face = 0; face < cloth->garment->face_count; face++) {
		float ratio[3];
		side_ratios(cloth, position, face, ratio);
		for (size_t side = 0; side < 3; side++) {
			found.short_sides += ratio[side] < is_short;
			found.collapsed += ratio[side] < is_collapsed;
			if (ratio[side] > found.longest_ratio) {
				found.longest_ratio = ratio[side];
				found.longest = 3 * face + side;
			}
			if (ratio[side] < found.shortest_ratio) {
				found.shortest_ratio = ratio[side];
				found.shortest = 3 * face + side;
			}
		}
	}
	return found;
}

static struct cloth_edge edge_at(const struct cloth *cloth, const float *position, uint32_t frame, size_t side)
{
	const uint32_t *vertex = cloth->garment->face_vertex;
	uint32_t a = vertex[side], b = vertex[side % 3 == 2 ? side - 2 : side + 1];
	double square = 0;
	for (size_t axis = 0; axis < 3; axis++) {
		double step = (double)position[3 * (size_t)b + axis] - (double)position[3 * (size_t)a + axis];
		square += step * step;
	}
	return (struct cloth_edge){.frame = frame,
				   .vertex = {a, b},
				   .stretch = sqrt(square / (double)cloth->rest[side]),
				   .length_mm = sqrt(square)};
}

/* "vertices 3 and 17" */
enum { ENDS_BYTES = 2 * VERTEX_NAME_BYTES + 16 };
static const char *name_ends(const struct cloth *cloth, const struct cloth_edge *edge, char ends[ENDS_BYTES])
{
	char name[2][VERTEX_NAME_BYTES];
	snprintf(ends, ENDS_BYTES, "vertices %s and %s", garment_vertex_name(cloth->garment, edge->vertex[0], name[0]),
		 garment_vertex_name(cloth->garment, edge->vertex[1], name[1]));
	return ends;
}

static enum tw_status refuse_stretch(const struct cloth *cloth, const struct cloth_edge *edge, struct tw_error *error)
{
	char ends[ENDS_BYTES], where[ENDS_BYTES + 16];
	snprintf(where, sizeof where, "frame %u, %s", edge->frame, name_ends(cloth, edge, ends));
	return tw_fail(
		error, TW_ERROR_INPUT, "motion-not-cloth", where,
		"in frame %u the edge between %s is %.3g mm long, %.3g times as long as on the garment, which no "
		"fabric does: %s; mend the motion and send it again",
		edge->frame, ends, edge->length_mm, edge->stretch,
		edge->frame == 0 ? "its vertices are in another order than the garment's, or astray"
				 : "the simulation exploded, or a vertex went astray");
}

static enum tw_status refuse_collapse(const struct cloth *cloth, const struct cloth_edge *edge, double share,
				      struct tw_error *error)
{
	char ends[ENDS_BYTES], where[ENDS_BYTES + 16];
	snprintf(where, sizeof where, "frame %u, %s", edge->frame, name_ends(cloth, edge, ends));
	return tw_fail(
		error, TW_ERROR_INPUT, "motion-not-cloth", where,
		"in frame %u, %.3g %% of the edges are shorter than a fifth of their length on the garment, that "
		"between %s %.3g mm: the simulation collapsed; mend the motion and send it again",
		edge->frame, 100 * share, ends, edge->length_mm);
}

enum tw_status cloth_judge(struct cloth *cloth, uint32_t frame, const float *position, struct tw_error *error)
{
	const double sides = 3.0 * cloth->garment->face_count;
	struct finding found = look(cloth, position);
	struct cloth_edge longest = edge_at(cloth, position, frame, found.longest);
	if (longest.stretch > CLOTH_STRETCH_REFUSED)
		return refuse_stretch(cloth, &longest, error);
	if (found.collapsed > CLOTH_COLLAPSED_SHARE_REFUSED * sides) {
		struct cloth_edge shortest = edge_at(cloth, position, frame, found.shortest);
		return refuse_collapse(cloth, &shortest, found.collapsed / sides, error);
	}
	if (longest.stretch > CLOTH_STRETCH_WARNED) {
		cloth->stretched++;
		cloth->longest = longest.stretch > cloth->longest.stretch ? longest : cloth->longest;
	}
	if (found.short_sides > CLOTH_SHORT_SHARE_WARNED * sides) {
		cloth->crumpled++;
		cloth->short_share = fmax(cloth->short_share, found.short_sides / sides);
	}
	return TW_OK;
}

enum tw_status cloth_judge_copies(struct cloth *cloth, uint32_t frame, const float *frame_position,
				  struct tw_error *error)
{
	const double limit = sliver_share * cloth->mean_mm;
	struct cloth_edge widest = {.frame = frame};
	for (uint32_t i = 0; i < cloth->copy_count; i++) {
		const float *a = frame_position + 3 * (size_t)cloth->copy[i][0];
		const float *b = frame_position + 3 * (size_t)cloth->copy[i][1];
		double square = 0;
		for (int axis = 0; axis < 3; axis++)
			square += ((double)a[axis] - (double)b[axis]) * ((double)a[axis] - (double)b[axis]);
		if (square > widest.length_mm * widest.length_mm)
			widest = (struct cloth_edge){frame, {cloth->copy[i][1], cloth->copy[i][0]}, 0, sqrt(square)};
	}
	if (widest.length_mm <= limit)
		return TW_OK;
	if (widest.length_mm > CLOTH_STRETCH_REFUSED * cloth->mean_mm) {
		char where[64];
		snprintf(where, sizeof where, "frame %u, vertices %u and %u", frame, widest.vertex[0],
			 widest.vertex[1]);
		return tw_fail(error, TW_ERROR_INPUT, "motion-not-cloth", where,
			       "in frame %u vertices %u and %u, which are sewn together, lie %.4g mm apart: the "
			       "simulation exploded, or a vertex went astray; mend the motion and send it again",
			       frame, widest.vertex[0], widest.vertex[1], widest.length_mm);
	}
	cloth->opened++;
	cloth->widest = widest.length_mm > cloth->widest.length_mm ? widest : cloth->widest;
	return TW_OK;
}

void cloth_warn(struct cloth *cloth)
{
	char ends[ENDS_BYTES];
	if (cloth->stretched > 0)
		warning_add(
			cloth->warnings, "motion-stretched", "frame", cloth->longest.frame,
			"%u frames have edges more than %g times as long as on the garment; in frame %u that between "
			"%s %.3g times. Is the simulation sound?",
			cloth->stretched, CLOTH_STRETCH_WARNED, cloth->longest.frame,
			name_ends(cloth, &cloth->longest, ends), cloth->longest.stretch);
	if (cloth->opened > 0)
		warning_add(cloth->warnings, "motion-seam-opens", "frame", cloth->widest.frame,
			    "in %u frames vertices that are sewn together lie apart, in frame %u vertices %u and %u by "
			    "%.3g mm; the first of them counts. Was the garment simulated unsewn?",
			    cloth->opened, cloth->widest.frame, cloth->widest.vertex[0], cloth->widest.vertex[1],
			    cloth->widest.length_mm);
	if (cloth->crumpled > 0)
		warning_add_whole(cloth->warnings, "motion-crumpled",
				  "in %u frames up to %.3g %% of the edges are shorter than half their length on the "
				  "garment. Is the simulation sound?",
				  cloth->crumpled, 100 * cloth->short_share);
}
