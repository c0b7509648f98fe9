#!/bin/sh
# deps.sh build|lint|test: installs what is missing, and nothing else. Debian's packages through apt; what the HTTP tests need
# through npm, by the lock file. Quiet and quick when all is there.
set -eu
cd "$(dirname "$0")/.."

build='gcc g++ make pkg-config libopenmesh-dev libmicrohttpd-dev libjansson-dev libsqlite3-dev libmodbus-dev
       libzstd-dev libsodium-dev coinor-libclp-dev'
show='curl jq librsvg2-bin'
test='libcmocka-dev libgeos-dev clang libclang-rt-14-dev sqlite3'
lint='clang-format clang-tidy cppcheck'

missing() {
	for package in "$@"; do
		dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q '^install ok installed' || echo "$package"
	done
}

apt_install() {
	[ $# -eq 0 ] && return
	echo "deps: installing $*"
	root=; [ "$(id -u)" = 0 ] || root=sudo
	$root apt-get update -qq
	DEBIAN_FRONTEND=noninteractive $root apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

# shellcheck disable=SC2046,SC2086
case "${1:-}" in
build)
	apt_install $(missing $build $show)
	;;
lint)
	apt_install $(missing $build $lint)
	;;
test)
	apt_install $(missing $build $show $test)
	# Any Node.js of version 18 or later will do, also one that did not come through apt.
	command -v node >/dev/null || apt_install nodejs
	command -v npm >/dev/null || apt_install npm
	if [ ! -d tests/http/node_modules ] || [ tests/http/package-lock.json -nt tests/http/node_modules/.package-lock.json ]; then
		npm --prefix tests/http ci --omit=optional --no-audit --no-fund --loglevel=error
	fi
	;;
*)
	echo "usage: deps.sh build|lint|test" >&2
	exit 2
	;;
esac
