/* Migration 5, second part: a fair queue; see lane.h for who takes turns, and pick.c for how a job is found. The table
 * of jobs keeps its rows, which get some columns more. */
#include "storage/schema_parts.h"

const char schema_queue[] =
	/* A client's place in a class: clients take turns. */
	"CREATE TABLE share("
	"	number INTEGER PRIMARY KEY,"
	"	tenant INTEGER NOT NULL,"
	"	client INTEGER NOT NULL," /* 0: all that have no key */
	"	pool INTEGER NOT NULL,"   /* enum job_pool */
	"	class INTEGER NOT NULL,"  /* enum job_class */
	"	weight INTEGER NOT NULL DEFAULT 1 CHECK (weight > 0),"
	"	open INTEGER NOT NULL DEFAULT 0," /* 0: none of its lanes is open; 1: one may be, and it stands in turn
						   */
	"	turn INTEGER NOT NULL DEFAULT 0," /* where it was when it stood there last */
	"	UNIQUE (tenant, client, pool, class)"
	") STRICT;"

	/* Open shares, the next one first. A table of its own, because every claim writes it: one page. */
	"CREATE TABLE turn("
	"	pool INTEGER NOT NULL,"
	"	class INTEGER NOT NULL,"
	"	turn INTEGER NOT NULL," /* grows with what the share is given */
	"	share INTEGER NOT NULL,"
	"	PRIMARY KEY (pool, class, turn, share)"
	") STRICT, WITHOUT ROWID;"

	/* Jobs that run so many at a time. */
	"CREATE TABLE job_group("
	"	number INTEGER PRIMARY KEY,"
	"	tenant INTEGER NOT NULL,"
	"	name TEXT NOT NULL,"
	"	max_running INTEGER NOT NULL CHECK (max_running > 0),"
	"	running INTEGER NOT NULL DEFAULT 0 CHECK (running >= 0),"
	"	UNIQUE (tenant, name)"
	") STRICT;"

	/* The jobs of a share that are of one kind and group. */
	"CREATE TABLE lane("
	"	number INTEGER PRIMARY KEY,"
	"	share INTEGER NOT NULL REFERENCES share ON DELETE CASCADE,"
	"	kind INTEGER NOT NULL,"                    /* enum job_kind */
	"	job_group INTEGER NOT NULL DEFAULT 0,"     /* number of a job_group; 0: none */
	"	head_priority INTEGER NOT NULL DEFAULT 0," /* no ready job of it comes before this one; */
	"	head_number INTEGER NOT NULL DEFAULT 0,"   /* 0: none is ready */
	"	blocked INTEGER NOT NULL DEFAULT 0,"       /* its group runs as many as it may */
	"	UNIQUE (share, kind, job_group)"
	") STRICT;"
	"CREATE INDEX lane_open ON lane(share, head_priority DESC, head_number) WHERE head_number > 0 AND blocked = 0;"
	"CREATE INDEX lane_of_group ON lane(job_group) WHERE job_group > 0;"

	/* How often a class was passed over since it had its last turn, while one of its jobs could have been claimed.
	 */
	"CREATE TABLE class_turn("
	"	pool INTEGER NOT NULL,"
	"	class INTEGER NOT NULL,"
	"	passed INTEGER NOT NULL,"
	"	PRIMARY KEY (pool, class)"
	") STRICT, WITHOUT ROWID;"

	/* Attempts that did not end in a result. */
	"CREATE TABLE job_attempt("
	"	job INTEGER NOT NULL REFERENCES job ON DELETE CASCADE,"
	"	number INTEGER NOT NULL,"  /* grows */
	"	times INTEGER NOT NULL,"   /* so many in a row ended like this; what follows is the last one's */
	"	ending INTEGER NOT NULL,"  /* enum attempt_ending */
	"	attempt INTEGER NOT NULL," /* which of its attempts_max */
	"	worker TEXT NOT NULL,"
	"	started_ms INTEGER NOT NULL,"
	"	ended_ms INTEGER NOT NULL,"
	"	failure_type TEXT NOT NULL,"
	"	failure_text TEXT NOT NULL,"
	"	PRIMARY KEY (job, number)"
	") STRICT, WITHOUT ROWID;";

/* What jobs get on top. */
const char schema_queue_jobs[] =
	"DROP INDEX job_claimable; DROP INDEX job_put_off; DROP INDEX job_oldest;"
	"ALTER TABLE job RENAME COLUMN not_before_ms TO pause_until_ms;" /* by the lease clock */
	"ALTER TABLE job ADD COLUMN class INTEGER NOT NULL DEFAULT 2;"
	"ALTER TABLE job ADD COLUMN lane INTEGER NOT NULL DEFAULT 0;"          /* number of a lane */
	"ALTER TABLE job ADD COLUMN not_before_ms INTEGER NOT NULL DEFAULT 0;" /* by the machine's clock, as the next */
	"ALTER TABLE job ADD COLUMN cancel_at_ms INTEGER NOT NULL DEFAULT 0;"  /* 0: never */
	"ALTER TABLE job ADD COLUMN delayed INTEGER NOT NULL DEFAULT 0;"       /* 1 until not_before_ms has come */
	"ALTER TABLE job ADD COLUMN supersedes TEXT NOT NULL DEFAULT '';"
	"ALTER TABLE job ADD COLUMN affinity INTEGER NOT NULL DEFAULT 0;"
	"ALTER TABLE job ADD COLUMN passed INTEGER NOT NULL DEFAULT 0;" /* times that another was preferred to it */
	/* So many requests asked for it, and nobody wants it when their clients go away; 0: somebody does. */
	"ALTER TABLE job ADD COLUMN transient INTEGER NOT NULL DEFAULT 0;"
	"ALTER TABLE job ADD COLUMN session TEXT NOT NULL DEFAULT '';"
	/* What a job without a resource of its own works on, and which part of it it makes. */
	"ALTER TABLE job ADD COLUMN subject INTEGER REFERENCES resource ON DELETE CASCADE;"
	"ALTER TABLE job ADD COLUMN argument TEXT NOT NULL DEFAULT '';"

	/* Nobody said who had asked: all that is there is of one client. The heads come before all that is ready. */
	"INSERT INTO share(tenant, client, pool, class, open)"
	" SELECT DISTINCT 1, 0, CASE kind WHEN 4 THEN 1 ELSE 0 END, 2, 1 FROM job;"
	"INSERT INTO turn SELECT pool, class, turn, number FROM share;"
	"INSERT INTO lane(share, kind, head_priority, head_number) SELECT s.number, k.kind, 2147483647, 1"
	" FROM (SELECT DISTINCT kind FROM job) k JOIN share s ON s.pool = CASE k.kind WHEN 4 THEN 1 ELSE 0 END;"
	"UPDATE job SET lane = (SELECT number FROM lane WHERE lane.kind = job.kind);"

	/* What may be claimed, and all that a claim looks at before it decides. */
	"CREATE INDEX job_ready ON job(lane, priority DESC, number, affinity, room_bytes)"
	" WHERE state = 0 AND waiting_for = 0 AND pause_until_ms = 0 AND delayed = 0;"
	"CREATE INDEX job_oldest ON job(class, created_ms)"
	" WHERE state = 0 AND waiting_for = 0 AND pause_until_ms = 0 AND delayed = 0;"
	"CREATE INDEX job_paused ON job(pause_until_ms) WHERE state = 0 AND pause_until_ms > 0;"
	"CREATE INDEX job_delayed ON job(not_before_ms) WHERE state = 0 AND delayed = 1;"
	"CREATE INDEX job_deadline ON job(cancel_at_ms) WHERE state < 2 AND cancel_at_ms > 0 AND cancel_requested = 0;"
	"CREATE INDEX job_superseded ON job(tenant, client, supersedes) WHERE state < 2 AND supersedes <> '';"
	"CREATE INDEX job_by_subject ON job(subject, argument) WHERE subject IS NOT NULL;"

	/* A file that a task has made, which may be dropped; touched_ms is when somebody read it, to the hour. */
	"ALTER TABLE blob ADD COLUMN of_task INTEGER NOT NULL DEFAULT 0;"
	"CREATE INDEX blob_of_task ON blob(touched_ms) WHERE of_task = 1 AND resource IS NOT NULL;"

	"DROP TRIGGER job_count_added; DROP TRIGGER job_count_removed; DROP TRIGGER job_count_moved; DROP TABLE "
	"job_count;"
	"CREATE TABLE job_count("
	"	tenant INTEGER NOT NULL,"
	"	client INTEGER NOT NULL,"
	"	class INTEGER NOT NULL,"
	"	kind INTEGER NOT NULL,"
	"	state INTEGER NOT NULL,"
	"	count INTEGER NOT NULL,"
	"	PRIMARY KEY (tenant, client, class, kind, state)"
	") STRICT, WITHOUT ROWID;"
	"INSERT INTO job_count SELECT tenant, client, class, kind, state, count(*) FROM job GROUP BY 1, 2, 3, 4, 5;"
	"CREATE TRIGGER job_count_added AFTER INSERT ON job BEGIN"
	"	INSERT INTO job_count VALUES (NEW.tenant, NEW.client, NEW.class, NEW.kind, NEW.state, 1)"
	"	 ON CONFLICT (tenant, client, class, kind, state) DO UPDATE SET count = count + 1;"
	" END;"
	"CREATE TRIGGER job_count_removed AFTER DELETE ON job BEGIN"
	"	UPDATE job_count SET count = count - 1 WHERE tenant = OLD.tenant AND client = OLD.client"
	"	 AND class = OLD.class AND kind = OLD.kind AND state = OLD.state;"
	" END;"
	"CREATE TRIGGER job_count_moved AFTER UPDATE OF state, class, client ON job"
	" WHEN OLD.state <> NEW.state OR OLD.class <> NEW.class OR OLD.client <> NEW.client BEGIN"
	"	UPDATE job_count SET count = count - 1 WHERE tenant = OLD.tenant AND client = OLD.client"
	"	 AND class = OLD.class AND kind = OLD.kind AND state = OLD.state;"
	"	INSERT INTO job_count VALUES (NEW.tenant, NEW.client, NEW.class, NEW.kind, NEW.state, 1)"
	"	 ON CONFLICT (tenant, client, class, kind, state) DO UPDATE SET count = count + 1;"
	" END;";
