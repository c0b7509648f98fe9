#!/bin/sh
# run.sh: runs every bench program and prints `name value unit goal verdict` lines, each figure beside its goal. Times are
# processor time where the goal is per core, wall time where it is what a user waits for. Exit 1 when a bench fails to
# run; a missed goal is printed as MISSED and counted in the last line.
#   BUILD  folder of the built programs     DATA  real suits, used where they are there     TIGHTWIRE  the binary
set -u
log="$BUILD/bench.log"
: >"$log"
failed=0
run() { # COMMAND…: shows and keeps what it prints
	"$@" >"$log.part" || failed=1
	cat "$log.part"
	cat "$log.part" >>"$log"
}
for program in $(find "$BUILD/tests/bench" -type f -perm -u+x ! -name '*.o' ! -name '*.d' | sort); do
	run "$program"
done
for script in tests/bench/*.bench.sh; do
	run sh "$script"
done
rm -f "$log.part"
ok=$(grep -c ' ok$' "$log"); missed=$(grep -c ' MISSED$' "$log")
echo "$ok goals met, $missed missed"
[ $failed -eq 0 ]
