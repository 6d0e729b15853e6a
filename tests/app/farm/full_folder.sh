#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A farm whose results folder has no space left: the file is named with its remedy, what is done
# stays, and with space again `resume` ends it.
#   full_folder.sh ORBITFUSE SESSION     needs to mount a tmpfs; ends with 77 where it can't
set -euo pipefail
if [ -z "${ALONE:-}" ]; then  # the mount is ours alone, and goes with us
  unshare --mount true 2> /dev/null || { echo "skipped: no right to mount"; exit 77; }
  ALONE=1 exec unshare --mount "$0" "$@"
fi
program=$(realpath "$1")
session=$(realpath "$2")
work=$(mktemp -d)
trap 'umount "$work/disk" 2> /dev/null; rm -rf "$work"' EXIT
fail() { echo "FAILED: $*"; exit 1; }
mkdir "$work/disk"
mount -t tmpfs -o size=3m none "$work/disk" || { echo "skipped: no right to mount"; exit 77; }

. "$(dirname "$0")/short_run.sh"
options+=(--stage-cores 1 --workers 1)
import_cars "$program" "$session" "$work" 2
farm=$work/disk/farm
ends_with() {  # CODE WORDS...
  local code=0
  "${@:2}" > "$work/out" 2> "$work/said" || code=$?
  [ "$code" = "$1" ] || fail "code $code, $1 expected: $(cat "$work/said")"
}
says() { grep -q -- "$1" "$work/said" "$work/out" || fail "'$1' not in: $(cat "$work/said" "$work/out")"; }
starts() { grep -o '"starts":[0-9]*' "$farm/.farm/$1/$2.json"; }

# -- full before it starts ---------------------------------------------------------------------------
dd if=/dev/zero of="$work/disk/others" bs=64k 2> /dev/null || true
ends_with 4 "$program" farm "$work"/car? --out "$farm" "${options[@]}"
says "No space left on device"
says "$farm"
[ ! -e "$farm/farm.json" ] || fail "a plan that was not written whole"
rm "$work/disk/others"

# -- a stage's results fill it -----------------------------------------------------------------------
ends_with 5 "$program" farm "$work"/car? --out "$farm" "${options[@]}"
cat "$work/out"
says "No space left on device"
says "free disk space"
[ "$(starts car1 poses_visible)" = '"starts":1' ] || fail "a full folder is no cause to try again"

# -- space again ---------------------------------------------------------------------------------------
mount -o remount,size=400m "$work/disk"
ends_with 0 "$program" farm resume "$farm"
[ "$(starts car1 poses_visible)" = '"starts":1' ] || fail "what was done ran again"
for car in car1 car2; do [ -s "$farm/$car/report/report.html" ] || fail "$car has no report"; done
echo "all hold"
