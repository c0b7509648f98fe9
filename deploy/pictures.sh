#!/bin/sh
# pictures.sh BINARY: README's pictures anew: the generated suit with 36 haptic motors, laid out under its six motions. Needs
# rsvg-convert and pngquant.
set -eu
cd "$(dirname "$0")/.."
binary=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$binary" sample --out "$folder/sample" >/dev/null
set --
for motion in "$folder"/sample/motions/*.pc2; do
	set -- "$@" --motion "$motion"
done
"$binary" layout --worn "$folder/sample/suit.obj" "$@" --terminals "$folder/sample/terminals/muscles36.json" --out "$folder/layout" >/dev/null
picture() { # NAME WIDTH
	rsvg-convert -w "$2" -b white "$folder/layout/$1.svg" | pngquant 96 - >"deploy/pictures/$1.png"
}
picture suit 1400
picture pattern 1100
