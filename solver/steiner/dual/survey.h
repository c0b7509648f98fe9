/* Which terminals lie near each other, and which in the middle: what the dual chooses by. */
#ifndef SOLVER_STEINER_DUAL_SURVEY_H
#define SOLVER_STEINER_DUAL_SURVEY_H

#include "solver/steiner/search.h"

/* Distances are coarse, as the dual's (coarse.h), and approximate. Terminals keep their indices and, about, their
 * distances, whatever is deleted: a survey is good for all instances that follow. */
struct dual_survey {
	uint32_t *near;          /* [terminal_count * near_count] the nearest other terminals, nearest first */
	uint32_t near_count;     /* the same for all */
	uint32_t *near_distance; /* [terminal_count] to the nearest */
	uint64_t *middle;        /* [terminal_count] small for terminals in the middle of all: they make good roots */
};

/* Surveys search->instance. Arrays from search->arena; TW_ERROR_MEMORY. */
enum tw_status dual_survey_make(struct dual_survey *survey, struct search *search, unsigned coarse_shift) TW_NODISCARD;

#endif
