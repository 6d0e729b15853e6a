# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash
# A Slurm of two nodes on this machine, in the folder $work: sourced by slurm_farm.sh. With slurmdbd
# and mariadbd it has the database that sacct asks; without, sacct says that it has none.
# NO_DATABASE=1 leaves it out. SLURM_DEFAULTS=1 leaves Slurm's own times of scheduling, which wait to gather jobs.

# Our own daemons only, by the numbers they wrote.
stop_cluster() {
  for name in slurmctld n1 n2 slurmdbd mariadbd munged; do
    [ -f "$work/$name.pid" ] && kill "$(cat "$work/$name.pid")" 2> /dev/null
  done
  for _ in $(seq 50); do
    [ -f "$work/slurmctld.pid" ] && kill -0 "$(cat "$work/slurmctld.pid")" 2> /dev/null || break
    sleep 0.2
  done
  return 0
}

start_munge() {
  dd if=/dev/urandom of="$work/munge.key" bs=64 count=1 status=none
  chmod 600 "$work/munge.key"
  munged --force --key-file="$work/munge.key" --socket="$work/munge.sock" \
    --pid-file="$work/munged.pid" --log-file="$work/munged.log" --seed-file="$work/munge.seed"
}

# Nobody but this machine reaches it, and it lives as long as the test: no passwords.
start_database() {
  mkdir -p "$work/db"
  mariadbd --no-defaults --user=root --datadir="$work/db" --skip-grant-tables \
    --bind-address=127.0.0.1 --port=$((base + 3)) --socket="$work/db.sock" \
    --pid-file="$work/mariadbd.pid" --innodb-buffer-pool-size=32M >> "$work/db.log" 2>&1 &
  for _ in $(seq 60); do [ -S "$work/db.sock" ] && break; sleep 0.5; done
  cat > "$work/slurmdbd.conf" << CONF
AuthType=auth/munge
AuthInfo=socket=$work/munge.sock
DbdHost=localhost
DbdAddr=127.0.0.1
DbdPort=$((base + 4))
SlurmUser=root
StorageType=accounting_storage/mysql
StorageHost=127.0.0.1
StoragePort=$((base + 3))
StorageUser=root
StorageLoc=slurm_farm
PidFile=$work/slurmdbd.pid
LogFile=$work/slurmdbd.log
CONF
  chmod 600 "$work/slurmdbd.conf"
  (export SLURM_CONF=$work/slurmdbd.conf; slurmdbd)
  for _ in $(seq 60); do grep -q started "$work/slurmdbd.log" 2> /dev/null && break; sleep 0.5; done
  cat >> "$work/slurm.conf" << CONF
AccountingStorageType=accounting_storage/slurmdbd
AccountingStorageHost=127.0.0.1
AccountingStoragePort=$((base + 4))
AccountingStoragePass=$work/munge.sock
JobAcctGatherType=jobacct_gather/none
CONF
  sacctmgr -i add cluster farm > "$work/sacctmgr.log" 2>&1
}

node() { slurmd -N "$1" -f "$SLURM_CONF"; }
idle() { [ "$(sinfo -h -o %t 2> /dev/null)" = idle ]; }

start_cluster() {
  mkdir -p "$work/state" "$work/n1" "$work/n2"
  chmod 755 "$work"
  base=$((20000 + RANDOM % 20000))
  export SLURM_CONF=$work/slurm.conf
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
JobRequeue=1
NodeName=n1 NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=$((base + 1)) CPUs=1 RealMemory=8000
NodeName=n2 NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=$((base + 2)) CPUs=1 RealMemory=8000
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
  [ -n "${SLURM_DEFAULTS:-}" ] ||
    echo "SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,sched_interval=1" >> "$work/slurm.conf"
  start_munge
  if [ -z "${NO_DATABASE:-}" ] && command -v slurmdbd > /dev/null && command -v mariadbd > /dev/null; then
    start_database
  else
    echo "no slurmdbd and mariadb-server-core: the controller is asked instead of sacct"
  fi
  slurmctld -f "$SLURM_CONF"
  node n1
  node n2
  for _ in $(seq 60); do idle && return; sleep 1; done
  cat "$work"/*.log
  echo "FAILED: the nodes are not up"
  return 1
}

# A node that loses its power: the daemon, the job's keeper and all below die at once.
kill_node() {
  local name=$1 job=$2 below first
  below=$(scontrol listpids "$job" "$name" 2> /dev/null | awk 'NR > 1 && $1 > 1 {print $1}')
  first=$(echo "$below" | head -1)
  # shellcheck disable=SC2086
  kill -9 "$(cat "$work/$name.pid")" ${first:+$(ps -o ppid= -p "$first")} $below 2> /dev/null || true
}
