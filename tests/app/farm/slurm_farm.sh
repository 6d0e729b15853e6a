#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The farm on a real Slurm: controller and two nodes on this machine, in a temporary folder. Six
# sessions, one broken; a node is killed in the middle of a stage and comes back.
#   slurm_farm.sh ORBITFUSE SESSION      needs root and Debian's slurm-wlm and munge; ends with 77 without
set -euo pipefail
program=$(realpath "$1")
session=$(realpath "$2")
for tool in slurmctld slurmd sbatch munged; do
  command -v "$tool" > /dev/null || { echo "skipped: no $tool (apt-get install slurm-wlm munge)"; exit 77; }
done
[ "$(id -u)" = 0 ] || { echo "skipped: slurmd needs root"; exit 77; }

work=$(mktemp -d)
# Our own daemons only, by the numbers they wrote.
clean() {
  for pid in "$work"/*.pid; do
    [ -f "$pid" ] && kill "$(cat "$pid")" 2> /dev/null
  done
  sleep 1
  [ -n "${KEEP:-}" ] && echo "kept: $work" || rm -rf "$work"
}
trap clean EXIT
fail() { echo "FAILED: $*"; exit 1; }

# -- munge and Slurm -------------------------------------------------------------------------------
mkdir -p "$work/state" "$work/n1" "$work/n2"
chmod 755 "$work"
dd if=/dev/urandom of="$work/munge.key" bs=64 count=1 status=none
chmod 600 "$work/munge.key"
munged --force --key-file="$work/munge.key" --socket="$work/munge.sock" --pid-file="$work/munged.pid" \
  --log-file="$work/munged.log" --seed-file="$work/munge.seed"
base=$((20000 + RANDOM % 20000))
cat > "$work/slurm.conf" << CONF
ClusterName=farm
SlurmctldHost=$(hostname)(127.0.0.1)
SlurmUser=root
SlurmctldPort=$base
AuthType=auth/munge
AuthInfo=socket=$work/munge.sock
CredType=cred/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/%n
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/%n.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
SlurmdTimeout=10
ReturnToService=2
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,sched_interval=1
JobRequeue=1
NodeName=n1 NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=$((base + 1)) CPUs=1 RealMemory=8000
NodeName=n2 NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=$((base + 2)) CPUs=1 RealMemory=8000
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$work/slurm.conf
node() { slurmd -N "$1" -f "$SLURM_CONF"; }
slurmctld -f "$SLURM_CONF"
node n1
node n2
for _ in $(seq 60); do [ "$(sinfo -h -o %t 2> /dev/null)" = idle ] && break; sleep 1; done
[ "$(sinfo -h -o %t)" = idle ] || { cat "$work"/*.log; fail "the nodes are not up"; }

# -- sessions and the single run they are held against ---------------------------------------------
options=(--seed 1)
for set in train.visible.iterations=20 train.thermal.iterations=20 train.visible.eval_count=0 \
  train.thermal.eval_count=0 depth.width_px=48 train.visible.max_width_px=48 \
  train.thermal.max_width_px=48 train.visible.cloud_width_px=32 train.thermal.cloud_width_px=32 \
  render.views=1 render.width_px=64 'fuse.methods=["heat"]'; do
  options+=(--set "$set")
done
# Poses are given: what is tested is the farm, and they are half of a run's cost.
"$program" import "$work/car1" --visible "$session/visible" --thermal "$session/thermal" \
  --ground-truth "$session/ground_truth.json"
for i in 2 3 4 5 6; do cp -r "$work/car1" "$work/car$i"; done
truncate -s 100 "$work/car4/visible/$(ls "$work/car4/visible" | head -1)"
"$program" run "$work/car1" --out "$work/single" --threads 1 "${options[@]}"

refused=$("$program" farm "$work/car1" --out "$work/refused" --slurm --partition nowhere 2>&1) && fail "nowhere was taken"
echo "$refused" | grep -q "nvalid partition" || fail "partition: $refused"
[ -z "$(squeue -h)" ] || fail "a refused farm left jobs"

# -- the farm --------------------------------------------------------------------------------------
farm=$work/farm
begin=$(date +%s.%N)
"$program" farm "$work"/car? --out "$farm" --slurm --stage-cores 1 "${options[@]}"
"$program" farm "$work"/car? --out "$farm" --slurm 2> "$work/second" && fail "two farms in one folder"
grep -q "a farm was started in it before" "$work/second" || fail "second: $(cat "$work/second")"
killed=
for _ in $(seq 3000); do
  if [ -z "$killed" ]; then
    job=$(squeue -h -t R -w n2 -o '%A %j' | grep -E 'depth|train' | head -1 || true)
    if [ -n "$job" ]; then
      sleep 1
      echo "kill n2 with job $job"
      slurmd_pid=$(cat "$work/n2.pid")
      step=$(pgrep -f "slurmstepd: \[${job%% *}\." || true)
      # All below it first: once it is dead they are init's, and would go on working.
      below=$step
      for _ in 1 2 3 4 5; do below="$below $(for p in $below; do pgrep -P "$p" || true; done | tr '\n' ' ')"; done
      kill -9 $slurmd_pid $below 2> /dev/null || true
      killed=$job
      sleep 15
      node n2
    fi
  fi
  [ -z "$(squeue -h)" ] && break
  sleep 1
done
wall=$(echo "$(date +%s.%N) - $begin" | bc)
[ -n "$killed" ] || fail "no node was killed"
"$program" farm status "$farm"
cat "$farm/farm.csv"

# -- what must hold --------------------------------------------------------------------------------
python3 - "$work" "$wall" << 'PY'
import json, pathlib, sys
work, wall = pathlib.Path(sys.argv[1]), float(sys.argv[2])
farm, single = work / "farm", work / "single"
stages = json.load(open(farm / "farm.json"))["stages"]
bad, twice, busy = [], [], 0.0
for i in range(1, 7):
    name = f"car{i}"
    for stage in stages:
        record = farm / ".farm" / name / f"{stage}.json"
        if not record.exists():
            if name != "car4": bad.append(f"{name}/{stage} never ran")
            continue
        outcome = json.load(open(record))
        busy += outcome["wall_s"]
        if outcome["starts"] > 1: twice.append(f"{name}/{stage} x{outcome['starts']}")
        if name == "car4":
            if outcome["state"] != "failed" or "visible/" not in outcome["cause"]:
                bad.append(f"car4: {outcome}")
        elif outcome["state"] != "done": bad.append(f"{name}/{stage}: {outcome}")
    if name == "car4": continue
    for stage in stages:
        mine, theirs = farm / name / stage / "stage.json", single / stage / "stage.json"
        if not theirs.exists(): continue
        if not mine.exists(): bad.append(f"{name}/{stage}: no result"); continue
        a, b = ({o["file"]: o["hash"] for o in json.load(open(f))["outputs"]} for f in (mine, theirs))
        if stage == "report":
            if a.keys() != b.keys(): bad.append(f"{name}: report's files differ")
        elif a != b:
            bad.append(f"{name}/{stage}: differs in {[f for f in a if a[f] != b.get(f)]}")
print("started twice:", twice)
print(f"wall {wall:.0f} s with 2 slots, stages {busy:.0f} s: {100 * (1 - busy / (2 * wall)):.1f} % of the slots' time idle")
if len(twice) != 1: bad.append(f"{len(twice)} stages started twice, 1 expected")
print("\n".join(bad) or "all hold")
sys.exit(bool(bad))
PY
