#!/bin/sh
# run.sh: runs every bench program and prints `name value unit goal verdict` lines, each figure beside its goal. Times are
# processor time where the goal is per core, wall time where it is what a user waits for. Exit 1 when a bench fails to
# run; a missed goal is printed as MISSED and counted in the last line.
#   BUILD  folder of the built programs     DATA  real suits, used where they are there     TIGHTWIRE  the binary
set -u
log="$BUILD/bench.log" figures="$BUILD/bench.out"
: >"$log"
failed=0
run() { # COMMAND…: its lines on the screen and in the log
	"$@" >"$figures" || { echo "$* failed"; failed=1; }
	tee -a "$log" <"$figures"
}
for program in $(find "$BUILD/tests/bench" -type f -perm -u+x ! -name '*.o' ! -name '*.d' | sort); do
	run "$program"
done
for script in tests/bench/*.bench.sh; do
	[ ! -e "$script" ] || run sh "$script"
done
echo "$(grep -c ' ok$' "$log") goals met, $(grep -c ' MISSED$' "$log") missed"
[ $failed -eq 0 ]
