# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash
# Options of a run of seconds, `options`, and the session it is for: sourced by what runs farms.
options=(--seed 1)
for set in train.visible.iterations=60 train.thermal.iterations=20 train.visible.eval_count=0 \
  train.thermal.eval_count=0 depth.width_px=48 train.visible.max_width_px=48 \
  train.thermal.max_width_px=48 train.visible.cloud_width_px=32 train.thermal.cloud_width_px=32 \
  render.views=1 render.width_px=64 'fuse.methods=["heat"]'; do
  options+=(--set "$set")
done

# Poses are given: what is looked at is the farm, and they are half of a run's cost.
import_cars() {  # PROGRAM SESSION FOLDER COUNT: FOLDER/car1 and its copies
  "$1" import "$3/car1" --visible "$2/visible" --thermal "$2/thermal" \
    --ground-truth "$2/ground_truth.json" > /dev/null
  for ((i = 2; i <= $4; ++i)); do cp -r "$3/car1" "$3/car$i"; done
}
