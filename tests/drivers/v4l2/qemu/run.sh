#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Boots Debian's stock kernel in QEMU and runs drivers/v4l2 there against the kernel's own vivid and
# uvcvideo drivers; the UVC camera is software of ours behind usbip. Needs no rights and leaves
# nothing outside the build folder.
#
#   tests/drivers/v4l2/qemu/run.sh [BUILD_FOLDER] [GTEST_FILTER]
#
# Exit code 0: passed; 77: skipped, with what is missing; else failed.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=$(realpath -m "${1:-$here/../../../../build/release}")
filter=${2:-*}
work=$build/qemu
binary=$build/tests/drivers/v4l2/qemu/drivers_v4l2_qemu_guest
limit_s=${ORBITFUSE_QEMU_LIMIT_S:-540}

skip() { echo "SKIPPED: $1" >&2; exit 77; }

need=()
command -v qemu-system-x86_64 > /dev/null || need+=(qemu-system-x86)
command -v cpio > /dev/null || need+=(cpio)
[ -x /bin/busybox ] && ! ldd /bin/busybox > /dev/null 2>&1 || need+=(busybox-static)
[ ${#need[@]} -eq 0 ] || skip "install first: apt-get install --no-install-recommends ${need[*]}"
cmake --build "$build" --target drivers_v4l2_qemu_guest

# The kernel's package is unpacked here, not installed. ORBITFUSE_QEMU_KERNEL_DEB names one that
# was fetched before, for machines without a registry.
mkdir -p "$work"
if [ ! -e "$work/kernel/done" ]; then
  rm -rf "$work/kernel"; mkdir -p "$work/kernel"
  deb=${ORBITFUSE_QEMU_KERNEL_DEB:-}
  if [ -z "$deb" ]; then
    command -v apt-cache > /dev/null || skip "no apt here; set ORBITFUSE_QEMU_KERNEL_DEB to a kernel's .deb file"
    package=$(apt-cache depends linux-image-amd64 2> /dev/null | awk '/Depends: linux-image-/ {print $2; exit}')
    [ -n "$package" ] || skip "apt knows no linux-image-amd64; run apt-get update, or set ORBITFUSE_QEMU_KERNEL_DEB"
    (cd "$work/kernel" && apt-get download -q "$package" > /dev/null 2>&1) ||
      skip "$package cannot be downloaded; set ORBITFUSE_QEMU_KERNEL_DEB to its .deb file"
    deb=$(echo "$work"/kernel/*.deb)
  fi
  dpkg -x "$deb" "$work/kernel"
  rm -f "$work"/kernel/*.deb
  touch "$work/kernel/done"
fi
kernel=$(echo "$work"/kernel/boot/vmlinuz-*)
modules=$(echo "$work"/kernel/lib/modules/*)

# A module file after those it depends on, by its own .modinfo.
add_module() {
  local file dependency
  file=$(find "$modules" -name "${1//[-_]/[-_]}.ko" | head -1)
  [ -n "$file" ] || { echo "the kernel package has no module $1" >&2; exit 1; }
  for dependency in $(grep -az '^depends=' "$file" | tr -d '\0' | sed 's/^depends=//; s/,/ /g'); do
    add_module "$dependency"
  done
  grep -qx "$(basename "$file")" "$root/modules/order" && return
  cp "$file" "$root/modules/"
  basename "$file" >> "$root/modules/order"
}

root=$work/root
rm -rf "$root"
mkdir -p "$root"/{bin,dev,proc,sys,tmp,modules,lib64}
: > "$root/modules/order"
for module in vivid uvcvideo vhci-hcd; do add_module "$module"; done
cp /bin/busybox "$root/bin/"
cp "$here/guest_init.sh" "$root/init"
chmod +x "$root/init"
# Stripped: symbols would only be copied into the machine's memory.
strip -o "$root/test" "$binary"
ldd "$binary" | grep -o '/[^ ]*' | sort -u | while read -r library; do
  install -D -m 755 "$(readlink -f "$library")" "$root$library"
done
(cd "$root" && find . | cpio -o -H newc --quiet) > "$work/initramfs.cpio"
rm -rf "$root"

log=$work/console.log
echo "booting $(basename "$kernel") (at most $limit_s s; console in $log)"
# The baseline of the project is AVX2, which -cpu max has.
timeout "$limit_s" qemu-system-x86_64 -accel tcg,thread=multi -cpu max -smp 2 -m 1536 -nographic \
  -no-reboot -nic none -kernel "$kernel" -initrd "$work/initramfs.cpio" \
  -append "console=ttyS0 quiet loglevel=3 panic=-1 filter=$filter" \
  < /dev/null > "$log" 2>&1 || echo "QEMU ended with $?" >&2
rm -f "$work/initramfs.cpio"
tr -d '\r' < "$log" | sed -n '/ORBITFUSE-GUEST-BEGIN/,$p'
grep -q '^ORBITFUSE-GUEST-RESULT 0' "$log" && grep -q 'PASSED.* [1-9][0-9]* test' "$log" || {
  echo "FAILED: the guest did not report success within $limit_s s (see $log)" >&2
  exit 1
}
