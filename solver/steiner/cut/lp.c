/* Purpose: the directed cut relaxation (Y. P. Aneja, An integer linear programming approach to the Steiner problem in
 * graphs, Networks 10, 1980; directed: R. T. Wong 1984) with the rows of balance.c, solved by Clp's dual simplex.
 *
 * The first basis is that of the dual ascent: in a cut's row stands the arc that raising the cut made free. No later
 * cut is entered by that arc, so the basis is triangular, and its prices are the ascent's: the program begins at the
 * ascent's bound instead of climbing there.
 *
 * Equal weights make the program degenerate, and the simplex method run in circles. So the program's costs are a little
 * less than the real ones, by an amount of its own for each arc, together less than an eighth of a unit for a tree. Any
 * prices prove a bound, those of cheaper arcs as well; at most that eighth is lost.
 *
 * Costs are scaled by a power of two into a range that suits the program. Nothing of the floating-point result is
 * trusted. The prices y >= 0 of the rows are rounded down to fixed point; then with the reduced costs r = c - yA,
 * computed in integers, every tree costs at least sum(y b) + sum over arcs of min(0, r): the weak duality of linear
 * programming with 0 <= x <= 1, true for any y >= 0. Rounding costs at most a millionth of a unit for each row, and
 * bounds are rounded up to whole units at the end. */
#include "solver/steiner/cut/lp.h"

#include "solver/splitmix.h"

#include <coin/Clp_C_Interface.h>
#include <float.h>
#include <math.h>
#include <string.h>

enum { ITERATIONS_LEAST = 500, WORK_AT_ONCE = 80000000, WORK_OF_ITERATION = 4, COST_BITS = 10, LOST_SHARE = 8 };
enum { BASIC = 1, AT_LOWER = 3 };                 /* Clp's names for where a variable is */
enum { SOLVED = 0, INFEASIBLE = 1, STOPPED = 3 }; /* and for how it ended; INFEASIBLE also at the limit */
#define NO_LIMIT 1e50
/* What Clp holds. At rest it was 14 bytes an entry, all told (fieldL_mesh_vest40: 72,418 columns, 14,205 rows, 2.16
 * million entries, 30 MB); while it solves it has the matrix by rows and scaled too, 12 bytes an entry each, and a
 * dozen doubles for each row and column. */
#define BYTES_OF_COLUMN 256
#define BYTES_OF_ROW 256
#define BYTES_OF_ENTRY 48

/* A number in [0, 1) that belongs to the arc. */
static double share_of(uint64_t arc)
{
	return ldexp((double)(splitmix(arc * SPLITMIX_STEP) >> 11), -53);
}

static enum tw_status load_columns(struct cut_lp *lp)
{
	const struct cut_problem *problem = lp->problem;
	const struct search *search = problem->search;
	const size_t arcs = problem->arc_count;
	struct arena *arena = search->arena;
	const struct arena_mark mark = arena_mark(arena);
	CoinBigIndex *start = ARENA_ZEROED(arena, arcs + 1, CoinBigIndex);
	double *cost = ARENA_ARRAY(arena, arcs, double);
	double *lower = ARENA_ZEROED(arena, arcs, double), *upper = ARENA_ARRAY(arena, arcs, double);
	const enum tw_status status = start && cost && lower && upper ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		const double most = ldexp(1, (int)problem->fraction_bits) / (LOST_SHARE * (search->best_count + 1.0));
		for (uint32_t arc = 0; arc < arcs; arc++) {
			const double less = (double)problem->cost[arc] - most * share_of(arc);
			cost[arc] = less > 0 ? ldexp(less, -lp->exponent) : 0;
			upper[arc] = problem->allowed[arc];
		}
		Clp_loadProblem(lp->model, (int)arcs, 0, start, NULL, NULL, lower, upper, cost, NULL, NULL);
	}
	arena_release(arena, mark);
	return status;
}

/* Clp takes its memory from malloc. What it holds at most with so many rows and entries counts against the search's
 * budget all the same; the figures are those below. It is never given back before the end: Clp keeps its space too. */
static enum tw_status charge(struct cut_lp *lp, size_t rows, size_t entries)
{
	const size_t bytes = BYTES_OF_COLUMN * lp->problem->arc_count + BYTES_OF_ROW * rows + BYTES_OF_ENTRY * entries;
	if (bytes <= lp->charged)
		return TW_OK;
	if (!arena_charge(lp->problem->search->arena, bytes - lp->charged))
		return TW_ERROR_MEMORY;
	lp->charged = bytes;
	return TW_OK;
}

enum tw_status cut_lp_init(struct cut_lp *lp, const struct cut_problem *problem, struct cut_pool *pool)
{
	struct arena *arena = problem->search->arena;
	*lp = (struct cut_lp){
		.model = Clp_newModel(),
		.problem = problem,
		.pool = pool,
		.idle = ARENA_ZEROED(arena, pool->capacity, uint8_t),
		.reduced = ARENA_ARRAY(arena, problem->arc_count, int64_t),
		.x = ARENA_ZEROED(arena, problem->arc_count, double),
		.upper = ARENA_ARRAY(arena, problem->arc_count, double),
	};
	if (!lp->model || !lp->idle || !lp->reduced || !lp->x || !lp->upper || charge(lp, 0, 0) != TW_OK)
		return TW_ERROR_MEMORY;
	int64_t heaviest = 1;
	for (uint32_t arc = 0; arc < problem->arc_count; arc++)
		heaviest = problem->cost[arc] > heaviest ? problem->cost[arc] : heaviest;
	(void)frexp((double)heaviest, &lp->exponent);
	lp->exponent -= COST_BITS;
	Clp_setLogLevel(lp->model, 0);
	return load_columns(lp);
}

void cut_lp_free(struct cut_lp *lp)
{
	if (lp->model)
		Clp_deleteModel(lp->model);
	if (lp->problem)
		arena_discharge(lp->problem->search->arena, lp->charged);
	lp->model = NULL;
	lp->charged = 0;
}

static enum tw_status add_rows(struct cut_lp *lp)
{
	const struct cut_pool *pool = lp->pool;
	const uint32_t first = lp->row_count, count = pool->count - first;
	if (!count)
		return TW_OK;
	if (charge(lp, pool->count, pool->start[pool->count]) != TW_OK)
		return TW_ERROR_MEMORY;
	struct arena *arena = lp->problem->search->arena;
	const struct arena_mark mark = arena_mark(arena);
	const size_t entries = pool->start[pool->count] - pool->start[first];
	CoinBigIndex *start = ARENA_ARRAY(arena, (size_t)count + 1, CoinBigIndex);
	int *column = ARENA_ARRAY(arena, entries, int);
	double *element = ARENA_ARRAY(arena, entries, double);
	double *lower = ARENA_ARRAY(arena, count, double), *upper = ARENA_ARRAY(arena, count, double);
	enum tw_status status = start && column && element && lower && upper ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		for (uint32_t i = 0; i <= count; i++)
			start[i] = (CoinBigIndex)(pool->start[first + i] - pool->start[first]);
		for (size_t i = 0; i < entries; i++) {
			const uint32_t arc = pool->arc[pool->start[first] + i];
			column[i] = (int)(arc & ~CUT_MINUS);
			element[i] = arc & CUT_MINUS ? -1 : 1;
		}
		for (uint32_t i = 0; i < count; i++) {
			lower[i] = pool->least[first + i];
			upper[i] = DBL_MAX;
			lp->idle[first + i] = 0;
		}
		Clp_addRows(lp->model, (int)count, lower, upper, start, column, element);
		for (uint32_t i = first; i < pool->count; i++)
			if (pool->basic[i] != INSTANCE_NONE) {
				Clp_setRowStatus(lp->model, (int)i, AT_LOWER);
				Clp_setColumnStatus(lp->model, (int)pool->basic[i], BASIC);
				pool->basic[i] = INSTANCE_NONE;
			}
		lp->row_count = pool->count;
	}
	arena_release(arena, mark);
	return status;
}

/* A price in fixed point; nonsense is 0. */
static int64_t fixed_price(const struct cut_lp *lp, double price)
{
	const double scaled = ldexp(price, lp->exponent);
	return scaled > 0 && scaled < 0x1p61 ? (int64_t)scaled : 0;
}

/* Weak duality in integers. A bound of 0 on overflow. */
static void prove_bound(struct cut_lp *lp)
{
	const struct cut_problem *problem = lp->problem;
	const struct cut_pool *pool = lp->pool;
	const double *price = Clp_getRowPrice(lp->model);
	int64_t sum = 0;
	int overflow = 0;
	memcpy(lp->reduced, problem->cost, problem->arc_count * sizeof *lp->reduced);
	for (uint32_t i = 0; i < lp->row_count && !overflow; i++) {
		const int64_t y = fixed_price(lp, price[i]);
		overflow |= __builtin_add_overflow(sum, pool->least[i] ? y : 0, &sum);
		for (size_t j = pool->start[i]; y && j < pool->start[i + 1]; j++) {
			int64_t *reduced = &lp->reduced[pool->arc[j] & ~CUT_MINUS];
			overflow |= __builtin_sub_overflow(*reduced, pool->arc[j] & CUT_MINUS ? -y : y, reduced);
		}
	}
	for (uint32_t arc = 0; arc < problem->arc_count && !overflow; arc++) {
		int64_t *reduced = &lp->reduced[arc];
		if (*reduced < 0) {
			if (problem->allowed[arc])
				overflow |= __builtin_add_overflow(sum, *reduced, &sum);
			*reduced = 0;
		}
	}
	lp->bound = overflow || sum < 0 ? 0 : sum;
	if (overflow)
		memset(lp->reduced, 0, problem->arc_count * sizeof *lp->reduced);
}

/* What is left of the user's time. */
static void limit_time(struct cut_lp *lp)
{
	const struct search *search = lp->problem->search;
	const double limit_s = search->options->time_limit_s, left_s = limit_s - (search_clock_s() - search->started_s);
	if (limit_s > 0)
		Clp_setMaximumSeconds(lp->model, left_s > 0.01 ? left_s : 0.01);
}

/* No more than the turn's budget has left. */
static uint64_t work_at_once(const struct search *search)
{
	const uint64_t left = search->budget_end > search->work ? search->budget_end - search->work : 0;
	return search->budget_end && left < WORK_AT_ONCE ? left : WORK_AT_ONCE;
}

/* Runs the dual simplex until it ends or the objective reaches `limit`; *code is Clp's status. It is interrupted now
 * and then to look at the clock, but not often: it takes a while to find back. */
static enum tw_status run_simplex(struct cut_lp *lp, double limit, int *code)
{
	const uint64_t cost = WORK_OF_ITERATION * ((uint64_t)lp->row_count + 100);
	Clp_setDualObjectiveLimit(lp->model, limit);
	do {
		const uint64_t at_once = work_at_once(lp->problem->search) / cost;
		limit_time(lp);
		Clp_setMaximumIterations(lp->model, at_once > ITERATIONS_LEAST ? (int)at_once : ITERATIONS_LEAST);
		Clp_dual(lp->model, 0);
		*code = Clp_status(lp->model);
		const uint64_t iterations = (uint64_t)Clp_numberIterations(lp->model) + 1;
		if (!search_spend(lp->problem->search, iterations * cost))
			return TW_ERROR_CANCELLED;
		if (iterations == 1)
			break;
	} while (*code == STOPPED);
	return TW_OK;
}

static void take_solution(struct cut_lp *lp)
{
	memcpy(lp->x, Clp_getColSolution(lp->model), lp->problem->arc_count * sizeof *lp->x);
	const double *activity = Clp_getRowActivity(lp->model);
	for (uint32_t i = 0; i < lp->row_count; i++) {
		if (activity[i] < lp->pool->least[i] + 1e-6)
			lp->idle[i] = 0;
		else if (lp->idle[i] < UINT8_MAX)
			lp->idle[i]++;
	}
}

enum tw_status cut_lp_solve(struct cut_lp *lp, int64_t enough)
{
	const struct cut_problem *problem = lp->problem;
	enum tw_status status = add_rows(lp);
	if (status != TW_OK)
		return status;
	for (uint32_t arc = 0; arc < problem->arc_count; arc++)
		lp->upper[arc] = problem->allowed[arc];
	Clp_chgColumnUpper(lp->model, lp->upper);
	int code;
	lp->is_solved = 0;
	if (enough < INT64_MAX / 2) {
		const double beyond = (double)enough + ldexp(1, (int)problem->fraction_bits - 3);
		status = run_simplex(lp, ldexp(beyond, -lp->exponent), &code);
		if (status == TW_OK && code == INFEASIBLE) {
			prove_bound(lp);
			if (lp->bound >= enough)
				return TW_OK;
		}
	}
	if (status == TW_OK && (enough >= INT64_MAX / 2 || code == INFEASIBLE))
		status = run_simplex(lp, NO_LIMIT, &code);
	if (status != TW_OK || code != SOLVED)
		return status; /* bound and solution stay as they were: nothing new is known */
	lp->is_solved = 1;
	take_solution(lp);
	prove_bound(lp);
	return TW_OK;
}

void cut_lp_remember(struct cut_lp *lp, struct cut_basis *basis)
{
	struct cut_pool *pool = lp->pool;
	const uint32_t arcs = lp->problem->arc_count;
	basis->row_count = 0;
	if (!basis->column) {
		/* A basis has as many rows that are not basic as it has basic columns. */
		basis->row = ARENA_ARRAY(lp->problem->search->arena, arcs, uint32_t);
		basis->column = basis->row ? ARENA_ARRAY(lp->problem->search->arena, arcs, uint8_t) : NULL;
	}
	if (!basis->column)
		return;
	for (uint32_t arc = 0; arc < arcs; arc++)
		basis->column[arc] = (uint8_t)Clp_getColumnStatus(lp->model, (int)arc);
	for (uint32_t i = 0; i < lp->row_count && basis->row_count < arcs; i++)
		if (Clp_getRowStatus(lp->model, (int)i) != BASIC && pool->pins[i] < UINT16_MAX) {
			basis->row[basis->row_count++] = pool->number[i];
			pool->pins[i]++;
		}
}

void cut_lp_recall(struct cut_lp *lp, struct cut_basis *basis)
{
	struct cut_pool *pool = lp->pool;
	if (!basis->column)
		return;
	for (uint32_t arc = 0; arc < lp->problem->arc_count; arc++)
		Clp_setColumnStatus(lp->model, (int)arc, basis->column[arc]);
	for (uint32_t i = 0, j = 0; i < lp->row_count; i++) {
		while (j < basis->row_count && basis->row[j] < pool->number[i])
			j++;
		const int is_remembered = j < basis->row_count && basis->row[j] == pool->number[i];
		Clp_setRowStatus(lp->model, (int)i, is_remembered ? AT_LOWER : BASIC);
		pool->pins[i] = (uint16_t)(pool->pins[i] - is_remembered);
	}
	basis->row_count = 0;
}

enum tw_status cut_lp_drop(struct cut_lp *lp, const uint8_t *drop)
{
	struct cut_pool *pool = lp->pool;
	struct arena *arena = lp->problem->search->arena;
	const struct arena_mark mark = arena_mark(arena);
	int *gone = ARENA_ARRAY(arena, pool->count, int);
	if (!gone)
		return TW_ERROR_MEMORY;
	int gone_count = 0;
	uint32_t kept = 0, kept_rows = 0;
	size_t at = 0;
	for (uint32_t i = 0; i < pool->count; i++) {
		const size_t start = pool->start[i], end = pool->start[i + 1];
		if (drop[i]) {
			if (i < lp->row_count)
				gone[gone_count++] = (int)i;
			continue;
		}
		kept_rows += i < lp->row_count;
		memmove(pool->arc + at, pool->arc + start, (end - start) * sizeof *pool->arc);
		pool->least[kept] = pool->least[i];
		pool->target[kept] = pool->target[i];
		pool->basic[kept] = pool->basic[i];
		pool->number[kept] = pool->number[i];
		pool->pins[kept] = pool->pins[i];
		lp->idle[kept] = lp->idle[i];
		pool->start[kept++] = at;
		at += end - start;
	}
	pool->start[kept] = at;
	pool->count = kept;
	lp->row_count = kept_rows;
	if (gone_count)
		Clp_deleteRows(lp->model, gone_count, gone);
	arena_release(arena, mark);
	return TW_OK;
}
