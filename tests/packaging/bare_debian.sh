#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The Debian package as a stranger meets it: a bare Debian 12 in a folder, `apt-get install
# ./orbitfuse.deb` from Debian's own mirror, the whole job on the orbit that the package brings as an
# ordinary user, then `apt-get purge`, after which nothing of ours may be left.
#
#   tests/packaging/bare_debian.sh [BUILD_FOLDER] [WORK_FOLDER]
#
# Needs root, debootstrap and the network, some 4 GB in WORK_FOLDER (removed in the end unless
# ORBITFUSE_KEEP is set) and half an hour. ORBITFUSE_DEB_CACHE names a folder of .deb files and, as
# base.tar, of the bare system: what is there is not fetched again.
# Exit code 0: passed; 77: skipped, with what is missing; else failed.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=$(realpath -m "${1:-$here/../../build/release}")
work=$(realpath -m "${2:-$build/bare_debian}")
mirror=http://deb.debian.org/debian
root=$work/root

skip() { echo "SKIPPED: $1" >&2; exit 77; }
fail() { echo "FAILED: $1" >&2; exit 1; }
say() { echo "== $(date -u +%H:%M:%S) $1"; }

# Mounts of the test end with its own namespace, whatever happens: nothing is left to unmount, and
# removing the folder can't reach through one.
if [ -z "${ORBITFUSE_OWN_MOUNTS:-}" ]; then
  [ "$(id -u)" -eq 0 ] || skip "run it as root: debootstrap and chroot need that"
  command -v debootstrap > /dev/null || skip "install first: apt-get install debootstrap"
  package=$(ls "$build"/packages/orbitfuse_*.deb 2> /dev/null | tail -n 1 || true)
  [ -n "$package" ] || skip "no package in $build/packages: cmake/build.sh --target deb"
  [ -n "${ORBITFUSE_DEB_CACHE:-}" ] || getent hosts deb.debian.org > /dev/null || skip "no network: deb.debian.org is not found"
  [ ! -e "$root" ] || fail "$root exists; remove it, or name another WORK_FOLDER"
  mkdir -p "$root"
  status=0
  ORBITFUSE_OWN_MOUNTS=1 ORBITFUSE_PACKAGE=$package unshare --mount --pid --fork --kill-child \
    bash "$0" "$build" "$work" || status=$?
  [ -n "${ORBITFUSE_KEEP:-}" ] || rm -rf --one-file-system "$root"
  exit $status
fi

inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }

# Everything on disk but what package tools and the kernel keep for themselves.
list_files() {
  (cd "$root" && find . -xdev \( -path ./proc -o -path ./sys -o -path ./dev -o -path ./var/cache \
    -o -path ./var/log -o -path ./var/lib/apt -o -path ./var/lib/dpkg -o -path ./tmp -o -path ./home \) -prune \
    -o -print | sort)
}

say "a bare Debian 12 in $root"
cache=${ORBITFUSE_DEB_CACHE:-}
if [ -n "$cache" ] && [ -e "$cache/base.tar" ]; then
  tar -C "$root" -xf "$cache/base.tar"
else
  debootstrap --variant=minbase bookworm "$root" "$mirror" > "$work/debootstrap.log" ||
    fail "debootstrap; see $work/debootstrap.log"
fi
cp /etc/resolv.conf "$root/etc/resolv.conf"
if [ -n "$cache" ]; then cp "$cache"/*.deb "$root/var/cache/apt/archives/" 2> /dev/null || true; fi
mount -t proc proc "$root/proc"
mount -t tmpfs tmpfs "$root/dev/shm" 2> /dev/null || true
# No daemon of a dependency starts in here.
printf '#!/bin/sh\nexit 101\n' > "$root/usr/sbin/policy-rc.d"
chmod +x "$root/usr/sbin/policy-rc.d"
inside apt-get update -qq
inside useradd --create-home visitor
list_files > "$work/before.txt"

say "apt-get install ./$(basename "$ORBITFUSE_PACKAGE")"
cp "$ORBITFUSE_PACKAGE" "$root/tmp/orbitfuse.deb"
inside apt-get install -y /tmp/orbitfuse.deb > "$work/install.log" 2>&1 ||
  { tail -n 20 "$work/install.log" >&2; fail "apt-get install"; }
inside dpkg -L orbitfuse > "$work/package_files.txt"
installed_mb=$(($(inside dpkg-query -W -f='${Installed-Size}\n' | awk '{s += $1} END {print s}') / 1024))
say "$(inside orbitfuse --version); $installed_mb MB of packages in the folder"
version=$(inside dpkg-query -W -f='${Version}' orbitfuse)
[ "orbitfuse ${version%-*}" = "$(inside orbitfuse --version)" ] || fail "package $version, program $(inside orbitfuse --version)"

# An ordinary user, for whom the package's orbit is read-only.
say "the whole run on the package's orbit"
as_visitor() { inside setpriv --reuid=visitor --regid=visitor --clear-groups env HOME=/home/visitor "$@"; }
as_visitor sh -c 'cd && exec orbitfuse run /usr/share/orbitfuse/replay_data/car --out out/' \
  > "$work/run.log" 2>&1 || { tail -n 20 "$work/run.log" >&2; fail "orbitfuse run"; }
tail -n 5 "$work/run.log"
out=$root/home/visitor/out
[ -s "$out/report/report.html" ] || fail "no report"
grep -q "OrbitFuse" "$out/report/report.html" || fail "the report is not one"
for stage in poses_visible poses_thermal train_visible train_thermal render fuse metrics report; do
  [ -d "$out/$stage" ] || fail "the run left no $stage"
done
as_visitor sh -c 'cd && exec orbitfuse inspect out/' > "$work/inspect.log" 2>&1 || fail "orbitfuse inspect out/"
as_visitor sh -c 'cd && exec orbitfuse measure out/ --hottest 2' > "$work/measure.log" 2>&1 || fail "orbitfuse measure"

# The parts that are looked for beside the program.
say "camera profiles, dictionary and network, man pages"
as_visitor orbitfuse capture /home/visitor/none --thermal aravis:none,profile=nonesuch --dry-run \
  > "$work/profiles.log" 2>&1 && fail "a profile that is not there was taken"
grep -q "not in /usr/share/orbitfuse/cameras; use one of .*flir-radiometric" "$work/profiles.log" || fail "the program finds no camera profiles: $(cat "$work/profiles.log")"
for method in ms-srif cnn-lpif pca-msif best; do
  as_visitor sh -c "cd && exec orbitfuse fuse --visible \$(ls out/render/visible/*.png | head -n 1) \
    --thermal \$(ls out/render/thermal/*.tiff | head -n 1) --method $method --out $method.png" \
    > "$work/fuse.log" 2>&1 || { cat "$work/fuse.log" >&2; fail "orbitfuse fuse --method $method"; }
done

say "apt-get purge"
inside apt-get remove --purge -y orbitfuse > "$work/purge.log" 2>&1 || fail "apt-get remove --purge"
left=()
while read -r file; do
  [ "$file" != /. ] && [ -e "$root$file" ] || continue
  inside dpkg -S "$file" > /dev/null 2>&1 || left+=("$file")
done < "$work/package_files.txt"
while read -r file; do left+=("$file"); done < <(list_files | grep -i orbitfuse || true)
[ ${#left[@]} -eq 0 ] || fail "left behind: ${left[*]}"
inside apt-get autoremove --purge -y > "$work/autoremove.log" 2>&1 || fail "apt-get autoremove"
list_files > "$work/after.txt"
diff "$work/before.txt" "$work/after.txt" > "$work/difference.txt" || true
say "after autoremove $(grep -c '^>' "$work/difference.txt" || true) files of dependencies stay ($work/difference.txt), none of orbitfuse"
say "passed"
