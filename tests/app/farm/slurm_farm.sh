#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The farm on a real Slurm: controller and two nodes on this machine, in a temporary folder.
#   slurm_farm.sh ORBITFUSE SESSION      needs root and Debian's slurm-wlm and munge; ends with 77
#                                        without. slurmdbd and mariadb-server-core, where they are,
#                                        have sacct asked; KEEP=1 leaves the folder.
# What Slurm costs a stage is measured, not judged: STAGE_S=13.3 for stages of that length.
set -euo pipefail
here=$(dirname "$(realpath "$0")")
program=$(realpath "$1")
session=$(realpath "$2")
for tool in slurmctld slurmd sbatch munged; do
  command -v "$tool" > /dev/null || { echo "skipped: no $tool (apt-get install slurm-wlm munge)"; exit 77; }
done
[ "$(id -u)" = 0 ] || { echo "skipped: slurmd needs root"; exit 77; }

work=$(mktemp -d)
. "$here/slurm_cluster.sh"
clean() {
  stop_cluster
  [ -n "${KEEP:-}" ] && echo "kept: $work" || rm -rf "$work"
}
trap clean EXIT
trap 'exit 1' INT TERM  # so that the daemons end as well
fail() { echo "FAILED: $*"; exit 1; }
check() { python3 "$here/slurm_farm_check.py" "$@" || fail "$1"; }
state_of() { python3 "$here/slurm_farm_check.py" state "$@"; }  # FARM SESSION STAGE
wait_until_empty() { while [ -n "$(squeue -h)" ]; do sleep 1; done; }
start_cluster

# -- sessions and the single run they are held against ---------------------------------------------
. "$here/short_run.sh"
import_cars "$program" "$session" "$work" 6
broken=$(ls "$work/car4/visible" | head -1)
truncate -s 100 "$work/car4/visible/$broken"
"$program" run "$work/car1" --out "$work/single" --threads 1 "${options[@]}"

# -- refusals --------------------------------------------------------------------------------------
refused() {  # WORDS PATTERN: the farm of these words says this and leaves no job
  "$program" farm "${@:2}" 2> "$work/said" && fail "taken: ${*:2}"
  grep -q -- "$1" "$work/said" || fail "'$1' not in: $(cat "$work/said")"
}
refused "nvalid partition" "$work/car1" --out "$work/refused" --slurm --partition nowhere
refused "no stage uses a GPU" "$work/car1" --out "$work/refused" --slurm --gpu-partition all
[ -z "$(squeue -h)" ] || fail "a refused farm left jobs"

# -- six sessions, one broken; a node dies in the middle of a stage and comes back -------------------
running_of() { python3 "$here/slurm_farm_check.py" running "$@"; }  # FARM SESSION
kill_a_node() {  # FARM; prints the session and stage whose stage was interrupted
  local stage
  while true; do
    read -r job array task <<< "$(squeue -h -t R -w n2 -o '%A %F %K' | head -1)"
    if [ -n "${job:-}" ] && running_of "$1" "car$((task + 1))" | grep -qE 'depth|train'; then
      kill_node n2 "$job"
      stage=$(running_of "$1" "car$((task + 1))")  # what it was at, and nothing goes on from here
      [ -n "$stage" ] && break
      node n2  # it was between two stages: another one
    fi
    sleep 0.1
  done
  while [ "$(squeue -h -j "${array}_$task" -o %T)" = RUNNING ]; do sleep 1; done
  node n2  # Slurm starts the job again after two minutes; made sooner, it forgets the job's end
  echo "car$((task + 1))/$stage"
}
farm=$work/farm
"$program" farm "$work"/car? --out "$farm" --slurm --stage-cores 1 "${options[@]}"
refused "a farm was started in it before" "$work"/car? --out "$farm" --slurm
refused "still wait or run in Slurm" resume "$farm"
interrupted=$(kill_a_node "$farm")
echo "n2 died with $interrupted"
wait_until_empty
"$program" farm status "$farm"
check farm "$farm" "$work/single" "$interrupted" "car4=visible/$broken"

# -- cancel and resume -----------------------------------------------------------------------------
# Longer, so that it is stopped between two steps and has a checkpoint to go on from.
farm=$work/cancelled
options+=(--set train.visible.iterations=500)
"$program" run "$work/car1" --out "$work/single2" --threads 1 "${options[@]}"
"$program" farm "$work/car1" "$work/car2" --out "$farm" --slurm --stage-cores 1 "${options[@]}"
steps='"done":[1-9].*"event":"progress","stage":"train.visible"'
until grep -q "$steps" "$farm/.farm/car1/train_visible.ndjson" 2> /dev/null; do sleep 0.1; done
"$program" farm cancel "$farm"
wait_until_empty
[ "$(state_of "$farm" car1 train_visible)" != running ] || fail "cancel left a stage as running"
"$program" farm cancel "$farm"  # nothing to do is no error
"$program" farm resume "$farm"
wait_until_empty
check resumed "$farm" "$work/single2"

# -- gather: what was killed, or out of time, is submitted once more with more ------------------------
# A stand-in for the stages, so that it can hang: `a` fares well, `b` is killed in `depth`, `c` takes
# longer than Slurm gives it and does not stop when asked.
cat > "$work/stand_in" << 'SH'
#!/bin/sh
[ "$1" = farm ] && exec PROGRAM "$@"
session=$(basename "$2") stage=$6
first() { [ ! -e "$4.$stage.started" ] && touch "$4.$stage.started"; }
[ "$session$stage" = bdepth ] && first "$@" && kill -9 $$
[ "$session$stage" = cdepth ] && first "$@" && { trap '' TERM; sleep 300; }
sleep "$(cat "$(dirname "$0")/stage_s")"
SH
sed -i "s|PROGRAM|$program|" "$work/stand_in"
chmod +x "$work/stand_in"
stand_in() {  # FARM SESSIONS...: sent off with the stand-in in the program's place
  scontrol update NodeName=n1,n2 State=DRAIN Reason=edit
  "$program" farm "${@:2}" --out "$1" --slurm --stage-cores 1 > /dev/null
  python3 "$here/slurm_farm_check.py" edit "$1" program "$work/stand_in"
}
mkdir -p "$work/a" "$work/b" "$work/c"
echo 0 > "$work/stage_s"
farm=$work/gathered
stand_in "$farm" "$work/a" "$work/b" "$work/c"
# shellcheck disable=SC2046
scontrol update "JobId=$(squeue -h -n orbitfuse-poses_visible -o %F | sort -u)" TimeLimit=1
scontrol update NodeName=n1,n2 State=RESUME
wait_until_empty
check gathered "$farm"
if [ -f "$work/slurmdbd.conf" ]; then  # the farm asked sacct, and not the controller in its place
  sacct --noheader --allocations --parsable2 --format=State | grep -q TIMEOUT || fail "sacct has no TIMEOUT"
fi

# -- what Slurm costs a stage ------------------------------------------------------------------------
stage_s=${STAGE_S:-1}
echo "$stage_s" > "$work/stage_s"
for i in 1 2 3 4; do mkdir -p "$work/s$i"; done
farm=$work/measured
stand_in "$farm" "$work"/s?
begin=$(date +%s.%N)
scontrol update NodeName=n1,n2 State=RESUME
while squeue -h -o %j | grep -qv gather; do sleep 0.2; done
check measured "$farm" "$stage_s" "$begin"
echo "all hold"
