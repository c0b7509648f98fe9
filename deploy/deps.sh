#!/bin/sh
# deps.sh build|lint|test: installs what is missing, and nothing else. Debian's packages through apt; what the HTTP tests need
# through npm, by the lock file. Quiet and quick when all is there. Exit 75 where a download did not arrive: try again later.
set -eu
cd "$(dirname "$0")/.."

build='gcc g++ make pkg-config libopenmesh-dev libmicrohttpd-dev libjansson-dev libsqlite3-dev libmodbus-dev
       libzstd-dev libsodium-dev coinor-libclp-dev libsuitesparse-dev zlib1g-dev'
show='curl jq librsvg2-bin'
test='libcmocka-dev libgeos-dev clang libclang-rt-14-dev sqlite3'
lint='clang-format clang-tidy cppcheck'

missing() {
	for package in "$@"; do
		dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q '^install ok installed' || echo "$package"
	done
}

no_download() {
	echo "deps: a download did not arrive ($1); try again when the network is there" >&2
	exit 75
}

# Nothing may ask: neither debconf, nor dpkg about a configuration file, nor a service that wants to restart.
apt() {
	$root env DEBIAN_FRONTEND=noninteractive NEEDRESTART_MODE=l apt-get -qq --yes --no-install-recommends \
		-o Dpkg::Options::=--force-confdef -o Dpkg::Options::=--force-confold -o Dpkg::Use-Pty=0 "$@" </dev/null
}

# Resolving names, downloading and installing apart, so that a failure is known for what it is.
apt_install() {
	[ $# -eq 0 ] && return
	root=; [ "$(id -u)" = 0 ] || root=sudo
	echo "deps: installing $*"
	apt -o APT::Update::Error-Mode=any update || no_download "apt-get update"
	apt install --simulate "$@" >/dev/null
	apt install --download-only "$@" >/dev/null || no_download "apt-get install"
	apt install "$@" >/dev/null
}

# npm's words for a registry that does not answer, or not with a package.
npm_install() {
	log=$(mktemp)
	if npm --prefix tests/http ci --omit=optional --no-audit --no-fund --loglevel=error >"$log" 2>&1; then
		rm -f "$log"
		return
	fi
	cat "$log" >&2
	grep -qE 'code (E(AI_AGAIN|NOTFOUND|CONN[A-Z]*|NETUNREACH|HOSTUNREACH|TIMEDOUT|403|407|429|5[0-9]{2})|ERR_SOCKET[A-Z_]*|.*_CERT.*)$' \
		"$log" && { rm -f "$log"; no_download "npm ci"; }
	rm -f "$log"
	exit 1
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
		npm_install
	fi
	;;
*)
	echo "usage: deps.sh build|lint|test" >&2
	exit 2
	;;
esac
