#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Fuzzes every reader of outside bytes with libFuzzer (Debian: apt-get install clang):
#   tests/fuzz/run.sh [--cpu-minutes N] [TARGET...]
# N minutes of processor time each (default 5), one after the other; what earlier calls spent on the same
# corpus is told beside it. Corpora grow in build/fuzz/corpus, findings stay in
# build/fuzz/findings. A finding ends as a file under tests/fuzz/cases/TARGET, which fuzz_cases_test
# runs ever after. Exit code 1 when there is one.
set -euo pipefail
cd "$(dirname "$0")/../.."
minutes=5
targets=()
while [ $# -gt 0 ]; do
  case "$1" in
    --cpu-minutes) minutes=$2; shift 2 ;;
    -*) sed -n '3,9s/^# //p' "$0"; exit 2 ;;
    *) targets+=("$1"); shift ;;
  esac
done

[ -f build/fuzz/build.ninja ] || cmake --preset fuzz
cmake --build --preset fuzz --target fuzz_images fuzz_formats fuzz_live fuzz_field
bin=build/fuzz/tests/fuzz
declare -A part
for program in images formats live field; do
  for target in $("$bin/fuzz_$program" 2>/dev/null || true); do
    part[$target]=$program
    ln -sf "fuzz_$program" "$bin/fuzz_$target.run"
  done
done
[ ${#targets[@]} -gt 0 ] || targets=(rjpeg tiff photo heic exif sidecar ply colmap_text colmap_binary transforms truth manifest toml http camera profile field)

export ASAN_OPTIONS=detect_leaks=1:allocator_may_return_null=1
# Findings in libraries that read files for us are theirs; what they do to us is ours.
export UBSAN_OPTIONS=print_stacktrace=1
failed=0
for target in "${targets[@]}"; do
  [ -n "${part[$target]:-}" ] || { echo "unknown target $target; known: ${!part[*]}" >&2; exit 2; }
  corpus=build/fuzz/corpus/$target findings=build/fuzz/findings/$target
  mkdir -p "$corpus" "$findings"
  "$bin/fuzz_$target.run" --write-seeds "$corpus"
  log=build/fuzz/$target.log spent_file=build/fuzz/$target.cpu_s
  status=ok runs=0 spent=0
  # libFuzzer ends by the clock; a busy machine gives a process less than that.
  while [ $status = ok ] && [ "$spent" -lt $((minutes * 60)) ]; do
    TIMEFORMAT='%U %S'
    { time "$bin/fuzz_$target.run" "$corpus" -max_total_time=$((minutes * 60 - spent)) -timeout=10 \
      -rss_limit_mb=2048 -malloc_limit_mb=2048 -max_len=65536 -artifact_prefix="$findings/" \
      -print_final_stats=1 >"$log" 2>&1 || status=FOUND; } 2>"$log.time"
    used=$(awk '{print int($1 + $2) + 1}' "$log.time")
    spent=$((spent + used))
    executed=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log" | tail -1)
    runs=$((runs + ${executed:-0}))
  done
  echo $(($(cat "$spent_file" 2>/dev/null || echo 0) + spent)) >"$spent_file"
  cover=$(grep -o 'cov: [0-9]*' "$log" | tail -1)
  printf '%-14s %-6s %10s runs in %d CPU s (%d on this corpus)  %s  corpus %s\n' "$target" "$status" "$runs" \
    "$spent" "$(cat "$spent_file")" "${cover:-}" "$(ls "$corpus" | wc -l)"
  [ $status = ok ] || { failed=1; tail -5 "$log" >&2; ls "$findings" >&2; }
done
exit $failed
