/* Every label has the same few places around its point. In the first round each takes the cheapest beside those before
 * it; in the following ones the cheapest beside all others, which undoes what was taken too early. */
#include "solver/pattern/label.h"

enum { ROUNDS = 5 };
static const double glyph_width = 0.6, ascent = 0.8, descent = 0.25; /* of the size */

/* The best first. Right and left of the point, above and below; from NEAR_SPOTS on a step further out, and another. */
static const struct spot {
	double x, y;
	enum label_anchor anchor;
} spots[] = {
	{1, -0.6, LABEL_START},   {-1, -0.6, LABEL_END},   {1, 0.6, LABEL_START},   {-1, 0.6, LABEL_END},
	{1, 0, LABEL_START},      {-1, 0, LABEL_END},      {0, -1, LABEL_MIDDLE},   {0, 1, LABEL_MIDDLE},
	{1.2, -2, LABEL_START},   {-1.2, -2, LABEL_END},   {1.2, 2, LABEL_START},   {-1.2, 2, LABEL_END},
	{2.5, 0, LABEL_START},    {-2.5, 0, LABEL_END},    {0, -2.2, LABEL_MIDDLE}, {0, 2.2, LABEL_MIDDLE},
	{1.5, -3.5, LABEL_START}, {-1.5, -3.5, LABEL_END}, {1.5, 3.5, LABEL_START}, {-1.5, 3.5, LABEL_END},
};
enum { SPOTS = sizeof spots / sizeof *spots, NEAR_SPOTS = 8 };

enum tw_status label_page_init(struct label_page *page, struct arena *arena, struct label_box bounds, double gap,
			       uint32_t label_room, uint32_t block_room, struct tw_error *error)
{
	*page = (struct label_page){.bounds = bounds, .gap = gap, .label_room = label_room, .block_room = block_room};
	page->label = ARENA_ZEROED(arena, label_room, struct label);
	page->block = ARENA_ARRAY(arena, block_room, struct label_block);
	page->near = ARENA_ARRAY(arena, (size_t)label_room + block_room, struct label_block);
	return page->label && page->block && page->near ? TW_OK : tw_fail_memory(error);
}

double label_width(const char *text, double size)
{
	double letters = 0;
	for (const char *c = text; *c; c++)
		letters += ((unsigned char)*c & 0xc0) != 0x80; /* not the later bytes of a UTF-8 character */
	return letters * glyph_width * size;
}

const char *label_anchor_name(enum label_anchor anchor)
{
	static const char *const names[] = {[LABEL_START] = "start", [LABEL_MIDDLE] = "middle", [LABEL_END] = "end"};
	return names[anchor];
}

void label_page_add(struct label_page *page, struct vec2 at, const char *name, double size)
{
	if (page->label_count == page->label_room)
		return;
	page->label[page->label_count++] = (struct label){.at = at, .width = label_width(name, size), .height = size};
}

void label_page_block_box(struct label_page *page, struct label_box box, double price)
{
	if (page->block_count < page->block_room)
		page->block[page->block_count++] = (struct label_block){box, price};
}

void label_page_block(struct label_page *page, struct vec2 at, double width, double price)
{
	double half = width / 2;
	label_page_block_box(page, (struct label_box){at.x - half, at.y - half, at.x + half, at.y + half}, price);
}

static double overlap(const struct label_box *a, const struct label_box *b)
{
	double width = fmin(a->right, b->right) - fmax(a->left, b->left);
	double height = fmin(a->bottom, b->bottom) - fmax(a->top, b->top);
	return width > 0 && height > 0 ? width * height : 0;
}

static double area(const struct label_box *box)
{
	return (box->right - box->left) * (box->bottom - box->top);
}

static void put(const struct label_page *page, struct label *label, const struct spot *spot)
{
	double size = label->height;
	/* The middle of the letters, not the base line, lies level with the point. */
	label->text.x = label->at.x + spot->x * page->gap;
	label->text.y = label->at.y + spot->y * (page->gap + size / 2) + (ascent - descent) / 2 * size;
	label->anchor = spot->anchor;
	double before = spot->anchor == LABEL_START ? 0 : spot->anchor == LABEL_MIDDLE ? 0.5 : 1;
	label->box.left = label->text.x - before * label->width;
	label->box.right = label->box.left + label->width;
	label->box.top = label->text.y - ascent * size;
	label->box.bottom = label->text.y + descent * size;
}

/* What any place of the label could meet; the first `others` labels count. */
static uint32_t find_near(const struct label_page *page, const struct label *label, uint32_t others)
{
	uint32_t count = 0;
	double reach = label->width + 4 * (page->gap + label->height);
	struct label_box around = {label->at.x - reach, label->at.y - reach, label->at.x + reach, label->at.y + reach};
	for (uint32_t i = 0; i < others; i++)
		if (&page->label[i] != label && overlap(&page->label[i].box, &around) > 0)
			page->near[count++] = (struct label_block){page->label[i].box, LABEL_PRICE};
	for (uint32_t i = 0; i < page->block_count; i++)
		if (overlap(&page->block[i].box, &around) > 0)
			page->near[count++] = page->block[i];
	return count;
}

static double cost(const struct label_page *page, const struct label_box *box, uint32_t near_count)
{
	double sum = LABEL_PRICE * (area(box) - overlap(box, &page->bounds));
	for (uint32_t i = 0; i < near_count; i++)
		sum += page->near[i].price * overlap(box, &page->near[i].box);
	return sum;
}

/* What a place costs by itself, as a share of the label's area. Of places that are as free the earlier one is taken;
 * one further out, where it is not so clear what is named, only to get off another name or most of a line. */
static double rank_price(int spot)
{
	int ring = spot / NEAR_SPOTS;
	return 0.001 * spot + 0.5 * ring;
}

static void choose(const struct label_page *page, struct label *label, uint32_t others)
{
	double least = INFINITY;
	uint32_t near_count = find_near(page, label, others);
	struct label best = *label;
	for (int i = 0; i < SPOTS; i++) {
		put(page, label, &spots[i]);
		double here = cost(page, &label->box, near_count) + rank_price(i) * area(&label->box);
		if (here < least) {
			least = here;
			best = *label;
		}
	}
	*label = best;
}

void label_page_settle(struct label_page *page)
{
	for (int round = 0; round < ROUNDS; round++)
		for (uint32_t i = 0; i < page->label_count; i++)
			choose(page, &page->label[i], round ? page->label_count : i);
}
