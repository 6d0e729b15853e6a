#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Fails where a tracked source differs from .clang-format (clang-format 14, as in Debian 12), and names
# the file and line. With --fix it formats them.
set -euo pipefail
cd "$(dirname "$0")/.."

mode=(--dry-run -Werror)
case "${1:-}" in
  "") ;;
  --fix) mode=(-i) ;;
  *) echo "usage: tests/format_check.sh [--fix]" >&2; exit 2 ;;
esac
formatter=$(command -v clang-format-14 || command -v clang-format) || {
  echo "clang-format is missing: apt-get install clang-format-14" >&2
  exit 2
}
git ls-files -z '*.cpp' '*.hpp' | xargs -0 -n 40 -P "$(nproc)" "$formatter" --style=file "${mode[@]}"
