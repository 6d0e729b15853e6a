#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds and runs the tests: the fast ones, or with --slow the slow ones.
set -euo pipefail
cd "$(dirname "$0")/.."

preset=release
case "${1:-}" in
  "") ;;
  --slow) preset=slow ;;
  *) echo "usage: tests/run.sh [--slow]" >&2; exit 2 ;;
esac
cmake/install_packages.sh
cmake/build.sh
# One more than there are processors: some wait for what a camera or a peer does not do in time.
ctest --preset "$preset" --parallel "$(($(nproc) + 1))"
