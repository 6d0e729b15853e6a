#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# clang-tidy with .clang-tidy over the product's sources, or over those whose path holds a word given:
#   tests/tidy.sh [word...]
# It reads the compile commands of build/dev (cmake --preset dev; those of release are of ten sources at a
# time); flags that only GCC knows are dropped.
set -euo pipefail
cd "$(dirname "$0")/.."

commands=build/dev/compile_commands.json
[ -f "$commands" ] || { echo "$commands is missing: run cmake --preset dev" >&2; exit 2; }
tidy=$(command -v clang-tidy-14 || command -v clang-tidy) || {
  echo "clang-tidy is missing: apt-get install clang-tidy-14" >&2
  exit 2
}
words=()
for word in "${@:-.cpp}"; do words+=(-e "$word"); done
mapfile -t sources < <(git ls-files 'core/*.cpp' 'capture/*.cpp' 'drivers/*.cpp' 'recon/*.cpp' \
  'fusion/*.cpp' 'app/*.cpp' | grep -F "${words[@]}" | while read -r file; do
    grep -qF "\"$PWD/$file\"" "$commands" && echo "$file"
  done)
[ ${#sources[@]} -gt 0 ] || { echo "no compiled source matches: $*" >&2; exit 2; }
echo "${#sources[@]} sources"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
sed -E 's/ -Wno-(stringop-overflow|restrict|maybe-uninitialized)| -fpch-preprocess| -Winvalid-pch| -include [^ ]*cmake_pch\.hxx//g' \
  "$commands" > "$folder/compile_commands.json"
printf '%s\0' "${sources[@]}" |
  xargs -0 -n 1 -P "$(nproc)" "$tidy" -p "$folder" --quiet --extra-arg=-Wno-unknown-warning-option \
    --extra-arg=-Wno-unknown-pragmas 2> "$folder/errors" || {
    grep -E "error:" "$folder/errors" || true
    exit 1
  }
