/* The independent checker of certificates. It knows the graph and nothing of the solver but steiner_verify, which is as
 * independent.
 *
 * Potentials are taken one after the other. The arcs that a potential takes something from all enter a member of it, as
 * p(u) - p(v) is positive only where p(v) is below the radius; so a dense array holds the current potential, and the
 * rows of the members are looked at. `taken` sums up by arc over all potentials, and is compared with the weights at
 * the end. Sums that do not fit 64 bits are refused, never wrapped. */
#include "solver/steiner/certificate/certificate.h"

#include <stdlib.h>
#include <string.h>

struct check {
	const struct steiner_certificate *certificate;
	const struct graph *graph;
	uint8_t *is_open;  /* [vertex_count] a terminal without a potential yet */
	uint64_t *value;   /* [vertex_count] of the current potential; UINT64_MAX: no member */
	uint64_t *taken;   /* [2 * edge_count] from the arc that enters the vertex in whose row it stands */
	uint32_t *tree;    /* [tree_count] edges of the graph */
	uint8_t *is_taken; /* [edge_count] the edge is in `tree` already */
	struct tw_error *error;
};

TW_PRINTF(3, 4)
static enum tw_status refuse(const struct check *check, const char *where, const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	tw_error_vfill(check->error, TW_ERROR_INPUT, "steiner-certificate-wrong", where, format, arguments);
	va_end(arguments);
	return TW_ERROR_INPUT;
}

static enum tw_status check_claims(const struct check *check, uint32_t terminal_count)
{
	const struct steiner_certificate *c = check->certificate;
	if (c->vertex_count != check->graph->vertex_count || c->edge_count != check->graph->edge_count ||
	    c->terminal_count != terminal_count)
		return refuse(check, "instance",
			      "the certificate is of an instance with %u vertices, %u edges and %u terminals, not of "
			      "this one",
			      c->vertex_count, c->edge_count, c->terminal_count);
	if (!c->scale || c->certified != c->total / c->scale + (c->total % c->scale != 0))
		return refuse(check, "certified", "is not the total over the scale, rounded up");
	if (c->certified > c->bound || c->bound > c->weight)
		return refuse(check, "bound", "does not lie between what is certified and the tree's weight");
	return TW_OK;
}

static enum tw_status find_tree_edge(const struct check *check, uint32_t i)
{
	const struct certificate_edge *edge = &check->certificate->tree[i];
	const struct graph *graph = check->graph;
	const uint32_t u = edge->ends[0], v = edge->ends[1];
	char where[40];
	snprintf(where, sizeof where, "tree edge %u", i + 1);
	if (u >= graph->vertex_count || v >= graph->vertex_count)
		return refuse(check, where, "ends at a vertex that is not there");
	for (uint32_t a = graph->first[u]; a < graph->first[u + 1]; a++) {
		const uint32_t e = graph->edge[a];
		if (graph->head[a] != v || graph->weight[e] != edge->weight || check->is_taken[e])
			continue;
		check->is_taken[e] = 1;
		check->tree[i] = e;
		return TW_OK;
	}
	return refuse(check, where, "the graph has no such edge from %u to %u of weight %llu", u + 1, v + 1,
		      (unsigned long long)edge->weight);
}

static enum tw_status check_tree(const struct check *check, const uint32_t *terminals, uint32_t terminal_count)
{
	const struct steiner_certificate *c = check->certificate;
	for (uint32_t i = 0; i < c->tree_count; i++) {
		const enum tw_status status = find_tree_edge(check, i);
		if (status != TW_OK)
			return status;
	}
	struct tw_error why = {0};
	const enum tw_status status =
		steiner_verify(check->graph, terminals, terminal_count, check->tree, c->tree_count, c->weight, &why);
	if (status == TW_ERROR_INTERNAL)
		return refuse(check, "tree", "%s%s%s", why.where, *why.where ? " " : "", why.text);
	return status == TW_OK ? TW_OK : tw_fail_memory(check->error);
}

/* Lays the members into check->value, which holds nothing else. */
static enum tw_status lay_members(const struct check *check, const struct certificate_potential *potential,
				  const char *where)
{
	const struct certificate_member *member = check->certificate->member + potential->start;
	for (uint32_t i = 0; i < potential->count; i++) {
		if (member[i].vertex >= check->graph->vertex_count)
			return refuse(check, where, "member %u is not a vertex", i + 1);
		if (member[i].value >= potential->radius)
			return refuse(check, where, "member %u is not below the radius", i + 1);
		if (check->value[member[i].vertex] != UINT64_MAX)
			return refuse(check, where, "vertex %u is a member twice", member[i].vertex + 1);
		check->value[member[i].vertex] = member[i].value;
	}
	if (check->value[potential->terminal] != 0)
		return refuse(check, where, "is not zero at its terminal");
	if (check->value[check->certificate->root] != UINT64_MAX)
		return refuse(check, where, "the root is a member");
	return TW_OK;
}

static enum tw_status take_shares(const struct check *check, const struct certificate_potential *potential,
				  const char *where)
{
	const struct graph *graph = check->graph;
	const struct certificate_member *member = check->certificate->member + potential->start;
	for (uint32_t i = 0; i < potential->count; i++) {
		const uint32_t v = member[i].vertex;
		for (uint32_t a = graph->first[v]; a < graph->first[v + 1]; a++) {
			const uint64_t outer = check->value[graph->head[a]];
			const uint64_t above = outer < potential->radius ? outer : potential->radius;
			if (above > member[i].value &&
			    __builtin_add_overflow(check->taken[a], above - member[i].value, &check->taken[a]))
				return refuse(check, where, "takes more than 64 bits hold");
		}
	}
	for (uint32_t i = 0; i < potential->count; i++)
		check->value[member[i].vertex] = UINT64_MAX;
	return TW_OK;
}

static enum tw_status check_potential(const struct check *check, uint32_t i, uint64_t *total)
{
	const struct steiner_certificate *c = check->certificate;
	const struct certificate_potential *potential = &c->potential[i];
	char where[40];
	snprintf(where, sizeof where, "potential %u", i + 1);
	if (potential->start > c->member_count || potential->count > c->member_count - potential->start)
		return refuse(check, where, "its members are not there");
	if (potential->terminal >= c->vertex_count || !check->is_open[potential->terminal])
		return refuse(check, where, "belongs to no terminal, to the root, or to one that has its own already");
	check->is_open[potential->terminal] = 0;
	if (__builtin_add_overflow(*total, potential->radius, total))
		return refuse(check, where, "the radii sum to more than 64 bits hold");
	const enum tw_status status = lay_members(check, potential, where);
	return status == TW_OK ? take_shares(check, potential, where) : status;
}

static enum tw_status check_arcs(const struct check *check)
{
	const struct graph *graph = check->graph;
	for (uint32_t v = 0; v < graph->vertex_count; v++)
		for (uint32_t a = graph->first[v]; a < graph->first[v + 1]; a++) {
			uint64_t cost;
			if (__builtin_mul_overflow(graph->weight[graph->edge[a]], check->certificate->scale, &cost))
				continue; /* more than any sum */
			if (check->taken[a] > cost)
				return refuse(check, "potentials",
					      "take more from the edge from %u to %u than it weighs",
					      graph->head[a] + 1, v + 1);
		}
	return TW_OK;
}

static enum tw_status check_dual(const struct check *check)
{
	const struct steiner_certificate *c = check->certificate;
	uint64_t total = 0;
	if (c->root >= c->vertex_count || !check->is_open[c->root])
		return refuse(check, "root", "is not a terminal");
	check->is_open[c->root] = 0;
	memset(check->value, 0xff, c->vertex_count * sizeof *check->value);
	for (uint32_t i = 0; i < c->potential_count; i++) {
		const enum tw_status status = check_potential(check, i, &total);
		if (status != TW_OK)
			return status;
	}
	if (total != c->total)
		return refuse(check, "total", "is %llu, but the radii sum to %llu", (unsigned long long)c->total,
			      (unsigned long long)total);
	return check_arcs(check);
}

enum tw_status certificate_check(const struct steiner_certificate *certificate, const struct graph *graph,
				 const uint32_t *terminals, uint32_t terminal_count, struct tw_error *error)
{
	const size_t n = graph->vertex_count, m = graph->edge_count;
	struct check check = {
		.certificate = certificate,
		.graph = graph,
		.is_open = calloc(n + 1, 1),
		.value = calloc(n + 1, sizeof(uint64_t)),
		.taken = calloc(2 * m + 1, sizeof(uint64_t)),
		.tree = calloc((size_t)certificate->tree_count + 1, sizeof(uint32_t)),
		.is_taken = calloc(m + 1, 1),
		.error = error,
	};
	enum tw_status status;
	if (!check.is_open || !check.value || !check.taken || !check.tree || !check.is_taken) {
		status = tw_fail_memory(error);
	} else {
		status = check_claims(&check, terminal_count);
		if (status == TW_OK)
			status = check_tree(&check, terminals, terminal_count);
		for (uint32_t i = 0; i < terminal_count && status == TW_OK; i++)
			check.is_open[terminals[i]] = 1;
		if (status == TW_OK)
			status = check_dual(&check);
	}
	free(check.is_open);
	free(check.value);
	free(check.taken);
	free(check.tree);
	free(check.is_taken);
	return status;
}
