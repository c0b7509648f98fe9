#!/bin/sh
# run.sh [unit|http]: runs the C tests (cmocka) and the HTTP, contract, process and short soak tests (Node's test runner), each to
# its end, and closes with one line that counts them. Exit 1 when a test failed, or when none ran.
#   BUILD      folder of the built programs        TIGHTWIRE  the binary
#   DATA       real suits, INSTANCES Steiner instances, CASES small bad inputs; tests that need them are skipped where
#              they are not
set -u
which=${1:-all}
logs="$BUILD/test-logs"
rm -rf "$logs"; mkdir -p "$logs"
passed=0 failed=0 skipped=0

count() { grep -c "$1" "$2" || true; }

# The programs run side by side, one for each core; each leaves its output, and its exit code once it has ended. They are a
# process group of their own, which ends with this script.
start_unit() { # PROGRAM…
	printf '%s\n' "$@" >"$logs/units"
	setsid xargs -a "$logs/units" -P "$(nproc)" -I '{}' sh -c '
		log=$1/unit-$(echo "${2#"$BUILD"/tests/unit/}" | tr / -)
		CMOCKA_MESSAGE_OUTPUT=TAP "$2" >"$log.tap" 2>"$log.tap.err"
		echo $? >"$log.code.new" && mv "$log.code.new" "$log.code"' sh "$logs" '{}' &
	units=$!
	trap 'kill -s TERM -- "-$units" 2>/dev/null; exit 130' INT TERM HUP
}

# They are told of in the order of their names, whichever ends first.
run_unit() {
	programs=$(find "$BUILD/tests/unit" -type f -perm -u+x ! -name '*.o' ! -name '*.d' | sort)
	# shellcheck disable=SC2086
	start_unit $programs
	for program in $programs; do
		name=${program#"$BUILD"/tests/unit/}
		log="$logs/unit-$(echo "$name" | tr / -).tap"
		while [ ! -e "${log%.tap}.code" ]; do
			kill -0 "$units" 2>/dev/null || break
			sleep 0.1
		done
		code=$(cat "${log%.tap}.code" 2>/dev/null || echo 'lost')
		# cmocka 1.1.5 says `not ok … # SKIP` of a skipped test.
		skip=$(count '^\(not \)\?ok .*# SKIP' "$log"); ok=$(count '^ok ' "$log"); bad=$(count '^not ok ' "$log")
		ok=$((ok - $(count '^ok .*# SKIP' "$log"))); bad=$((bad - $(count '^not ok .*# SKIP' "$log")))
		# A crash counts as a failed test even when every line before it was ok.
		[ "$code" != 0 ] && [ "$bad" -eq 0 ] && bad=1
		[ $((ok + bad + skip)) -eq 0 ] && bad=1
		passed=$((passed + ok)); failed=$((failed + bad)); skipped=$((skipped + skip))
		if [ "$bad" -gt 0 ]; then
			echo "FAIL unit/$name (exit $code)"
			grep -A 12 '^not ok ' "$log" | head -n 60
			tail -n 30 "$log.err"
		else
			echo "ok   unit/$name: $ok passed$([ "$skip" -gt 0 ] && echo ", $skip skipped")"
		fi
	done
}

run_http() {
	log="$logs/http.tap"
	node --test --test-reporter=tap tests/http/*.test.mjs tests/soak/*.test.mjs >"$log" 2>&1
	code=$?
	ok=$(sed -n 's/^# pass //p' "$log"); bad=$(sed -n 's/^# fail //p' "$log"); skip=$(sed -n 's/^# skipped //p' "$log")
	cancelled=$(sed -n 's/^# cancelled //p' "$log")
	ok=${ok:-0} bad=$((${bad:-0} + ${cancelled:-0})) skip=${skip:-0}
	[ $code -ne 0 ] && [ "$bad" -eq 0 ] && bad=1
	passed=$((passed + ok)); failed=$((failed + bad)); skipped=$((skipped + skip))
	if [ "$bad" -gt 0 ]; then
		echo "FAIL http"
		grep -A 25 '^ *not ok ' "$log" | head -n 200
	else
		echo "ok   http: $ok passed$([ "$skip" -gt 0 ] && echo ", $skip skipped")"
	fi
}

case $which in
unit) run_unit ;;
http) run_http ;;
*) run_unit; run_http ;;
esac
[ $((passed + failed)) -eq 0 ] && failed=1
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
