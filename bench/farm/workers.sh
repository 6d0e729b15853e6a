#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What a farm on this machine costs and gains with 1, 2 and 4 workers: four sessions of stages that
# only wait (the farm alone: no processor is in the way), then of a short run of a real session.
#   [WORKERS="1 2 4"] [STAGE_S=1.5] workers.sh ORBITFUSE SESSION
set -euo pipefail
program=$(realpath "$1")
session=$(realpath "$2")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
stage_s=${STAGE_S:-1.5}
# Of farm.json, as the program has it: a plan of an older one is refused.
schema=$(sed -n 's/.*plan_schema = \([0-9]*\).*/\1/p' "$(dirname "$0")/../../app/farm/plan.hpp")
printf '#!/bin/sh\nexec sleep %s\n' "$stage_s" > "$work/stand_in"
chmod +x "$work/stand_in"
for i in 1 2 3 4; do mkdir -p "$work/s$i"; done
lscpu | sed -n 's/^Model name: */processor: /p'
echo "cores: $(nproc); load before: $(cut -d' ' -f1-3 /proc/loadavg)"

measure() {  # WORKERS WORDS...: wall time from outside, the stages' own from their records
  python3 - "$@" << 'PY'
import json, pathlib, subprocess, sys, time
workers, farm, *words = sys.argv[1:]
begin = time.monotonic()
ran = subprocess.run(words, capture_output=True, text=True)
wall = time.monotonic() - begin
if ran.returncode != 0:
    sys.exit(f"code {ran.returncode}: {ran.stderr}")
records = [json.loads(f.read_text()) for f in pathlib.Path(farm, ".farm").glob("*/*.json")]
stages, cpu = sum(r["wall_s"] for r in records), sum(r["cpu_s"] for r in records)
idle = (int(workers) * wall - stages) / len(records)
print(f"{workers} workers: {len(records)} stages, wall {wall:.1f} s, stages {stages:.1f} s, "
      f"CPU {cpu:.1f} s, a worker's time between stages {1000 * idle:.0f} ms a stage "
      f"({100 * (1 - stages / (int(workers) * wall)):.1f} %)")
PY
}

echo "-- stages that wait $stage_s s"
for n in ${WORKERS:-1 2 4}; do
  farm=$work/waiting$n
  mkdir -p "$farm/.farm"
  python3 - "$farm" "$work" "$schema" << 'PY'
import json, sys
farm, work, schema = sys.argv[1:]
stages = [f"stage{i}" for i in range(10)]
json.dump({"schema": int(schema), "program": f"{work}/stand_in", "options": [], "stages": stages, "tries": 3,
           "sessions": [{"name": f"s{i}", "folder": f"{work}/s{i}"} for i in range(1, 5)],
           "needs": {s: {"cores": 1, "memory_mb": 10, "time_min": 5, "gpu": False} for s in stages}},
          open(f"{farm}/farm.json", "w"))
PY
  measure $n "$farm" "$program" farm resume "$farm" --workers $n --cores 4
done

echo "-- a short run of $(basename "$session")"
. "$(dirname "$0")/../../tests/app/farm/short_run.sh"
import_cars "$program" "$session" "$work" 4
for n in ${WORKERS:-1 2 4}; do
  measure $n "$work/run$n" "$program" farm "$work"/car? --out "$work/run$n" --workers $n --cores 4 \
    --stage-cores 1 "${options[@]}"
done
echo "load after: $(cut -d' ' -f1-3 /proc/loadavg)"
