#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What comes of stations that were declared wrongly, with no focal length told.
#   bench/app/wrong_stations.sh FOLDER SPACING_DEG LOOPS
# FOLDER: visible/, thermal/ and ground_truth.json (orbits/* of the shared data: 30 degrees, 2 loops).
set -euo pipefail
usage="usage: bench/app/wrong_stations.sh FOLDER SPACING_DEG LOOPS"
folder=${1:?"$usage"} spacing_deg=${2:?"$usage"} loops=${3:?"$usage"}
program=$(cd "$(dirname "$0")/../.." && pwd)/build/release/app/orbitfuse
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$program" import "$work/session" --visible "$folder/visible" --thermal "$folder/thermal" \
  --station-spacing-deg "$spacing_deg" --loops "$loops" >&2
"$program" run "$work/session" --out "$work/out" --stage poses_thermal >&2
"$program" eval "$work/session" --out "$work/out" --ground-truth "$folder/ground_truth.json"
