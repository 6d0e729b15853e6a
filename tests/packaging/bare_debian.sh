#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The Debian packages on a bare Debian 12, in a folder: installs orbitfuse.deb there, runs the demo's orbit,
# builds a program against liborbitfuse-dev, removes both and sees that nothing is left.
#   tests/packaging/bare_debian.sh FOLDER_OF_DEBS [WORK_FOLDER]
# Needs root, debootstrap, some 6 GB under WORK_FOLDER (a temporary one, removed at the end) and Debian's mirror.
set -euo pipefail
here=$(cd "$(dirname "$0")/../.." && pwd)
debs=$(cd "$1" && pwd)
work=${2:-$(mktemp -d)}
root=$work/root
mkdir -p "$work"
mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}

say() { printf '\n== %s\n' "$*"; }
fail() { echo "bare_debian: $*" >&2; exit 1; }
inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 \
  DEBIAN_FRONTEND=noninteractive ${http_proxy:+http_proxy=$http_proxy} ${https_proxy:+https_proxy=$https_proxy} "$@"; }
leave() {
  for m in proc dev; do mountpoint -q "$root/$m" && umount "$root/$m"; done
  [ $# -eq 0 ] || [ -n "${KEEP:-}" ] || rm -rf "$work"
}
trap 'leave keep' EXIT

say "a bare Debian 12"
[ -e "$root/etc/debian_version" ] || debootstrap --variant=minbase bookworm "$root" "$mirror" > "$work/debootstrap.log"
cp /etc/resolv.conf "$root/etc/"
for file in /etc/apt/apt.conf.d/*proxy* /etc/apt/apt.conf; do [ ! -e "$file" ] || cp "$file" "$root/etc/apt/apt.conf.d/"; done
mount -t proc proc "$root/proc"
mount --bind /dev "$root/dev"
inside apt-get update -qq

say "install"
program=$(ls "$debs"/orbitfuse_*.deb) library=$(ls "$debs"/liborbitfuse-dev_*.deb)
cp "$program" "$library" "$root/tmp/"
inside apt-get install -y --no-install-recommends "/tmp/$(basename "$program")" > "$work/install.log"
dpkg-deb -c "$program" | awk '$1 !~ /^d/ {sub(/^\./, "", $6); print $6}' > "$work/files"
inside orbitfuse --version
inside orbitfuse doctor || true

say "the demo"
start=$SECONDS
inside orbitfuse run /usr/share/orbitfuse/replay_data/car --out /root/out --quiet
[ -s "$root/root/out/report/report.html" ] || fail "no report"
inside orbitfuse measure /root/out --hottest 1
inside orbitfuse export /root/out --to /root/car.glb
echo "demo done, $((SECONDS - start)) s"

say "remove"
inside apt-get purge -y orbitfuse > "$work/remove.log"
left=$(while read -r file; do [ ! -e "$root$file" ] || echo "$file"; done < "$work/files")
[ -z "$left" ] || fail "left behind: $left"
[ ! -e "$root/usr/share/orbitfuse" ] || fail "left behind: /usr/share/orbitfuse"
inside dpkg -s orbitfuse > /dev/null 2>&1 && fail "dpkg still knows it"

if [ -n "${WITH_LIBRARY:-}" ]; then
  say "the library"
  inside apt-get install -y --no-install-recommends g++ cmake ninja-build pkg-config "/tmp/$(basename "$library")" > "$work/library.log"
  cp -r "$here/tests/library/stranger" "$root/root/stranger"
  inside cmake -S /root/stranger -B /root/stranger/build -G Ninja > "$work/stranger.log"
  inside cmake --build /root/stranger/build >> "$work/stranger.log"
fi
say "passed"
