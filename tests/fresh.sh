#!/bin/sh
# fresh.sh: what README promises of a fresh machine, done. Debian 12 as `debootstrap --variant=minbase` makes it, with git, make and
# ca-certificates; a clone of the committed HEAD; `make demo`; `make test`; all in a chroot that is gone afterwards.
#
# The machine lends what lets it download: apt's sources of Debian, keyrings and Acquire settings, certificates, proxies, npm's
# registry. No other package source, no cache, none of its programs. ../shared is not there, so tests that need it are skipped.
#
# Says `fresh: skipped: why` and ends well where it is not root, where a chroot cannot be had, or where a download does not arrive.
# A build, a link, a demo or a test that fails there is a failure.
#   TMPDIR   where the system is made: 3 GB, on a file system that may hold devices and programs (default /var/tmp)
set -eu
cd "$(dirname "$0")/.."

skip() {
	echo "fresh: skipped: $*"
	exit 0
}

# --- a place that goes away: mounts with this script's own namespace, processes with it, the folder with the outer half ------------
if [ -z "${FRESH_ROOT:-}" ]; then
	[ "$(id -u)" = 0 ] || skip "making a chroot needs root"
	FRESH_ROOT=$(mktemp -d "${TMPDIR:-/var/tmp}/tightwire-fresh.XXXXXX")
	export FRESH_ROOT
	chmod 755 "$FRESH_ROOT" # apt fetches as a user of its own
	inner=
	remove() {
		[ -z "$inner" ] || kill -KILL "$inner" 2>/dev/null || true
		# Where the namespace was refused, mounts are still here; a folder with a mount in it is never removed.
		for process in /proc/[0-9]*; do
			[ "$(readlink "$process/root")" != "$FRESH_ROOT" ] || kill -KILL "${process#/proc/}" 2>/dev/null || true
		done
		awk -v root="$FRESH_ROOT/" 'index($5, root) == 1 { print $5 }' /proc/self/mountinfo | sort -r | while read -r mount; do
			umount -l "$mount" || true
		done
		rm -f "$FRESH_ROOT.log"
		grep -q " $FRESH_ROOT/" /proc/self/mountinfo || rm -rf --one-file-system "$FRESH_ROOT"
	}
	trap remove EXIT
	trap 'exit 130' INT TERM HUP
	apart=
	unshare --mount --pid --fork --kill-child true 2>/dev/null && apart='unshare --mount --pid --fork --kill-child'
	# shellcheck disable=SC2086
	$apart sh tests/fresh.sh "$@" &
	inner=$!
	wait "$inner" && code=0 || code=$?
	inner=
	exit "$code"
fi
root=$FRESH_ROOT
log=$root.log

seconds() { echo $(($(date +%s) - $1)); }

# quietly WHAT COMMAND…: runs it with its output in the log; false with the end of it shown where it fails.
quietly() {
	what=$1 start=$(date +%s)
	shift
	echo "fresh: $what"
	if "$@" >"$log" 2>&1; then
		echo "       $(seconds "$start") s"
		return
	fi
	echo "       failed after $(seconds "$start") s:"
	tail -n "${LINES_SHOWN:-60}" "$log"
	return 1
}

# --- the system ------------------------------------------------------------------------------------------------------------------
# The machine's own mirrors of Debian 12, one "URI suite component" a line; nothing where it knows none.
sources() {
	apt-get indextargets --format '$(REPO_URI) $(CODENAME) $(COMPONENT)' 'Identifier: Packages' 'Origin: Debian' 2>/dev/null |
		grep -E ' bookworm(-updates|-security)? main$' | sort -u || true
}

keyring=/usr/share/keyrings/debian-archive-keyring.gpg
[ -f $keyring ] || keyring=
install_debootstrap() {
	command -v apt-get >/dev/null || return 1
	DEBIAN_FRONTEND=noninteractive apt-get -qq update &&
		DEBIAN_FRONTEND=noninteractive apt-get -qq --yes --no-install-recommends install debootstrap
}
bootstrap() {
	# What is thrown away need not be synced to the disk; nothing else changes by it.
	mkdir -p "$root/etc/dpkg/dpkg.cfg.d" && echo force-unsafe-io >"$root/etc/dpkg/dpkg.cfg.d/fresh"
	mirror=$(sources | awk '$2 == "bookworm" { print $1; exit }')
	debootstrap --variant=minbase --include=git,make,ca-certificates ${keyring:+"--keyring=$keyring"} bookworm \
		"$root" ${mirror:+"$mirror"}
}
command -v debootstrap >/dev/null || quietly 'debootstrap' install_debootstrap || skip 'debootstrap cannot be installed'
quietly 'a minimal Debian 12' bootstrap || skip 'debootstrap could not make a system'

# --- what the machine lends --------------------------------------------------------------------------------------------------------
# lend_path PATH: a copy at the same path. What is there goes first: a link there would lead out of the chroot.
lend_path() {
	[ -e "$1" ] || return 0
	rm -rf "${root:?}$1"
	mkdir -p "$root$(dirname "$1")"
	cp -rL --preserve=mode "$1" "$root$1"
}
lend() {
	lines=$(sources) # without any, debootstrap has used its own mirror, and written it down
	[ -z "$lines" ] || echo "$lines" | sed 's/^/deb /' >"$root/etc/apt/sources.list"
	apt-config dump 2>/dev/null | grep -E '^Acquire::(http|https|Retries|Check-Valid-Until|Check-Date|ForceIPv[46])\b' \
		>"$root/etc/apt/apt.conf.d/80machine" || true
	for path in /etc/apt/keyrings /etc/apt/trusted.gpg.d /etc/apt/auth.conf /etc/apt/auth.conf.d /usr/share/keyrings \
		/etc/ssl/certs /etc/hosts /etc/resolv.conf; do
		lend_path $path || return 1
	done
	# Only what says how to reach a registry, wherever npm found it.
	for file in /etc/npmrc /usr/etc/npmrc /usr/local/etc/npmrc "${NPM_CONFIG_USERCONFIG:-$HOME/.npmrc}"; do
		[ ! -f "$file" ] || grep -E '^ *((@[^ =]+:)?registry|(https?-)?proxy|noproxy|ca|cafile|strict-ssl|//[^ =]+) *=' "$file" || true
	done >"$root/root/.npmrc"
	chmod 600 "$root/root/.npmrc"
}
quietly 'sources, certificates and registry of this machine' lend

mount_all() {
	mount -t proc proc "$root/proc" || mount --bind /proc "$root/proc" || return 1
	mount -t sysfs -o ro sysfs "$root/sys" || mount --bind /sys "$root/sys" || echo 'no /sys'
	mkdir -p "$root/dev/shm" "$root/dev/pts"
	mount -t tmpfs -o mode=1777 tmpfs "$root/dev/shm" || chmod 1777 "$root/dev/shm"
	mount -t devpts -o newinstance,ptmxmode=0666,mode=0620 devpts "$root/dev/pts" || echo 'no /dev/pts'
}
quietly 'mounts' mount_all || skip 'this machine may not mount /proc in a chroot'

# --- the two commands ----------------------------------------------------------------------------------------------------------------
network='[a-zA-Z]+_proxy|[A-Z]+_PROXY|(npm|NPM)_(config|CONFIG)_([^=]*registry|cafile|CAFILE|strict_ssl|STRICT_SSL)'
certificates='NODE_EXTRA_CA_CERTS|SSL_CERT_FILE|CURL_CA_BUNDLE|GIT_SSL_CAINFO'

# inside COMMAND: in the chroot, with the environment of a login and what of the machine's says how to reach the network.
inside() (
	set -- chroot "$root" sh -c "$1"
	for name in $(env | sed -nE "s/^($network|$certificates)=.*/\\1/p"); do
		set -- "$name=$(printenv "$name")" "$@"
	done
	exec env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 TERM=dumb "$@" </dev/null
)
lend_certificates() {
	for name in $(env | sed -nE "s/^($certificates)=.*/\\1/p"); do
		lend_path "$(printenv "$name")" || return 1
	done
}
quietly 'certificates that the environment names' lend_certificates

# The repository may belong to another user than root.
lend_repository() {
	GIT_CONFIG_COUNT=1 GIT_CONFIG_KEY_0=safe.directory GIT_CONFIG_VALUE_0='*' \
		git clone --bare --no-hardlinks . "$root/srv/tightwire.git"
}
quietly "the repository at $(git -c safe.directory='*' log -1 --format=%h)" lend_repository

must() { # WHAT COMMAND
	quietly "$1" inside "$2" && return
	! grep -q '^deps: a download did not arrive' "$log" || skip 'a download did not arrive'
	echo "fresh: FAILED: $1"
	exit 1
}
must 'git clone' 'cd && git clone /srv/tightwire.git'
must 'make demo' 'cd ~/tightwire && make demo'
sed -n '/^ *weight/,/^$/p' "$log"
must 'make test' 'cd ~/tightwire && make test'
echo "fresh: $(tail -n 1 "$log"), after \`make demo\`, on a fresh Debian 12"
