/* The design rules of wires (method 6), and where a layout breaks them. Whatever smoothing could not keep is named
 * here, with its place and its size; nothing is broken silently.
 *
 * The clearance from cut lines is a wish and no rule: a strand whose curve would break a rule with it is drawn near the
 * tree's path instead, which may run along the cut line itself (wires.c, struct manner). */
#ifndef SOLVER_LAYOUT_RULES_H
#define SOLVER_LAYOUT_RULES_H

#include "solver/layout/branches.h"
#include "solver/layout/strips.h"
#include "solver/pattern/locate.h"
#include "solver/warning.h"

enum design_rule {
	RULE_MINIMUM_RADIUS, /* value: the arc's radius, limit: the smallest allowed, mm */
	RULE_OFF_PIECE,      /* value: how far the curve leaves its piece, limit: tolerance of the cut, mm */
	RULE_KEEP_OUT,       /* value: how much kept-out fabric of the piece the strip covers, mm² */
	RULE_TOLERANCE,      /* value: how far the curve strays from the tree's path, limit: the tolerance, mm */
	/* value: how much of the piece two strips cover both, mm². Strips of two branches may do so near where these
	 * meet: see RULES_MEETING_WIDTHS. Each counts as wider by the spacing that strips have to keep. */
	RULE_STRIP_OVERLAP,
	RULE_SEAM_CORNER,   /* value: how near the curve comes to a point where more than two pieces meet, limit: mm */
	RULE_TREE_CROSSING, /* two edges of the tree cross; value: 0 */
	RULE_COUNT
};

/* Branches meet at an end that they share, or where other branches join their ends. The strips of two branches may
 * overlap along the last strip widths of wire from the one to the other, counted over what joins them: half of
 * RULES_MEETING_WIDTHS on each where they share an end. That is room for strips that part at 28 degrees. */
#define RULES_MEETING_WIDTHS 4

struct violation {
	enum design_rule rule;
	uint32_t branch;
	uint32_t other; /* the other branch of an overlap; GARMENT_NONE */
	uint32_t piece;
	struct vec2 at; /* where it is worst, in the piece's plane */
	double value, limit;
};

struct violation_list {
	struct violation *violation;
	uint32_t count, room;
};

struct rules_input {
	const struct network *network;
	const struct locator *locator;
	const struct branch_set *branches;
	const struct wire_set *wires;
	const struct strip_areas *strips; /* [branch_count] of the strip width alone */
	const struct strip_cutter *cutter;
	const struct wire_rules *rules;
};

/* A rule's name, as answers give it, and the unit of its values: "mm" or "mm2". */
const char *rule_name(enum design_rule rule);
const char *rule_unit(enum design_rule rule);

/* A warning for every rule that is broken: its worst place in words, and the branches. */
void rules_warn(const struct violation_list *list, const struct garment *garment, struct warning_list *warnings);

/* Adds the places where edges of the tree cross, of which at least one is half of a chord: two that pass the same face,
 * or one and the edge that it goes over. Optimal trees were never seen to. TW_ERROR_MEMORY. */
enum tw_status rules_check_tree(struct violation_list *list, struct arena *arena, const struct network *network,
				const struct branch_set *branches, struct tw_error *error) TW_NODISCARD;

/* Lists all violations, rule by rule, each by branch. TW_ERROR_MEMORY. */
enum tw_status rules_check(struct violation_list *list, struct arena *arena, const struct rules_input *input,
			   struct tw_error *error) TW_NODISCARD;

#endif
