/* Jobs in statements. Internal to this folder. */
#ifndef STORAGE_JOB_SQL_H
#define STORAGE_JOB_SQL_H

#include "storage/job.h"

#include <assert.h>

/* The states in statements: literals rather than parameters, because partial indices are used for literals only. */
#define SQL_QUEUED "0/*queued*/"
#define SQL_RUNNING "1/*running*/"
#define SQL_SUCCEEDED "2/*succeeded*/"
#define SQL_FAILED "3/*failed*/"
#define SQL_CANCELLED "4/*cancelled*/"
#define SQL_INCOMPLETE "5/*incomplete*/"
static_assert(JOB_QUEUED == 0 && JOB_RUNNING == 1 && JOB_SUCCEEDED == 2 && JOB_FAILED == 3 && JOB_CANCELLED == 4 &&
		      JOB_INCOMPLETE == 5 && JOB_STATES == 6,
	      "the literals above");

/* As job_state_has_result says. */
#define SQL_WITH_RESULT "(" SQL_SUCCEEDED ", " SQL_INCOMPLETE ")"
/* Ended without the result that others wait for. */
#define SQL_UNSUCCESSFUL "(" SQL_FAILED ", " SQL_CANCELLED ", " SQL_INCOMPLETE ")"
/* Ended so that it may be tried again. */
#define SQL_REDRIVABLE "(" SQL_FAILED ", " SQL_CANCELLED ")"

/* A job that could be claimed, by the index job_ready. */
#define SQL_READY "state = " SQL_QUEUED " AND waiting_for = 0 AND pause_until_ms = 0 AND delayed = 0"
/* One that has not ended: as the indices say it. */
#define SQL_UNFINISHED "state < 2/*succeeded*/"

/* A job of one of these classes (JOB_CLASS_BIT…), created before then, of this group: parameters of the statement; 0,
 * 0 and '' for all. */
#define SQL_MATCHES(classes, before_ms, group)                                                                         \
	"(" classes " = 0 OR " classes " >> class & 1 = 1) AND (" before_ms " = 0 OR created_ms < " before_ms ")"      \
	" AND (" group " = '' OR EXISTS (SELECT 1 FROM lane l JOIN job_group g ON g.number = l.job_group"              \
	"  WHERE l.number = job.lane AND g.name = " group "))"

#endif
