#!/bin/sh
# Layout requests against a real service (see submit.mjs): on this disk, and on one that takes 5 ms longer to confirm a write.
set -eu
node tests/bench/submit.mjs
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/slow.c" <<'C'
#include <sys/syscall.h>
#include <unistd.h>
int fdatasync(int file)
{
	usleep(5000);
	return (int)syscall(SYS_fdatasync, file);
}
C
gcc -shared -fPIC -o "$folder/slow.so" "$folder/slow.c"
SLOW_DISK="$folder/slow.so" node tests/bench/submit.mjs
