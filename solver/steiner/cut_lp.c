/* Purpose: the directed cut relaxation (Y. P. Aneja, An integer linear programming approach to the Steiner problem in
 * graphs, Networks 10, 1980; directed: R. T. Wong 1984) with flow balance (T. Koch & A. Martin 1998), solved by Clp's
 * dual simplex.
 *
 * Costs are scaled by a power of two into a range that suits the program. Nothing of the floating-point result is
 * trusted. The prices y >= 0 of the rows are rounded down to fixed point; then with the reduced costs r = c - yA,
 * computed in integers, every tree costs at least sum(y b) + sum over arcs of min(0, r): the weak duality of linear
 * programming with 0 <= x <= 1, true for any y >= 0. Rounding costs at most a millionth of a unit for each row, and
 * bounds are rounded up to whole units at the end. */
#include "solver/steiner/cut_lp.h"

#include <coin/Clp_C_Interface.h>
#include <float.h>
#include <math.h>
#include <string.h>

enum { ITERATIONS_AT_ONCE = 1000, COST_BITS = 10 };

static enum tw_status load_balance(struct cut_lp *lp)
{
	const struct cut_problem *problem = lp->problem;
	const size_t arcs = problem->arc_count, n = problem->instance->vertex_count;
	struct arena *arena = problem->search->arena;
	const struct arena_mark mark = arena_mark(arena);
	CoinBigIndex *start = ARENA_ARRAY(arena, arcs + 1, CoinBigIndex);
	int *row = ARENA_ARRAY(arena, 2 * arcs, int);
	double *element = ARENA_ARRAY(arena, 2 * arcs, double), *cost = ARENA_ARRAY(arena, arcs, double);
	double *lower = ARENA_ZEROED(arena, arcs, double), *upper = ARENA_ARRAY(arena, arcs, double);
	double *row_lower = ARENA_ARRAY(arena, n, double), *row_upper = ARENA_ARRAY(arena, n, double);
	enum tw_status status =
		start && row && element && cost && lower && upper && row_lower && row_upper ? TW_OK : TW_ERROR_MEMORY;
	if (status == TW_OK) {
		for (size_t v = 0; v < n; v++) {
			/* A terminal may be a leaf, and nothing needs to enter the root. */
			row_lower[v] = problem->instance->terminal_at[v] == INSTANCE_NONE ? 0 : -DBL_MAX;
			row_upper[v] = DBL_MAX;
		}
		for (uint32_t arc = 0; arc < arcs; arc++) {
			start[arc] = (CoinBigIndex)(2 * arc);
			row[2 * arc] = (int)cut_tail(problem, arc);
			row[2 * arc + 1] = (int)cut_head(problem, arc);
			element[2 * arc] = 1;
			element[2 * arc + 1] = -1;
			cost[arc] = ldexp((double)problem->cost[arc], -lp->exponent);
			upper[arc] = problem->allowed[arc];
		}
		start[arcs] = (CoinBigIndex)(2 * arcs);
		Clp_loadProblem(lp->model, (int)arcs, (int)n, start, row, element, lower, upper, cost, row_lower,
				row_upper);
	}
	arena_release(arena, mark);
	return status;
}

enum tw_status cut_lp_init(struct cut_lp *lp, const struct cut_problem *problem, struct cut_pool *pool)
{
	struct arena *arena = problem->search->arena;
	*lp = (struct cut_lp){
		.model = Clp_newModel(),
		.problem = problem,
		.pool = pool,
		.balance_count = problem->instance->vertex_count,
		.idle = ARENA_ZEROED(arena, pool->capacity, uint8_t),
		.reduced = ARENA_ARRAY(arena, problem->arc_count, int64_t),
		.x = ARENA_ZEROED(arena, problem->arc_count, double),
		.upper = ARENA_ARRAY(arena, problem->arc_count, double),
	};
	if (!lp->model || !lp->idle || !lp->reduced || !lp->x || !lp->upper)
		return TW_ERROR_MEMORY;
	int64_t heaviest = 1;
	for (uint32_t arc = 0; arc < problem->arc_count; arc++)
		heaviest = problem->cost[arc] > heaviest ? problem->cost[arc] : heaviest;
	(void)frexp((double)heaviest, &lp->exponent);
	lp->exponent -= COST_BITS;
	Clp_setLogLevel(lp->model, 0);
	return load_balance(lp);
}

void cut_lp_free(struct cut_lp *lp)
{
	if (lp->model)
		Clp_deleteModel(lp->model);
	lp->model = NULL;
}

static enum tw_status add_rows(struct cut_lp *lp)
{
	const struct cut_pool *pool = lp->pool;
	const uint32_t first = lp->row_count, count = pool->count - first;
	if (!count)
		return TW_OK;
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
			column[i] = (int)pool->arc[pool->start[first] + i];
			element[i] = 1;
		}
		for (uint32_t i = 0; i < count; i++) {
			lower[i] = 1;
			upper[i] = DBL_MAX;
			lp->idle[first + i] = 0;
		}
		Clp_addRows(lp->model, (int)count, lower, upper, start, column, element);
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
		const int64_t y = fixed_price(lp, price[lp->balance_count + i]);
		overflow |= __builtin_add_overflow(sum, y, &sum);
		for (size_t j = pool->start[i]; y && j < pool->start[i + 1]; j++)
			overflow |= __builtin_sub_overflow(lp->reduced[pool->arc[j]], y, &lp->reduced[pool->arc[j]]);
	}
	for (uint32_t arc = 0; arc < problem->arc_count && !overflow; arc++) {
		const uint32_t u = cut_tail(problem, arc), v = cut_head(problem, arc);
		int64_t *reduced = &lp->reduced[arc];
		if (problem->instance->terminal_at[u] == INSTANCE_NONE)
			overflow |= __builtin_sub_overflow(*reduced, fixed_price(lp, price[u]), reduced);
		if (problem->instance->terminal_at[v] == INSTANCE_NONE)
			overflow |= __builtin_add_overflow(*reduced, fixed_price(lp, price[v]), reduced);
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

enum tw_status cut_lp_solve(struct cut_lp *lp)
{
	const struct cut_problem *problem = lp->problem;
	enum tw_status status = add_rows(lp);
	if (status != TW_OK)
		return status;
	for (uint32_t arc = 0; arc < problem->arc_count; arc++)
		lp->upper[arc] = problem->allowed[arc];
	Clp_chgColumnUpper(lp->model, lp->upper);
	int code;
	do {
		Clp_setMaximumIterations(lp->model, ITERATIONS_AT_ONCE);
		Clp_dual(lp->model, 0);
		code = Clp_status(lp->model);
		const uint64_t iterations = (uint64_t)Clp_numberIterations(lp->model) + 1;
		if (!search_spend(problem->search, 2 * iterations * ((uint64_t)lp->row_count + lp->balance_count)))
			return TW_ERROR_CANCELLED;
		if (iterations == 1 && code == 3)
			break;
	} while (code == 3); /* stopped by the number of iterations */
	lp->is_solved = code == 0;
	if (!lp->is_solved)
		return TW_OK; /* bound and solution stay as they were: nothing new is known */
	memcpy(lp->x, Clp_getColSolution(lp->model), problem->arc_count * sizeof *lp->x);
	const double *activity = Clp_getRowActivity(lp->model);
	for (uint32_t i = 0; i < lp->row_count; i++) {
		if (activity[lp->balance_count + i] < 1 + 1e-6)
			lp->idle[i] = 0;
		else if (lp->idle[i] < UINT8_MAX)
			lp->idle[i]++;
	}
	prove_bound(lp);
	return TW_OK;
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
				gone[gone_count++] = (int)(lp->balance_count + i);
			continue;
		}
		kept_rows += i < lp->row_count;
		memmove(pool->arc + at, pool->arc + start, (end - start) * sizeof *pool->arc);
		pool->target[kept] = pool->target[i];
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
