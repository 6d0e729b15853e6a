#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs the whole job on a data set with exact truth and prints every stage's time beside its error.
#   bench/app/end_to_end.sh FOLDER [options of orbitfuse run]
# FOLDER: a recorded session with ground_truth.json (replay_data/*), or image folders with one
# (orbits/container of the shared data): those are imported first, with stations, elevations and
# focal lengths as an operator would know them, not the poses.
set -euo pipefail
folder=${1:?"usage: bench/app/end_to_end.sh FOLDER [options]"}
shift
program=$(cd "$(dirname "$0")/../.." && pwd)/build/release/app/orbitfuse
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

session=$folder
if [ ! -e "$folder/manifest.jsonl" ]; then
  session=$work/session
  "$program" import "$session" --visible "$folder/visible" --thermal "$folder/thermal" \
    --ground-truth "$folder/ground_truth.json" --priors-only --station-spacing-deg 30 --loops 2 >&2
fi
"$program" run "$session" --out "$work/out" "$@" >&2
echo "$(basename "$folder"), $(nproc) threads, $("$program" doctor --folder "$work" | sed -n 's/^.*processor *//p')"
"$program" inspect "$work/out"
"$program" eval "$session" --out "$work/out" --ground-truth "$folder/ground_truth.json"
