#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# bench/nerf/cuda.sh PROGRAM DATA SCENE...: fields of orbits on the processor and on the first CUDA
# device, as rows of docs/benchmarks/cuda.md; then each kernel's time on the first scene.
# PROGRAM is nerf_time_error of a build with -DORBITFUSE_CUDA=ON.
set -euo pipefail
program=$1 data=$2
shift 2

row() {  # scene, device, further options
  local scene=$1 device=$2
  shift 2
  "$program" --data "$data" --scene "$scene" --device "$device" "$@" | awk -v scene="$scene" -v device="$device" '
    /^step/ { wall = $7 }
    /^render 640/ { render = $3 }
    /^full resolution/ { db = $3; for (i = 1; i <= NF; ++i) if ($i == "MAE") mae = $(i + 1) }
    END { printf "| `%s` | %s | %s | %s%s | %s |\n", scene, device, wall, db, mae ? ", " mae " K" : "", render }'
}

echo "| scene | device | training, s | test views, dB | 640x480, s |"
echo "|---|---|---|---|---|"
for scene in "$@"; do
  for device in cpu cuda; do
    row "$scene" "$device" --depth
    row "$scene-thermal" "$device"
  done
done
"$program" --data "$data" --scene "$1" --device cuda --depth --quick --kernels | grep launches
